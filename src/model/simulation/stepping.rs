//! How the time of a simulation is divided.

use crate::body::Body;
use crate::integrator::Spectrum;

/// How time is divided: ticks of the haptic rate, each of several explicit substeps.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Haptic period (s).
    pub tick: f64,
    /// Explicit substeps per tick, at least one.
    pub substeps: u32,
}

/// How many times shorter than at rest the longest stable step may be before steps are divided. They have a margin of 1.3, most of which
/// is left for what the body does within the tick, and for what it does not know of itself.
const BORNE: f64 = 1.05;
/// Parts of a step at most: a late tick is better than a body that flies apart.
const MOST_PARTS: f64 = 16.0;

impl Default for Stepping {
    /// One substep per millisecond.
    fn default() -> Self {
        Self { tick: 1e-3, substeps: 1 }
    }
}

impl Stepping {
    /// Substeps per tick of `tick` (s) from the body's stability limit.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and evaluates the body's forces hundreds of times.
    pub fn stable_substeps(body: &mut dyn Body, tick: f64) -> u32 {
        Spectrum::estimate(body).substeps(tick)
    }

    /// The substep d (s).
    pub fn step(&self) -> f64 {
        self.tick / f64::from(self.substeps)
    }

    /// The same with every step in so many parts that a body whose longest stable step is `share` of that at rest bears them.
    pub(crate) fn divided(&self, share: f64) -> Self {
        // What is not a number is zero parts.
        let parts = (1.0 / (BORNE * share)).ceil().clamp(1.0, MOST_PARTS) as u32;
        Self { substeps: self.substeps * parts.max(1), ..*self }
    }

    /// The parts of one tick, from and to a share of it.
    pub(crate) fn parts(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        let n = f64::from(self.substeps);
        (0..self.substeps).map(move |u| [f64::from(u) / n, f64::from(u + 1) / n])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check that no part of a step is longer than what the body bears, down to a sixteenth of what it bears at rest.
    #[test]
    fn steps_are_divided_until_the_body_bears_them() {
        let stepping = Stepping { tick: 1e-3, substeps: 3 };
        let parts = |share: f64| stepping.divided(share).substeps / 3;
        assert_eq!([1.0, 0.96, 0.9, 0.5, 0.19].map(parts), [1, 1, 2, 2, 6]);
        assert!((7..=100).map(|n| f64::from(n) / 100.0).all(|share| BORNE * share * f64::from(parts(share)) > 0.999));
        assert_eq!([0.01, 0.0].map(parts), [16; 2]);
        assert_eq!(parts(f64::NAN), 1);
    }
}
