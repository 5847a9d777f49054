//! One axis of a mass with viscous and Coulomb friction, drawn by a spring: m x'' = F + k (x_h - x) - b x' - F_c sgn(x').

/// Place (m) and velocity (m/s) along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::devices) struct Motion {
    pub(in crate::devices) place: f64,
    pub(in crate::devices) velocity: f64,
}

/// What acts on the mass during a step.
#[derive(Clone, Copy, Debug)]
pub(in crate::devices) struct Load {
    pub(in crate::devices) mass_kg: f64,
    pub(in crate::devices) damping_n_s_per_m: f64,
    pub(in crate::devices) stiffness_n_per_m: f64,
    /// The spring's other end (m).
    pub(in crate::devices) intended_m: f64,
    /// Everything else (N).
    pub(in crate::devices) force_n: f64,
    pub(in crate::devices) friction_n: f64,
}

impl Motion {
    /// The motion `dt` seconds later: implicit in spring, damper and friction, so that no parameter makes it unstable and
    /// no step gains energy. Without friction these are the equations of the reference `hand_release`.
    ///
    /// Dry friction takes from the momentum what it can and stops the mass where that is more than there is: a mass that
    /// is pushed with less than `friction_n` stands still, to the last bit.
    pub(in crate::devices) fn after(self, dt: f64, load: &Load) -> Self {
        let per_mass = dt / load.mass_kg;
        let pull = load.force_n + load.stiffness_n_per_m * (load.intended_m - self.place);
        let driven = self.velocity + pull * per_mass;
        let taken = load.friction_n * per_mass;
        let left = if driven.abs() <= taken { 0.0 } else { driven - taken.copysign(driven) };
        let resistance = 1.0 + load.damping_n_s_per_m * per_mass + load.stiffness_n_per_m * dt * per_mass;
        let velocity = left / resistance;
        Self { place: self.place + dt * velocity, velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        fn any_load()(
            mass_kg in 0.05..1.0_f64,
            damping_n_s_per_m in 0.0..5.0_f64,
            stiffness_n_per_m in 0.0..3000.0_f64,
            intended_m in -0.1..0.1_f64,
            force_n in -10.0..10.0_f64,
            friction_n in 0.0..0.3_f64,
        ) -> Load {
            Load { mass_kg, damping_n_s_per_m, stiffness_n_per_m, intended_m, force_n, friction_n }
        }
    }

    /// Of mass and spring, less what the constant force has yet to give (J).
    fn energy(motion: Motion, load: &Load) -> f64 {
        let stretched = load.intended_m - motion.place;
        0.5 * load.mass_kg * motion.velocity.powi(2) + 0.5 * load.stiffness_n_per_m * stretched.powi(2)
            - load.force_n * motion.place
    }

    proptest! {
        // Check that the device itself is passive: what it tells of a simulation's energy is not its own.
        #[test]
        fn no_step_gains_energy(
            load in any_load(), place in -0.1..0.1_f64, velocity in -2.0..2.0_f64, dt in 1e-5..1e-2_f64,
        ) {
            let mut motion = Motion { place, velocity };
            for _ in 0..100 {
                let next = motion.after(dt, &load);
                let (before, after) = (energy(motion, &load), energy(next, &load));
                prop_assert!(after <= before + 1e-12 * before.abs().max(1.0), "{before} J, then {after} J");
                motion = next;
            }
        }

        #[test]
        fn a_mass_that_is_pushed_with_less_than_its_friction_never_moves(
            load in any_load(), place in -0.1..0.1_f64, share in -1.0..1.0_f64, dt in 1e-5..1e-2_f64,
        ) {
            let spring = load.stiffness_n_per_m * (load.intended_m - place);
            let load = Load { force_n: share * load.friction_n * (1.0 - 1e-6) - spring, ..load };
            let motion = Motion { place, velocity: 0.0 };
            // Rounding of the spring's force against the pull that cancels it.
            prop_assume!(load.friction_n > 1e-6);
            prop_assert_eq!(motion.after(dt, &load), motion);
        }

        #[test]
        fn friction_brakes_and_never_turns_a_mass_round(
            load in any_load(), velocity in -2.0..2.0_f64, dt in 1e-5..1e-2_f64,
        ) {
            let load = Load { stiffness_n_per_m: 0.0, force_n: 0.0, ..load };
            let next = Motion { place: 0.0, velocity }.after(dt, &load);
            prop_assert!(next.velocity.abs() <= velocity.abs() && next.velocity * velocity >= 0.0);
        }
    }

    // Check the order of the method against the exact decay of a damped mass: the error halves with the step.
    #[test]
    fn a_finer_step_comes_nearer_to_the_exact_motion() {
        let load = Load {
            mass_kg: 0.2,
            damping_n_s_per_m: 2.0,
            stiffness_n_per_m: 0.0,
            intended_m: 0.0,
            force_n: 0.0,
            friction_n: 0.0,
        };
        let exact = 0.02 * (1.0 - (-0.1_f64 * 10.0).exp()) * 10.0 / 2.0;
        let error = |steps: u32| {
            let dt = 0.1 / f64::from(steps);
            let start = Motion { place: 0.0, velocity: 1.0 };
            let end = (0..steps).fold(start, |motion, _| motion.after(dt, &load));
            (end.place - exact).abs()
        };
        let ratio = error(1000) / error(2000);
        assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
    }
}
