//! Start-up: nobody is pushed by a device that has just been switched on.

use super::{Force, norm};

/// When the force engages, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartUp {
    /// It engages once the computed force has been below this (N) ...
    pub engage_force_n: f64,
    /// ... for so many ticks.
    pub engage_ticks: u32,
    /// Then it ramps in over this time (s).
    pub ramp_s: f64,
}

impl Default for StartUp {
    /// CHAI3D's values.
    fn default() -> Self {
        Self { engage_force_n: 0.2, engage_ticks: 4, ramp_s: 2.0 }
    }
}

/// How far the start has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Engagement {
    calm_ticks: u32,
    gain: f64,
}

impl Engagement {
    /// The gain for a computed `force` (N), `dt` seconds after the one before.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn advance(&mut self, limits: StartUp, force: Force, dt: f64) -> f64 {
        if self.calm_ticks < limits.engage_ticks {
            self.calm_ticks = if norm(force) < limits.engage_force_n { self.calm_ticks + 1 } else { 0 };
        } else if self.gain < 1.0 {
            self.gain = (self.gain + dt / limits.ramp_s).min(1.0);
        }
        self.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_waits_for_four_calm_ticks_in_a_row_and_then_ramps_in_over_two_seconds() {
        let (limits, mut engagement) = (StartUp::default(), Engagement::default());
        let mut gain = |force: f64| engagement.advance(limits, [0.0, force, 0.0], 1e-3);
        assert!([3.0, 0.0, 0.1, 0.19, 0.2, 0.0, 0.0, 0.0, 0.0].iter().all(|&force| gain(force) == 0.0));
        let gains: Vec<f64> = (0..2001).map(|_| gain(3.0)).collect();
        assert!(gains.windows(2).all(|pair| pair[1] >= pair[0] && pair[1] - pair[0] < 6e-4));
        assert!((gains[999] - 0.5).abs() < 1e-9 && gains[1990] < 1.0 && gains[2000] == 1.0);
    }
}
