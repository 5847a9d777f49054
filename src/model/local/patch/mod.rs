//! What the models with a patch have in common: the part of the body that they hold, its nodes and the surface around them in
//! compact numbering, and what the tool feels of it.

mod tools;
mod window;

use self::tools::Tools;
use super::beyond::Beyond;
use super::{PatchGeometry, ResyncView, Watched};
use crate::body::State;
use crate::contact::{
    Contact, ContactPoint, Deformable, Law, Normals, Rows, ToolMotion, Touch, contact_normal, interpolate, step_all,
};
use crate::simulation::Stepping;
use crate::{Pose, Vec3, Wrench};

pub(super) use window::Window;

/// A patch of a body and its contact, in the numbering of its window.
#[derive(Clone, Debug, Default)]
pub(super) struct Patch {
    pub(super) window: Window,
    /// Of all window nodes, movable ones first.
    pub(super) state: State,
    /// Zero for all nodes that the patch does not move (1/kg).
    pub(super) inverse_masses: Vec<f64>,
    pub(super) forces: Vec<Vec3>,
    pub(super) tools: Tools,
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
        self.tools.take_present(resync, window);
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
        let Contact { triangle, weights, .. } = self.tools.own().contact;
        let (surface, triangle) = (&self.window.surface, triangle?);
        let corners = surface.triangles[triangle as usize].map(|node| self.rest[node as usize]);
        let normal = contact_normal(Normals::Face, surface, &self.rest, triangle, &weights);
        Some((interpolate(&weights, &corners), normal))
    }

    /// The tool felt `wrench` at `at` (m).
    fn learn(&mut self, wrench: Wrench, at: Vec3) {
        if let Some((place, normal)) = self.rest_contact() {
            let depth = (place - at).dot(&normal) + self.tools.own().shape.radius();
            self.beyond.learn(wrench.force.dot(&normal), depth);
        }
    }

    /// Makes room for what an implicit step of the tool needs.
    pub(super) fn reserve_implicit(&mut self) {
        // A capsule has three places on a triangle.
        let (touches, _, rows) = self.tools.present();
        let places = |touch: &Touch| if touch.has_shape() { 3 * self.window.candidates.len() } else { 1 };
        rows.reserve_coupling(touches.iter().map(places).sum());
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
        self.tools.end(steps, &self.window);
        match self.strayed.take() {
            Some(normal) => self.beyond.leave(normal, at.position, self.felt),
            None => {
                self.learn(wrench, at.position);
                self.felt = wrench;
            }
        }
        self.felt
    }

    /// One explicit step of `d` seconds under the forces and the tools', each of which moves along `motion` of its number; returns the
    /// force and torque on the patch's own.
    pub(super) fn step(&mut self, motion: impl Fn(usize) -> ToolMotion, d: f64) -> Wrench {
        self.with_contact(|body, forces, (touches, numbers, rows), law| {
            step_all(body, forces, touches, rows, law, |tool| motion(numbers[tool]), d);
        })
    }

    /// Does `step` with the patch, its forces, the tools on it with their numbers, and its law; returns the force and torque on its own.
    pub(super) fn with_contact(
        &mut self,
        step: impl FnOnce(&mut Deformable<'_>, &[Vec3], (&mut [Touch], &[usize], &mut Rows), &Law),
    ) -> Wrench {
        self.tools.add_beside(&self.window, &mut self.forces);
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        step(&mut deformable, &self.forces, self.tools.present(), &self.law);
        self.tools.let_go(&self.window);
        let own = self.tools.own();
        if self.window.has_left(own) {
            self.strayed = Some(self.rest_contact().map_or(Vec3::zeros(), |(_, normal)| normal));
        }
        own.wrench
    }

    /// The contact in the body's numbering.
    pub(super) fn global_contact(&self) -> Contact {
        self.window.globalised(&self.tools.own().contact)
    }

    /// The places where a tool with a shape touches, in the body's numbering.
    pub(super) fn contact_points(&self) -> &[ContactPoint] {
        self.tools.own().points()
    }

    /// The area that it touches (m^2).
    pub(super) fn contact_area(&self) -> f64 {
        self.tools.own().area(&self.window.surface, &self.state.positions)
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
