//! `patch`: the paper's local model, a linear patch around the tool in surroundings that stand still.

use super::Kind;
use super::linear::{Boundary, LinearPatch, LinearSpec};

/// The nodes around the contact, with their tangent at the resync; every other node stands still (paper, section 2.3).
pub type Patch = LinearPatch<Still>;

/// Surroundings that stand still.
#[derive(Clone, Copy, Debug, Default)]
pub struct Still;

impl Boundary for Still {
    const KIND: Kind = Kind::Patch;
}

impl Patch {
    /// An empty patch.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](super::LocalModel::rebuild).
    pub fn new(spec: LinearSpec) -> Self {
        Self::with_boundary(spec, Still)
    }
}
