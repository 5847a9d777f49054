//! The mock's device: a mass with damping, and a hand that holds it by a spring while it moves.

use std::f64::consts::TAU;
use std::time::Duration;

/// Moving mass (kg) and viscous friction (N s/m).
const MASS_KG: f64 = 0.15;
const DAMPING_N_S_PER_M: f64 = 1.0;

/// The hand's spring (N/m) and damper (N s/m), a light grip.
const HAND_N_PER_M: f64 = 300.0;
const HAND_N_S_PER_M: f64 = 4.0;

/// Where the hand's way begins and comes back to, from the device's base (m).
pub(super) const HOME_M: [f64; 3] = [0.0, -0.1, 0.15];

/// The hand goes down by this (m), and sideways to either side by half of it, once per period (s).
const DEPTH_M: f64 = 0.02;
const PERIOD_S: f64 = 4.0;

/// A device without commands for this long is idle.
const IDLE_AFTER_S: f64 = 0.01;

const STEP_S: f64 = 1e-4;

/// A pause of the mock's process is not made up beyond this.
const LONGEST_S: f64 = 1.0;

/// A point mass in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plant {
    pub(super) position_m: [f64; 3],
    pub(super) velocity_m_s: [f64; 3],
    /// The last command (N) and its age (s).
    force_n: [f64; 3],
    age_s: f64,
    time_s: f64,
}

impl Plant {
    pub(super) fn new() -> Self {
        Self { position_m: HOME_M, velocity_m_s: [0.0; 3], force_n: [0.0; 3], age_s: f64::INFINITY, time_s: 0.0 }
    }

    pub(super) fn command(&mut self, force_n: [f64; 3]) {
        (self.force_n, self.age_s) = (force_n, 0.0);
    }

    /// The force that acts now (N): none once commands have stopped.
    pub(super) fn force_n(&self) -> [f64; 3] {
        if self.is_idle() { [0.0; 3] } else { self.force_n }
    }

    pub(super) fn is_idle(&self) -> bool {
        self.age_s > IDLE_AFTER_S
    }

    /// Goes on for `passed`, by symplectic Euler.
    pub(super) fn advance(&mut self, passed: Duration) {
        let steps = (passed.as_secs_f64().min(LONGEST_S) / STEP_S).ceil();
        let step_s = passed.as_secs_f64().min(LONGEST_S) / steps.max(1.0);
        for _ in 0..steps as usize {
            self.time_s += step_s;
            self.age_s += step_s;
            let (force_n, intended_m) = (self.force_n(), intended_m(self.time_s));
            for axis in 0..3 {
                let hand_n = HAND_N_PER_M * (intended_m[axis] - self.position_m[axis])
                    - HAND_N_S_PER_M * self.velocity_m_s[axis];
                let sum_n = force_n[axis] + hand_n - DAMPING_N_S_PER_M * self.velocity_m_s[axis];
                self.velocity_m_s[axis] += step_s * sum_n / MASS_KG;
                self.position_m[axis] += step_s * self.velocity_m_s[axis];
            }
        }
    }
}

/// Where the hand wants to be (m).
fn intended_m(time_s: f64) -> [f64; 3] {
    let phase = TAU * time_s / PERIOD_S;
    let [x, y, z] = HOME_M;
    [x + 0.5 * DEPTH_M * phase.sin(), y, z - 0.5 * DEPTH_M * (1.0 - phase.cos())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_moves_it_and_is_gone_when_commands_stop() {
        let (mut pushed, mut free) = (Plant::new(), Plant::new());
        for _ in 0..1000 {
            pushed.command([0.0, 3.0, 0.0]);
            pushed.advance(Duration::from_millis(1));
            free.advance(Duration::from_millis(1));
        }
        // 3 N against 300 N/m: a centimetre
        assert!((pushed.position_m[1] - free.position_m[1] - 0.01).abs() < 1e-3, "{pushed:?}");
        assert!(!pushed.is_idle() && free.is_idle());
        pushed.advance(Duration::from_millis(12));
        assert_eq!((pushed.is_idle(), pushed.force_n()), (true, [0.0; 3]));
    }
}
