//! Detection for a tool with a shape that goes so fast that its centre comes in within one step.

use super::deformable::Deformable;
use super::skin::Skin;
use super::swept::{Hit, passed_through};
use crate::Vec3;

/// The earliest of the triangles `candidates`, as smoothed for a tool, through which a point of the tool's axis comes in on its straight way.
pub(super) fn first(
    body: &Deformable<'_>,
    candidates: impl Iterator<Item = u32>,
    skin: &Skin,
    way: [Vec3; 2],
    d: f64,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for triangle in candidates {
        if !body.is_within(skin, triangle, &way, 0.0, d) {
            continue;
        }
        let [start, end] = [0.0, d].map(|ahead| body.smoothed_corners(skin, triangle, ahead));
        let corners = |share: f64| std::array::from_fn(|i| start[i] + (end[i] - start[i]) * share);
        if let Some((weights, share)) = passed_through(corners, |share| way[0] + (way[1] - way[0]) * share)
            && best.is_none_or(|best| share < best.share)
        {
            best = Some(Hit { triangle, weights, share });
        }
    }
    best
}
