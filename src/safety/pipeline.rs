//! The stages in their order, with what they remember.

use super::actions::Actions;
use super::force::{Force, clamp, dot, finite, norm, slew};
use super::limits::Limits;
use super::model_age::AgeFade;
use super::passivity::{Ledger, control};
use super::start_up::{Engagement, Ramp};
use super::tank::TankState;
use super::tool_speed::speed_gain;
use super::torque::TorqueStages;

/// The force that a tick asks of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// A computed force (N), ramped in if there was none before.
    Force(Force),
    /// The last force, ramped out: nothing computes a new one.
    Rest,
}

/// The input of the safety pipeline in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// The force that is asked for.
    pub request: Request,
    /// The computed torque that belongs to it (N m); none is asked for at rest.
    pub torque: Force,
    /// Time since the tick before (s).
    pub dt: f64,
    /// Position of the tool (m), as the device said last.
    pub position: [f64; 3],
    /// Number of ticks since the device said something new.
    pub stale_ticks: u32,
    /// Age of the local model (ticks of the local group).
    pub model_age_ticks: u32,
    /// Step that a swap of local models added to the force in this tick (N).
    pub swap_step: Force,
    /// Energy that the contact dissipated in this tick (J).
    pub dissipated_j: f64,
}

impl Input {
    /// A `request` about a tool at `position` (m), `dt` seconds after the one before, with nothing else to tell.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(request: Request, position: [f64; 3], dt: f64) -> Self {
        let (stale_ticks, model_age_ticks, swap_step, dissipated_j, torque) = (0, 0, [0.0; 3], 0.0, [0.0; 3]);
        Self { request, torque, dt, position, stale_ticks, model_age_ticks, swap_step, dissipated_j }
    }
}

/// The output of the safety pipeline in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// The force for the device (N).
    pub force: Force,
    /// The torque for the device (N m); zero for one that exerts none.
    pub torque: Force,
    /// The stages that acted.
    pub actions: Actions,
    /// Balance of the ledger: what the environment has taken in less what it gave out, and what it stored at the start (J).
    pub energy_j: f64,
    /// Energy in the tank (J).
    pub tank_j: f64,
}

/// The whole pipeline of one contact.
///
/// ```text
/// finite -> clamp -> slew -> tool speed -> tank -> passivity -> model age -> start-up, ramp
///        -> finite -> clamp -> slew -> watchdog
/// ```
///
/// A torque passes the same stages but tank and passivity, with its own limits and with the gains of the force.
///
/// The first slew limit compares with the force that was asked for before, the last one with the command that was given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pipeline {
    limits: Limits,
    ramp: Ramp,
    engagement: Engagement,
    age: AgeFade,
    tank: TankState,
    ledger: Ledger,
    /// The last force that was computed, within what the device may exert (N); infinite if it was none.
    computed: Force,
    /// The last force asked for, behind the first three stages.
    held: Force,
    last: Force,
    torque: TorqueStages,
}

impl Pipeline {
    /// A pipeline that starts from zero force.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            ramp: Ramp::new(limits.ramp_s),
            engagement: Engagement::default(),
            age: AgeFade::default(),
            tank: TankState::new(&limits.tank.unwrap_or_default()),
            ledger: Ledger::new(limits.passivity.map_or(0.0, |passivity| passivity.stored_j)),
            computed: [0.0; 3],
            held: [0.0; 3],
            last: [0.0; 3],
            torque: TorqueStages::default(),
        }
    }

    /// The command for one tick.
    ///
    /// # Real-time
    /// Bounded, allocates nothing, real-time safe.
    pub fn apply(&mut self, input: &Input) -> Output {
        let (limits, dt) = (self.limits, input.dt);
        let mut actions = Actions::default();
        let step_limit = limits.max_slew_n_per_s * dt;
        let mut swap_step = input.swap_step;
        if let Request::Force(force) = input.request {
            let (force, is_none) = finite(force);
            actions.note(is_none, Actions::FINITE);
            let (force, acted) = clamp(force, limits.max_force_n);
            actions.note(acted, Actions::CLAMP);
            self.computed = if is_none { [f64::INFINITY; 3] } else { force };
            let (force, acted) = slew(self.held, force, step_limit);
            actions.note(acted, Actions::SLEW);
            let changed = norm(std::array::from_fn(|i| force[i] - self.held[i]));
            self.held = force;
            // Of a step that the slew limit spreads only what it lets through now can be held back.
            swap_step = if norm(swap_step).is_finite() { clamp(swap_step, changed).0 } else { [0.0; 3] };
            self.torque.ask(&limits, input.torque, dt, &mut actions);
        }
        // A position that is not finite is none: the ledger waits for the next.
        let (velocity, believed) = match finite(input.position) {
            (position, false) => self.ledger.book(self.last, position, dt),
            (_, true) => ([0.0; 3], true),
        };
        let gain = self.by_speed(norm(velocity), &mut actions);
        let force = scaled(self.held, gain);
        // Against a motion that did not happen nothing is damped.
        let velocity = if believed { velocity } else { [0.0; 3] };
        let force =
            self.by_energy(&Input { swap_step: scaled(swap_step, gain), ..*input }, force, velocity, &mut actions);
        let [age, start_up, ramp] = self.by_time(input, &mut actions);
        let force = scaled(scaled(scaled(force, age), start_up), ramp);
        let gain = gain * age * start_up * ramp;
        self.torque.finish(&limits, gain, input.stale_ticks, dt, &mut self.ramp, &mut actions);
        self.finish(input, force, step_limit, actions)
    }

    fn by_speed(&self, speed: f64, actions: &mut Actions) -> f64 {
        let gain = self.limits.tool_speed.map_or(1.0, |limits| speed_gain(limits, speed));
        actions.note(gain < 1.0, Actions::TOOL_SPEED);
        gain
    }

    /// Tank and passivity.
    fn by_energy(&mut self, input: &Input, mut force: Force, velocity: [f64; 3], actions: &mut Actions) -> Force {
        if let Some(limits) = &self.limits.tank {
            self.tank.fill(limits, input.dissipated_j);
            let (passed, acted) = self.tank.pass(limits, force, input.swap_step, velocity, input.dt);
            actions.note(acted, Actions::TANK);
            force = passed;
        }
        if let Some(limits) = &self.limits.passivity {
            let controlled = control(limits, self.ledger.balance_j(), force, velocity, input.dt);
            actions.note(controlled.damping > 0.0, Actions::PASSIVITY);
            actions.note(controlled.withdrew, Actions::WITHDRAWN);
            if let Some(tank) = &self.limits.tank {
                self.tank.fill(tank, controlled.damping * dot(velocity, velocity) * input.dt);
            }
            force = controlled.force;
        }
        force
    }

    /// Model age, start-up and ramp: gains that depend on counted time alone.
    fn by_time(&mut self, input: &Input, actions: &mut Actions) -> [f64; 3] {
        let age = self
            .limits
            .model_age
            .map_or(1.0, |limits| self.age.advance(limits, input.model_age_ticks, input.dt / self.limits.tick_s));
        actions.note(age < 1.0, Actions::MODEL_AGE);
        let start_up =
            self.limits.start_up.map_or(1.0, |limits| self.engagement.advance(limits, self.computed, input.dt));
        actions.note(start_up < 1.0, Actions::START_UP);
        let ramp = self.ramp.advance(input.request != Request::Rest, input.dt);
        actions.note(ramp < 1.0, Actions::RAMP);
        [age, start_up, ramp]
    }

    /// The last checks: whatever the stages before have made of it.
    fn finish(&mut self, input: &Input, force: Force, step_limit: f64, mut actions: Actions) -> Output {
        let (force, acted) = finite(force);
        actions.note(acted, Actions::FINAL_FINITE);
        let (force, acted) = clamp(force, self.limits.max_force_n);
        actions.note(acted, Actions::FINAL_CLAMP);
        let (mut force, acted) = slew(self.last, force, step_limit);
        actions.note(acted, Actions::FINAL_SLEW);
        if let Some(watchdog) = self.limits.watchdog {
            let guarded = watchdog.guard(input.stale_ticks, self.last, force, step_limit, &mut self.ramp);
            actions.note(guarded.1, Actions::WATCHDOG);
            force = guarded.0;
        }
        self.last = force;
        self.output(actions)
    }

    /// Zero at once, and a ramp from there: after a gap in which nobody knows what the device did.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn release(&mut self) -> Output {
        self.ramp.release();
        self.ledger.forget_position();
        self.last = [0.0; 3];
        self.torque.release();
        self.output(Actions::RAMP)
    }

    fn output(&self, actions: Actions) -> Output {
        Output {
            force: self.last,
            torque: self.torque.last(),
            actions,
            energy_j: self.ledger.balance_j(),
            tank_j: self.tank.energy_j(),
        }
    }
}

/// A gain of 1 leaves every bit as it is.
fn scaled(force: Force, gain: f64) -> Force {
    if gain < 1.0 { force.map(|c| c * gain) } else { force }
}

#[cfg(test)]
mod tests {
    use super::super::{StartUp, Tank, ToolSpeed};
    use super::*;
    use proptest::prelude::*;

    fn bare() -> Pipeline {
        Pipeline::new(Limits::bare(3.0))
    }

    /// A tool that stands still.
    fn tick(pipeline: &mut Pipeline, request: Request) -> (Force, Actions) {
        let Output { force, actions, .. } = pipeline.apply(&Input::new(request, [0.0; 3], 1e-3));
        (force, actions)
    }

    fn any_force() -> impl Strategy<Value = Force> {
        prop::array::uniform3(prop_oneof![any::<f64>(), -10.0..10.0])
    }

    proptest! {
        #[test]
        fn no_input_makes_a_command_that_is_not_finite_too_large_or_too_fast(
            requests in prop::collection::vec(prop_oneof![4 => any_force().prop_map(Request::Force), 1 => Just(Request::Rest)], 1..50),
        ) {
            let mut pipeline = bare();
            let mut last = [0.0; 3];
            for request in requests {
                let (command, _) = tick(&mut pipeline, request);
                prop_assert!(command.iter().all(|c| c.is_finite()));
                prop_assert!(norm(command) <= 3.0 * (1.0 + 1e-12));
                let change = std::array::from_fn(|i| command[i] - last[i]);
                prop_assert!(norm(change) <= 0.5 * (1.0 + 1e-12));
                last = command;
            }
        }
    }

    #[test]
    fn a_force_within_the_limits_passes_unchanged_and_unreported() {
        let mut pipeline = bare();
        assert_eq!(tick(&mut pipeline, Request::Force([0.1, -0.2, 0.3])), ([0.1, -0.2, 0.3], Actions::default()));
    }

    #[test]
    fn every_stage_reports_what_it_did() {
        let mut pipeline = bare();
        assert_eq!(tick(&mut pipeline, Request::Force([f64::NAN, 0.0, 0.0])), ([0.0; 3], Actions::FINITE));
        let (command, actions) = tick(&mut pipeline, Request::Force([0.0, 0.0, 34.0]));
        assert_eq!(command, [0.0, 0.0, 0.5]);
        assert!(actions.contains(Actions::CLAMP) && actions.contains(Actions::SLEW));
    }
    #[test]
    fn at_rest_the_force_is_gone_within_the_ramp_time_and_comes_back_as_slowly() {
        let mut pipeline = bare();
        let wanted = Request::Force([0.0, 0.0, 2.0]);
        (0..10).for_each(|_| assert!(tick(&mut pipeline, wanted).0[2] <= 2.0));
        let out: Vec<f64> = (0..100).map(|_| tick(&mut pipeline, Request::Rest).0[2]).collect();
        assert!(out.windows(2).all(|pair| pair[1] < pair[0]) && out[99] == 0.0, "{out:?}");
        assert_eq!(tick(&mut pipeline, Request::Rest), ([0.0; 3], Actions::RAMP));
        let back: Vec<f64> = (0..100).map(|_| tick(&mut pipeline, wanted).0[2]).collect();
        assert!(back.windows(2).all(|pair| pair[1] > pair[0]) && (back[99] - 2.0).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn after_a_gap_the_first_command_is_zero() {
        let mut pipeline = bare();
        let wanted = Request::Force([0.0, 0.0, 2.0]);
        (0..10).for_each(|_| assert!(tick(&mut pipeline, wanted).0[2] <= 2.0));
        assert_eq!((pipeline.release().force, pipeline.release().actions), ([0.0; 3], Actions::RAMP));
        let next = tick(&mut pipeline, wanted).0[2];
        assert!(next > 0.0 && next <= 0.02 * (1.0 + 1e-9), "{next}");
    }

    /// A force that is there from the first tick on, and one that is no number: neither is calm, however slowly the command could follow it.
    #[test]
    fn a_slow_limit_does_not_make_a_force_calm() {
        for computed in [3.0, f64::NAN] {
            let limits = Limits { max_slew_n_per_s: 40.0, start_up: Some(StartUp::default()), ..Limits::bare(3.0) };
            let mut pipeline = Pipeline::new(limits);
            let felt = |_| tick(&mut pipeline, Request::Force([0.0, 0.0, computed])).0;
            assert!((0..3000).map(felt).all(|force| force == [0.0; 3]), "{computed}");
            (0..4).for_each(|_| assert_eq!(tick(&mut pipeline, Request::Force([0.0; 3])).0, [0.0; 3]));
            let felt = |_| tick(&mut pipeline, Request::Force([0.0, 0.0, 3.0])).0[2];
            assert!((0..2500).map(felt).last().unwrap() > 2.9, "{computed}");
        }
    }

    /// A resync while the tool is so fast that it feels nothing: what the tank holds back of a step is held back of nothing.
    #[test]
    fn of_a_step_that_is_not_felt_nothing_is_held_back() {
        let (tank, tool_speed) = (Some(Tank::default()), Some(ToolSpeed::default()));
        let limits = Limits { tank, tool_speed, ..Limits::bare(3.0) };
        let mut pipeline = Pipeline::new(limits);
        for n in 0..50 {
            let stepped = if n == 20 { [0.0, 0.0, 0.4] } else { [0.0; 3] };
            let force = [0.0, 0.0, if n < 20 { 0.5 } else { 0.9 }];
            let position = [2.2e-3 * f64::from(n), 0.0, 2.2e-3 * f64::from(n)];
            let input = Input { swap_step: stepped, ..Input::new(Request::Force(force), position, 1e-3) };
            let Output { force, .. } = pipeline.apply(&input);
            assert!(n < 2 || force == [0.0; 3], "{n}: {force:?}");
        }
    }
}
