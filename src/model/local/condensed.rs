//! `condensed`: a linear patch in surroundings that yield as they do at rest, at once.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::DMatrix;

use super::super::surroundings::Condensation;
use super::Kind;
use super::linear::{Boundary, LinearPatch, LinearSpec};

/// As [`Patch`](super::Patch), but with the surroundings' compliance at rest in its stiffness: K_LL + K_LB (-K_BB)^-1 K_BL,
/// the Schur complement of the nodes outside. Static: the surroundings have no inertia and no damping of their own. The
/// geometry must not be fed back: the global model would give way a second time.
pub type Condensed = LinearPatch<Yielding>;

/// Windows whose matrices are kept, by their size (numbers).
const KEPT: usize = 4 << 20;

/// Surroundings that give way; copies share what has been computed.
#[derive(Clone, Debug)]
pub struct Yielding {
    shared: Arc<Mutex<Windows>>,
}

#[derive(Debug)]
struct Windows {
    surroundings: Condensation,
    /// Oldest first.
    known: Vec<(Vec<u32>, Arc<DMatrix<f64>>)>,
}

impl Yielding {
    /// The given surroundings.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(surroundings: Condensation) -> Self {
        Self { shared: Arc::new(Mutex::new(Windows { surroundings, known: Vec::new() })) }
    }
}

impl Boundary for Yielding {
    const KIND: Kind = Kind::Condensed;

    fn compliance(&mut self, nodes: &[u32]) -> Option<Arc<DMatrix<f64>>> {
        let mut windows = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = windows.known.iter().find(|(of, _)| of == nodes) {
            return Some(Arc::clone(known));
        }
        let found = Arc::new(windows.surroundings.compliance(nodes)?);
        windows.known.push((nodes.to_vec(), Arc::clone(&found)));
        while windows.known.len() > 1 && windows.known.iter().map(|(_, matrix)| matrix.len()).sum::<usize>() > KEPT {
            windows.known.remove(0);
        }
        Some(found)
    }
}

impl Condensed {
    /// An empty patch in `boundary`.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](super::LocalModel::rebuild).
    pub fn new(spec: LinearSpec, boundary: Yielding) -> Self {
        Self::with_boundary(spec, boundary)
    }
}
