//! What the models with a patch have in common: the part of the body that they hold, its nodes and the surface around them in
//! compact numbering, and what the tool feels of it.

mod feeling;
mod tools;
mod window;

use self::feeling::Feeling;
use self::tools::Tools;
use super::{PatchGeometry, ResyncView, Watched};
use crate::body::State;
use crate::contact::{Contact, ContactPoint, Deformable, Law, Rows, ToolMotion, Touch, step_all};
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
    /// The tool that it is for.
    pub(super) own: usize,
    /// Of all window nodes (m).
    rest: Vec<Vec3>,
}

impl Patch {
    /// All but the forces as they are in the global model; the window is there.
    pub(super) fn take_present(&mut self, resync: &ResyncView<'_>) {
        let (global, window) = (&*resync.global, &self.window);
        window.gather(&global.state().positions, &mut self.state.positions);
        window.gather(&global.state().velocities, &mut self.state.velocities);
        window.gather_movable(global.body().inverse_masses(), &mut self.inverse_masses);
        window.gather(global.body().rest(), &mut self.rest);
        self.tools.take_present(resync, window, &self.rest);
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        self.own = resync.index;
        self.watched.take(global.state());
    }

    /// Makes room for what an implicit step of the tool needs.
    pub(super) fn reserve_implicit(&mut self) {
        // A capsule has three places on a triangle.
        let (touches, _, rows) = self.tools.present();
        let places = |touch: &Touch| if touch.has_shape() { 3 * self.window.candidates.len() } else { 1 };
        rows.reserve_coupling(touches.iter().map(places));
    }

    /// True once none of its tools touches it any more: there is nothing left to advance.
    pub(super) fn is_left(&self) -> bool {
        self.tools.are_gone()
    }

    /// True once tool number `tool` has left it.
    pub(super) fn has_left(&self, tool: usize) -> bool {
        self.tools.feeling(tool).is_some_and(Feeling::is_beyond)
    }

    /// What tool number `tool` felt in the last tick, in the patch or beyond it; `None` if it is none of those on the patch.
    pub(super) fn wrench(&self, tool: usize) -> Option<Wrench> {
        self.tools.feeling(tool).map(Feeling::felt)
    }

    /// A tick is over, at whose end the tool of each number is at a pose of `end`; what its own feels.
    pub(super) fn feel(&mut self, end: impl Fn(usize) -> Pose) -> Wrench {
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if self.state.is_finite() {
            self.tools.end_tick(end, self.stepping, (&self.window, &self.rest), &self.law.friction);
        } else {
            self.tools.spoil();
        }
        self.wrench(self.own).unwrap_or_default()
    }

    /// One explicit step, or a part of it of that `length`, under the forces and the tools', each of which moves along `motion` of its number.
    pub(super) fn step(&mut self, motion: impl Fn(usize) -> ToolMotion, length: f64) {
        let d = self.stepping.step() * length;
        self.with_contact(length, |body, forces, (touches, numbers, rows), law| {
            step_all(body, forces, touches, rows, law, |tool| motion(numbers[tool]), d);
        })
    }

    /// Does `step`, or a part of it of that `length`, with the patch, its forces, the tools on it with their numbers, and its law.
    pub(super) fn with_contact(
        &mut self,
        length: f64,
        step: impl FnOnce(&mut Deformable<'_>, &[Vec3], (&mut [Touch], &[usize], &mut Rows), &Law),
    ) {
        self.tools.add_beside(&self.window, &mut self.forces);
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        step(&mut deformable, &self.forces, self.tools.present(), &self.law);
        self.tools.end_step(length, &self.window, &self.rest);
    }

    /// The contact of tool number `tool` in the body's numbering.
    pub(super) fn contact(&self, tool: usize) -> Contact {
        self.tools.touch(tool).map(|touch| self.window.globalised(&touch.contact)).unwrap_or_default()
    }

    /// The places where tool number `tool` touches if it has a shape, in the body's numbering.
    pub(super) fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.tools.touch(tool).map_or(&[], Touch::points)
    }

    /// The area that it touches (m^2).
    pub(super) fn contact_area(&self, tool: usize) -> f64 {
        self.tools.touch(tool).map_or(0.0, |touch| touch.area(&self.window.surface, &self.state.positions))
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
