//! A place at which a tool may touch.

use crate::Vec3;

/// Where a tool comes near the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub(super) triangle: u32,
    pub(super) weights: [f64; 3],
    pub(super) place: Vec3,
    pub(super) normal: Vec3,
    /// From the surface to the tool's (m); negative where they overlap.
    pub(super) gap: f64,
    /// Where on the axis, from one end to the other.
    pub(super) share: f64,
}
