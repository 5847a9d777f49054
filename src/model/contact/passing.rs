//! Detection for a tool with a shape that goes so fast that its centre comes in within one step.

use super::swept::passed_through;
use super::vicinity::is_near;
use crate::Vec3;

/// The earliest of triangles, each with its corners at the start and at the end of a step, through which a point of the tool's axis
/// comes in on its straight way: its number, and the weights of the place.
pub(super) fn first(triangles: impl Iterator<Item = [[Vec3; 2]; 3]>, way: [Vec3; 2]) -> Option<(usize, [f64; 3])> {
    let mut best: Option<(usize, [f64; 3], f64)> = None;
    for (number, moving) in triangles.enumerate() {
        if !is_near(&way, 0.0, &moving) {
            continue;
        }
        let corners = |share: f64| moving.map(|[start, end]| start + (end - start) * share);
        if let Some((weights, share)) = passed_through(corners, |share| way[0] + (way[1] - way[0]) * share)
            && best.is_none_or(|(.., earliest)| share < earliest)
        {
            best = Some((number, weights, share));
        }
    }
    best.map(|(number, weights, _)| (number, weights))
}
