//! The search for the places at which a tool with a shape may touch in a step.

use super::ToolMotion;
use super::closest;
use super::corners::{self, Corners, chord};
use super::deformable::Deformable;
use super::extent::Extent;
use super::inside::{MOST_PARTS, Surroundings};
use super::near::{Near, is_in_front, is_off, outward};
use super::passing;
use super::swept::MAX_DEPTH;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use super::vicinity::{NARROW, Vicinity};
use crate::mesh::Surface;
use crate::{Pose, Vec3};

/// The places that were found, and what the search keeps from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    pub(super) near: Vec<Near>,
    /// Of each tool: the wide one, and the part of it that is looked at while little moves.
    vicinities: Vec<[Vicinity; 2]>,
    /// The corners of a vicinity as the tool meets them at the start of the step, and at its end if nothing presses (m).
    corners: Vec<[Vec3; 2]>,
    /// How far these are from the tool's axis then, squared (m^2).
    squares: Vec<f64>,
    fine: Corners,
    /// How far the triangles of a vicinity are from the tool's axis at least, squared (m^2).
    apart: Vec<f64>,
    /// Working memory: the ways out of what is inside.
    outs: Vec<Option<Near>>,
    /// The same for what passes through the surface.
    sides: Vec<u8>,
}

/// How far the nearest place that the axis is in front of is from it at most, and the nearest that it is behind (m), and whether it goes through
/// the surface.
struct Around {
    front: f64,
    behind: f64,
    passes: bool,
}

impl Search {
    /// For so many tools.
    pub(super) fn new(tools: usize) -> Self {
        let vicinities = vec![<[Vicinity; 2]>::default(); tools];
        let (near, outs) = (Vec::with_capacity(MOST_POINTS), Vec::with_capacity(MOST_PARTS + 1));
        Self { near, vicinities, outs, ..Self::default() }
    }

    /// Makes room for tools on a body of so many nodes, with that surface and candidates, and forgets another one.
    pub(super) fn make_room(&mut self, nodes: usize, surface: (&Surface, &[u32]), touches: &[Touch]) {
        for (vicinities, touch) in self.vicinities.iter_mut().zip(touches) {
            vicinities.iter_mut().for_each(|vicinity| vicinity.make_room(nodes, surface, &touch.skin));
        }
        self.corners.reserve(nodes);
        self.squares.reserve(nodes);
        self.sides.reserve(nodes);
        self.apart.reserve(surface.1.len());
        self.fine.make_room(nodes);
    }

    /// Two tools have each other's number from now on.
    pub(super) fn swap(&mut self, one: usize, other: usize) {
        self.vicinities.swap(one, other);
    }

    /// Finds the places that would overlap with a tool at the end of the step if nothing pressed.
    pub(super) fn find(&mut self, body: &Deformable<'_>, (tool, touch): (usize, &Touch), motion: ToolMotion, d: f64) {
        self.near.clear();
        let [mut wide, mut narrow] = std::mem::take(&mut self.vicinities[tool]);
        let is_narrow = narrow.is_narrow(body, touch, motion, d);
        if !is_narrow {
            wide.update(body, touch, motion, d);
        }
        let vicinity = if is_narrow { &narrow } else { &wide };
        self.corners.clear();
        self.corners
            .extend(vicinity.nodes.iter().map(|&node| body.corner(&touch.skin, touch.steady.fineness, node, d)));
        if !self.find_passed(vicinity, touch, motion) {
            let front = self.find_near(vicinity, touch, &motion.to);
            if !is_narrow {
                // What is nearest stays so near, or nearer: what is farther is neither the nearest nor touched. Parts of a long axis
                // may be inside while others are not.
                let radius = touch.shape.radius();
                let most = radius + MAX_DEPTH;
                let nearest = if is_long(touch) { most } else { (front + NARROW).min(most) };
                let beyond = |place: u32| corners::beyond(touch, wide.nodes[place as usize] as usize);
                narrow.narrow(&wide, (body, touch), motion, d, |number, more| {
                    let beyond = wide.corners[number].into_iter().map(beyond).fold(0.0, f64::max);
                    let reach = nearest.max(radius + beyond) + more;
                    self.apart[number] <= reach * reach
                });
            }
        }
        self.vicinities[tool] = [wide, narrow];
    }

    /// A place of the surface that the axis passes within the step; whatever else is near at its end is the far side. None if a long axis
    /// has gone in so little that the way out is where it came in: it may rest on many places.
    fn find_passed(&mut self, vicinity: &Vicinity, touch: &Touch, motion: ToolMotion) -> bool {
        let shape = &touch.shape;
        let [from, to] = [shape.axis(&motion.from), shape.axis(&motion.to)];
        let surroundings = Surroundings { vicinity, corners: &self.corners, touch, axis: to };
        let ends = if is_long(touch) { 3 } else { 1 };
        let mut is_shallow = is_long(touch);
        for end in 0..ends {
            let share = [0.0, 1.0, 0.5][end];
            let [from, to] = [from, to].map(|[a, b]| a + (b - a) * share);
            let found = passing::first(&vicinity.corners, &self.corners, [from, to], &mut self.sides);
            let Some((found, weights)) = found else { continue };
            let [starts, corners] =
                [0, 1].map(|time| vicinity.corners[found].map(|node| self.corners[node as usize][time]));
            let [from, place] = [starts, corners].map(|corners| interpolate(&weights, &corners));
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let Some(normal) = across.try_normalize(0.0) else { continue };
            let gap = (to - place).dot(&normal) - vicinity.depth(found, &weights, touch) - shape.radius();
            let triangle = vicinity.triangles[found];
            is_shallow = is_shallow && surroundings.way_out(share).is_some_and(|out| out.normal.dot(&normal) > 0.0);
            self.near.push(Near { triangle, weights, from, place, normal, gap, share });
        }
        if is_shallow {
            self.near.clear();
        }
        !self.near.is_empty()
    }

    /// Whatever is near at the end of the step; returns how far the nearest place in front of the surface is from the axis at most (m).
    fn find_near(&mut self, vicinity: &Vicinity, touch: &Touch, pose: &Pose) -> f64 {
        let (axis, radius) = (touch.shape.axis(pose), touch.shape.radius());
        let Self { near: list, corners, squares, fine: met, .. } = self;
        squares.clear();
        squares.extend(corners.iter().map(|[_, end]| closest::squared_to(&axis, end)));
        met.find((vicinity, corners, squares), touch, &axis, |found| keep(list, found, radius));
        let Around { front, behind, passes } = self.look_around(vicinity, touch, &axis);
        let may_be_inside = if is_long(touch) {
            behind.is_finite()
        } else {
            // A centre inside is nearest to the inner side of some triangle.
            behind < front * (1.0 - 1e-9) && behind < MAX_DEPTH + radius
        };
        if may_be_inside {
            let Self { near: list, corners, outs, .. } = self;
            Surroundings { vicinity, corners, touch, axis }.leave_inside(list, outs, passes);
        }
        front
    }

    /// Adds the places in front of the surface that touch. Looks at triangles that do, or are the nearest of all.
    fn look_around(&mut self, vicinity: &Vicinity, touch: &Touch, axis: &[Vec3; 2]) -> Around {
        let (skin, fine, radius) = (&*touch.skin, touch.steady.fineness, touch.shape.radius());
        let coarse = 1.0 - fine;
        let is_long = is_long(touch);
        let around_axis = Extent::around(axis);
        let Self { near: list, corners: moving, squares, fine: met, apart, .. } = self;
        apart.clear();
        let mut around = Around { front: f64::INFINITY, behind: f64::INFINITY, passes: false };
        for (&triangle, places) in vicinity.triangles.iter().zip(&vicinity.corners) {
            let [a, b, c] = places.map(|place| place as usize);
            let depths = if coarse == 0.0 {
                [0.0; 3]
            } else {
                [a, b, c].map(|place| coarse * skin.depth(vicinity.nodes[place] as usize))
            };
            // It touches, or is the nearest of all.
            let touching = radius + depths.into_iter().fold(0.0, f64::max);
            let distance = touching.max(around.front.min(radius + MAX_DEPTH));
            let squares = [squares[a], squares[b], squares[c]];
            let [a, b, c] = [&moving[a][1], &moving[b][1], &moving[c][1]];
            let mut squared = closest::least_squared(squares, a, b, c);
            if squared <= distance * distance {
                squared = squared.max(Extent::around([a, b, c]).apart_squared(&around_axis));
            }
            apart.push(squared);
            if squared > distance * distance {
                continue;
            }
            let across = (b - a).cross(&(c - a));
            if fine == 1.0 && met.are_all_met(places) && is_in_front(axis, a, &across, radius) {
                around.front = squares.iter().fold(around.front, |front, squared| front.min(squared.sqrt()));
                continue;
            }
            let corners = [*a, *b, *c];
            let shares = [closest::share_of_axis(axis, &corners), 0.0, 1.0];
            for share in if is_long { &shares[..] } else { &shares[..1] } {
                let centre = axis[0] + (axis[1] - axis[0]) * *share;
                let weights = closest::weights(&corners, &centre);
                let place = interpolate(&weights, &corners);
                let away = centre - place;
                let distance = away.norm();
                around.passes |= !is_off(&away, radius);
                if away.dot(&across) < 0.0 {
                    around.behind = around.behind.min(distance);
                    continue;
                }
                around.front = around.front.min(distance);
                if fine == 1.0 && met.are_met(places, &weights) {
                    continue;
                }
                let Some(normal) = outward(&away, &across, radius) else { continue };
                let depth: f64 = weights.iter().zip(depths).map(|(w, depth)| w * depth).sum();
                let gap = distance - depth - radius + fine * chord(&corners, &weights, radius);
                if gap < 0.0 {
                    let from = interpolate(&weights, &places.map(|place| moving[place as usize][0]));
                    keep(list, Near { triangle, weights, from, place, normal, gap, share: *share }, radius);
                }
            }
        }
        around
    }
}

/// True for a tool with an axis that is more than a point.
fn is_long(touch: &Touch) -> bool {
    touch.shape.half_axis() != Vec3::zeros()
}

/// Adds a place, or takes it for one that is there already, for another part of the axis or of another triangle, if it is deeper for a tool
/// of that `radius` (m). Of too many the deepest are kept.
fn keep(places: &mut Vec<Near>, near: Near, radius: f64) {
    // Triangles that share a place are mostly next to each other in the list.
    let is_same = |known: &&mut Near| (known.place - near.place).norm_squared() < 1e-12 * radius * radius;
    if let Some(known) = places.iter_mut().rev().find(is_same) {
        if near.gap < known.gap - 1e-9 * radius {
            *known = near;
        }
    } else if places.len() < MOST_POINTS {
        places.push(near);
    } else if let Some(shallowest) = places.iter_mut().max_by(|a, b| a.gap.total_cmp(&b.gap))
        && near.gap < shallowest.gap
    {
        *shallowest = near;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::skin::Skin;
    use super::super::{Contact, ToolShape};
    use super::*;
    use crate::Turn;
    use crate::body::{Block, Body, State};
    use crate::mesh::Face;

    /// A tool that goes to and fro over a top that swings, faster and faster, at times a jump: what it finds hangs on where things are, and
    /// not on what was looked at before.
    #[test]
    fn whoever_looks_at_little_finds_what_a_search_of_everything_does() {
        let block = Block::builder([9, 9, 3], [0.08, 0.08, 0.02]).fix(Face::ZMin).build().unwrap();
        let candidates: Vec<u32> = (0..block.surface().triangles.len() as u32).collect();
        let (mut found, mut inside, mut narrow) = (0, 0, 0);
        let half_axis = Vec3::new(6e-3, 2e-3, 1e-3);
        for shape in [
            ToolShape::Sphere { radius: 4e-3 },
            ToolShape::Sphere { radius: 40e-3 },
            ToolShape::Capsule { radius: 3e-3, half_axis },
        ] {
            let mut touch = Touch::new(shape, Arc::new(Skin::new(&block, shape.radius())), Contact::default());
            let mut kept = Search::new(1);
            kept.make_room(block.rest().len(), (block.surface(), &candidates), std::slice::from_ref(&touch));
            let at = |t: f64| {
                let depth =
                    2e-3 + 4e-3 * (17.0 * t).sin() + shape.radius() * (f64::from((t * 3.0) as i32 % 5) - 3.0).max(0.0);
                Vec3::new(0.04 + 0.03 * (9.0 * t).sin(), 0.041 + 0.02 * (7.0 * t).cos(), 0.02 + shape.radius() - depth)
            };
            for step in 0..600 {
                let [t, next] = [step, step + 1].map(|step| (f64::from(step) * 1e-3).powi(2) * 4.0);
                touch.steady.fineness =
                    if step % 200 < 150 { 0.0 } else { (f64::from(step % 200 - 150) / 30.0).min(1.0) };
                let State { mut positions, mut velocities } = State::at_rest(block.rest());
                for (x, v) in positions.iter_mut().zip(&mut velocities) {
                    let phase = 100.0 * x.x + 60.0 * x.y + 30.0 * t;
                    (x.z, v.z) = (x.z + 1e-3 * phase.sin(), 0.03 * phase.cos());
                }
                let body = Deformable {
                    positions: &mut positions,
                    velocities: &mut velocities,
                    inverse_masses: block.inverse_masses(),
                    surface: block.surface(),
                    candidates: &candidates,
                };
                let motion = ToolMotion::straight(at(t), at(next));
                let mut anew = Search::new(1);
                anew.make_room(block.rest().len(), (block.surface(), &candidates), std::slice::from_ref(&touch));
                let [wide, small] = &kept.vicinities[0];
                let is_known = small.is_narrow(&body, &touch, motion, 1e-3) && !wide.triangles.is_empty();
                kept.find(&body, (0, &touch), motion, 1e-3);
                anew.find(&body, (0, &touch), motion, 1e-3);
                assert_eq!(format!("{:?}", kept.near), format!("{:?}", anew.near), "{shape:?}, step {step}");
                found += kept.near.len();
                inside += usize::from(kept.near.iter().any(|near| near.gap < -shape.radius()));
                narrow += usize::from(is_known);
            }
        }
        assert!(found > 3000 && inside > 20 && (600..1700).contains(&narrow), "{found} {inside} {narrow}");
    }

    /// Where a resting tool of that `shape`, its centre at `centre`, touches a `block` whose nodes rest at `positions`.
    fn places(block: &Block, mut positions: Vec<Vec3>, shape: ToolShape, centre: Vec3) -> Vec<Near> {
        let candidates: Vec<u32> = (0..block.surface().triangles.len() as u32).collect();
        let body = Deformable {
            velocities: &mut vec![Vec3::zeros(); positions.len()],
            positions: &mut positions,
            inverse_masses: block.inverse_masses(),
            surface: block.surface(),
            candidates: &candidates,
        };
        let touch = Touch::new(shape, Arc::new(Skin::new(block, shape.radius())), Contact::default());
        let mut search = Search::new(1);
        search.make_room(block.rest().len(), (block.surface(), &candidates), std::slice::from_ref(&touch));
        search.find(&body, (0, &touch), ToolMotion::straight(centre, centre), 1e-3);
        search.near
    }

    /// A long axis that stands upright in a flat top, at places where nodes and edges are and where none is: where it passes the surface is the
    /// way out of its end too.
    #[test]
    fn the_end_of_an_upright_axis_is_found_inside_wherever_it_goes_in() {
        let block = Block::builder([9, 9, 5], [0.08, 0.08, 0.04]).fix(Face::ZMin).build().unwrap();
        let (radius, depth) = (2e-3, 6.5e-3);
        for (x, y) in [(0.04, 0.021), (0.054, 0.027), (0.02, 0.03), (0.05, 0.04), (0.026, 0.041)] {
            for tilt in [Vec3::zeros(), Vec3::x() * 0.3, Vec3::new(-0.2, 0.4, 0.7)].map(Turn::from_scaled_axis) {
                let half_axis = tilt * Vec3::z() * 0.015;
                let positions = block.rest().iter().map(|position| tilt * position).collect();
                let centre = tilt * Vec3::new(x, y, 0.04 - depth) + half_axis;
                let near = places(&block, positions, ToolShape::Capsule { radius, half_axis }, centre);
                let deepest = near.iter().min_by(|one, other| one.gap.total_cmp(&other.gap));
                let Near { gap, normal, share, .. } = *deepest.expect("it is in the block");
                assert!((gap + depth + radius).abs() < 1e-9 && share == 0.0, "{x} {y}: {gap} at {share}");
                assert!((normal - tilt * Vec3::z()).norm() < 1e-9, "{x} {y}: {normal}");
            }
        }
    }

    /// A slanted axis over a flat top: a node is as near to it as it is, and not as near as an end of the axis, whichever way it slants.
    #[test]
    fn a_node_is_met_by_the_part_of_the_axis_that_is_nearest_to_it() {
        let block = Block::builder([15, 15, 3], [0.042, 0.042, 0.006]).fix(Face::ZMin).build().unwrap();
        let radius = 5e-3;
        for towards in [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()] {
            let half_axis = towards * 0.015 + Vec3::z() * 1.35e-3;
            let centre = Vec3::new(0.021, 0.021, 0.006 + 2.65e-3);
            let shape = ToolShape::Capsule { radius, half_axis };
            let near = places(&block, block.rest().to_vec(), shape, centre);
            let axis = shape.axis(&Pose::at(centre));
            for k in -4..=4 {
                let node = Vec3::new(0.021, 0.021, 0.006) + towards * 3e-3 * f64::from(k);
                let near = near.iter().find(|near| (near.place - node).norm() < 1e-9).expect("it is touched");
                let away = axis[0] + (axis[1] - axis[0]) * closest::share_at(&axis, &node) - node;
                assert!((near.gap - (away.norm() - radius)).abs() < 1e-9, "{towards}, {k}: {near:?}");
            }
        }
    }
}
