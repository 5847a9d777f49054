//! The triangles that a tool with a shape may come near: found once, and again when something has moved far.

use super::ToolMotion;
use super::deformable::Deformable;
use super::extent::Extent;
use super::skin::Skin;
use super::swept::MAX_DEPTH;
use super::touch::Touch;
use crate::Vec3;
use crate::mesh::Surface;

/// Triangles are found for tools and surfaces that move by so much together: among all, and among those that were found so (m).
const MARGIN: f64 = 3e-3;
pub(super) const NARROW: f64 = 1e-3;

/// The triangles that a tool may come near until it and the surface have moved by so much together. All others are so far that
/// no search would take one: what is found hangs on where things are and not on when this was made.
#[derive(Clone, Debug, Default)]
pub(super) struct Vicinity {
    /// Among the body's candidates, in their order.
    pub(super) triangles: Vec<u32>,
    /// Their corners, as places in `nodes`.
    pub(super) corners: Vec<[u32; 3]>,
    /// Each once, in the order in which the triangles name them.
    pub(super) nodes: Vec<u32>,
    /// The body's nodes that candidates' corners are made of, in increasing order.
    surface: Vec<u32>,
    /// The ends of the tool's axis, and these nodes, when it was made (m).
    axis: [Vec3; 2],
    positions: Vec<Vec3>,
    /// How fine the elements were.
    fineness: f64,
    is_known: bool,
    /// How far things had moved by then since what this is a part of was made (m).
    before: f64,
    /// By node of the body: its place in `nodes`, from one on; zero for all others.
    places: Vec<u32>,
    /// By node of the body: its place in `extents`, from one on, or other marks. Working memory.
    seen: Vec<u32>,
    /// Around the corners that were looked at: at both ends of the step, and smoothed or not.
    extents: Vec<Extent>,
}

impl Vicinity {
    /// Of a tool with that `skin` on a body of so many nodes, with that surface and candidates: not known yet.
    pub(super) fn make_room(&mut self, nodes: usize, (surface, candidates): (&Surface, &[u32]), skin: &Skin) {
        self.forget();
        self.triangles.reserve(candidates.len());
        self.corners.reserve(candidates.len());
        self.nodes.reserve(nodes);
        self.extents.clear();
        self.extents.reserve(nodes);
        self.places.clear();
        self.places.resize(nodes, 0);
        self.seen.clear();
        self.seen.resize(nodes, 0);
        for corner in candidates.iter().flat_map(|&triangle| surface.triangles[triangle as usize]) {
            let made_of = skin.corner(corner).iter().map(|&(node, _)| node);
            // Each corner is of several triangles.
            if std::mem::replace(&mut self.seen[corner as usize], 2) < 2 {
                made_of.for_each(|node| self.seen[node as usize] = self.seen[node as usize].max(1));
            }
        }
        self.surface.clear();
        self.surface.extend((0..nodes as u32).filter(|&node| self.seen[node as usize] > 0));
        self.positions.clear();
        self.positions.resize(self.surface.len(), Vec3::zeros());
    }

    /// It is not known any more.
    fn forget(&mut self) {
        self.is_known = false;
        self.triangles.clear();
        self.corners.clear();
        self.nodes.drain(..).for_each(|node| self.places[node as usize] = 0);
    }

    /// Makes it what it says for a step of `d` seconds, of all candidates.
    pub(super) fn update(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        if !self.is_known || self.moved(body, touch, motion, d) > MARGIN {
            self.find(body, touch, motion, d);
        }
    }

    /// True if it is still what a [narrow](Self::narrow) one says, for a step of `d` seconds.
    pub(super) fn is_narrow(&self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) -> bool {
        // Corners move too while elements become finer.
        self.is_known
            && self.fineness == touch.steady.fineness
            && self.moved(body, touch, motion, d) <= NARROW.min(MARGIN - self.before)
    }

    /// Becomes the part of `wide` whose triangles are, by their number there, within a reach (m) that is given for how much more than
    /// what is touched it has to hold. Nothing is known if in one such step too much moves.
    pub(super) fn narrow(
        &mut self,
        wide: &Self,
        (body, touch): (&Deformable<'_>, &Touch),
        motion: ToolMotion,
        d: f64,
        is_within: impl Fn(usize, f64) -> bool,
    ) {
        self.forget();
        self.begin(body, touch, motion);
        self.before = wide.moved(body, touch, motion, d);
        let moved = self.moved(body, touch, motion, d);
        self.is_known = moved <= NARROW;
        if !self.is_known {
            return;
        }
        for (number, (&triangle, corners)) in wide.triangles.iter().zip(&wide.corners).enumerate() {
            if is_within(number, NARROW + moved) {
                self.add(triangle, corners.map(|place| wide.nodes[place as usize]));
            }
        }
    }

    /// Things are where it is made.
    fn begin(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion) {
        (self.axis, self.fineness) = (touch.shape.axis(&motion.to), touch.steady.fineness);
        for (to, &node) in self.positions.iter_mut().zip(&self.surface) {
            *to = body.positions[node as usize];
        }
    }

    fn add(&mut self, triangle: u32, nodes: [u32; 3]) {
        let Self { triangles, corners, nodes: listed, places, .. } = self;
        triangles.push(triangle);
        corners.push(nodes.map(|node| {
            let place = &mut places[node as usize];
            if *place == 0 {
                listed.push(node);
                *place = listed.len() as u32;
            }
            *place - 1
        }));
    }

    /// How far below the surface a place of the triangle of that number is met (m): smoothed corners lie below their nodes.
    pub(super) fn depth(&self, number: usize, weights: &[f64; 3], touch: &Touch) -> f64 {
        let coarse = 1.0 - touch.steady.fineness;
        let depth = |&place: &u32| coarse * touch.skin.depth(self.nodes[place as usize] as usize);
        self.corners[number].iter().zip(weights).map(|(place, weight)| weight * depth(place)).sum()
    }

    /// How far the tool and the surface have moved together at most at the end of the step (m).
    fn moved(&self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) -> f64 {
        let ends = [&motion.from, &motion.to].map(|pose| touch.shape.axis(pose));
        let tool = ends.iter().flat_map(|axis| [axis[0] - self.axis[0], axis[1] - self.axis[1]]);
        let tool = tool.fold(0.0, |most: f64, way| most.max(way.norm()));
        let (mut way, mut speed) = ([0.0; 3], [0.0; 3]);
        let larger = |one: f64, other: f64| if one > other { one } else { other };
        for (&node, then) in self.surface.iter().zip(&self.positions) {
            let (now, v) = (body.positions[node as usize], body.velocities[node as usize]);
            for axis in 0..3 {
                way[axis] = larger((now[axis] - then[axis]).abs(), way[axis]);
                speed[axis] = larger(v[axis].abs(), speed[axis]);
            }
        }
        let largest = |of: [f64; 3]| of.into_iter().fold(0.0, larger);
        // As far as a mean of nodes moves by what each of them does along each axis.
        tool + touch.skin.stretch() * 3.0_f64.sqrt() * (largest(way) + d * largest(speed))
    }

    fn find(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        let (skin, radius) = (&*touch.skin, touch.shape.radius());
        let way = [&motion.from, &motion.to].map(|pose| touch.shape.axis(pose));
        let way = Extent::around(way.as_flattened());
        self.forget();
        self.begin(body, touch, motion);
        self.is_known = true;
        self.seen.fill(0);
        self.extents.clear();
        for &triangle in body.candidates {
            let ids = body.surface.triangles[triangle as usize];
            let depth = ids.iter().fold(MAX_DEPTH, |most: f64, &node| most.max(skin.depth(node as usize)));
            let distance = radius + depth + MARGIN;
            let is_near = |extent: Extent, distance: f64| way.apart_squared(&extent) <= distance * distance;
            // A smoothed corner is near its node.
            let moving = ids.map(|node| body.corner(skin, 1.0, node, d));
            if !is_near(Extent::around(moving.as_flattened()), distance + skin.reach()) {
                continue;
            }
            let [a, b, c] = ids.map(|node| {
                let place = &mut self.seen[node as usize];
                if *place == 0 {
                    let moving = [0.0, 1.0].map(|fine| body.corner(skin, fine, node, d));
                    self.extents.push(Extent::around(moving.as_flattened()));
                    *place = self.extents.len() as u32;
                }
                self.extents[*place as usize - 1]
            });
            if is_near(a.and(&b).and(&c), distance) {
                self.add(triangle, ids);
            }
        }
    }
}
