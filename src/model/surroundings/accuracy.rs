//! From an error budget to a number of states: how the linear estimate relates to the force error of a whole run.

/// The wanted size of a basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// At most so many states.
    States(usize),
    /// The least number of states that keeps the expected error within so many % (rms over a run, of the peak force).
    ErrorPct(f64),
}

impl Size {
    /// The least error budget that can be kept (%): closer to the floor the states grow without end.
    pub const LEAST_PCT: f64 = 0.4;

    /// A compromise on random scenes: with 150 states errors are up to twice as large, and with 350 a tick is a fifth dearer.
    pub const DEFAULT_STATES: usize = 250;

    /// The largest number of states that is tried for an error budget.
    pub const MOST_STATES: usize = 150;
}

impl From<usize> for Size {
    fn from(states: usize) -> Self {
        Self::States(states)
    }
}

/// Force error of a run for an error of the linear force: the share of the force that deviates from the forecast. Measured
/// with 5 to 100 states, one period late: 0.2 to 0.72, the largest with 5 on `hand`.
const GAIN: f64 = 0.8;

/// The reduction error of the linear contact force of a basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The relative error of the force against an imposed motion of a touched node, linear at rest (%, root mean square over
    /// four real frequencies, the worst of the nodes in the middle of the patch).
    pub linear_pct: f64,
}

impl Estimate {
    /// The force error that is left however many states there are (%): that of the forecast of the tool and the rest of the body's non-linearity. Measured
    /// one global period late with 100 states: `hand` 0.34, `wave` 0.24, `drag_friction` 0.20, `drag_slip` 0.12.
    pub const FLOOR_PCT: f64 = 0.35;

    /// The force error of `predictive` that goes with it, one period late (rms over a run, % of the peak): a calibration on the
    /// scenes `hand`, `wave`, `drag_friction` and `drag_slip`, above all that was measured there.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn expected_pct(&self) -> f64 {
        Self::FLOOR_PCT.hypot(GAIN * self.linear_pct)
    }
}

/// The least number of states whose expected error is within `error_pct`, by the relative `errors` from one state on; all if
/// none is.
pub(super) fn states_within(error_pct: f64, errors: &[f64]) -> usize {
    let fits = |error: &f64| Estimate { linear_pct: 100.0 * error }.expected_pct() <= error_pct;
    errors.iter().position(fits).map_or(errors.len(), |index| index + 1)
}
