//! What can be filled.

use palpate_model::Vec3;

/// A shape given by a function instead of triangles.
pub trait ImplicitShape {
    /// Negative inside, positive outside, zero on the surface, and continuous. The distance (m) is best; a value that merely grows with
    /// it fills as well.
    fn signed_distance(&self, point: &Vec3) -> f64;

    /// The lowest and the highest corner of a box that the whole shape lies in (m).
    fn bounds(&self) -> [Vec3; 2];
}
