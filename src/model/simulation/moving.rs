//! A body in motion with the contacts of its tools: what a simulation advances, and what runs ahead of it.

use super::stepping::{Part, Stepping};
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
    /// Haptic ticks that one step may span; more than one only of a stepping with one substep.
    pub(super) stride: u32,
    /// The surface triangles that a tool may touch, in increasing order.
    pub(super) candidates: Vec<u32>,
    pub(super) inverse_masses: Vec<f64>,
    /// On each tool: mean force and torque of the last tick, or of the resting contact before the first.
    pub(super) means: Vec<Wrench>,
}

impl Moving {
    /// Makes room for the places at which the tools that it has may touch.
    pub(super) fn make_room(&mut self) {
        self.rows = Rows::with_room(self.touches.len());
        self.rows.make_room(self.inverse_masses.len(), (self.body.surface(), &self.candidates), &self.touches);
    }

    /// Advances one haptic tick, or several in one step, along `motion` of each tool in all of that time, and shows `watch` the state at
    /// the start of every step that the stepping has.
    pub(super) fn advance(&mut self, ticks: u32, motion: impl Fn(usize) -> ToolMotion, watch: &mut impl FnMut(&State)) {
        let Self { body, state, forces, touches, rows, law, candidates, inverse_masses, stepping, stride, means } =
            self;
        assert!((1..=*stride).contains(&ticks), "{ticks} ticks in steps of at most {stride}");
        means.fill(Wrench::default());
        touches.iter_mut().for_each(Touch::begin);
        let (mut progress, step) = (stepping.begin(), f64::from(ticks) * stepping.step());
        while !progress.is_over() {
            body.forces(state, forces);
            if progress.begins_step() {
                watch(state);
            }
            let Part { shares: [from, to], length, .. } = progress.next(|| body.stable_share(state));
            let mut deformable = Deformable {
                positions: &mut state.positions,
                velocities: &mut state.velocities,
                inverse_masses,
                surface: body.surface(),
                candidates,
            };
            let part = |tool| motion(tool).part(from, to);
            step_all(&mut deformable, forces, touches, rows, law, part, step * length);
            means.iter_mut().zip(&*touches).for_each(|(sum, touch)| *sum += touch.wrench * length);
        }
        means.iter_mut().for_each(|sum| *sum = *sum / f64::from(stepping.substeps));
        touches.iter_mut().for_each(|touch| touch.end(f64::from(ticks) * stepping.tick, |triangle| triangle));
    }

    /// The body is so stiff from now on.
    pub(super) fn put_stiffness(&mut self, stiffness: Stiffness) {
        self.body.set_stiffness(stiffness);
        self.touches.iter_mut().for_each(|touch| touch.stiffness = stiffness);
    }
}

#[cfg(test)]
mod tests {
    use crate::Vec3;
    use crate::body::{Block, Body, State};
    use crate::contact::{Contact, Law, ToolMotion, ToolShape};
    use crate::mesh::Face;
    use crate::simulation::{Simulation, Stepping};

    /// A sphere that is pressed 8 mm into a lattice within 0.2 s, in steps of as many ticks as `strides` says: force (N) and tick.
    fn pressed(strides: impl Fn(u32) -> u32) -> Vec<(u32, f64)> {
        let builder = Block::builder([8; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
        let block = builder.fix(Face::ZMin).build().unwrap();
        let (state, stepping) = (State::at_rest(block.rest()), Stepping { tick: 0.25e-3, substeps: 1 });
        let law = Law { friction: 0.5.into(), ..Law::default() };
        let simulation = Simulation::new(Box::new(block), state, Contact::default(), law, stepping).unwrap();
        let mut simulation = simulation.with_shape(0, ToolShape::Sphere { radius: 0.008 }).striding(2);
        let at = |tick: u32| Vec3::new(0.047, 0.0512, 0.108 - 0.008 * f64::from(tick) / 800.0);
        let (mut tick, mut forces) = (0, Vec::new());
        while tick < 800 {
            let ticks = strides(tick);
            simulation.step_all(ticks, &[ToolMotion::straight(at(tick), at(tick + ticks))]);
            tick += ticks;
            forces.push((tick, simulation.force(0).z));
        }
        forces
    }

    /// Check that longer steps feel what short ones do, and that no contact is lost where a step is shorter than the one before: what
    /// pressed then is twice what presses now, and under that the tool would sink in deeper.
    #[test]
    fn steps_of_one_tick_and_of_two_feel_the_same() {
        let expected = pressed(|_| 1);
        let most = expected.iter().fold(0.0_f64, |most, (_, force)| most.max(*force));
        let alternating = pressed(|tick| 1 + u32::from(tick % 7 < 5));
        for (tick, force) in pressed(|_| 2).into_iter().chain(alternating) {
            let (at, other) = expected[tick as usize - 1];
            assert_eq!(at, tick);
            assert!((force - other).abs() < 0.02 * most, "tick {tick}: {force} and {other} N of {most}");
        }
    }
}
