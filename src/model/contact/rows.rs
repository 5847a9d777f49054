//! The places at which tools may touch in one step, as rows of one system for the impulses there.

use super::closest;
use super::deformable::Deformable;
use super::exact::Exact;
use super::nearness::Nearness;
use super::passing;
use super::resolve::{IMMOVABLE, Place, RECOVERY, approach};
use super::row::Row;
use super::skin::Sunk;
use super::touch::{MOST_POINTS, Touch};
use super::triangle::interpolate;
use super::{ContactMode, Law, ToolMotion};
use crate::{Mat3, Pose, Vec3};

/// A centre that is farther than this below the surface, beside the tool's radius, has lost it (m).
const MAX_DEPTH: f64 = 5e-3;

/// A place of which less than this share can move is held: its few movable nodes would have to fly.
const HELD: f64 = 0.1;

/// A node that a search has met.
const MARKED: u8 = 1 << 7;

/// A tool that sinks in less than this beside the elements does not (m).
const NEXT_TO_NOTHING: f64 = 1e-7;

/// Where a tool comes near the surface.
#[derive(Clone, Copy, Debug)]
struct Near {
    triangle: u32,
    weights: [f64; 3],
    place: Vec3,
    normal: Vec3,
    /// From the surface to the tool's (m); negative where they overlap.
    gap: f64,
    /// Where on the axis, from one end to the other.
    share: f64,
}

/// The rows of one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(super) rows: Vec<Row>,
    /// The nodes of all rows with their weights.
    pub(super) nodes: Vec<(u32, f64)>,
    near: Vec<Near>,
    pub(super) nearness: Nearness,
    pub(super) exact: Exact,
    /// How each place answers to an impulse at each (1/kg): in an explicit step, and in an implicit one.
    pub(super) shared: Vec<f64>,
    pub(super) coupling: Vec<Mat3>,
    /// How fast each place closes (m/s), and did before a sweep.
    pub(super) closing: Vec<Vec3>,
    pub(super) before: Vec<Vec3>,
    /// A number for each node of the body; zeros between steps.
    pub(super) at_nodes: Vec<f64>,
    /// The place of each node in the list of a row, from one on; zeros but while that list is made.
    listed: Vec<u32>,
    /// On which sides of the box around a tool each node stays in the step, a bit for each, and `MARKED`.
    sides: Vec<u8>,
    /// The corner at each marked node as the tool meets it at the end of the step (m).
    corners: Vec<Vec3>,
}

impl Rows {
    /// With room for so many tools that none is made in a step.
    pub(crate) fn with_room(tools: usize) -> Self {
        let rows = tools * MOST_POINTS;
        Self {
            rows: Vec::with_capacity(rows),
            nodes: Vec::with_capacity(40 * rows),
            near: Vec::with_capacity(MOST_POINTS),
            nearness: Nearness::with_room(rows),
            exact: Exact::default(),
            shared: Vec::with_capacity(rows * rows),
            coupling: Vec::new(),
            closing: Vec::with_capacity(rows),
            before: Vec::with_capacity(rows),
            at_nodes: Vec::new(),
            listed: Vec::new(),
            sides: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Makes room for the coupling of so many places in an implicit step.
    pub(crate) fn reserve_coupling(&mut self, places: usize) {
        let places = places.min(MOST_POINTS);
        self.coupling.clear();
        self.coupling.reserve(places * places);
    }

    /// Makes room for a body of `nodes` nodes.
    pub(crate) fn make_room(&mut self, nodes: usize) {
        self.at_nodes.resize(nodes, 0.0);
        self.listed.resize(nodes, 0);
        self.sides.resize(nodes, 0);
        self.corners.resize(nodes, Vec3::zeros());
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.nodes.clear();
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
            place: at,
            normal,
            target: velocity - closing,
            allowed: 0.0,
            compliance,
            along: compliance,
            sinking: None,
            sunk: Sunk::default(),
            stuck: contact.mode == ContactMode::Stick,
            glued: contact.glued,
            mode: ContactMode::Free,
            impulse: Vec3::zeros(),
            nodes: (first, self.nodes.len()),
        });
    }

    /// Adds the rows of a tool with a shape: where it would overlap with the surface at the end of the step if nothing pressed.
    pub(super) fn add_shape(
        &mut self,
        body: &Deformable<'_>,
        (tool, touch): (usize, &Touch),
        motion: ToolMotion,
        d: f64,
    ) {
        self.near.clear();
        self.find_sides(body, touch, motion, d);
        if !self.find_passed(body, touch, motion, d) {
            self.find_near(body, touch, &motion.to, d);
        }
        for place in 0..self.near.len() {
            let near = self.near[place];
            self.add(body, (tool, touch), motion, d, near);
        }
    }

    /// Tells where nodes stay of the box around the way of a tool with all that it may touch: a triangle whose corners stay on one
    /// side of it is not looked at again.
    fn find_sides(&mut self, body: &Deformable<'_>, touch: &Touch, motion: ToolMotion, d: f64) {
        let axes = [touch.shape.axis(&motion.from), touch.shape.axis(&motion.to)].into_iter().flatten();
        let (low, high) = axes
            .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), end| {
                (low.inf(&end), high.sup(&end))
            });
        let around = Vec3::repeat(touch.shape.radius() + MAX_DEPTH + touch.skin.reach());
        let (low, high) = (low - around, high + around);
        for ((sides, x), v) in self.sides.iter_mut().zip(&*body.positions).zip(&*body.velocities) {
            let end = x + v * d;
            *sides = (0..3).fold(0, |sides, i| {
                let below = u8::from(x[i].max(end[i]) < low[i]);
                let above = u8::from(x[i].min(end[i]) > high[i]);
                sides << 2 | below << 1 | above
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
            let candidates = body.candidates.iter().copied().filter(|&triangle| meets(&self.sides, body, triangle));
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
            if !meets(&self.sides, body, triangle) {
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
            if !is_around(&axis, radius + MAX_DEPTH, &corners) {
                continue;
            }
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let depths = body.corners(triangle).map(|node| skin.depth(node));
            let shares = [closest::share_of_axis(&axis, &corners), 0.0, 1.0];
            for share in if is_long { &shares[..] } else { &shares[..1] } {
                let centre = axis[0] + (axis[1] - axis[0]) * *share;
                let weights = closest::weights(&corners, &centre);
                let place = interpolate(&weights, &corners);
                let away = centre - place;
                let distance = away.norm();
                let depth: f64 = weights.iter().zip(depths).map(|(w, depth)| w * depth).sum();
                let near = |normal, distance: f64| Near {
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
                        behind = Some(Near { gap: -distance - radius, ..near(away / -distance, 0.0) });
                    }
                    continue;
                }
                front = front.min(distance);
                let Some(normal) = away.try_normalize(1e-12).or_else(|| across.try_normalize(0.0)) else { continue };
                let near = near(normal, distance);
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

    fn add(&mut self, body: &Deformable<'_>, (tool, touch): (usize, &Touch), motion: ToolMotion, d: f64, near: Near) {
        let first = self.nodes.len();
        let corners = body.surface.triangles[near.triangle as usize];
        for (node, weight) in corners.into_iter().zip(near.weights).filter(|&(_, weight)| weight > 0.0) {
            let shares = touch.skin.corner(node);
            let alone = [(node, 1.0)];
            for &(node, share) in if shares.is_empty() { &alone[..] } else { shares } {
                // Corners share nodes.
                let place = &mut self.listed[node as usize];
                if *place == 0 {
                    self.nodes.push((node, 0.0));
                    *place = (self.nodes.len() - first) as u32;
                }
                self.nodes[first + *place as usize - 1].1 += weight * share;
            }
        }
        let nodes = &self.nodes[first..];
        nodes.iter().for_each(|&(node, _)| self.listed[node as usize] = 0);
        let mean =
            |vectors: &[Vec3]| nodes.iter().fold(Vec3::zeros(), |sum, &(node, w)| sum + vectors[node as usize] * w);
        let compliance: f64 = nodes.iter().map(|&(node, w)| w * w * body.inverse_masses[node as usize]).sum();
        let (velocity, position) = (mean(body.velocities), mean(body.positions));
        let movable: f64 =
            nodes.iter().filter(|&&(node, _)| body.inverse_masses[node as usize] > 0.0).map(|&(_, w)| w).sum();
        let is_held = movable < HELD || compliance < IMMOVABLE;
        // The tool's own point that is nearest at the end: where it was, and how fast it moves.
        let at = |pose: &Pose| touch.shape.axis(pose)[0] * (1.0 - near.share) + touch.shape.axis(pose)[1] * near.share;
        let arm = near.place - motion.to.position;
        let turned = motion.to.turned_since(&motion.from);
        let target = (motion.way() + turned.cross(&arm)) / d;
        let depth = (at(&motion.to) - near.place).dot(&near.normal) - touch.shape.radius() - near.gap;
        let before = (at(&motion.from) - position).dot(&near.normal) - touch.shape.radius() - depth;
        // What overlapped before is pushed out slowly; what would overlap by the motion is met at once.
        let grain = touch.skin.grain(corners, &near.weights);
        let sinking = grain.map(|grain| (grain.sinking(touch.shape.radius(), touch.steady), grain));
        let sinking = sinking.filter(|(sinking, _)| sinking.most() > NEXT_TO_NOTHING);
        let sunk = sinking.map_or(0.0, |(sinking, _)| sinking.most());
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
            place: near.place,
            normal: near.normal,
            target,
            allowed: (velocity - target).dot(&near.normal) + (near.gap - gap) / d,
            compliance,
            along: compliance,
            sinking,
            sunk: Sunk::default(),
            stuck: touch.stuck_at(&feature, near.triangle),
            glued: false,
            mode: if is_held { ContactMode::Lost } else { ContactMode::Free },
            impulse: if is_held { Vec3::zeros() } else { touch.impulse_at(&feature) },
            nodes: (first, self.nodes.len()),
        });
    }
}

/// False if the corners of a triangle are all on one side of the box.
fn meets(sides: &[u8], body: &Deformable<'_>, triangle: u32) -> bool {
    body.corners(triangle).iter().fold(!MARKED, |common, &node| common & sides[node]) == 0
}

/// False if a triangle is surely farther than `distance` (m) from the axis.
fn is_around(axis: &[Vec3; 2], distance: f64, [a, b, c]: &[Vec3; 3]) -> bool {
    let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
    let [from, to] = axis;
    (0..3).all(|i| from[i].min(to[i]) <= high[i] + distance && from[i].max(to[i]) >= low[i] - distance)
}
