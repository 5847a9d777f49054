//! How the force comes and goes: it engages late after a start, and ramps within a declared time.

use super::force::{Force, norm};

/// The conditions under which the force engages after a start, and how slowly it comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartUp {
    /// Computed force below which it has to be before it engages (N).
    pub engage_force_n: f64,
    /// Number of ticks in a row for which it has to be below that.
    pub engage_ticks: u32,
    /// Time over which the force ramps in once it has engaged (s).
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
    pub(crate) fn advance(&mut self, limits: StartUp, force: Force, dt: f64) -> f64 {
        if self.calm_ticks < limits.engage_ticks {
            self.calm_ticks = if norm(force) < limits.engage_force_n { self.calm_ticks + 1 } else { 0 };
        } else if self.gain < 1.0 {
            self.gain = (self.gain + dt / limits.ramp_s).min(1.0);
        }
        self.gain
    }
}

/// A gain between 0 (at rest) and 1 (the force passes as it is).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    gain: f64,
    /// Time from one end to the other (s).
    time_s: f64,
}

/// Below this a gain is zero: rounding must not keep a device from coming to rest.
const SMALLEST_GAIN: f64 = 1e-9;

impl Ramp {
    /// A ramp that is fully in.
    pub(crate) fn new(time_s: f64) -> Self {
        Self { gain: 1.0, time_s }
    }

    /// Moves towards 1 (`on`) or towards 0 for `dt` seconds and gives the gain.
    pub(crate) fn advance(&mut self, on: bool, dt: f64) -> f64 {
        let step = dt / self.time_s;
        let gain = if on { self.gain + step } else { self.gain - step }.clamp(0.0, 1.0);
        self.gain = if gain < SMALLEST_GAIN { 0.0 } else { gain };
        self.gain
    }

    /// Goes to 0 at once.
    pub(crate) fn release(&mut self) {
        self.gain = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn it_waits_for_four_calm_ticks_in_a_row_and_then_ramps_in_over_two_seconds() {
        let (limits, mut engagement) = (StartUp::default(), Engagement::default());
        let mut gain = |force: f64| engagement.advance(limits, [0.0, force, 0.0], 1e-3);
        assert!([3.0, 0.0, 0.1, 0.19, 0.2, 0.0, 0.0, 0.0, 0.0].iter().all(|&force| gain(force) == 0.0));
        let gains: Vec<f64> = (0..2001).map(|_| gain(3.0)).collect();
        assert!(gains.windows(2).all(|pair| pair[1] >= pair[0] && pair[1] - pair[0] < 6e-4));
        assert!((gains[999] - 0.5).abs() < 1e-9 && gains[1990] < 1.0 && gains[2000] == 1.0);
    }

    proptest! {
        #[test]
        fn a_ramp_ends_within_its_time_and_never_leaves_its_range(
            time_s in 1e-3..1.0_f64,
            steps in prop::collection::vec((any::<bool>(), 1e-4..0.02_f64), 0..100),
        ) {
            let mut ramp = Ramp::new(time_s);
            let mut last = 1.0;
            for (on, dt) in steps {
                let gain = ramp.advance(on, dt);
                prop_assert!((0.0..=1.0).contains(&gain));
                prop_assert!((gain - last).abs() <= dt / time_s * (1.0 + 1e-9) + SMALLEST_GAIN);
                last = gain;
            }
            let ticks = (time_s / 1e-3).ceil() as usize;
            let off = (0..ticks).fold(last, |_, _| ramp.advance(false, 1e-3));
            prop_assert_eq!(off, 0.0);
        }
    }
}
