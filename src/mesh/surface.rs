//! Triangle surfaces as files hold them.

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
}
