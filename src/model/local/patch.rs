//! What the models with a patch have in common: the part of the body that they hold, and what the tool feels of it.

use super::window::Window;
use super::{PatchGeometry, ResyncView, Watched};
use crate::Vec3;
use crate::body::State;
use crate::contact::{Contact, Deformable, Law, ToolMotion, step};
use crate::simulation::Stepping;

/// A patch of a body and its contact, in the numbering of its window.
#[derive(Clone, Debug, Default)]
pub(super) struct Patch {
    pub(super) window: Window,
    /// Of all window nodes, movable ones first.
    pub(super) state: State,
    /// Zero for all nodes that the patch does not move (1/kg).
    pub(super) inverse_masses: Vec<f64>,
    pub(super) forces: Vec<Vec3>,
    pub(super) contact: Contact,
    pub(super) law: Law,
    pub(super) stepping: Stepping,
    pub(super) built_at: u64,
    pub(super) watched: Watched,
    /// The force of the last tick whose contact was inside the patch (N).
    felt: Vec3,
    has_left: bool,
}

impl Patch {
    /// All but the forces as they are in the global model; the window is there.
    pub(super) fn take_present(&mut self, resync: &ResyncView<'_>) {
        let (global, window) = (&*resync.global, &self.window);
        window.gather(&global.state().positions, &mut self.state.positions);
        window.gather(&global.state().velocities, &mut self.state.velocities);
        window.gather_movable(global.body().inverse_masses(), &mut self.inverse_masses);
        self.contact = window.localised(global.contact(resync.index));
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        (self.felt, self.has_left) = (global.force(resync.index), false);
        self.watched.take(global.state());
    }

    /// The last force, once the contact has left the patch (N).
    pub(super) fn held(&self) -> Option<Vec3> {
        self.has_left.then_some(self.felt)
    }

    /// What is felt (N) after a tick with `force`: the patch's own force until the contact leaves it, the last one from then on.
    pub(super) fn feel(&mut self, force: Vec3) -> Vec3 {
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if !self.state.is_finite() {
            return Vec3::repeat(f64::NAN);
        }
        self.has_left = self.contact_has_left();
        if !self.has_left {
            self.felt = force;
        }
        self.felt
    }

    /// True if the contact presses on a node that gives way in the body, but not here.
    pub(super) fn contact_has_left(&self) -> bool {
        self.window.has_left(&self.contact)
    }

    /// One explicit step of `d` seconds under the forces and the tool's; returns the force on the tool (N).
    pub(super) fn step(&mut self, tool: ToolMotion, d: f64) -> Vec3 {
        self.with_contact(|body, forces, contact, law| step(body, forces, contact, law, tool, d))
    }

    /// Does `step` with the patch, its forces, its contact and its law.
    pub(super) fn with_contact(
        &mut self,
        step: impl FnOnce(&mut Deformable<'_>, &[Vec3], &mut Contact, &Law) -> Vec3,
    ) -> Vec3 {
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        step(&mut deformable, &self.forces, &mut self.contact, &self.law)
    }

    /// The contact in the body's numbering.
    pub(super) fn global_contact(&self) -> Contact {
        self.window.globalised(&self.contact)
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
