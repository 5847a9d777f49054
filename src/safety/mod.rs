//! What stands between a computed force and a device: one stage per file, pure functions of state and time.
//!
//! Order: finite check, magnitude clamp, ramp, slew limit. Every action is reported as a bit of [`Actions`].

mod clamp;
mod finite;
mod ramp;
mod slew;

pub use clamp::clamp;
pub use finite::finite;
pub use ramp::Ramp;
pub use slew::slew;

/// A force in space (N).
pub type Force = [f64; 3];

/// The stages that acted on a command, a bit each.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Actions(pub u16);

impl Actions {
    /// A force that was not finite was replaced by zero.
    pub const FINITE: Self = Self(1);
    /// A force above the limit was shortened.
    pub const CLAMP: Self = Self(1 << 1);
    /// A change above the limit was shortened.
    pub const SLEW: Self = Self(1 << 2);

    /// The force was on its way to rest or back.
    pub const RAMP: Self = Self(1 << 3);

    /// Names of the bits, lowest first.
    pub const NAMES: [&'static str; 4] = ["finite", "clamp", "slew", "ramp"];

    /// True if every bit of `other` is set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    fn note(&mut self, acted: bool, stage: Self) {
        if acted {
            self.0 |= stage.0;
        }
    }
}

/// The limits of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest force (N).
    pub max_force_n: f64,
    /// Largest change of the force (N/s).
    pub max_slew_n_per_s: f64,
    /// Time in which the force goes to zero when it has to, and comes back afterwards (s).
    pub ramp_s: f64,
}

/// What is asked of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// This force (N), ramped in if there was none before.
    Force(Force),
    /// The last force, ramped out: nothing computes a new one.
    Rest,
}

/// The stages in their order, with the command that was given last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pipeline {
    limits: Limits,
    ramp: Ramp,
    /// The last force asked for, finite and clamped.
    held: Force,
    last: Force,
}

impl Pipeline {
    /// A pipeline that starts from zero force.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(limits: Limits) -> Self {
        Self { limits, ramp: Ramp::new(limits.ramp_s), held: [0.0; 3], last: [0.0; 3] }
    }

    /// The command for a `request`, `dt` seconds after the one before.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn apply(&mut self, request: Request, dt: f64) -> (Force, Actions) {
        let mut actions = Actions::default();
        if let Request::Force(force) = request {
            let (force, acted) = finite(force);
            actions.note(acted, Actions::FINITE);
            let (force, acted) = clamp(force, self.limits.max_force_n);
            actions.note(acted, Actions::CLAMP);
            self.held = force;
        }
        let gain = self.ramp.advance(request != Request::Rest, dt);
        actions.note(gain < 1.0, Actions::RAMP);
        let force = if gain < 1.0 { self.held.map(|c| c * gain) } else { self.held };
        let (force, acted) = slew(self.last, force, self.limits.max_slew_n_per_s * dt);
        actions.note(acted, Actions::SLEW);
        self.last = force;
        (force, actions)
    }

    /// Zero at once, and a ramp from there: after a gap in which nobody knows what the device did.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn release(&mut self) -> (Force, Actions) {
        self.ramp.release();
        self.last = [0.0; 3];
        (self.last, Actions::RAMP)
    }
}

fn norm(force: Force) -> f64 {
    force.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { max_force_n: 3.0, max_slew_n_per_s: 500.0, ramp_s: 0.1 };

    fn any_force() -> impl Strategy<Value = Force> {
        prop::array::uniform3(prop_oneof![any::<f64>(), -10.0..10.0])
    }

    proptest! {
        #[test]
        fn no_input_makes_a_command_that_is_not_finite_too_large_or_too_fast(
            requests in prop::collection::vec(prop_oneof![4 => any_force().prop_map(Request::Force), 1 => Just(Request::Rest)], 1..50),
        ) {
            let mut pipeline = Pipeline::new(LIMITS);
            let mut last = [0.0; 3];
            for request in requests {
                let (command, _) = pipeline.apply(request, 1e-3);
                prop_assert!(command.iter().all(|c| c.is_finite()));
                prop_assert!(norm(command) <= LIMITS.max_force_n * (1.0 + 1e-12));
                let change = std::array::from_fn(|i| command[i] - last[i]);
                prop_assert!(norm(change) <= 0.5 * (1.0 + 1e-12));
                last = command;
            }
        }
    }

    #[test]
    fn a_force_within_the_limits_passes_unchanged_and_unreported() {
        let mut pipeline = Pipeline::new(LIMITS);
        assert_eq!(pipeline.apply(Request::Force([0.1, -0.2, 0.3]), 1e-3), ([0.1, -0.2, 0.3], Actions::default()));
    }

    #[test]
    fn every_stage_reports_what_it_did() {
        let mut pipeline = Pipeline::new(LIMITS);
        assert_eq!(pipeline.apply(Request::Force([f64::NAN, 0.0, 0.0]), 1e-3), ([0.0; 3], Actions::FINITE));
        let (command, actions) = pipeline.apply(Request::Force([0.0, 0.0, 34.0]), 1e-3);
        assert_eq!(command, [0.0, 0.0, 0.5]);
        assert!(actions.contains(Actions::CLAMP) && actions.contains(Actions::SLEW));
    }
    #[test]
    fn at_rest_the_force_is_gone_within_the_ramp_time_and_comes_back_as_slowly() {
        let mut pipeline = Pipeline::new(LIMITS);
        let wanted = Request::Force([0.0, 0.0, 2.0]);
        (0..10).for_each(|_| assert!(pipeline.apply(wanted, 1e-3).0[2] <= 2.0));
        let out: Vec<f64> = (0..100).map(|_| pipeline.apply(Request::Rest, 1e-3).0[2]).collect();
        assert!(out.windows(2).all(|pair| pair[1] < pair[0]) && out[99] == 0.0, "{out:?}");
        assert_eq!(pipeline.apply(Request::Rest, 1e-3), ([0.0; 3], Actions::RAMP));
        let back: Vec<f64> = (0..100).map(|_| pipeline.apply(wanted, 1e-3).0[2]).collect();
        assert!(back.windows(2).all(|pair| pair[1] > pair[0]) && (back[99] - 2.0).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn after_a_gap_the_first_command_is_zero() {
        let mut pipeline = Pipeline::new(LIMITS);
        let wanted = Request::Force([0.0, 0.0, 2.0]);
        (0..10).for_each(|_| assert!(pipeline.apply(wanted, 1e-3).0[2] <= 2.0));
        assert_eq!(pipeline.release(), ([0.0; 3], Actions::RAMP));
        let next = pipeline.apply(wanted, 1e-3).0[2];
        assert!(next > 0.0 && next <= 0.02 * (1.0 + 1e-9), "{next}");
    }
}
