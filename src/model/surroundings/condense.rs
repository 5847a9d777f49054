//! Static condensation: what the surroundings of a patch yield when it is pushed.

use std::collections::HashMap;
use std::sync::Arc;

use super::resting::RestingBody;
use crate::error::ModelError;
use crate::linear_algebra::{Matrix, SparseFactor, push_block};

/// The stiffness of a whole body at rest, factorised once for every patch.
///
/// With A = -K over all nodes that can move, the Schur complement of a patch L is S = ((A^-1)_LL)^-1: a solution for each of
/// its coordinates, in place of a factorisation of its surroundings.
#[derive(Debug)]
pub struct Condensation {
    factor: SparseFactor,
    /// Place of each node among those that can move.
    places: Vec<Option<usize>>,
    movable: usize,
    body: Arc<RestingBody>,
}

impl Condensation {
    /// Factorises `body`.
    ///
    /// # Errors
    /// If nothing holds the body: pushed, it would drift away.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and factorises a sparse matrix of three rows per node.
    pub fn new(body: Arc<RestingBody>) -> Result<Self, ModelError> {
        let is_movable = |&node: &usize| body.inverse_masses()[node] > 0.0;
        let mut places = vec![None; body.rest().len()];
        (0..places.len()).filter(is_movable).enumerate().for_each(|(place, node)| places[node] = Some(place));
        let movable = places.iter().flatten().count();
        let mut entries = Vec::with_capacity(9 * body.couplings().len());
        for ((row, column), coupling) in body.couplings() {
            // Nodes that can move have a place, in the same order.
            if let (Some(row), Some(column)) = (places[*row as usize], places[*column as usize]) {
                push_block(&mut entries, 3 * row, 3 * column, &coupling.stiffness);
            }
        }
        let factor = Some(&places)
            .filter(|places| places.contains(&None))
            .and_then(|_| SparseFactor::new(3 * movable, &entries, None));
        match factor {
            Some(factor) => Ok(Self { factor, places, movable, body }),
            None => {
                let message = "\"condensed\" needs a body that is held, set what is fixed or use another model";
                Err(ModelError::of("local.model", message))
            }
        }
    }

    /// K_LB (-K_BB)^-1 K_BL (N/m, 3n x 3n) of the patch L of `nodes`, all of them movable, B all others: what is to be added
    /// to the stiffness K_LL of a patch between held surroundings. `None` if the numbers do not allow it.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and solves a sparse system for each coordinate of the patch.
    pub fn compliance(&self, nodes: &[u32]) -> Option<Matrix> {
        let (n, rows) = (3 * nodes.len(), 3 * self.movable);
        let places = nodes.iter().map(|&node| self.places[node as usize]).collect::<Option<Vec<_>>>()?;
        let row = |coordinate: usize| 3 * places[coordinate / 3] + coordinate % 3;
        let units = Matrix::from_fn(rows, n, |r, column| f64::from(r == row(column)));
        let inverse = self.factor.solve(units).select_rows(&(0..n).map(row).collect::<Vec<_>>());
        // Symmetric but for rounding, which the patch is not to have.
        let schur = inverse.try_inverse().map(|schur| (&schur + schur.transpose()) * 0.5)?;
        let added = self.held(nodes) - schur;
        added.iter().all(|entry| entry.is_finite()).then_some(added)
    }

    /// A_LL: the stiffness of the patch while all others are held.
    fn held(&self, nodes: &[u32]) -> Matrix {
        let mut held = Matrix::zeros(3 * nodes.len(), 3 * nodes.len());
        let place: HashMap<u32, usize> = nodes.iter().copied().zip((0..).step_by(3)).collect();
        for ((row, column), coupling) in self.body.couplings() {
            if let (Some(&row), Some(&column)) = (place.get(row), place.get(column)) {
                held.fixed_view_mut::<3, 3>(row, column).copy_from(&coupling.stiffness);
                held.fixed_view_mut::<3, 3>(column, row).copy_from(&coupling.stiffness.transpose());
            }
        }
        held
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::body::{Block, Body, State};
    use crate::equilibrium::static_equilibrium;
    use crate::linear::patch_of;
    use crate::mesh::Face;

    #[test]
    fn a_patch_with_its_condensed_surroundings_yields_as_the_whole_body_does() {
        let mut block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let (nodes, _) = patch_of(&block, &State::at_rest(block.rest()));
        let condensation = Condensation::new(RestingBody::new(&block).unwrap().into()).unwrap();
        let schur = condensation.held(&nodes) - condensation.compliance(&nodes).unwrap();

        // A small pull: the force on the pulled node of the whole body, and of the patch whose other nodes are free.
        let pulled = nodes[nodes.len() - 6];
        let way = Vec3::new(1e-6, -2e-6, 3e-6);
        let target = block.rest()[pulled as usize] + way;
        let state = static_equilibrium(&mut block, &[(pulled, target)]).unwrap();
        let mut forces = vec![Vec3::zeros(); block.rest().len()];
        block.forces(&state, &mut forces);
        let moved = nodes.iter().map(|&node| state.positions[node as usize] - block.rest()[node as usize]);
        let moved = nalgebra::DVector::from_iterator(3 * nodes.len(), moved.flat_map(|x| [x.x, x.y, x.z]));
        let answer = schur * moved;
        let largest = forces[pulled as usize].norm();
        for (place, &node) in nodes.iter().enumerate() {
            let force = Vec3::new(answer[3 * place], answer[3 * place + 1], answer[3 * place + 2]);
            let expected = if node == pulled { -forces[pulled as usize] } else { Vec3::zeros() };
            assert!((force - expected).norm() < 1e-3 * largest, "node {node}: {force} {expected}");
        }
    }

    #[test]
    fn a_body_that_floats_is_refused() {
        let block = Block::builder([3; 3], [0.05; 3]).build().unwrap();
        let error = Condensation::new(RestingBody::new(&block).unwrap().into()).unwrap_err().to_string();
        assert!(error.contains("held"), "{error}");
    }
}
