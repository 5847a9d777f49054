//! A body in motion with the contacts of its tools: what a simulation advances, and what runs ahead of it.

use super::stepping::Stepping;
use crate::body::{Body, State, Stiffened, Stiffness};
use crate::contact::{Deformable, Law, Rows, ToolMotion, Touch, step_all};
use crate::{Vec3, Wrench};

/// A body, its state and the contacts of the tools with it.
#[derive(Debug)]
pub(super) struct Moving {
    pub(super) body: Stiffened,
    pub(super) state: State,
    pub(super) forces: Vec<Vec3>,
    pub(super) touches: Vec<Touch>,
    pub(super) rows: Rows,
    pub(super) law: Law,
    pub(super) stepping: Stepping,
    /// The surface triangles that a tool may touch, in increasing order.
    pub(super) candidates: Vec<u32>,
    pub(super) inverse_masses: Vec<f64>,
    /// On each tool: mean force and torque of the last tick, or of the resting contact before the first.
    pub(super) means: Vec<Wrench>,
}

impl Moving {
    /// Advances one haptic tick along `motion`, of each tool, and shows `watch` the state at the start of every substep.
    pub(super) fn advance(&mut self, motion: impl Fn(usize) -> ToolMotion, watch: &mut impl FnMut(&State)) {
        let Self { body, state, forces, touches, rows, law, candidates, inverse_masses, stepping, means } = self;
        let (n, d) = (f64::from(stepping.substeps), stepping.step());
        means.fill(Wrench::default());
        touches.iter_mut().for_each(Touch::begin);
        for u in 0..stepping.substeps {
            let u = f64::from(u);
            watch(state);
            body.forces(state, forces);
            let mut deformable = Deformable {
                positions: &mut state.positions,
                velocities: &mut state.velocities,
                inverse_masses,
                surface: body.surface(),
                candidates,
            };
            let part = |tool| motion(tool).part(u / n, (u + 1.0) / n);
            step_all(&mut deformable, forces, touches, rows, law, part, d);
            means.iter_mut().zip(&*touches).for_each(|(sum, touch)| *sum += touch.wrench);
        }
        means.iter_mut().for_each(|sum| *sum = *sum / n);
        touches.iter_mut().for_each(|touch| touch.end(stepping.substeps, |triangle| triangle));
    }

    /// The body is so stiff from now on.
    pub(super) fn put_stiffness(&mut self, stiffness: Stiffness) {
        self.body.set_stiffness(stiffness);
        self.touches.iter_mut().for_each(|touch| touch.stiffness = stiffness);
    }
}
