//! The reduced surroundings that a global model asks for.

use super::basis::Wishes;
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;

/// Collects the patches whose bases are missing.
pub(super) struct WishList<'a> {
    pub(super) simulation: &'a Simulation,
    /// The tool that the patches are for.
    pub(super) index: usize,
    pub(super) bases: &'a Bases,
    pub(super) wishes: &'a mut Wishes,
}

impl WishList<'_> {
    fn patch(&self, triangles: &[u32], size: [usize; 3]) -> Vec<u32> {
        let mut patch = Vec::new();
        self.simulation.patch(self.index, triangles, size, &mut patch);
        patch
    }

    /// True if there is a basis for the patch around `triangles`, or for one that holds it.
    pub(super) fn is_covered(&self, triangles: &[u32], size: [usize; 3]) -> bool {
        self.bases.around(&self.patch(triangles, size)).is_some()
    }

    pub(super) fn wish(&mut self, triangles: &[u32], size: [usize; 3]) {
        let patch = self.patch(triangles, size);
        if self.bases.get(&patch).is_none() && !self.wishes.patches.contains(&patch) {
            self.wishes.patches.push(patch);
        }
    }
}
