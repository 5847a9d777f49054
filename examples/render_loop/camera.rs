//! A perspective camera.

use palpate::model::Vec3;

/// Looks at a point from a distance.
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
    /// A camera at `distance` (m) from `target`, `azimuth` round from the -y axis and `elevation` up (rad); the target
    /// appears at `centre` (px), where a metre has `scale` px.
    pub fn new(target: Vec3, distance: f64, azimuth: f64, elevation: f64, scale: f64, centre: [f64; 2]) -> Self {
        let away = Vec3::new(azimuth.sin() * elevation.cos(), -azimuth.cos() * elevation.cos(), elevation.sin());
        let forward = -away;
        let right = forward.cross(&Vec3::z()).normalize();
        let eye = target + away * distance;
        Self { eye, right, up: right.cross(&forward), forward, zoom: scale * distance, centre }
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
