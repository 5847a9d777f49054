//! Detection: a swept point against moving triangles, and a point that is already inside.

use super::ToolMotion;
use super::extent::Extent;
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
    let way = Extent::around([&tool.from.position, &tool.to.position]);
    let mut earliest: Option<Hit> = None;
    let mut inside = Inside::none();
    for &t in candidates {
        let nodes = surface.triangles[t as usize].map(|node| node as usize);
        // Most triangles of a large body are farther from the tool's way along some axis, usually the first: neither test takes those, as long
        // as triangles are below 500 m.
        let ends = |axis: usize| nodes.map(|node| [x[node][axis], x[node][axis] + v[node][axis] * d]);
        if !(0..3).all(|axis| way.is_within(MAX_DEPTH, axis, ends(axis).as_flattened())) {
            continue;
        }
        let start = nodes.map(|node| x[node]);
        let motion = nodes.map(|node| v[node] * d);
        if let Some((weights, share)) = swept(&start, &motion, tool)
            && earliest.is_none_or(|earliest| share < earliest.share)
        {
            earliest = Some(Hit { triangle: t, weights, share });
        }
        inside.look_at(t, &start, &tool.to.position);
    }
    earliest.or(inside.hit)
}

/// The tool against one moving triangle x(s) = x + s d v, s in [0, 1]: where in it and when.
fn swept(start: &[Vec3; 3], motion: &[Vec3; 3], tool: ToolMotion) -> Option<([f64; 3], f64)> {
    if !reaches(start, motion, tool) {
        return None;
    }
    let corners = |share: f64| std::array::from_fn(|i| start[i] + motion[i] * share);
    passed_through(corners, |share| tool.at(share).position)
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

/// The nearest triangle, if a point is behind it, by face normals and less than 5 mm deep. Near a thin sheet a point that is
/// outside is behind the far side too: what is nearer to the front of a triangle is not inside.
struct Inside {
    nearest: f64,
    hit: Option<Hit>,
}

impl Inside {
    fn none() -> Self {
        Self { nearest: MAX_DEPTH, hit: None }
    }

    /// Takes triangle `t` with these corners if it is the nearest to `point` so far.
    fn look_at(&mut self, t: u32, corners: &[Vec3; 3], point: &Vec3) {
        // A point behind the triangle and projecting into it lies in its box grown by the depth.
        let around = Extent::around([point]);
        if !(0..3).all(|axis| around.is_within(MAX_DEPTH, axis, &corners.map(|corner| corner[axis]))) {
            return;
        }
        let Some(seen) = Projection::new(corners, point) else { return };
        if seen.is_inside(1e-9) {
            if seen.distance.abs() < self.nearest {
                self.nearest = seen.distance.abs();
                self.hit = (seen.distance < 0.0).then_some(Hit { triangle: t, weights: seen.weights, share: 0.0 });
            }
        } else if seen.distance > 0.0 && seen.distance < self.nearest {
            // In front of a ridge a point is over none of its triangles.
            let beside = distance_to_edges(corners, point);
            if beside < self.nearest {
                (self.nearest, self.hit) = (beside, None);
            }
        }
    }
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
        found_at(body, body.rest(), point)
    }

    /// Where a resting point is inside of a `body` whose nodes rest at `x`.
    fn found_at(body: &Block, x: &[Vec3], point: Vec3) -> Option<Hit> {
        let candidates: Vec<u32> = (0..body.surface().triangles.len() as u32).collect();
        find(body.surface(), &candidates, x, &vec![Vec3::zeros(); x.len()], ToolMotion::straight(point, point), 1e-3)
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
        let at = |z: f64| found_at(&sheet, &bent, Vec3::new(0.02, 0.0153, z));
        assert_eq!(at(0.0015), None);
        assert!(at(0.0008).is_some());
    }
}
