//! A place at which a tool may touch.

use crate::Vec3;

/// Where a tool comes near the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub(super) triangle: u32,
    pub(super) weights: [f64; 3],
    /// Where it is at the start of the step, and at its end if nothing presses (m).
    pub(super) from: Vec3,
    pub(super) place: Vec3,
    pub(super) normal: Vec3,
    /// From the surface to the tool's (m); negative where they overlap.
    pub(super) gap: f64,
    /// Where on the axis, from one end to the other.
    pub(super) share: f64,
}

/// Within so many radii of the surface the way from there to the axis is rounding: an axis that goes through a triangle is at none.
const ON_SURFACE: f64 = 1e-3;

/// True for an axis so far `away` (m) from a triangle that the way there has a direction, for a tool of that `radius` (m).
pub(super) fn is_off(away: &Vec3, radius: f64) -> bool {
    away.norm() > ON_SURFACE * radius
}

/// True if the whole `axis` is so far in front of the plane of a triangle with this `corner` that it is [off](is_off) each of its places;
/// `across` is the triangle's, of any length.
pub(super) fn is_in_front(axis: &[Vec3; 2], corner: &Vec3, across: &Vec3, radius: f64) -> bool {
    let least = (ON_SURFACE * radius).powi(2) * across.norm_squared();
    axis.iter().all(|end| {
        let ahead = (end - corner).dot(across);
        ahead > 0.0 && ahead * ahead > least
    })
}

/// Out of the body at the place of a triangle that is so far `away` (m) from a tool's axis; `across` is the triangle's, of any length. `None`
/// for a triangle without an area.
pub(super) fn outward(away: &Vec3, across: &Vec3, radius: f64) -> Option<Vec3> {
    let outward = if is_off(away, radius) { away * away.dot(across).signum() } else { *across };
    outward.try_normalize(0.0)
}
