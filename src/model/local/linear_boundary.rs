//! `linear_boundary`: a linear patch whose surroundings move on as they moved at the resync.

use super::Kind;
use super::linear::{Boundary, LinearPatch, LinearSpec};

/// As [`Patch`](super::Patch), but the nodes outside go on with their velocity at the resync, x_B = x_B0 + t v_B, for one
/// period of the global model; then they stand still. Without that end a late global model would let them run away.
pub type LinearBoundary = LinearPatch<Drifting>;

/// Surroundings that move on for a while.
#[derive(Clone, Copy, Debug)]
pub struct Drifting {
    ticks: u32,
}

impl Boundary for Drifting {
    const KIND: Kind = Kind::LinearBoundary;

    fn moving_ticks(&self) -> u32 {
        self.ticks
    }
}

impl LinearBoundary {
    /// An empty patch; its surroundings move on for `ticks` haptic ticks after each resync.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](super::LocalModel::rebuild).
    pub fn new(spec: LinearSpec, ticks: u32) -> Self {
        Self::with_boundary(spec, Drifting { ticks })
    }
}
