//! A perspective camera that frames a body.

use palpate::model::Vec3;

/// Distance from the middle of the body in its diagonals.
const DISTANCE: f64 = 3.0;

/// Looks at a body from a distance.
pub struct Camera {
    eye: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Shown size of a metre at a metre's distance (px).
    zoom: f64,
    centre: [f64; 2],
}

/// Where a point appears.
#[derive(Clone, Copy)]
pub struct Seen {
    /// In the picture (px), y down.
    pub at: [f64; 2],
    /// Distance from the eye's plane (m).
    pub depth: f64,
}

impl Camera {
    /// A camera round from the -y axis by `azimuth` and up by `elevation` (rad), at such a place and with such a zoom that
    /// `points` just fit in the picture's rectangle from `low` to `high` (px).
    pub fn framing(points: &[Vec3], azimuth: f64, elevation: f64, low: [f64; 2], high: [f64; 2]) -> Self {
        let (least, largest) = points.iter().fold((points[0], points[0]), |(a, b), point| (a.inf(point), b.sup(point)));
        let away = Vec3::new(azimuth.sin() * elevation.cos(), -azimuth.cos() * elevation.cos(), elevation.sin());
        let forward = -away;
        let right = forward.cross(&Vec3::z()).normalize();
        let eye = (least + largest) / 2.0 + away * ((largest - least).norm() * DISTANCE);
        let up = right.cross(&forward);
        // What a zoom of 1 shows tells the zoom and the centre that are wanted.
        let unit = Self { eye, right, up, forward, zoom: 1.0, centre: [0.0; 2] };
        let shown = |axis: usize| {
            let range = (f64::INFINITY, f64::NEG_INFINITY);
            points.iter().map(|point| unit.see(point).at[axis]).fold(range, |(a, b), at| (a.min(at), b.max(at)))
        };
        let shown = [shown(0), shown(1)];
        let zooms = [0, 1].map(|axis| (high[axis] - low[axis]) / (shown[axis].1 - shown[axis].0));
        let zoom = zooms[0].min(zooms[1]);
        let middle = |axis: usize| (low[axis] + high[axis] - zoom * (shown[axis].0 + shown[axis].1)) / 2.0;
        Self { zoom, centre: [middle(0), middle(1)], ..unit }
    }

    /// Where `point` appears.
    pub fn see(&self, point: &Vec3) -> Seen {
        let from_eye = point - self.eye;
        let depth = from_eye.dot(&self.forward);
        let scale = self.zoom / depth;
        let [x, y] = self.centre;
        Seen { at: [x + scale * from_eye.dot(&self.right), y - scale * from_eye.dot(&self.up)], depth }
    }

    /// Shown size of a metre at `depth` (px).
    pub fn scale_at(&self, depth: f64) -> f64 {
        self.zoom / depth
    }

    /// The unit vector from `point` to the eye.
    pub fn towards(&self, point: &Vec3) -> Vec3 {
        (self.eye - point).normalize()
    }
}
