//! The surroundings of a patch in few states: how its ring answers to forces.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::reduced::Reduced;

/// The surroundings of one patch, linear around rest, in few states.
///
/// The answers to forces on the ring span the leading left singular vectors of `[Z_0/|Z_0|, Z_1/|Z_1|, Z_2/|Z_2|]`,
/// Z_0 = A^-1 B the answers to unit forces on the ring, Z_(i+1) = A^-1 M Z_i, A = s0^2 M - s0 C - K of what does not
/// depend on the patch, at rest: moment matching at a real frequency (Grimme 1997) with a singular value truncation. It
/// depends on patch, material and topology, not on time.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    pub(super) patch: Vec<u32>,
    pub(crate) answers: Reduced,
}

impl Basis {
    /// The states that are enough on random scenes: with 150 errors are up to twice as large, and with 350 a tick is a fifth dearer.
    pub const DEFAULT_STATES: usize = 250;

    /// Ids of the patch nodes, in increasing order.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn patch(&self) -> &[u32] {
        &self.patch
    }

    /// Of a `patch` around which nothing can move.
    pub(super) fn of_nothing(patch: &[u32]) -> Self {
        Self { patch: patch.to_vec(), answers: Reduced::of_nothing() }
    }

    /// The same for another `patch` (ids in increasing order) whose surroundings look the same.
    pub(super) fn moved_to(&self, patch: &[u32]) -> Self {
        Self { patch: patch.to_vec(), ..self.clone() }
    }

    /// The number of states in which the ring answers.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn states(&self) -> usize {
        self.answers.states()
    }
}

/// A collection of bases, by patch.
#[derive(Clone, Debug, Default)]
pub struct Bases {
    /// In the order of the patches: of two that serve as well, every run takes the same.
    of: BTreeMap<Vec<u32>, Arc<Basis>>,
}

impl Bases {
    /// The basis for `patch` (ids in increasing order), if there is one.
    ///
    /// # Real-time
    /// Bounded, by the patch; does not allocate.
    pub fn get(&self, patch: &[u32]) -> Option<&Arc<Basis>> {
        self.of.get(patch)
    }

    /// All bases, in the order of their patches.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<Basis>> {
        self.of.values()
    }

    /// Adds a basis, in place of one for the same patch.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn insert(&mut self, basis: Arc<Basis>) {
        self.of.insert(basis.patch.clone(), basis);
    }

    /// Keeps the bases that are to `stay`.
    ///
    /// # Real-time
    /// Not real-time safe: frees memory.
    pub fn retain(&mut self, mut stay: impl FnMut(&Basis) -> bool) {
        self.of.retain(|_, basis| stay(basis));
    }

    /// The number of bases.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn len(&self) -> usize {
        self.of.len()
    }

    /// True if there is no basis.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }
}
