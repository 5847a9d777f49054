//! What makes four local models of a linear patch: how its surroundings answer between two resyncs.

use std::sync::{Arc, Mutex, PoisonError};

use super::super::kind::Kind;
use crate::Vec3;
use crate::body::Body;
use crate::linear_algebra::Matrix;
use crate::surroundings::Condensation;

/// Numbers in the matrices of windows that are kept.
const KEPT: usize = 4 << 20;

/// The surroundings of a linear patch.
#[derive(Clone, Debug)]
pub(crate) enum Boundary {
    /// `patch`: they stand still (paper, section 2.3).
    Still,
    /// `linear_boundary`: they go on with their velocity at the resync, x_B = x_B0 + t v_B, for so many haptic ticks, one
    /// period of the global model; then they stand still. Without that end a late global model would let them run away.
    Drifting { ticks: u32 },
    /// `scaled_boundary`: they are layers of springs.
    Layered(Layers),
    /// `condensed`: they yield as they do at rest, at once.
    Yielding(Yielding),
}

impl Boundary {
    pub(super) fn kind(&self) -> Kind {
        match self {
            Self::Still => Kind::Patch,
            Self::Drifting { .. } => Kind::LinearBoundary,
            Self::Layered(_) => Kind::ScaledBoundary,
            Self::Yielding(_) => Kind::Condensed,
        }
    }

    /// How much of the coupling of patch node `row` to the outside node `column` of `body` answers to the patch's motion.
    pub(super) fn share(&self, body: &dyn Body, row: u32, column: u32) -> f64 {
        let Self::Layered(layers) = self else { return 1.0 };
        let (from, to) = (body.rest()[row as usize], body.rest()[column as usize]);
        1.0 / layers.between(&from, &(to - from))
    }

    /// What is added to the stiffness of the patch of `nodes` (N/m, 3n x 3n). May allocate, and may block until another model
    /// has found the same.
    pub(super) fn compliance(&self, nodes: &[u32]) -> Option<Arc<Matrix>> {
        if let Self::Yielding(yielding) = self { yielding.compliance(nodes) } else { None }
    }

    /// True if they answer to the patch's motion within a period.
    pub(super) fn gives_way(&self) -> bool {
        matches!(self, Self::Layered(_) | Self::Yielding(_))
    }

    /// Haptic ticks for which outside nodes move on with their velocity at the resync.
    pub(super) fn moving_ticks(&self) -> u32 {
        if let Self::Drifting { ticks } = *self { ticks } else { 0 }
    }
}

/// Springs to the outside answer to the patch's motion with k/n and b/n: the paper scales them by depth (section 6) and does
/// not say how, and n equal springs in a row, of which the far end is held, have the stiffness k/n. Here n is the number of
/// springs that fit between the patch node and the body's end, in the direction of the spring. The force at the resync is not
/// changed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layers {
    /// Corners of the box around the body at rest (m).
    low: Vec3,
    high: Vec3,
}

impl Layers {
    pub(crate) fn new(body: &dyn Body) -> Self {
        let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = body.rest().iter().fold(none, |(low, high), x| (low.inf(x), high.sup(x)));
        Self { low, high }
    }

    /// How many times `along` (m) fits between `from` and the side of the box that it points to; at least once.
    fn between(&self, from: &Vec3, along: &Vec3) -> f64 {
        let until_side = (0..3).filter(|&axis| along[axis] != 0.0).map(|axis| {
            let side = if along[axis] > 0.0 { self.high[axis] } else { self.low[axis] };
            (side - from[axis]) / along[axis]
        });
        let layers = until_side.fold(f64::INFINITY, f64::min).round();
        if layers.is_finite() { layers.max(1.0) } else { 1.0 }
    }
}

/// The surroundings' compliance at rest comes into the patch's stiffness: K_LL + K_LB (-K_BB)^-1 K_BL, the Schur complement of
/// the nodes outside. Static: the surroundings have no inertia and no damping of their own. The geometry must not be fed
/// back: the global model would give way a second time. Copies share what has been computed.
#[derive(Clone, Debug)]
pub(crate) struct Yielding(Arc<Mutex<Windows>>);

#[derive(Debug)]
struct Windows {
    surroundings: Condensation,
    /// Oldest first.
    known: Vec<(Vec<u32>, Arc<Matrix>)>,
}

impl Yielding {
    pub(crate) fn new(surroundings: Condensation) -> Self {
        Self(Arc::new(Mutex::new(Windows { surroundings, known: Vec::new() })))
    }

    fn compliance(&self, nodes: &[u32]) -> Option<Arc<Matrix>> {
        let mut windows = self.0.lock().unwrap_or_else(PoisonError::into_inner);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_counted_along_the_spring() {
        let body = Layers { low: Vec3::zeros(), high: Vec3::new(11.0, 11.0, 11.0) };
        let top = Vec3::new(5.0, 5.0, 10.0);
        assert_eq!(body.between(&top, &-Vec3::z()), 10.0);
        assert_eq!(body.between(&top, &Vec3::new(1.0, 0.0, -1.0)), 6.0);
        assert_eq!(body.between(&top, &Vec3::new(-1.0, 0.0, 0.0)), 5.0);
        assert_eq!(body.between(&top, &Vec3::new(0.0, 1.0, 1.0)), 1.0);
        assert_eq!(body.between(&top, &Vec3::zeros()), 1.0);
    }
}
