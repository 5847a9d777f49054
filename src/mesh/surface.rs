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
