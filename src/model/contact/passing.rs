//! Detection for a tool with a shape that goes so fast that its centre comes in within one step.

use super::extent::Extent;
use super::swept::passed_through;
use crate::Vec3;

/// The earliest of `triangles` through which a point of the tool's axis comes in on its straight `way`: its number, and the weights of the
/// place. `corners` are at the start and at the end of the step; `sides` is working memory.
pub(super) fn first(
    triangles: &[[u32; 3]],
    corners: &[[Vec3; 2]],
    way: [Vec3; 2],
    sides: &mut Vec<u8>,
) -> Option<(usize, [f64; 3])> {
    let extent = Extent::around(&way);
    sides.clear();
    sides.extend(corners.iter().map(|corner| extent.sides(corner)));
    let mut best: Option<(usize, [f64; 3], f64)> = None;
    for (number, places) in triangles.iter().enumerate() {
        let [a, b, c] = places.map(|place| sides[place as usize]);
        if a & b & c != 0 {
            continue;
        }
        let moving = places.map(|place| corners[place as usize]);
        let corners = |share: f64| moving.map(|[start, end]| start + (end - start) * share);
        if let Some((weights, share)) = passed_through(corners, |share| way[0] + (way[1] - way[0]) * share)
            && best.is_none_or(|(.., earliest)| share < earliest)
        {
            best = Some((number, weights, share));
        }
    }
    best.map(|(number, weights, _)| (number, weights))
}
