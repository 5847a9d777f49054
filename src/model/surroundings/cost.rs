//! What a basis costs, before it is made.

use super::reduction::{MOMENTS, Reduction};

/// Finding what is far from a patch, for each coupled pair of nodes (s).
const PREPARE_S: f64 = 1.5e-7;
/// Following a coarse grid, for each node that is beyond (s).
const BEYOND_S: f64 = 2e-5;
/// Factorising and solving, for each coupled pair of nodes and each unknown (s).
const FACTORISE_S: f64 = 3.5e-10;
/// Singular vectors and modes, for each unknown and each pair of states (s).
const SPAN_S: f64 = 1.25e-9;
/// Projecting, for each coupled pair of nodes and each state (s).
const PROJECT_S: f64 = 6e-8;

impl Reduction {
    /// The number of times that [`advance`](Self::advance) is called until the basis is there.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn parts(&self) -> usize {
        if self.is_known() {
            return 1;
        }
        1 + MOMENTS + 1
    }

    /// What the whole of it takes (s) on no machine in particular, for runs that must be the same on all of them: 0.55 to 1.1
    /// times that is what `cargo bench -p palpate-model --bench reduced_basis` measured on springs and tetrahedra of 8^3 to 24^3 nodes.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn nominal(&self) -> f64 {
        let (unknowns, pairs, states) = (self.far.unknowns() as f64, self.far.pairs() as f64, self.states as f64);
        let prepare = PREPARE_S * pairs;
        if self.is_known() {
            return prepare;
        }
        let beyond = BEYOND_S * self.beyond() as f64;
        prepare
            + beyond
            + FACTORISE_S * pairs * unknowns
            + SPAN_S * unknowns * states * states
            + PROJECT_S * pairs * states
    }
}
