//! The sizes of `predictive`: the usual ones, and smaller ones that do for an error budget.

use crate::model::surroundings::Basis;

/// A window and its reduced surroundings, and what random scenes kept with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sizes {
    /// Patch nodes along the surface, along it, into depth; the usual ones of the body if absent.
    pub(crate) patch: Option<[usize; 3]>,
    /// States of the reduced surroundings.
    pub(crate) states: usize,
    /// The force error one global period late (rms over a run, % of the peak force) that 19 of 20 of the scenes of docs/population.md were
    /// within, the seen ones as the unseen, and those with larger blocks too.
    pub(crate) kept_pct: f64,
}

impl Sizes {
    /// Without a budget.
    pub(crate) const USUAL: Self = Self { patch: None, states: Basis::DEFAULT_STATES, kept_pct: 1.8 };

    /// What a loose budget takes: docs/predictive.md has what it saves, and what still smaller ones would break.
    const SMALL: Self = Self { patch: Some([4, 4, 2]), states: 150, kept_pct: 2.9 };

    /// The cheaper ones if they keep `error_pct`.
    pub(super) fn within(error_pct: f64) -> Self {
        if Self::SMALL.kept_pct <= error_pct { Self::SMALL } else { Self::USUAL }
    }
}
