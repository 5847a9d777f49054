//! Working memory of the solver for the places of a step.

use super::exact::Exact;
use super::nearness::Nearness;
use crate::Vec3;

/// Working memory of the sweeps.
#[derive(Clone, Debug, Default)]
pub(super) struct Work {
    pub(super) nearness: Nearness,
    pub(super) exact: Exact,
    /// How fast each place closes (m/s), and did before a sweep.
    pub(super) closing: Vec<Vec3>,
    pub(super) before: Vec<Vec3>,
}

impl Work {
    /// With room for so many places.
    pub(super) fn with_room(places: usize) -> Self {
        let list = || Vec::with_capacity(places);
        Self { nearness: Nearness::with_room(places), exact: Exact::default(), closing: list(), before: list() }
    }
}
