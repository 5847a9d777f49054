//! The force comes and goes within a declared time.

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
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(time_s: f64) -> Self {
        Self { gain: 1.0, time_s }
    }

    /// Moves towards 1 (`on`) or towards 0 for `dt` seconds and gives the gain.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn advance(&mut self, on: bool, dt: f64) -> f64 {
        let step = dt / self.time_s;
        let gain = if on { self.gain + step } else { self.gain - step }.clamp(0.0, 1.0);
        self.gain = if gain < SMALLEST_GAIN { 0.0 } else { gain };
        self.gain
    }

    /// Goes to 0 at once.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn release(&mut self) {
        self.gain = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
