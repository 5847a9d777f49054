//! The search for the places at which a tool with a shape may touch in a step.

use super::ToolMotion;
use super::closest;
use super::corners::{Corners, chord};
use super::deformable::Deformable;
use super::near::Near;
use super::passing;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use super::vicinity::{MAX_DEPTH, Vicinity};
use crate::{Pose, Vec3};

/// Within so many radii of the surface the way from there to the axis is rounding: an axis that goes through a triangle is at none.
const ON_SURFACE: f64 = 1e-3;

/// The places that were found, and what the search keeps from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    pub(super) near: Vec<Near>,
    /// Of each tool.
    vicinities: Vec<Vicinity>,
    /// The corners of a vicinity as the tool meets them at the start of the step, and at its end if nothing presses (m).
    corners: Vec<[Vec3; 2]>,
    fine: Corners,
}

impl Search {
    /// For so many tools.
    pub(super) fn new(tools: usize) -> Self {
        let vicinities = vec![Vicinity::default(); tools];
        Self { near: Vec::with_capacity(MOST_POINTS), vicinities, ..Self::default() }
    }

    /// Makes room for a body of so many nodes and candidates, and forgets another one.
    pub(super) fn make_room(&mut self, nodes: usize, candidates: usize) {
        self.vicinities.iter_mut().for_each(|vicinity| vicinity.make_room(nodes, candidates));
        self.corners.reserve(nodes);
        self.fine.make_room(nodes);
    }

    /// Finds the places that would overlap with a tool at the end of the step if nothing pressed.
    pub(super) fn find(&mut self, body: &Deformable<'_>, (tool, touch): (usize, &Touch), motion: ToolMotion, d: f64) {
        self.near.clear();
        let mut vicinity = std::mem::take(&mut self.vicinities[tool]);
        vicinity.update(body, touch, motion, d);
        self.corners.clear();
        self.corners
            .extend(vicinity.nodes.iter().map(|&node| body.corner(&touch.skin, touch.steady.fineness, node, d)));
        if !self.find_passed(&vicinity, touch, motion) {
            self.find_near(&vicinity, touch, &motion.to);
        }
        self.vicinities[tool] = vicinity;
    }

    /// A place of the surface that the axis passes within the step; whatever else is near at its end is the far side.
    fn find_passed(&mut self, vicinity: &Vicinity, touch: &Touch, motion: ToolMotion) -> bool {
        let shape = &touch.shape;
        let [from, to] = [shape.axis(&motion.from), shape.axis(&motion.to)];
        let ends = if shape.half_axis() == Vec3::zeros() { 1 } else { 3 };
        for end in 0..ends {
            let share = [0.0, 1.0, 0.5][end];
            let [from, to] = [from, to].map(|[a, b]| a + (b - a) * share);
            let candidates = vicinity.corners.iter().map(|nodes| nodes.map(|node| self.corners[node as usize]));
            let Some((found, weights)) = passing::first(candidates, [from, to]) else { continue };
            let corners = vicinity.corners[found].map(|node| self.corners[node as usize][1]);
            let place = interpolate(&weights, &corners);
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let Some(normal) = across.try_normalize(0.0) else { continue };
            let gap = (to - place).dot(&normal) - shape.radius();
            let triangle = vicinity.triangles[found];
            self.near.push(Near { triangle, weights, place, normal, gap, share });
        }
        !self.near.is_empty()
    }

    fn find_near(&mut self, vicinity: &Vicinity, touch: &Touch, pose: &Pose) {
        let (shape, skin, fine) = (&touch.shape, &*touch.skin, touch.steady.fineness);
        let coarse = 1.0 - fine;
        let (radius, axis) = (shape.radius(), shape.axis(pose));
        let is_long = shape.half_axis() != Vec3::zeros();
        let Self { near: list, corners, fine: met, .. } = self;
        met.find(vicinity, |place| corners[place as usize][1], touch, &axis, |found| keep(list, found));
        // The nearest place in front of the surface, and the nearest behind it.
        let (mut front, mut behind) = (f64::INFINITY, None::<Near>);
        for (&triangle, places) in vicinity.triangles.iter().zip(&vicinity.corners) {
            let corners = places.map(|place| corners[place as usize][1]);
            let depths = places.map(|place| coarse * skin.depth(vicinity.nodes[place as usize] as usize));
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
                if fine == 1.0 && met.are_met(places, &weights) {
                    continue;
                }
                let mut near = near(distance);
                near.gap += fine * chord(&corners, &weights, radius);
                let same = 1e-12 * radius * radius;
                let is_new =
                    |found: &[Near]| found.iter().all(|known| (known.place - near.place).norm_squared() >= same);
                if near.gap < 0.0 && is_new(list) {
                    keep(list, near);
                }
            }
        }
        // A centre inside is nearest to the inner side of some triangle.
        if let Some(behind) = behind
            && -(behind.gap + radius) < front * (1.0 - 1e-9)
            && -(behind.gap + radius) < MAX_DEPTH + radius
        {
            list.clear();
            list.push(behind);
        }
    }
}

/// Adds a place; of too many the deepest are kept.
fn keep(places: &mut Vec<Near>, near: Near) {
    if places.len() < MOST_POINTS {
        places.push(near);
    } else if let Some(shallowest) = places.iter_mut().max_by(|a, b| a.gap.total_cmp(&b.gap))
        && near.gap < shallowest.gap
    {
        *shallowest = near;
    }
}
