//! The search for the places at which a tool with a shape may touch in a step.

use super::ToolMotion;
use super::closest;
use super::deformable::Deformable;
use super::passing;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use crate::{Pose, Vec3};

/// Within so many radii of the surface the way from there to the axis is rounding: an axis that goes through a triangle is at none.
const ON_SURFACE: f64 = 1e-3;

/// A centre that is farther than this below the surface, beside the tool's radius, has lost it (m).
const MAX_DEPTH: f64 = 5e-3;

/// Where a node stays in a step, a bit for each side of a box: that around the tool with all that it may touch, and that around the
/// way of its axis.
const AROUND: u16 = 0x3f;
const AXIS: u16 = AROUND << 6;
/// A node that a search has met.
const MARKED: u16 = 1 << 15;

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

/// The places that were found, and what the search keeps of each node.
#[derive(Clone, Debug)]
pub(super) struct Search {
    pub(super) near: Vec<Near>,
    /// On which sides of the boxes `AROUND` the tool and of its `AXIS` each node stays in the step, and `MARKED`.
    sides: Vec<u16>,
    /// The corner at each marked node as the tool meets it at the end of the step (m).
    corners: Vec<Vec3>,
}

impl Default for Search {
    fn default() -> Self {
        Self { near: Vec::with_capacity(MOST_POINTS), sides: Vec::new(), corners: Vec::new() }
    }
}

impl Search {
    /// Makes room for a body of `nodes` nodes.
    pub(super) fn make_room(&mut self, nodes: usize) {
        self.sides.resize(nodes, 0);
        self.corners.resize(nodes, Vec3::zeros());
    }

    /// Finds the places that would overlap with the tool at the end of the step if nothing pressed.
    pub(super) fn find(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        self.near.clear();
        self.find_sides(body, touch, motion, d);
        if !self.find_passed(body, touch, motion, d) {
            self.find_near(body, touch, &motion.to, d);
        }
    }

    /// Tells where nodes stay of the boxes around the way of a tool: a triangle whose corners stay on one side of one is not
    /// looked at again.
    fn find_sides(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        let axes = [touch.shape.axis(&motion.from), touch.shape.axis(&motion.to)].into_iter().flatten();
        let (low, high) = axes
            .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), end| {
                (low.inf(&end), high.sup(&end))
            });
        let [around, beside] =
            [touch.shape.radius() + MAX_DEPTH, 0.0].map(|far| Vec3::repeat(far + touch.skin.reach()));
        let boxes = [(low - beside, high + beside), (low - around, high + around)];
        for ((sides, x), v) in self.sides.iter_mut().zip(&*body.positions).zip(&*body.velocities) {
            let end = x + v * d;
            let (least, most) = (x.inf(&end), x.sup(&end));
            *sides = boxes.iter().fold(0, |sides, (low, high)| {
                (0..3).fold(sides, |sides, i| {
                    sides << 2 | u16::from(most[i] < low[i]) << 1 | u16::from(least[i] > high[i])
                })
            });
        }
    }

    /// A place of the surface that the axis passes within the step; whatever else is near at its end is the far side.
    fn find_passed(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) -> bool {
        let (shape, skin) = (&touch.shape, &*touch.skin);
        let [from, to] = [shape.axis(&motion.from), shape.axis(&motion.to)];
        let ends = if shape.half_axis() == Vec3::zeros() { 1 } else { 3 };
        for end in 0..ends {
            let share = [0.0, 1.0, 0.5][end];
            let [from, to] = [from, to].map(|[a, b]| a + (b - a) * share);
            let candidates =
                body.candidates.iter().copied().filter(|&triangle| meets(&self.sides, AXIS, body, triangle));
            let Some(hit) = passing::first(body, candidates, skin, [from, to], d) else { continue };
            let corners = body.smoothed_corners(skin, hit.triangle, d);
            let place = interpolate(&hit.weights, &corners);
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let Some(normal) = across.try_normalize(0.0) else { continue };
            let gap = (to - place).dot(&normal) - shape.radius();
            self.near.push(Near { triangle: hit.triangle, weights: hit.weights, place, normal, gap, share });
        }
        !self.near.is_empty()
    }

    fn find_near(&mut self, body: &Deformable<'_>, touch: &Touch, pose: &Pose, d: f64) {
        let (shape, skin) = (&touch.shape, &*touch.skin);
        let (radius, axis) = (shape.radius(), shape.axis(pose));
        let is_long = shape.half_axis() != Vec3::zeros();
        // The nearest place in front of the surface, and the nearest behind it.
        let (mut front, mut behind) = (f64::INFINITY, None::<Near>);
        for &triangle in body.candidates {
            if !meets(&self.sides, AROUND, body, triangle) {
                continue;
            }
            // Triangles share corners.
            let corners = body.corners(triangle).map(|node| {
                if self.sides[node] & MARKED == 0 {
                    self.sides[node] |= MARKED;
                    self.corners[node] = body.smoothed_corner(skin, node as u32, d);
                }
                self.corners[node]
            });
            let depths = body.corners(triangle).map(|node| skin.depth(node));
            // It touches, or is the nearest of all.
            let touching = radius + depths.into_iter().fold(0.0, f64::max);
            let distance = touching.max(front.min(radius + MAX_DEPTH));
            let [a, b, c] = &corners;
            if !closest::may_be_near(&axis, distance, &a.inf(b).inf(c), &a.sup(b).sup(c)) {
                continue;
            }
            let across = (b - a).cross(&(c - a));
            let shares = [closest::share_of_axis(&axis, &corners), 0.0, 1.0];
            for share in if is_long { &shares[..] } else { &shares[..1] } {
                let centre = axis[0] + (axis[1] - axis[0]) * *share;
                let weights = closest::weights(&corners, &centre);
                let place = interpolate(&weights, &corners);
                let away = centre - place;
                let distance = away.norm();
                let is_off = distance > ON_SURFACE * radius;
                let normal = if is_off { away * away.dot(&across).signum() } else { across };
                let Some(normal) = normal.try_normalize(0.0) else { continue };
                let depth: f64 = weights.iter().zip(depths).map(|(w, depth)| w * depth).sum();
                let near = |distance: f64| Near {
                    triangle,
                    weights,
                    place,
                    normal,
                    gap: distance - depth - radius,
                    share: *share,
                };
                if away.dot(&across) < 0.0 {
                    if behind.is_none_or(|known| -distance > known.gap + radius) {
                        // Out of the body on the shortest way.
                        behind = Some(Near { gap: -distance - radius, ..near(0.0) });
                    }
                    continue;
                }
                front = front.min(distance);
                let near = near(distance);
                if near.gap < 0.0 {
                    self.keep(near, radius);
                }
            }
        }
        // A centre inside is nearest to the inner side of some triangle.
        if let Some(behind) = behind
            && -(behind.gap + radius) < front * (1.0 - 1e-9)
            && -(behind.gap + radius) < MAX_DEPTH + radius
        {
            self.near.clear();
            self.near.push(behind);
        }
    }

    /// Each place once, and of too many the deepest.
    fn keep(&mut self, near: Near, radius: f64) {
        let same = 1e-12 * radius * radius;
        if self.near.iter().any(|known| (known.place - near.place).norm_squared() < same) {
            return;
        }
        if self.near.len() < MOST_POINTS {
            self.near.push(near);
        } else if let Some(shallowest) = self.near.iter_mut().max_by(|a, b| a.gap.total_cmp(&b.gap))
            && near.gap < shallowest.gap
        {
            *shallowest = near;
        }
    }
}

/// False if the corners of a triangle are all on one side of the box whose bits are `of`.
fn meets(sides: &[u16], of: u16, body: &Deformable<'_>, triangle: u32) -> bool {
    body.corners(triangle).iter().fold(of, |common, &node| common & sides[node]) == 0
}
