//! Following the tool over the surface, from triangle to triangle.

use super::super::Vec3;
use super::super::mesh::{NONE, Surface};
use super::triangle::Projection;

/// Longest walk within one step.
const MAX_HOPS: usize = 16;
/// Weights above minus this are inside.
const INSIDE: f64 = 1e-9;

/// Walks from triangle `from` across the edge of the most negative weight to the triangle under `point`, projecting
/// along face normals. A walk that returns (a valley or a ridge) or meets the surface's rim is clamped to the edge.
pub(super) fn walk(surface: &Surface, x: &[Vec3], from: u32, point: &Vec3) -> (u32, [f64; 3]) {
    let (mut t, mut previous) = (from, NONE);
    let mut weights = [1.0 / 3.0; 3];
    for hop in 0..=MAX_HOPS {
        let corners = surface.triangles[t as usize].map(|node| x[node as usize]);
        // A sliver has no weights of its own: stay in its middle.
        weights = Projection::new(&corners, point).map_or([1.0 / 3.0; 3], |seen| seen.weights);
        let lowest = (0..3).fold(0, |lowest, i| if weights[i] < weights[lowest] { i } else { lowest });
        if weights[lowest] >= -INSIDE {
            return (t, weights);
        }
        let next = surface.neighbours[t as usize][lowest];
        if next == NONE || next == previous || hop == MAX_HOPS {
            break;
        }
        (previous, t) = (t, next);
    }
    (t, clamp(weights))
}

/// The weights without their negative part.
fn clamp(weights: [f64; 3]) -> [f64; 3] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f64 = positive.iter().sum();
    positive.map(|w| w / sum)
}
