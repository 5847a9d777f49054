//! Triangle surfaces as files hold them, and what must hold of one that is filled.

mod checks;
mod crossing;
mod welded;

pub use checks::{SurfaceFindings, SurfacePart};
pub(crate) use welded::{PlaceKey, Welded, place_key};

use palpate_model::Vec3;

/// A triangle surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// The position of each node (m).
    pub points: Vec<Vec3>,
    /// Three nodes of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl SurfaceMesh {
    /// The surface with coordinates in metres: those it has, in units of `metres_per_unit`.
    #[must_use]
    pub fn scaled(mut self, metres_per_unit: f64) -> Self {
        self.points.iter_mut().for_each(|point| *point *= metres_per_unit);
        self
    }

    /// The volume that the surface encloses if it is closed (m^3): negative if it is inside out.
    pub fn volume(&self) -> f64 {
        let Some(&origin) = self.points.first() else { return 0.0 };
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|node| self.points[node as usize] - origin);
            a.cross(&b).dot(&c) / 6.0
        };
        self.triangles.iter().map(of).sum()
    }

    /// The corners of a triangle.
    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|node| self.points[node as usize])
    }
}
