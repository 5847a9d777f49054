//! A patch and what of the body depends on it, linear around rest.

use super::coupling::couplings;
use crate::body::Restriction;
use crate::linear_algebra::Matrix;

/// At most so many nodes of a patch are pressed.
const CONTACTS: usize = 12;

/// Mass, damping and stiffness (all positive) of the patch's movable coordinates, then of the ring's; the ring without its
/// mass, which belongs to the surroundings.
#[derive(Debug)]
pub(super) struct Near {
    pub(super) mass: Matrix,
    pub(super) damping: Matrix,
    pub(super) stiffness: Matrix,
    /// Coordinates of the patch.
    pub(super) patch: usize,
    /// The nodes that a tool presses: those of the patch with the least stiffness towards the ring, as a
    /// window leaves a node to spare around the tool.
    pub(super) pressed: Vec<Pressed>,
}

/// A node of the patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    /// Its id.
    pub(super) node: u32,
    /// The first of its coordinates.
    pub(super) coordinate: usize,
}

impl Near {
    /// The `restriction` of a body to a patch of so many nodes.
    pub(super) fn new(restriction: &Restriction, patch: usize) -> Self {
        let Restriction { nodes, body } = restriction;
        let inverse_masses = body.inverse_masses();
        let is_movable = |node: &usize| inverse_masses[*node] > 0.0;
        let movable: Vec<usize> = (0..patch).filter(is_movable).collect();
        let ring = (patch..nodes.len()).filter(is_movable);
        let mut place = vec![None; nodes.len()];
        movable.iter().copied().chain(ring).enumerate().for_each(|(at, node)| place[node] = Some(3 * at));
        let (on_patch, total) = (3 * movable.len(), 3 * place.iter().flatten().count());
        let [mut mass, mut damping, mut stiffness] = [0; 3].map(|_| Matrix::zeros(total, total));
        let mut outward = vec![0.0; movable.len()];
        for (at, &node) in movable.iter().enumerate() {
            (0..3).for_each(|axis| mass[(3 * at + axis, 3 * at + axis)] = 1.0 / inverse_masses[node]);
        }
        for ((row, column), coupling) in couplings(&**body) {
            let (Some(row), Some(column)) = (place[row as usize], place[column as usize]) else { continue };
            for (matrix, block) in [(&mut stiffness, coupling.stiffness), (&mut damping, coupling.damping)] {
                matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
                matrix.fixed_view_mut::<3, 3>(column, row).copy_from(&block.transpose());
            }
            let (inner, outer) = (row.min(column), row.max(column));
            if inner < on_patch && outer >= on_patch {
                outward[inner / 3] += coupling.stiffness.norm();
            }
        }
        let least = outward.iter().copied().fold(f64::INFINITY, f64::min);
        let inner = (0..movable.len()).filter(|&at| outward[at] <= least * (1.0 + 1e-9));
        let pressed: Vec<Pressed> = inner.map(|at| Pressed { node: nodes[movable[at]], coordinate: 3 * at }).collect();
        let stride = pressed.len().div_ceil(CONTACTS).max(1);
        Self { mass, damping, stiffness, patch: on_patch, pressed: pressed.into_iter().step_by(stride).collect() }
    }

    /// `own` with the ring's coordinates replaced by states, which are `on_ring` there (a column each) and have `sign` times
    /// the matrix `far` of their own.
    pub(super) fn beside(&self, own: &Matrix, on_ring: &Matrix, far: &Matrix, sign: f64) -> Matrix {
        let (patch, ring, states) = (self.patch, on_ring.nrows(), on_ring.ncols());
        let mut all = Matrix::zeros(patch + states, patch + states);
        all.view_mut((0, 0), (patch, patch)).copy_from(&own.view((0, 0), (patch, patch)));
        all.view_mut((patch, 0), (states, patch)).copy_from(&on_ring.tr_mul(&own.view((patch, 0), (ring, patch))));
        let of_ring = on_ring.tr_mul(&(own.view((patch, patch), (ring, ring)) * on_ring));
        all.view_mut((patch, patch), (states, states)).copy_from(&(of_ring + far * sign));
        all
    }
}
