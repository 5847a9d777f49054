//! What the models with a patch have in common: the part of the body that they hold, its nodes and the surface around them in
//! compact numbering, and what the tool feels of it.

use std::sync::Arc;

use super::beyond::Beyond;
use super::{PatchGeometry, ResyncView, Watched};
use crate::body::{Body, State};
use crate::contact::{
    Contact, ContactPoint, Deformable, Law, Normals, Rows, Skin, ToolMotion, Touch, contact_normal, interpolate,
    step_all,
};
use crate::mesh::Surface;
use crate::simulation::Stepping;
use crate::{Pose, Vec3, Wrench};

/// A tool that presses more than this share of its force on nodes outside has left the patch.
const BEYOND: f64 = 0.02;

/// A patch of a body and its contact, in the numbering of its window.
#[derive(Clone, Debug, Default)]
pub(super) struct Patch {
    pub(super) window: Window,
    /// Of all window nodes, movable ones first.
    pub(super) state: State,
    /// Zero for all nodes that the patch does not move (1/kg).
    pub(super) inverse_masses: Vec<f64>,
    pub(super) forces: Vec<Vec3>,
    pub(super) touch: Touch,
    rows: Rows,
    pub(super) law: Law,
    pub(super) stepping: Stepping,
    pub(super) built_at: u64,
    pub(super) watched: Watched,
    /// In the last tick whose contact was inside the patch.
    felt: Wrench,
    /// Of all window nodes (m).
    rest: Vec<Vec3>,
    /// The normal of the surface at rest where the contact presses on a node that gives way in the body, but not here.
    strayed: Option<Vec3>,
    beyond: Beyond,
}

impl Patch {
    /// All but the forces as they are in the global model; the window is there.
    pub(super) fn take_present(&mut self, resync: &ResyncView<'_>) {
        let (global, window) = (&*resync.global, &self.window);
        window.gather(&global.state().positions, &mut self.state.positions);
        window.gather(&global.state().velocities, &mut self.state.velocities);
        window.gather_movable(global.body().inverse_masses(), &mut self.inverse_masses);
        let touch = global.touch(resync.index);
        if self.touch.shape != touch.shape {
            self.touch = Touch::new(touch.shape, Arc::default(), Contact::default());
            self.rows = Rows::with_room(1);
        }
        if touch.has_shape() {
            self.rows.make_room(window.nodes.len(), window.candidates.len());
        }
        self.touch.restart(touch, |contact| window.localised(contact), |triangle| window.triangle(triangle));
        let skin = Arc::make_mut(&mut self.touch.skin);
        touch.skin.localise(&window.nodes, |node| window.node(node), skin);
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        window.gather(global.body().rest(), &mut self.rest);
        self.strayed = None;
        // Not what this patch knew before: which one is built anew hangs on the threads, and a replay is to be the same.
        self.beyond = Beyond::default();
        self.felt = global.wrench(resync.index);
        self.learn(global.wrench(resync.index), resync.tools[resync.index].position);
        self.watched.take(global.state());
    }

    /// Where it touches the surface at rest (m), and the outward unit normal there.
    fn rest_contact(&self) -> Option<(Vec3, Vec3)> {
        let Contact { triangle, weights, .. } = self.touch.contact;
        let (surface, triangle) = (&self.window.surface, triangle?);
        let corners = surface.triangles[triangle as usize].map(|node| self.rest[node as usize]);
        let normal = contact_normal(Normals::Face, surface, &self.rest, triangle, &weights);
        Some((interpolate(&weights, &corners), normal))
    }

    /// The tool felt `wrench` at `at` (m).
    fn learn(&mut self, wrench: Wrench, at: Vec3) {
        if let Some((place, normal)) = self.rest_contact() {
            let depth = (place - at).dot(&normal) + self.touch.shape.radius();
            self.beyond.learn(wrench.force.dot(&normal), depth);
        }
    }

    /// Makes room for what an implicit step of the tool needs.
    pub(super) fn reserve_implicit(&mut self) {
        // A capsule has three places on a triangle.
        let places = if self.touch.has_shape() { 3 * self.window.candidates.len() } else { 1 };
        self.rows.reserve_coupling(places);
    }

    /// True once the contact has left the patch.
    pub(super) fn has_left(&self) -> bool {
        self.beyond.has_left()
    }

    /// What a tool that goes to `to` feels, once the contact has left the patch.
    pub(super) fn beyond(&mut self, to: &Pose) -> Option<Wrench> {
        self.beyond.follow(to.position, &self.law.friction)
    }

    /// What the tool at `at` feels after a tick of `steps` steps with `wrench`: that, or what is beyond the patch if the contact leaves it.
    pub(super) fn feel(&mut self, wrench: Wrench, at: &Pose, steps: u32) -> Wrench {
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if !self.state.is_finite() {
            return Vec3::repeat(f64::NAN).into();
        }
        let window = &self.window;
        self.touch.end(steps, |triangle| window.triangles[triangle as usize]);
        match self.strayed.take() {
            Some(normal) => self.beyond.leave(normal, at.position, self.felt),
            None => {
                self.learn(wrench, at.position);
                self.felt = wrench;
            }
        }
        self.felt
    }

    /// One explicit step of `d` seconds under the forces and the tool's; returns the force and torque on the tool.
    pub(super) fn step(&mut self, tool: ToolMotion, d: f64) -> Wrench {
        self.with_contact(|body, forces, touch, rows, law| {
            step_all(body, forces, std::slice::from_mut(touch), rows, law, |_| tool, d);
        })
    }

    /// Does `step` with the patch, its forces, its contact and its law; returns the force and torque on the tool.
    pub(super) fn with_contact(
        &mut self,
        step: impl FnOnce(&mut Deformable<'_>, &[Vec3], &mut Touch, &mut Rows, &Law),
    ) -> Wrench {
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        step(&mut deformable, &self.forces, &mut self.touch, &mut self.rows, &self.law);
        if self.window.has_left(&self.touch) {
            self.strayed = Some(self.rest_contact().map_or(Vec3::zeros(), |(_, normal)| normal));
        }
        self.touch.wrench
    }

    /// The contact in the body's numbering.
    pub(super) fn global_contact(&self) -> Contact {
        self.window.globalised(&self.touch.contact)
    }

    /// The places where a tool with a shape touches, in the body's numbering.
    pub(super) fn contact_points(&self) -> &[ContactPoint] {
        self.touch.points()
    }

    /// The area that it touches (m^2).
    pub(super) fn contact_area(&self) -> f64 {
        self.touch.area(&self.window.surface, &self.state.positions)
    }

    /// Where a node of the body is (m), if the patch moves it.
    pub(super) fn position(&self, node: u32) -> Option<Vec3> {
        self.window.movable(node).map(|place| self.state.positions[place])
    }

    /// Adds its node at `place` to what is told to the global model.
    pub(super) fn tell(&self, geometry: &mut PatchGeometry, place: usize) {
        geometry.push(self.window.nodes[place], self.state.positions[place], self.state.velocities[place]);
    }
}

/// Patch nodes first; then, if the model asks for them, the other nodes of the body's restriction to the patch: the ring,
/// which can move, and held ones; then the rim: surface nodes that contact needs for normals and walking.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// Global id of each local node.
    pub nodes: Vec<u32>,
    /// How many of them the patch moves; they come first, in increasing order.
    pub movable: usize,
    /// How many ring nodes follow, in increasing order; 0 if they were not asked for.
    pub ring: usize,
    /// The surface over local nodes: every triangle that shares a node with one that the tool can press.
    pub surface: Surface,
    /// Global id of each local triangle.
    pub triangles: Vec<u32>,
    /// Local triangles with a movable node, and those around the centre: those that detection looks at.
    pub candidates: Vec<u32>,
    /// By local node: true for those that give way in the body, but not here.
    beyond: Vec<bool>,
    /// Local place of each global node and triangle, or [`Surface::NONE`]; as long as the body, only touched entries change.
    local_node: Vec<u32>,
    local_triangle: Vec<u32>,
}

impl Window {
    /// Makes the window anew around surface triangles `triangles` for the nodes that `patch` gives, in increasing order, and
    /// those that `neighbours` gives for them, the ring and held ones; costs as much as the patch, whatever the body.
    pub(super) fn rebuild<'a>(
        &mut self,
        body: &dyn Body,
        triangles: &[u32],
        skin: &Skin,
        patch: impl FnOnce(&mut Vec<u32>),
        neighbours: impl FnOnce(&[u32]) -> [&'a [u32]; 2],
    ) {
        let whole = body.surface();
        self.forget();
        self.local_node.resize(body.rest().len(), Surface::NONE);
        self.local_triangle.resize(whole.triangles.len(), Surface::NONE);
        patch(&mut self.nodes);
        self.movable = self.nodes.len();
        for (place, &node) in self.nodes.iter().enumerate() {
            self.local_node[node as usize] = place as u32;
        }
        let [ring, held] = neighbours(&self.nodes);
        self.ring = ring.len();
        ring.iter().chain(held).for_each(|&node| self.add_node(node));
        // On a held face nothing moves, but the tool is to be found there too.
        for &triangle in triangles {
            for node in whole.triangles[triangle as usize] {
                self.add_node(node);
            }
        }
        // First the triangles of movable nodes and those asked for (the candidates), then those around their corners (for
        // normals).
        self.grow(whole, 0..self.movable);
        for &triangle in triangles {
            self.add_triangle(triangle);
        }
        let candidates = self.triangles.len();
        let corners: Vec<u32> = self.triangles.iter().flat_map(|&t| whole.triangles[t as usize]).collect();
        for node in corners {
            self.add_triangles(whole, node);
        }
        self.add_corners(whole, candidates);
        // Corners of candidates as a tool with a shape meets them.
        for place in 0..3 * candidates {
            let node = whole.triangles[self.triangles[place / 3] as usize][place % 3];
            skin.corner(node).iter().for_each(|&(other, _)| self.add_node(other));
        }
        self.candidates.clear();
        self.candidates.extend(0..candidates as u32);

        self.surface.triangles.clear();
        self.surface.neighbours.clear();
        for &t in &self.triangles {
            self.surface.triangles.push(whole.triangles[t as usize].map(|node| self.local_node[node as usize]));
            let local = |t: u32| if t == Surface::NONE { Surface::NONE } else { self.local_triangle[t as usize] };
            self.surface.neighbours.push(whole.neighbours[t as usize].map(local));
        }
        self.surface.index_nodes(self.nodes.len());

        let masses = body.inverse_masses();
        self.beyond.clear();
        self.beyond.resize(self.movable, false);
        self.beyond.extend(self.nodes[self.movable..].iter().map(|&node| masses[node as usize] > 0.0));
    }

    fn add_node(&mut self, node: u32) {
        if self.local_node[node as usize] == Surface::NONE {
            self.local_node[node as usize] = self.nodes.len() as u32;
            self.nodes.push(node);
        }
    }

    /// Adds the triangles at the nodes of `places`, and then their missing corners.
    fn grow(&mut self, whole: &Surface, places: std::ops::Range<usize>) {
        let start = self.triangles.len();
        for place in places {
            self.add_triangles(whole, self.nodes[place]);
        }
        self.add_corners(whole, start);
    }

    fn add_triangles(&mut self, whole: &Surface, node: u32) {
        for &t in whole.at_node(node) {
            self.add_triangle(t);
        }
    }

    fn add_triangle(&mut self, triangle: u32) {
        if self.local_triangle[triangle as usize] == Surface::NONE {
            self.local_triangle[triangle as usize] = self.triangles.len() as u32;
            self.triangles.push(triangle);
        }
    }

    fn add_corners(&mut self, whole: &Surface, start: usize) {
        for place in start..self.triangles.len() {
            for node in whole.triangles[self.triangles[place] as usize] {
                self.add_node(node);
            }
        }
    }

    fn forget(&mut self) {
        self.nodes.drain(..).for_each(|node| self.local_node[node as usize] = Surface::NONE);
        self.triangles.drain(..).for_each(|t| self.local_triangle[t as usize] = Surface::NONE);
    }

    /// Local place of a global node.
    pub(super) fn node(&self, global: u32) -> Option<u32> {
        self.local_node.get(global as usize).copied().filter(|&place| place != Surface::NONE)
    }

    /// Local place of a global triangle.
    pub(super) fn triangle(&self, global: u32) -> Option<u32> {
        self.local_triangle.get(global as usize).copied().filter(|&place| place != Surface::NONE)
    }

    /// Place of a global node among the movable ones.
    pub(super) fn movable(&self, global: u32) -> Option<usize> {
        self.node(global).map(|place| place as usize).filter(|&place| place < self.movable)
    }

    /// The contact in local numbering. One outside the window cannot be followed here: detection starts anew.
    pub(super) fn localised(&self, contact: &Contact) -> Contact {
        match contact.triangle.and_then(|triangle| self.triangle(triangle)) {
            Some(triangle) => Contact { triangle: Some(triangle), ..*contact },
            None => Contact { glued: contact.glued, ..Contact::default() },
        }
    }

    /// The contact in the body's numbering.
    pub(super) fn globalised(&self, contact: &Contact) -> Contact {
        Contact { triangle: contact.triangle.map(|triangle| self.triangles[triangle as usize]), ..*contact }
    }

    /// True if a tool presses on nodes that give way in the body, but not here.
    pub(super) fn has_left(&self, touch: &Touch) -> bool {
        let beyond = |&&(node, _): &&(u32, Vec3)| self.beyond[node as usize];
        if touch.has_shape() {
            // The far ends of a smoothed corner bear next to nothing.
            let force = |sum: f64, (_, force): &(u32, Vec3)| sum + force.norm();
            let outside = touch.pressed().iter().filter(beyond).fold(0.0, force);
            return outside > BEYOND * touch.pressed().iter().fold(0.0, force);
        }
        let contact = &touch.contact;
        let touched = contact.triangle.filter(|_| contact.is_touching());
        touched.is_some_and(|t| self.surface.triangles[t as usize].iter().any(|&node| self.beyond[node as usize]))
    }

    /// Writes the inverse mass of each local node (1/kg), zero for those that the patch does not move.
    pub(super) fn gather_movable(&self, inverse_masses: &[f64], local: &mut Vec<f64>) {
        local.clear();
        local.extend(self.nodes[..self.movable].iter().map(|&node| inverse_masses[node as usize]));
        local.resize(self.nodes.len(), 0.0);
    }

    /// The diagonal of the box around the patch whose nodes are at `rest` (m).
    pub(super) fn extent(&self, rest: &[Vec3]) -> f64 {
        let places = || self.nodes[..self.movable].iter().map(|&node| rest[node as usize]);
        let corner = |of: fn(&Vec3, &Vec3) -> Vec3| places().reduce(|a, b| of(&a, &b)).unwrap_or_default();
        (corner(Vec3::sup) - corner(Vec3::inf)).norm()
    }

    /// Copies the window's share of a global array.
    pub(super) fn gather(&self, global: &[Vec3], local: &mut Vec<Vec3>) {
        local.clear();
        local.extend(self.nodes.iter().map(|&node| global[node as usize]));
    }
}
