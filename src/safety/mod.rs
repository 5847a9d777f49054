//! What stands between a computed force and a device: one stage per file, pure functions of state and time.
//!
//! Order: finite check, magnitude clamp, slew limit. Every action is reported as a bit of [`Actions`].

mod clamp;
mod finite;
mod slew;

pub use clamp::clamp;
pub use finite::finite;
pub use slew::slew;

/// A force in space (N).
pub type Force = [f64; 3];

/// The stages that acted on a command, a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Actions(pub u16);

impl Actions {
    /// A force that was not finite was replaced by zero.
    pub const FINITE: Self = Self(1);
    /// A force above the limit was shortened.
    pub const CLAMP: Self = Self(1 << 1);
    /// A change above the limit was shortened.
    pub const SLEW: Self = Self(1 << 2);

    /// Names of the bits, lowest first.
    pub const NAMES: [&'static str; 3] = ["finite", "clamp", "slew"];

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
}

/// The stages in their order, with the command that was given last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pipeline {
    limits: Limits,
    last: Force,
}

impl Pipeline {
    /// A pipeline that starts from zero force.
    pub fn new(limits: Limits) -> Self {
        Self { limits, last: [0.0; 3] }
    }

    /// The command for a computed `force`, `dt` seconds after the one before.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn apply(&mut self, force: Force, dt: f64) -> (Force, Actions) {
        let mut actions = Actions::default();
        let (force, acted) = finite(force);
        actions.note(acted, Actions::FINITE);
        let (force, acted) = clamp(force, self.limits.max_force_n);
        actions.note(acted, Actions::CLAMP);
        let (force, acted) = slew(self.last, force, self.limits.max_slew_n_per_s * dt);
        actions.note(acted, Actions::SLEW);
        self.last = force;
        (force, actions)
    }
}

fn norm(force: Force) -> f64 {
    force.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { max_force_n: 3.0, max_slew_n_per_s: 500.0 };

    fn any_force() -> impl Strategy<Value = Force> {
        prop::array::uniform3(prop_oneof![any::<f64>(), -10.0..10.0])
    }

    proptest! {
        #[test]
        fn no_input_makes_a_command_that_is_not_finite_too_large_or_too_fast(
            forces in prop::collection::vec(any_force(), 1..50),
        ) {
            let mut pipeline = Pipeline::new(LIMITS);
            let mut last = [0.0; 3];
            for force in forces {
                let (command, _) = pipeline.apply(force, 1e-3);
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
        assert_eq!(pipeline.apply([0.1, -0.2, 0.3], 1e-3), ([0.1, -0.2, 0.3], Actions::default()));
    }

    #[test]
    fn every_stage_reports_what_it_did() {
        let mut pipeline = Pipeline::new(LIMITS);
        assert_eq!(pipeline.apply([f64::NAN, 0.0, 0.0], 1e-3), ([0.0; 3], Actions::FINITE));
        let (command, actions) = pipeline.apply([0.0, 0.0, 34.0], 1e-3);
        assert_eq!(command, [0.0, 0.0, 0.5]);
        assert!(actions.contains(Actions::CLAMP) && actions.contains(Actions::SLEW));
    }
}
