//! Detection: a swept point against moving triangles, and a point that is already inside.

use super::ToolMotion;
use super::triangle::Projection;
use crate::Vec3;
use crate::mesh::Surface;

/// A place on the surface where the tool comes in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// The triangle.
    pub triangle: u32,
    /// Barycentric weights.
    pub weights: [f64; 3],
    /// Share of the step after which it happens, in [0, 1].
    pub share: f64,
}

/// A tool whose centre is farther than this below the surface, beside its radius, has lost it (m).
pub(super) const MAX_DEPTH: f64 = 5e-3;
/// A start this far below a triangle still counts as outside (m).
const ON_SURFACE: f64 = 1e-9;
/// Halvings of the step: resolves 1e-9 of it.
const BISECTIONS: usize = 30;

/// The earliest hit during one step: first the swept test, then the search for a tool that is inside at its end.
///
/// `candidates` are triangle indices; nodes move linearly from `x` to `x + d v`.
pub(super) fn find(
    surface: &Surface,
    candidates: &[u32],
    x: &[Vec3],
    v: &[Vec3],
    tool: ToolMotion,
    d: f64,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for &t in candidates {
        if let Some(hit) = swept(surface, t, x, v, tool, d)
            && best.is_none_or(|best| hit.share < best.share)
        {
            best = Some(hit);
        }
    }
    best.or_else(|| inside(surface, candidates, x, &tool.to.position))
}

/// The tool against one moving triangle x(s) = x + s d v, s in [0, 1].
fn swept(surface: &Surface, t: u32, x: &[Vec3], v: &[Vec3], tool: ToolMotion, d: f64) -> Option<Hit> {
    let nodes = surface.triangles[t as usize].map(|node| node as usize);
    let start = nodes.map(|node| x[node]);
    let motion = nodes.map(|node| v[node] * d);
    if !reaches(&start, &motion, tool) {
        return None;
    }
    let corners = |share: f64| std::array::from_fn(|i| start[i] + motion[i] * share);
    let (weights, share) = passed_through(corners, |share| tool.at(share).position)?;
    Some(Hit { triangle: t, weights, share })
}

/// When a moving point comes in through a moving triangle, and where in it.
pub(super) fn passed_through(
    corners: impl Fn(f64) -> [Vec3; 3],
    point: impl Fn(f64) -> Vec3,
) -> Option<([f64; 3], f64)> {
    let seen_at = |share: f64| Projection::new(&corners(share), &point(share));
    // A sliver has no side; it counts as "outside" at both ends and is never hit.
    if seen_at(0.0).is_some_and(|seen| seen.distance < -ON_SURFACE)
        || !seen_at(1.0).is_some_and(|seen| seen.distance < 0.0)
    {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if seen_at(middle).is_none_or(|seen| seen.distance >= 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let seen = seen_at(low)?;
    seen.is_inside(1e-6).then_some((seen.weights, low))
}

/// Cheap and safe rejection: the boxes around the moving triangle and the moving tool must touch.
#[inline]
fn reaches(start: &[Vec3; 3], motion: &[Vec3; 3], tool: ToolMotion) -> bool {
    (0..3).all(|axis| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (start, motion) in start.iter().zip(motion) {
            low = low.min(start[axis]).min(start[axis] + motion[axis]);
            high = high.max(start[axis]).max(start[axis] + motion[axis]);
        }
        // Weights a little outside are accepted, so the box grows by a little of its size.
        let margin = 1e-5 * (high - low) + 2.0 * ON_SURFACE;
        let (from, to) = (tool.from.position[axis], tool.to.position[axis]);
        from.min(to) <= high + margin && from.max(to) >= low - margin
    })
}

/// The nearest triangle, if `point` is behind it, by face normals and less than 5 mm deep. Near a thin sheet a point that is
/// outside is behind the far side too: what is nearer to the front of a triangle is not inside.
fn inside(surface: &Surface, candidates: &[u32], x: &[Vec3], point: &Vec3) -> Option<Hit> {
    let (mut nearest, mut best) = (MAX_DEPTH, None);
    for &t in candidates {
        let corners = surface.triangles[t as usize].map(|node| x[node as usize]);
        // A point behind the triangle and projecting into it lies in its box grown by the depth.
        let near = (0..3).all(|axis| {
            let low = corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max);
            point[axis] >= low - MAX_DEPTH && point[axis] <= high + MAX_DEPTH
        });
        if !near {
            continue;
        }
        let Some(seen) = Projection::new(&corners, point) else { continue };
        if seen.is_inside(1e-9) {
            if seen.distance.abs() < nearest {
                nearest = seen.distance.abs();
                best = (seen.distance < 0.0).then_some(Hit { triangle: t, weights: seen.weights, share: 0.0 });
            }
        } else if seen.distance > 0.0 && seen.distance < nearest {
            // In front of a ridge a point is over none of its triangles.
            let beside = distance_to_edges(&corners, point);
            if beside < nearest {
                (nearest, best) = (beside, None);
            }
        }
    }
    best
}

/// From `point` to the nearest edge of the triangle `corners` (m).
fn distance_to_edges(corners: &[Vec3; 3], point: &Vec3) -> f64 {
    let to_edge = |i: usize| {
        let (edge, r) = (corners[(i + 1) % 3] - corners[i], point - corners[i]);
        let share = (r.dot(&edge) / edge.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (r - edge * share).norm()
    };
    to_edge(0).min(to_edge(1)).min(to_edge(2))
}

#[cfg(test)]
mod tests {
    use super::super::super::body::{Block, Body};
    use super::super::super::mesh::Face;
    use super::*;

    fn found(body: &Block, point: Vec3) -> Option<Hit> {
        let candidates: Vec<u32> = (0..body.surface().triangles.len() as u32).collect();
        inside(body.surface(), &candidates, body.rest(), &point)
    }

    #[test]
    fn above_a_thin_sheet_nothing_is_inside_though_it_is_behind_the_far_side() {
        let sheet = Block::builder([4, 4, 3], [0.03, 0.03, 0.001]).fix(Face::ZMin).build().unwrap();
        let at = |z: f64| found(&sheet, Vec3::new(0.0142, 0.0153, z));
        for z in [0.00101, 0.0015, 0.003, -0.00001, -0.002] {
            assert_eq!(at(z), None, "{z}");
        }
        for (z, side) in [(0.0009, 1e-3), (0.0006, 1e-3), (0.0002, 0.0)] {
            let hit = at(z).unwrap();
            let corners = sheet.surface().triangles[hit.triangle as usize].map(|node| sheet.rest()[node as usize].z);
            assert_eq!(corners, [side; 3], "{z}");
        }
    }

    #[test]
    fn in_front_of_a_ridge_nothing_is_inside() {
        // Bent upwards along a row of nodes; a point above the ridge is over neither of its slopes.
        let sheet = Block::builder([5, 4, 3], [0.04, 0.03, 0.001]).fix(Face::ZMin).build().unwrap();
        let bent: Vec<Vec3> = sheet.rest().iter().map(|x| x - Vec3::z() * (x.x - 0.02).abs()).collect();
        let candidates: Vec<u32> = (0..sheet.surface().triangles.len() as u32).collect();
        let at = |z: f64| inside(sheet.surface(), &candidates, &bent, &Vec3::new(0.02, 0.0153, z));
        assert_eq!(at(0.0015), None);
        assert!(at(0.0008).is_some());
    }
}
