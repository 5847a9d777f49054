//! The torque beside the force: the same stages in the same order, with its own limits and the force's own gains.
//!
//! It has no tank and no passivity controller: what a torque gives out is damped by the hand that holds the tool. A device
//! that exerts no torque is commanded none, whatever was computed.

use super::actions::Actions;
use super::force::{Force, clamp, finite, slew};
use super::limits::Limits;
use super::start_up::Ramp;

/// What the stages remember of a torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TorqueStages {
    /// The last torque asked for, behind the first three stages.
    held: Force,
    /// The last command.
    last: Force,
}

impl TorqueStages {
    /// The first stages: a new torque is asked for.
    pub(super) fn ask(&mut self, limits: &Limits, torque: Force, dt: f64, actions: &mut Actions) {
        let Some(most) = limits.max_torque_n_m else { return };
        let (torque, acted) = finite(torque);
        actions.note(acted, Actions::FINITE);
        let (torque, acted) = clamp(torque, most);
        actions.note(acted, Actions::CLAMP);
        let (torque, acted) = slew(self.held, torque, step_limit(limits, most, dt));
        actions.note(acted, Actions::SLEW);
        self.held = torque;
    }

    /// The last stages make the command, where the force had this `gain` of tool speed, model age, start-up and ramp.
    pub(super) fn finish(
        &mut self,
        limits: &Limits,
        gain: f64,
        stale_ticks: u32,
        dt: f64,
        ramp: &mut Ramp,
        actions: &mut Actions,
    ) {
        let Some(most) = limits.max_torque_n_m else { return };
        let faded = if gain < 1.0 { self.held.map(|c| c * gain) } else { self.held };
        let (torque, acted) = finite(faded);
        actions.note(acted, Actions::FINAL_FINITE);
        let (torque, acted) = clamp(torque, most);
        actions.note(acted, Actions::FINAL_CLAMP);
        let step = step_limit(limits, most, dt);
        let (mut torque, acted) = slew(self.last, torque, step);
        actions.note(acted, Actions::FINAL_SLEW);
        if let Some(watchdog) = limits.watchdog {
            torque = watchdog.guard(stale_ticks, self.last, torque, step, ramp).0;
        }
        self.last = torque;
    }

    /// Zero at once.
    pub(super) fn release(&mut self) {
        self.last = [0.0; 3];
    }

    /// The last command (N m).
    pub(super) fn last(&self) -> Force {
        self.last
    }
}

/// The largest change within `dt` seconds (N m): the same share of the largest torque as the force may change of its own.
fn step_limit(limits: &Limits, most: f64, dt: f64) -> f64 {
    limits.max_slew_n_per_s * (most / limits.max_force_n) * dt
}

#[cfg(test)]
mod tests {
    use super::super::{Input, Output, Pipeline, Request, ToolSpeed, Watchdog};
    use super::*;
    use proptest::prelude::*;

    /// 3 N at 0.5 N/ms, so 0.06 N m at 0.01 N m/ms.
    fn limits() -> Limits {
        Limits { max_torque_n_m: Some(0.06), ..Limits::bare(3.0) }
    }

    fn tick(pipeline: &mut Pipeline, request: Request, torque: Force) -> Output {
        pipeline.apply(&Input { torque, ..Input::new(request, [0.0; 3], 1e-3) })
    }

    const STILL: Request = Request::Force([0.0; 3]);

    fn length(torque: Force) -> f64 {
        torque.iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    #[test]
    fn a_torque_within_its_limits_passes_unchanged_and_unreported() {
        let output = tick(&mut Pipeline::new(limits()), STILL, [0.001, -0.002, 0.003]);
        assert_eq!((output.torque, output.actions), ([0.001, -0.002, 0.003], Actions::default()));
    }

    #[test]
    fn a_torque_is_finite_and_within_its_length_and_its_change() {
        let mut pipeline = Pipeline::new(limits());
        let nothing = tick(&mut pipeline, STILL, [f64::NAN, 0.0, 0.0]);
        assert_eq!((nothing.torque, nothing.actions), ([0.0; 3], Actions::FINITE));
        let torques: Vec<f64> = (0..10).map(|_| tick(&mut pipeline, STILL, [0.0, 5.0, 0.0]).torque[1]).collect();
        assert!((torques[0] - 0.01).abs() < 1e-15 && (torques[2] - 0.03).abs() < 1e-12, "{torques:?}");
        assert!((torques[9] - 0.06).abs() < 1e-12, "{torques:?}");
        let output = tick(&mut pipeline, STILL, [0.0, 5.0, 0.0]);
        assert_eq!(output.actions, Actions::CLAMP);
    }

    // Check that force and torque of the same shape stay in proportion through every stage that fades.
    #[test]
    fn a_torque_fades_with_exactly_the_gain_of_the_force() {
        let limits = Limits {
            tool_speed: Some(ToolSpeed::default()),
            ..Limits::new(&super::super::DeviceLimits::of_force(3.0))
        };
        let limits = Limits { max_torque_n_m: Some(0.06), passivity: None, ..limits };
        let mut pipeline = Pipeline::new(limits);
        let (mut place, mut faded) = (0.0, 0);
        for n in 0..4000_u32 {
            place += if n % 1000 < 20 { 1.4e-3 } else { 0.0 };
            let force = if n < 10 { 0.0 } else { 1.0 };
            let request = if (3000..3020).contains(&n) { Request::Rest } else { Request::Force([force, 0.0, 0.0]) };
            let age = if (2500..2700).contains(&n) { n - 2500 } else { 0 };
            let input = Input {
                torque: [0.02 * force, 0.0, 0.0],
                model_age_ticks: age,
                ..Input::new(request, [place, 0.0, 0.0], 1e-3)
            };
            let output = pipeline.apply(&input);
            assert!((output.torque[0] - 0.02 * output.force[0]).abs() < 1e-12, "{n}: {output:?}");
            faded += u32::from(output.actions != Actions::default());
        }
        assert!(faded > 2000, "{faded}");
    }

    #[test]
    fn at_rest_after_a_gap_and_in_silence_it_goes_as_the_force_does() {
        let mut pipeline = Pipeline::new(Limits { watchdog: Some(Watchdog::default()), ..limits() });
        let torque = [0.0, 0.0, 0.03];
        (0..10).for_each(|_| assert!(tick(&mut pipeline, STILL, torque).torque[2] <= 0.03));
        let out: Vec<f64> = (0..100).map(|_| tick(&mut pipeline, Request::Rest, [0.0; 3]).torque[2]).collect();
        assert!(out.windows(2).all(|pair| pair[1] < pair[0]) && out[99] == 0.0, "{out:?}");
        (0..200).for_each(|_| assert!(tick(&mut pipeline, STILL, torque).torque[2] <= 0.03));
        assert_eq!(pipeline.release().torque, [0.0; 3]);
        assert!(tick(&mut pipeline, STILL, torque).torque[2] < 0.001);
        (0..200).for_each(|_| assert!(tick(&mut pipeline, STILL, torque).torque[2] <= 0.03));
        let silent = |stale_ticks| Input { torque, stale_ticks, ..Input::new(STILL, [0.0; 3], 1e-3) };
        let gone: Vec<f64> = (3..7).map(|stale| pipeline.apply(&silent(stale)).torque[2]).collect();
        assert!((gone[0] - 0.02).abs() < 1e-12 && gone[3] == 0.0, "{gone:?}");
    }

    proptest! {
        #[test]
        fn no_input_makes_a_torque_that_is_not_finite_too_large_or_too_fast(
            torques in prop::collection::vec(prop::array::uniform3(prop_oneof![any::<f64>(), -0.2..0.2]), 1..50),
            rests: u64,
        ) {
            let mut pipeline = Pipeline::new(limits());
            let mut last = [0.0; 3];
            for (n, torque) in torques.into_iter().enumerate() {
                let request = if rests >> n & 1 == 1 { Request::Rest } else { STILL };
                let output = tick(&mut pipeline, request, torque);
                prop_assert!(output.torque.iter().all(|c| c.is_finite()));
                prop_assert!(length(output.torque) <= 0.06 * (1.0 + 1e-12));
                prop_assert!(length(std::array::from_fn(|i| output.torque[i] - last[i])) <= 0.01 * (1.0 + 1e-9));
                prop_assert_eq!(output.force, [0.0; 3]);
                last = output.torque;
            }
        }

        // Check that a device that exerts none gets none, and that nothing else of its commands changes.
        #[test]
        fn where_no_torque_can_be_none_is_and_the_force_is_the_same(
            torques in prop::collection::vec(prop::array::uniform3(prop_oneof![any::<f64>(), -0.2..0.2]), 1..50),
        ) {
            let [mut none, mut some] = [None, Some(0.06)]
                .map(|max_torque_n_m| Pipeline::new(Limits { max_torque_n_m, ..Limits::bare(3.0) }));
            for (n, torque) in torques.into_iter().enumerate() {
                let request = Request::Force([0.1 * n as f64, 1.0, -2.0]);
                let without = tick(&mut none, request, torque);
                prop_assert_eq!(without.torque, [0.0; 3]);
                prop_assert_eq!(without.force, tick(&mut some, request, torque).force);
            }
        }
    }
}
