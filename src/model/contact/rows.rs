//! The places at which tools may touch in one step, as rows of one system for the impulses there.

use super::columns::Columns;
use super::deformable::Deformable;
use super::grain::Sunk;
use super::near::Near;
use super::resolve::{IMMOVABLE, Place, RECOVERY, approach};
use super::row::Row;
use super::search::Search;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use super::work::Work;
use super::{ContactMode, Law, ToolMotion};
use crate::mesh::Surface;
use crate::{Mat3, Vec3};

/// A place of which less than this share can move is held: its few movable nodes would have to fly.
const HELD: f64 = 0.1;

/// A tool that sinks in less than this beside the elements does not (m).
const NEXT_TO_NOTHING: f64 = 1e-7;

/// The rows of one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(super) rows: Vec<Row>,
    /// The nodes of all rows with their weights.
    pub(super) nodes: Vec<(u32, f64)>,
    search: Search,
    pub(super) work: Work,
    /// How each place answers to an impulse at each (1/kg): in an explicit step, and in an implicit one.
    pub(super) shared: Columns<f64>,
    pub(super) coupling: Columns<Mat3>,
    /// A number for each node of the body; zeros between steps.
    pub(super) at_nodes: Vec<f64>,
    /// The place of each node in the list of a row, from one on; zeros but while that list is made.
    listed: Vec<u32>,
}

impl Rows {
    /// With room for so many tools that none is made in a step.
    pub(crate) fn with_room(tools: usize) -> Self {
        let rows = tools * MOST_POINTS;
        Self {
            rows: Vec::with_capacity(rows),
            nodes: Vec::with_capacity(40 * rows),
            search: Search::new(tools),
            work: Work::with_room(rows),
            shared: Columns::with_room(rows),
            coupling: Columns::default(),
            at_nodes: Vec::new(),
            listed: Vec::new(),
        }
    }

    /// Makes room for the coupling of so many places of each tool in an implicit step.
    pub(crate) fn reserve_coupling(&mut self, places: impl Iterator<Item = usize>) {
        self.coupling.make_room(places.map(|places| places.min(MOST_POINTS)).sum());
    }

    /// Makes room for tools on a body of so many nodes, with that surface and candidates, and forgets what it knows of another one.
    pub(crate) fn make_room(&mut self, nodes: usize, surface: (&Surface, &[u32]), touches: &[Touch]) {
        self.at_nodes.resize(nodes, 0.0);
        self.listed.resize(nodes, 0);
        self.search.make_room(nodes, surface, touches);
    }

    /// Two tools have each other's number from now on.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn swap(&mut self, one: usize, other: usize) {
        self.search.swap(one, other);
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.nodes.clear();
    }

    /// Puts rows in the order of their places. Sweeps that end before all is found find the same then in whatever order tools and
    /// triangles are.
    pub(super) fn sort(&mut self) {
        self.rows.sort_unstable_by(Row::in_order);
    }

    /// The rows of a tool with the nodes of each.
    pub(super) fn of(&self, tool: usize) -> impl Iterator<Item = (&Row, &[(u32, f64)])> {
        self.rows.iter().filter(move |row| row.tool == tool).map(|row| (row, &self.nodes[row.nodes.0..row.nodes.1]))
    }

    /// Adds the row of a point tool, if it touches.
    pub(super) fn add_point(
        &mut self,
        body: &mut Deformable<'_>,
        (tool, touch): (usize, &mut Touch),
        law: &Law,
        motion: ToolMotion,
        d: f64,
    ) {
        let contact = &mut touch.contact;
        let Some((triangle, share)) = body.detect(contact, motion, d) else { return };
        let corners = body.corners(triangle);
        let weights = contact.weights;
        let compliance = corners.iter().zip(&weights).map(|(&node, w)| w * w * body.inverse_masses[node]).sum();
        // Positions are those of the impact while the tool's approach is found.
        body.drift(share * d);
        let place = Place {
            triangle,
            weights: &contact.weights,
            is_glued: contact.glued,
            was_sticking: contact.mode == ContactMode::Stick,
        };
        let found = approach(body, law, place, motion.part(share, 1.0), [(1.0 - share) * d, d], compliance);
        let at = interpolate(&weights, &corners.map(|node| body.positions[node]));
        body.drift(-share * d);
        let (normal, closing) = match found {
            Ok(found) => found,
            Err(without_force) => {
                (contact.mode, contact.normal) = (without_force.mode, without_force.normal);
                return;
            }
        };
        let first = self.nodes.len();
        self.nodes.extend(corners.iter().zip(weights).map(|(&node, w)| (node as u32, w)));
        let velocity = interpolate(&weights, &corners.map(|node| body.velocities[node]));
        self.rows.push(Row {
            tool,
            triangle,
            weights,
            feature: [u32::MAX; 3],
            share: 0.0,
            place: at,
            normal,
            target: velocity - closing,
            closing,
            allowed: 0.0,
            compliance,
            along: compliance,
            sinking: None,
            sunk: Sunk::default(),
            stuck: contact.mode == ContactMode::Stick,
            glued: contact.glued,
            mode: ContactMode::Free,
            impulse: Vec3::zeros(),
            before: share * d,
            nodes: (first, self.nodes.len()),
        });
    }

    /// Adds the rows of a tool with a shape: where it would overlap with the surface at the end of the step if nothing pressed.
    pub(super) fn add_shape(
        &mut self,
        body: &Deformable<'_>,
        (tool, touch): (usize, &mut Touch),
        motion: ToolMotion,
        d: f64,
    ) {
        touch.settle(body.surface, body.positions, d);
        let touch = &*touch;
        self.search.find(body, (tool, touch), motion, d);
        let axes = [&motion.from, &motion.to].map(|pose| touch.shape.axis(pose));
        let turned = motion.to.turned_since(&motion.from);
        for place in 0..self.search.near.len() {
            let near = self.search.near[place];
            // The tool's own point that is nearest at the end, and how fast it moves.
            let of_tool = axes.map(|[a, b]| a * (1.0 - near.share) + b * near.share);
            let target = (motion.way() + turned.cross(&(near.place - motion.to.position))) / d;
            self.add(body, (tool, touch), (of_tool, target), d, near);
        }
    }

    /// Lists the nodes of a place with their weights; returns where the list begins.
    fn list_nodes(&mut self, corners: [u32; 3], touch: &Touch, weights: &[f64; 3]) -> usize {
        let (first, fine) = (self.nodes.len(), touch.steady.fineness);
        let Self { nodes, listed, .. } = self;
        for (corner, &weight) in corners.into_iter().zip(weights).filter(|&(_, &weight)| weight > 0.0) {
            // Corners share nodes.
            touch.skin.each_share(corner, fine, |node, share| {
                let place = &mut listed[node as usize];
                if *place == 0 {
                    nodes.push((node, weight * share));
                    *place = (nodes.len() - first) as u32;
                } else {
                    nodes[first + *place as usize - 1].1 += weight * share;
                }
            });
        }
        nodes[first..].iter().for_each(|&(node, _)| listed[node as usize] = 0);
        first
    }

    /// Adds the row of one: `at` is where the tool's own point there was before the step and is after it, and `target` how fast it moves.
    fn add(
        &mut self,
        body: &Deformable<'_>,
        (tool, touch): (usize, &Touch),
        (at, target): ([Vec3; 2], Vec3),
        d: f64,
        near: Near,
    ) {
        let corners = body.surface.triangles[near.triangle as usize];
        let first = self.list_nodes(corners, touch, &near.weights);
        let nodes = &self.nodes[first..];
        let (mut compliance, mut movable) = (0.0, 0.0);
        for &(node, w) in nodes {
            let inverse_mass = body.inverse_masses[node as usize];
            compliance += w * w * inverse_mass;
            movable += if inverse_mass > 0.0 { w } else { 0.0 };
        }
        let is_held = movable < HELD || compliance < IMMOVABLE;
        let depth = (at[1] - near.place).dot(&near.normal) - touch.shape.radius() - near.gap;
        let closing = (near.place - near.from) / d - target;
        let before = (at[0] - near.from).dot(&near.normal) - touch.shape.radius() - depth;
        // What overlapped before is pushed out slowly; what would overlap by the motion is met at once.
        let nodes_at = corners.map(|node| body.positions[node as usize]);
        // Fine elements show all of it.
        let is_fine = touch.steady.fineness == 1.0;
        let grain = if is_fine { None } else { touch.skin.grain(corners, &near.weights, &nodes_at) };
        let grain = grain.map(|grain| grain.stiffened(touch.stiffness));
        let sinking = grain.map(|grain| (grain.sinking(touch.shape.radius(), touch.steady), grain));
        let sunk = sinking.map_or(0.0, |(sinking, _)| sinking.most());
        let (sinking, sunk) = if sunk > NEXT_TO_NOTHING { (sinking, sunk) } else { (None, 0.0) };
        let gap = (before + sunk + RECOVERY * d).min(0.0);
        let mut feature = [u32::MAX; 3];
        for ((slot, node), weight) in feature.iter_mut().zip(corners).zip(near.weights) {
            if weight > 0.0 {
                *slot = node;
            }
        }
        feature.sort_unstable();
        self.rows.push(Row {
            tool,
            triangle: near.triangle,
            weights: near.weights,
            feature,
            share: near.share,
            place: near.place,
            normal: near.normal,
            target,
            closing,
            allowed: closing.dot(&near.normal) + (near.gap - gap) / d,
            compliance,
            along: compliance,
            sinking,
            sunk: Sunk::default(),
            stuck: touch.stuck_at(&feature, near.triangle),
            glued: false,
            mode: if is_held { ContactMode::Lost } else { ContactMode::Free },
            impulse: if is_held { Vec3::zeros() } else { touch.impulse_at(&feature) },
            before: 0.0,
            nodes: (first, self.nodes.len()),
        });
    }
}
