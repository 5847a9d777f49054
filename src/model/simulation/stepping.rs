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
/// is left for what the body does within the step, and for what it does not know of itself.
const BORNE: f64 = 1.1;
/// No part of a step is shorter than this share of it: a late tick is better than a body that flies apart, but it must end.
const SHORTEST: f64 = 1.0 / 64.0;
/// What a body bears is found at each step while that is less than at rest, and else so often (s): to find it takes time.
const FOUND_EVERY: f64 = 1e-3;

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

    /// A tick begins.
    pub(crate) fn begin(&self) -> TickProgress {
        let every = (FOUND_EVERY / self.step()).clamp(1.0, f64::from(u32::MAX)) as u32;
        TickProgress { substeps: self.substeps, step: 0, done: 0.0, every, share: 0.0 }
    }
}

/// How far a tick has come: step by step, each of them in parts that the body bears.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickProgress {
    substeps: u32,
    /// Steps that are over.
    step: u32,
    /// Share of the next one that is done.
    done: f64,
    /// After so many steps it is found anew what a body bears that has borne what it does at rest.
    every: u32,
    /// The longest stable step when it was found last, over that at rest.
    share: f64,
}

/// A step of a tick, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// Where it begins and ends in the tick, in steps.
    pub(crate) steps: [f64; 2],
    /// The same as shares of the tick.
    pub(crate) shares: [f64; 2],
    /// How long it is, as a share of a step.
    pub(crate) length: f64,
}

impl TickProgress {
    /// True once the tick is over.
    pub(crate) fn is_over(&self) -> bool {
        self.step == self.substeps
    }

    /// True where a step begins, and not a further part of one.
    pub(crate) fn begins_step(&self) -> bool {
        self.done == 0.0
    }

    /// The next part, for a body whose longest stable step is now the `share` of that at rest that is found; parts of one step are as long as
    /// each other while that does not change.
    pub(crate) fn next(&mut self, share: impl FnOnce() -> f64) -> Part {
        if self.share < 1.0 || self.step.is_multiple_of(self.every) {
            self.share = share();
        }
        let left = 1.0 - self.done;
        // What is not a number divides nothing.
        let parts = (left / (BORNE * self.share).clamp(SHORTEST, 1.0)).ceil().max(1.0);
        let from = [f64::from(self.step), self.done];
        (self.step, self.done) =
            if parts == 1.0 { (self.step + 1, 0.0) } else { (self.step, self.done + left / parts) };
        let steps = [from[0] + from[1], f64::from(self.step) + self.done];
        let shares = steps.map(|steps| steps / f64::from(self.substeps));
        Part { steps, shares, length: left / parts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts of a tick of three steps of a body that bears `share` of a step at rest.
    fn parts(share: impl Fn(f64) -> f64) -> Vec<Part> {
        let (mut progress, mut parts) = (Stepping { tick: 1e-3, substeps: 3 }.begin(), Vec::new());
        while !progress.is_over() {
            let (begins, done) = (progress.begins_step(), progress.done);
            let part = progress.next(|| share(done));
            assert_eq!(begins, part.steps[0].fract() == 0.0, "{part:?}");
            parts.push(part);
        }
        parts
    }

    /// Check that no part of a step is longer than what the body bears, down to a 64th of what it bears at rest, and that all parts
    /// together are the tick.
    #[test]
    fn steps_are_divided_until_the_body_bears_them() {
        let count = |share: f64| parts(|_| share).len() / 3;
        assert_eq!([1.0, 0.96, 0.9, 0.5, 0.19].map(count), [1, 1, 2, 2, 5]);
        assert_eq!([0.01, 0.0].map(count), [64; 2]);
        assert_eq!(count(f64::NAN), 1);
        let stiffens = |done: f64| 1.0 - 0.95 * done;
        for share in [&|_| 1.0, &|_| 0.3, &stiffens, &|_| 0.02] as [&dyn Fn(f64) -> f64; 4] {
            let parts = parts(share);
            let borne = |part: &Part| part.length <= BORNE * share(part.steps[0].fract()) + 1e-12;
            assert!(parts.iter().all(borne), "{parts:?}");
            assert!(parts.windows(2).all(|pair| (pair[1].steps[0] - pair[0].steps[1]).abs() < 1e-12), "{parts:?}");
            assert!((parts.iter().map(|part| part.length).sum::<f64>() - 3.0).abs() < 1e-12, "{parts:?}");
            assert_eq!([parts[0].shares[0], parts[parts.len() - 1].shares[1]], [0.0, 1.0]);
        }
    }
}
