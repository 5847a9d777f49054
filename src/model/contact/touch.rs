//! A tool on a body: its shape, where it touches, and what it feels there.

use std::sync::Arc;

use super::closest;
use super::extent::Extent;
use super::grain::Grain;
use super::row::Row;
use super::skin::Skin;
use super::steady::Steady;
use super::triangle::interpolate;
use super::{Contact, ContactMode, ContactPoint, ToolShape};
use crate::body::{Body, Stiffness};
use crate::mesh::{NearestTriangle, Surface};
use crate::{Pose, Vec3, Wrench};

/// Places that a tool can touch at the same time; of more the deepest count. A sphere that is pressed 3 mm into elements of
/// 1.5 mm touches some 70.
pub(super) const MOST_POINTS: usize = 192;

/// The share of the mean pressure below which a node of fine elements is at the rim of what is touched.
const RIM: f64 = 0.5;

/// What is within so many radii of a tool's axis is its footprint.
const FOOTPRINT: f64 = 1.1;

/// A tool on a body: its shape, its contact, and what it felt in the last step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touch {
    pub(crate) shape: ToolShape,
    /// The corners of the triangles for a tool of this size.
    pub(crate) skin: Arc<Skin>,
    /// The contact; of a tool with a shape that of the place with the largest force.
    pub(crate) contact: Contact,
    /// On the tool: the impulses over the full step.
    pub(crate) wrench: Wrench,
    /// How stiff the body is that it touches.
    pub(crate) stiffness: Stiffness,
    /// What it has pressed with lately.
    pub(super) steady: Steady,
    /// Where a tool with a shape touched in this tick; instead of forces it has their impulses (N s) until it is over.
    felt: Vec<Felt>,
    /// The same for whoever watches: forces are means over the last whole tick, triangles the body's.
    points: Vec<ContactPoint>,
    /// The nodes that the tool pressed in the last step, each with the force on it (N).
    pressed: Vec<(u32, Vec3)>,
    /// Of places that it would have pressed if they could give way: a node of each, for a tool with a shape.
    unmoved: Vec<u32>,
    /// At so many places it pressed.
    pressing: usize,
}

/// One place at which a tool touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Felt {
    /// The corners that it is between, in increasing order.
    feature: [u32; 3],
    pub(crate) weights: [f64; 3],
    pub(crate) point: ContactPoint,
    /// It pressed in the last step, with this impulse on the tool (N s).
    pub(crate) is_pressing: bool,
    pub(crate) impulse: Vec3,
}

impl Felt {
    /// A place that pressed if `pressed`, to [go on from](Touch::go_on_from): corners have other numbers there.
    pub(crate) fn told(point: ContactPoint, weights: [f64; 3], pressed: bool, impulse: Vec3) -> Self {
        Self { feature: [u32::MAX; 3], weights, point, is_pressing: pressed, impulse }
    }
}

impl Touch {
    /// Of a tool with a shape on a whole body.
    pub(crate) fn new(shape: ToolShape, skin: Arc<Skin>, contact: Contact) -> Self {
        let room = if shape == ToolShape::Point { 0 } else { MOST_POINTS };
        let (felt, points, unmoved) = (Vec::with_capacity(room), Vec::with_capacity(room), Vec::with_capacity(room));
        Self { shape, skin, contact, felt, points, unmoved, pressed: Vec::with_capacity(40 * room), ..Self::default() }
    }

    /// True for a tool that touches with its shape: not a point, and not glued by its centre.
    pub(crate) fn has_shape(&self) -> bool {
        self.shape != ToolShape::Point && !self.contact.glued
    }

    /// A tick begins.
    pub(crate) fn begin(&mut self) {
        // What was touched at its end is remembered for one more: who stuck goes on sticking.
        self.felt.retain(|felt| felt.is_pressing);
        self.felt.iter_mut().for_each(|felt| felt.point.force = Vec3::zeros());
    }

    /// A tick of `duration` seconds is over: forces are means over it. `id` gives the body's id of a triangle.
    pub(crate) fn end(&mut self, duration: f64, id: impl Fn(u32) -> u32) {
        self.felt.iter_mut().for_each(|felt| felt.point.force /= duration);
        self.points.clear();
        let points = self.felt.iter().map(|felt| ContactPoint { triangle: id(felt.point.triangle), ..felt.point });
        self.points.extend(points);
    }

    /// Goes on from what another one felt: `contact` gives the numbering of a contact here, `id` that of a triangle.
    pub(crate) fn restart(
        &mut self,
        other: &Self,
        contact: impl Fn(&Contact) -> Contact,
        id: impl Fn(u32) -> Option<u32>,
    ) {
        (self.contact, self.wrench) = (contact(&other.contact), Wrench::default());
        (self.steady, self.stiffness) = (other.steady, other.stiffness);
        self.points.clone_from(&other.points);
        self.pressed.clear();
        self.unmoved.clear();
        // Whether a place stuck is told by its triangle: corners have other numbers here.
        self.felt.clear();
        self.felt.extend(other.felt.iter().filter_map(|felt| {
            let point = ContactPoint { triangle: id(felt.point.triangle)?, ..felt.point };
            Some(Felt { feature: [u32::MAX; 3], point, ..*felt })
        }));
    }

    /// Takes all that `other` knows but its shape: the tool goes on where that was, bit for bit.
    pub(crate) fn remember(&mut self, other: &Self) {
        (self.contact, self.wrench, self.stiffness) = (other.contact, other.wrench, other.stiffness);
        (self.steady, self.pressing) = (other.steady, other.pressing);
        self.felt.clone_from(&other.felt);
        self.points.clone_from(&other.points);
        self.pressed.clone_from(&other.pressed);
        self.unmoved.clone_from(&other.unmoved);
    }

    /// Where it touched in the last tick, with the mean forces.
    pub(crate) fn felt(&self) -> &[Felt] {
        &self.felt
    }

    /// What it has pressed with lately.
    pub(crate) fn steady(&self) -> Steady {
        self.steady
    }

    /// Goes on from what was felt on another computer in a tick.
    pub(crate) fn go_on_from(&mut self, contact: Contact, steady: Steady, felt: &[Felt]) {
        (self.contact, self.steady) = (contact, steady);
        self.felt.clear();
        self.felt.extend_from_slice(&felt[..felt.len().min(MOST_POINTS)]);
        self.end(1.0, |triangle| triangle);
    }

    /// Lets the tool touch nothing until it meets something, unless it is glued; whether it does.
    pub(crate) fn lift(&mut self) -> bool {
        let is_free = !self.contact.glued;
        if is_free {
            self.go_on_from(Contact::default(), Steady::default(), &[]);
        }
        is_free
    }

    /// Appends the triangles of a surface with nodes at `positions` (m), where `nearest` knows them, that the tool touches, or may touch
    /// soon, at `pose`, or if its radius were larger by `margin` (m).
    pub(crate) fn footprint(
        &self,
        nearest: &NearestTriangle,
        (surface, positions): (&Surface, &[Vec3]),
        pose: &Pose,
        margin: f64,
        triangles: &mut Vec<u32>,
    ) {
        let (axis, near) = (self.shape.axis(pose), FOOTPRINT * self.shape.radius() + margin);
        for triangle in nearest.around(&axis, near) {
            let corners = surface.triangles[triangle as usize].map(|node| positions[node as usize]);
            if is_near(&corners, &axis, near) && !triangles.contains(&triangle) {
                triangles.push(triangle);
            }
        }
    }

    /// Adds to the `nodes` of a patch around `triangles`, in increasing order, what the corners of these triangles are made of
    /// for this tool and can move.
    pub(crate) fn complete(&self, body: &dyn Body, triangles: &[u32], nodes: &mut Vec<u32>) {
        if self.skin.is_none() || self.contact.glued {
            return;
        }
        let (surface, masses) = (body.surface(), body.inverse_masses());
        let corners = triangles.iter().flat_map(|&triangle| surface.triangles[triangle as usize]);
        let made_of = corners.flat_map(|corner| self.skin.corner(corner)).map(|&(node, _)| node);
        nodes.extend(made_of.filter(|&node| masses[node as usize] > 0.0));
        nodes.sort_unstable();
        nodes.dedup();
    }

    /// The impulse on the tool in the last step at the place between these corners (N s); none if it did not press.
    pub(super) fn impulse_at(&self, feature: &[u32; 3]) -> Vec3 {
        let same = self.felt.iter().find(|felt| felt.is_pressing && felt.feature == *feature);
        same.map_or_else(Vec3::zeros, |felt| felt.impulse)
    }

    /// True if the place `row` stuck in the last step.
    pub(super) fn stuck_at(&self, feature: &[u32; 3], triangle: u32) -> bool {
        let stuck = |felt: &Felt| felt.is_pressing && felt.point.mode == ContactMode::Stick;
        if let Some(same) = self.felt.iter().find(|felt| felt.is_pressing && felt.feature == *feature) {
            return stuck(same);
        }
        let near = self.felt.iter().find(|felt| felt.is_pressing && felt.point.triangle == triangle);
        near.map_or(self.contact.mode == ContactMode::Stick, stuck)
    }

    /// A step of `d` seconds begins: the elements are as fine as they are for what is touched.
    pub(super) fn settle(&mut self, surface: &Surface, positions: &[Vec3], d: f64) {
        let grain = self.grain(surface, positions);
        let edges = grain.map_or(0.0, |grain| grain.edges_touched(self.shape.radius(), self.steady.force));
        self.steady.settle(edges, d);
    }

    /// The grain of the body where the tool touches, if it does and that is known.
    fn grain(&self, surface: &Surface, positions: &[Vec3]) -> Option<Grain> {
        let (corners, weights) = (surface.triangles[self.contact.triangle? as usize], &self.contact.weights);
        let grain = self.skin.grain(corners, weights, &corners.map(|node| positions[node as usize]))?;
        Some(grain.stiffened(self.stiffness))
    }

    /// What a tool with a shape, at `pose` after a step of `d` seconds, feels of `rows`.
    pub(super) fn feel<'a>(&mut self, rows: impl Iterator<Item = (&'a Row, &'a [(u32, f64)])>, pose: &Pose, d: f64) {
        self.felt.iter_mut().for_each(|felt| felt.is_pressing = false);
        self.pressed.clear();
        self.unmoved.clear();
        self.wrench = Wrench::default();
        let (mut largest, mut pushed, mut sticks, mut count) = (0.0, Vec3::zeros(), true, 0);
        let (mut first, mut last) = (1.0_f64, 0.0_f64);
        let mut found = Contact { mode: ContactMode::Free, ..Contact::default() };
        let mut lost = None;
        for (row, nodes) in rows {
            if row.mode == ContactMode::Lost {
                lost = Some(row);
                self.unmoved.extend(nodes.first().map(|&(node, _)| node));
            }
            let along = row.impulse.dot(&row.normal);
            if along <= 0.0 {
                continue;
            }
            let force = row.impulse / d;
            self.wrench += Wrench::at(row.place - pose.position, force);
            self.pressed.extend(nodes.iter().map(|&(node, weight)| (node, -force * weight)));
            pushed += row.normal * along;
            (first, last) = (first.min(row.share), last.max(row.share));
            sticks &= row.mode == ContactMode::Stick;
            count += 1;
            if along > largest {
                largest = along;
                found = Contact { triangle: Some(row.triangle), weights: row.weights, ..found };
            }
            let (triangle, place, normal, mode) = (row.triangle, row.place, row.normal, row.mode);
            let point = ContactPoint { triangle, place, normal, force: row.impulse, mode };
            let felt =
                Felt { feature: row.feature, weights: row.weights, point, is_pressing: true, impulse: row.impulse };
            if let Some(known) = self.felt.iter_mut().find(|felt| felt.feature == row.feature && !felt.is_pressing) {
                let force = known.point.force + row.impulse;
                *known = Felt { point: ContactPoint { force, ..point }, ..felt };
            } else if self.felt.len() < MOST_POINTS {
                self.felt.push(felt);
            }
        }
        self.pressing = count;
        // Half of the axis' length along which it presses: a capsule on its tip is a sphere.
        let (radius, half) = (self.shape.radius(), self.shape.half_axis().norm() * (last - first).max(0.0));
        self.steady.follow(pushed.norm() / d * radius / (radius + half), d);
        self.contact = match lost {
            _ if count > 0 => {
                let mode = if sticks { ContactMode::Stick } else { ContactMode::Slip };
                Contact { mode, normal: pushed.try_normalize(0.0).unwrap_or_default(), ..found }
            }
            Some(row) => Contact {
                mode: ContactMode::Lost,
                triangle: Some(row.triangle),
                weights: row.weights,
                normal: row.normal,
                ..found
            },
            None => found,
        };
    }

    /// What a point tool feels of its `row`, if it has one, in a step of `d` seconds.
    pub(super) fn feel_point(&mut self, row: Option<&Row>, d: f64) {
        self.wrench = Wrench::default();
        if let Some(row) = row {
            (self.contact.mode, self.contact.normal) = (row.mode, row.normal);
            self.wrench = (row.impulse / d).into();
        }
    }

    /// The places that it touched in the last tick.
    pub(crate) fn points(&self) -> &[ContactPoint] {
        &self.points
    }

    /// The nodes that it pressed in the last step, each with the force on it (N).
    pub(crate) fn pressed(&self) -> &[(u32, Vec3)] {
        &self.pressed
    }

    /// The share of the places that it would press whose node `is_one` that did not give way in the last step.
    pub(crate) fn unmoved(&self, is_one: impl Fn(u32) -> bool) -> f64 {
        let unmoved = self.unmoved.iter().filter(|&&node| is_one(node)).count();
        unmoved as f64 / (unmoved + self.pressing).max(1) as f64
    }

    /// Tells `each` node that it presses with the force on that (N): of a tool with a shape those of the last step, of a point its share of
    /// `force`, which is that on the tool.
    pub(crate) fn each_exerted(&self, surface: &Surface, force: Vec3, mut each: impl FnMut(u32, Vec3)) {
        if self.has_shape() {
            self.pressed.iter().for_each(|&(node, force)| each(node, force));
        } else if let Some(triangle) = self.contact.triangle {
            let nodes = surface.triangles[triangle as usize];
            nodes.into_iter().zip(self.contact.weights).for_each(|(node, weight)| each(node, -force * weight));
        }
    }

    /// The area that it touches (m^2): a third of the triangles around each node that is touched, and of one that is
    /// touched in part, that part. Of a sphere on coarse elements no less than what it touches of a half space under its force; of fine ones
    /// nodes at the rim, which it only just reaches, count by how much they press.
    pub(crate) fn area(&self, surface: &Surface, positions: &[Vec3]) -> f64 {
        let mut touched = [Touched::default(); MOST_POINTS];
        let mut count = 0;
        for felt in self.felt.iter().filter(|felt| felt.is_pressing) {
            let corners = surface.triangles[felt.point.triangle as usize];
            for (node, weight) in corners.into_iter().zip(felt.weights).filter(|&(_, weight)| weight > 0.0) {
                let known = touched[..count].iter().position(|known| known.node == node);
                let place = known.unwrap_or(count);
                let Some(known) = touched.get_mut(place) else { continue };
                if place == count {
                    *known = Touched { node, area: area_at(surface, positions, node), ..Touched::default() };
                    count += 1;
                }
                known.share += weight;
                known.push += weight * felt.impulse.norm();
            }
        }
        let touched = &touched[..count];
        let seen: f64 = touched.iter().map(|node| node.share.min(1.0) * node.area).sum();
        let rim = RIM * touched.iter().map(|node| node.push).sum::<f64>() / seen.max(f64::MIN_POSITIVE);
        let fine = self.steady.fineness;
        let seen = touched.iter().fold(0.0, |sum, &Touched { area, share, push, .. }| {
            let pressing = if push < rim * area { push / (rim * area) } else { 1.0 };
            sum + share.min(1.0) * area * (1.0 - fine * (1.0 - pressing))
        });
        let expected = self.touched_of_half_space(surface, positions).unwrap_or_default();
        seen + (1.0 - fine) * (expected - seen).max(0.0)
    }

    /// What a sphere would touch of a half space (m^2); `None` if it does not sink in.
    fn touched_of_half_space(&self, surface: &Surface, positions: &[Vec3]) -> Option<f64> {
        let ToolShape::Sphere { radius } = self.shape else { return None };
        Some(self.grain(surface, positions)?.touched(radius, self.wrench.force.norm()))
    }
}

/// A node that is touched.
#[derive(Clone, Copy, Default)]
struct Touched {
    node: u32,
    /// Around it (m^2).
    area: f64,
    /// How much of it is touched.
    share: f64,
    /// N s
    push: f64,
}

/// True if a triangle comes as near as `distance` (m) to the segment `axis`.
fn is_near(corners: &[Vec3; 3], axis: &[Vec3; 2], distance: f64) -> bool {
    let place = || {
        let centre = axis[0] + (axis[1] - axis[0]) * closest::share_of_axis(axis, corners);
        interpolate(&closest::weights(corners, &centre), corners) - centre
    };
    Extent::around(axis).apart_squared(&Extent::around(corners)) <= distance * distance
        && place().norm_squared() <= distance * distance
}

/// A third of the triangles around a node (m^2).
fn area_at(surface: &Surface, positions: &[Vec3], node: u32) -> f64 {
    let area = |&t: &u32| {
        let [a, b, c] = surface.triangles[t as usize].map(|node| positions[node as usize]);
        (b - a).cross(&(c - a)).norm() / 6.0
    };
    surface.at_node(node).iter().map(area).sum()
}
