//! The turning of a rigid body with viscous friction, drawn by a spring: I w' = T + k e - c w, where e is the rotation vector from
//! where it is to where it is wanted, on the shorter way.

use crate::model::{Turn, Vec3};

/// Orientation and angular velocity in the world's axes (rad/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Turning {
    pub(super) orientation: Turn,
    pub(super) velocity: Vec3,
}

/// What turns the body during a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twist {
    /// The same about every axis.
    pub(super) inertia_kg_m2: f64,
    pub(super) damping_n_m_s_per_rad: f64,
    pub(super) stiffness_n_m_per_rad: f64,
    /// The spring's other end.
    pub(super) intended: Turn,
    /// Everything else (N m).
    pub(super) torque_n_m: Vec3,
}

impl Turning {
    /// The turning `dt` seconds later: implicit in spring and damper, as [`Motion`](super::plant::Motion) is. A body that
    /// nothing turns keeps its orientation to the last bit, and costs nothing.
    pub(super) fn after(self, dt: f64, twist: &Twist) -> Self {
        let is_there = twist.intended == self.orientation || twist.stiffness_n_m_per_rad == 0.0;
        let error = if is_there { Vec3::zeros() } else { self.error(&twist.intended) };
        let pull = twist.torque_n_m + error * twist.stiffness_n_m_per_rad;
        if pull == Vec3::zeros() && self.velocity == Vec3::zeros() {
            return self;
        }
        let per_inertia = dt / twist.inertia_kg_m2;
        let resistance =
            1.0 + twist.damping_n_m_s_per_rad * per_inertia + twist.stiffness_n_m_per_rad * dt * per_inertia;
        let velocity = (self.velocity + pull * per_inertia) / resistance;
        // Made of length one again: rounding would add up over a run.
        let turned = Turn::from_scaled_axis(velocity * dt).into_inner() * self.orientation.into_inner();
        Self { orientation: Turn::new_normalize(turned), velocity }
    }

    /// The rotation vector to `intended` (rad), on the shorter way.
    fn error(&self, intended: &Turn) -> Vec3 {
        (intended * self.orientation.inverse()).scaled_axis()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn free() -> Twist {
        Twist {
            inertia_kg_m2: 1e-4,
            damping_n_m_s_per_rad: 0.0,
            stiffness_n_m_per_rad: 0.0,
            intended: Turn::identity(),
            torque_n_m: Vec3::zeros(),
        }
    }

    fn run(start: Turning, twist: &Twist, dt: f64, seconds: f64) -> Turning {
        (0..(seconds / dt).round() as u32).fold(start, |turning, _| turning.after(dt, twist))
    }

    // Check against the exact motion of a damped body: w = T / c (1 - exp(-c t / I)).
    #[test]
    fn a_torque_turns_a_damped_body_as_the_equation_says() {
        let torque = Vec3::new(0.0, 0.0, 1e-3);
        let twist = Twist { damping_n_m_s_per_rad: 1e-3, torque_n_m: torque, ..free() };
        let end = run(Turning::default(), &twist, 1e-5, 0.2);
        let exact = 1.0 - (-2.0_f64).exp();
        assert!((end.velocity.z - exact).abs() < 1e-3 * exact, "{}", end.velocity);
        let angle = 0.2 - 0.1 * exact;
        assert!((end.orientation.angle() - angle).abs() < 1e-3, "{} rad, not {angle}", end.orientation.angle());
    }

    #[test]
    fn the_spring_carries_a_torque_at_the_angle_of_its_stiffness() {
        let intended = Turn::from_axis_angle(&Vec3::x_axis(), 0.4);
        let twist = Twist {
            damping_n_m_s_per_rad: 0.02,
            stiffness_n_m_per_rad: 1.0,
            intended,
            torque_n_m: Vec3::new(0.1, 0.0, 0.0),
            ..free()
        };
        let end = run(Turning::default(), &twist, 1e-4, 1.0);
        assert!((end.orientation.angle() - 0.5).abs() < 1e-6, "{}", end.orientation.angle());
        // The same orientation, written with the other sign, is the same way.
        let other = Twist { intended: Turn::new_unchecked(-intended.into_inner()), ..twist };
        assert!(run(Turning::default(), &other, 1e-4, 1.0).orientation.angle_to(&end.orientation) < 1e-6);
    }

    #[test]
    fn a_body_that_nothing_turns_keeps_every_bit() {
        let orientation = Turn::from_euler_angles(0.3, -0.7, 1.1);
        let start = Turning { orientation, ..Turning::default() };
        let held = Twist { stiffness_n_m_per_rad: 1.0, damping_n_m_s_per_rad: 0.01, intended: orientation, ..free() };
        assert_eq!(run(start, &held, 1e-4, 0.1), start);
        assert_eq!(run(start, &free(), 1e-4, 0.1), start);
    }

    proptest! {
        // Check that no parameter makes it swing up: kinetic energy and that of the spring never grow beyond rounding.
        #[test]
        fn no_parameter_and_no_step_make_it_unstable(
            inertia_kg_m2 in 1e-6..1e-2_f64,
            damping_n_m_s_per_rad in 0.0..0.1_f64,
            stiffness_n_m_per_rad in 0.0..50.0_f64,
            dt in 1e-5..1e-2_f64,
            angles in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let intended = Turn::from_euler_angles(angles[0], angles[1], angles[2]);
            let twist = Twist { inertia_kg_m2, damping_n_m_s_per_rad, stiffness_n_m_per_rad, intended, ..free() };
            let energy = |turning: &Turning| {
                0.5 * inertia_kg_m2 * turning.velocity.norm_squared()
                    + 0.5 * stiffness_n_m_per_rad * turning.error(&intended).norm_squared()
            };
            let mut turning = Turning::default();
            let first = energy(&turning);
            for _ in 0..300 {
                turning = turning.after(dt, &twist);
                prop_assert!(energy(&turning) <= first * (1.0 + 1e-6) + 1e-12, "{} J of {first}", energy(&turning));
                prop_assert!((turning.orientation.coords.norm() - 1.0).abs() < 1e-12);
            }
        }
    }
}
