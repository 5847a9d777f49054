//! The triangles that a tool with a shape may come near: found once, and again when something has moved far.

use super::ToolMotion;
use super::closest::may_be_near;
use super::deformable::Deformable;
use super::touch::Touch;
use crate::Vec3;

/// A centre that is farther than this below the surface, beside the tool's radius, has lost it (m).
pub(super) const MAX_DEPTH: f64 = 5e-3;

/// Triangles are found for tools and surfaces that move by so much together (m).
const MARGIN: f64 = 3e-3;

/// The triangles that a tool may come near until it and the surface have moved by [`MARGIN`] together. All others are so far that
/// no search would take one: what is found hangs on where things are and not on when this was made.
#[derive(Clone, Debug, Default)]
pub(super) struct Vicinity {
    /// Among the body's candidates, in their order.
    pub(super) triangles: Vec<u32>,
    /// Their corners, as places in `nodes`.
    pub(super) corners: Vec<[u32; 3]>,
    /// Each once.
    pub(super) nodes: Vec<u32>,
    /// The ends of the tool's axis, and all nodes of the body, when it was made (m).
    axis: [Vec3; 2],
    positions: Vec<Vec3>,
    is_known: bool,
    /// By node of the body: its place in `nodes` and that in `boxes`, from one on.
    places: Vec<[u32; 2]>,
    /// The corners that were looked at, from their least coordinates to their largest (m): at both ends of the step, and smoothed or not.
    boxes: Vec<[Vec3; 2]>,
}

impl Vicinity {
    /// Of a tool on a body of so many nodes and candidates: not known yet.
    pub(super) fn make_room(&mut self, nodes: usize, candidates: usize) {
        let Self { triangles, corners, nodes: listed, positions, places, boxes, is_known, .. } = self;
        *is_known = false;
        triangles.clear();
        triangles.reserve(candidates);
        corners.clear();
        corners.reserve(candidates);
        listed.clear();
        listed.reserve(nodes);
        boxes.clear();
        boxes.reserve(nodes);
        positions.resize(nodes, Vec3::zeros());
        places.resize(nodes, [0; 2]);
    }

    /// Makes it what it says for a step of `d` seconds.
    pub(super) fn update(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        if !self.is_known || self.moved(body, touch, motion, d) > MARGIN {
            self.find(body, touch, motion, d);
        }
    }

    /// How far the tool and the surface have moved together at most at the end of the step (m).
    fn moved(&self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) -> f64 {
        let ends = [&motion.from, &motion.to].map(|pose| touch.shape.axis(pose));
        let tool = ends.iter().flat_map(|axis| [axis[0] - self.axis[0], axis[1] - self.axis[1]]);
        let tool = tool.fold(0.0, |most: f64, way| most.max(way.norm()));
        let (mut way, mut speed) = ([0.0; 3], [0.0; 3]);
        let larger = |one: f64, other: f64| if one > other { one } else { other };
        for ((now, then), v) in body.positions.iter().zip(&self.positions).zip(&*body.velocities) {
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
        let [[a, b], [c, e]] = [&motion.from, &motion.to].map(|pose| touch.shape.axis(pose));
        let way = [a.inf(&b).inf(&c).inf(&e), a.sup(&b).sup(&c).sup(&e)];
        let Self { triangles, corners, nodes, axis, positions, is_known, places, boxes } = self;
        (*axis, *is_known) = ([c, e], true);
        positions.copy_from_slice(body.positions);
        places.fill([0; 2]);
        triangles.clear();
        corners.clear();
        nodes.clear();
        boxes.clear();
        for &triangle in body.candidates {
            let ids = body.surface.triangles[triangle as usize];
            let depth = ids.iter().fold(MAX_DEPTH, |most: f64, &node| most.max(skin.depth(node as usize)));
            let distance = radius + depth + MARGIN;
            // A smoothed corner is near its node.
            let moving = ids.map(|node| body.corner(skin, 1.0, node, d));
            if !is_near(&way, distance + skin.reach(), &moving) {
                continue;
            }
            let moving = ids.map(|node| {
                let [_, place] = &mut places[node as usize];
                if *place == 0 {
                    let [[a, b], [c, e]] = [0.0, 1.0].map(|fine| body.corner(skin, fine, node, d));
                    boxes.push([a.inf(&b).inf(&c).inf(&e), a.sup(&b).sup(&c).sup(&e)]);
                    *place = boxes.len() as u32;
                }
                boxes[*place as usize - 1]
            });
            if !is_near(&way, distance, &moving) {
                continue;
            }
            triangles.push(triangle);
            corners.push(ids.map(|node| {
                let [place, _] = &mut places[node as usize];
                if *place == 0 {
                    nodes.push(node);
                    *place = nodes.len() as u32;
                }
                *place - 1
            }));
        }
    }
}

/// False if a triangle is surely farther than `distance` (m) from the segment `way` while its corners go from one place to another.
pub(super) fn is_near(way: &[Vec3; 2], distance: f64, corners: &[[Vec3; 2]; 3]) -> bool {
    let [[a, d], [b, e], [c, f]] = corners;
    let low = a.inf(b).inf(c).inf(d).inf(e).inf(f);
    let high = a.sup(b).sup(c).sup(d).sup(e).sup(f);
    may_be_near(way, distance, &low, &high)
}
