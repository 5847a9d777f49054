//! Static equilibrium of a deformed body, by Newton's method.

use super::Vec3;
use super::body::{Body, State};
use crate::error::ModelError;
use crate::linear_algebra::{Matrix, SparseFactor, dissection, push_block};

/// Residual force per node at which the equilibrium is reached, relative to the largest force in play.
const TOLERANCE: f64 = 1e-12;
const MAX_ITERATIONS: usize = 200;

/// The resting state of `body` with some nodes held at given positions (besides the body's own held nodes).
///
/// Newton with the true tangent, or with the clamped one (always positive definite for an anchored body) where the
/// true one is not positive definite; the step is halved until the residual falls.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Block, Body};
/// use palpate_model::equilibrium::static_equilibrium;
/// use palpate_model::mesh::Face;
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let mut block = Block::builder([5; 3], [0.04; 3]).fix(Face::ZMin).build()?;
/// let node = block.lattice().id([2, 2, 4]);
/// let pulled = block.rest()[node as usize] + Vec3::z() * 0.005;
/// let state = static_equilibrium(&mut block, &[(node, pulled)])?;
/// let below = block.lattice().id([2, 2, 3]) as usize;
/// assert!(state.positions[below].z > block.rest()[below].z, "its neighbours follow");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// If no equilibrium is found, for instance because nothing anchors the body.
///
/// # Real-time
/// Not real-time safe: allocates, and solves a linear system per iteration.
pub fn static_equilibrium(body: &mut dyn Body, held: &[(u32, Vec3)]) -> Result<State, ModelError> {
    let mut state = State::at_rest(body.rest());
    for &(node, position) in held {
        state.positions[node as usize] = position;
    }
    if state.positions == body.rest() {
        return Ok(state);
    }
    let is_held = |node: usize| held.iter().any(|&(other, _)| other as usize == node);
    let free: Vec<u32> = (0..body.rest().len())
        .filter(|&node| body.inverse_masses()[node] > 0.0 && !is_held(node))
        .map(|node| node as u32)
        .collect();
    let mut place = vec![usize::MAX; body.rest().len()];
    free.iter().enumerate().for_each(|(p, &node)| place[node as usize] = p);

    let order = elimination(body, &state, &free, &place);
    let mut forces = vec![Vec3::zeros(); place.len()];
    body.forces(&state, &mut forces);
    // The start is rest with held nodes displaced, so this is the scale of all forces.
    let scale = forces.iter().map(Vec3::norm).fold(0.0, f64::max);
    let residual = |forces: &[Vec3]| free.iter().map(|&n| forces[n as usize].norm()).fold(0.0, f64::max);
    for _ in 0..MAX_ITERATIONS {
        let before = residual(&forces);
        if before <= TOLERANCE * scale {
            return Ok(state);
        }
        let Some(step) = [false, true]
            .into_iter()
            .find_map(|clamp| newton_step(body, &state, &free, &place, &forces, (order.as_deref(), clamp)))
        else {
            break;
        };
        let start = state.clone();
        let accepted = (0..30).any(|halvings| {
            let share = 0.5_f64.powi(halvings);
            for (&node, step) in free.iter().zip(&step) {
                state.positions[node as usize] = start.positions[node as usize] + step * share;
            }
            body.forces(&state, &mut forces);
            residual(&forces) < before
        });
        if !accepted {
            // Rounding stops the descent just above the tolerance: good enough if far below anything felt.
            if before <= 1e3 * TOLERANCE * scale {
                return Ok(start);
            }
            break;
        }
    }
    let message = format!(
        "no static equilibrium found (residual {:.1e} N left): move the nodes less far, and hold the body somewhere",
        residual(&forces)
    );
    Err(ModelError::new(message).at("initial"))
}

/// An order of elimination of the `free` nodes with little fill, if their places give one.
fn elimination(body: &dyn Body, state: &State, free: &[u32], place: &[usize]) -> Option<Vec<usize>> {
    let points: Vec<Vec3> = free.iter().map(|&node| body.rest()[node as usize]).collect();
    let mut pairs = Vec::new();
    body.tangent(state, free, false, &mut |block| {
        let (row, column) = (place[block.row as usize], place[block.column as usize]);
        if column < row {
            pairs.push([row as u32, column as u32]);
        }
    });
    dissection(&points, pairs.iter().copied())
}

/// dx of K dx = f on the free nodes, K = -df/dx.
fn newton_step(
    body: &dyn Body,
    state: &State,
    free: &[u32],
    place: &[usize],
    forces: &[Vec3],
    (order, clamp): (Option<&[usize]>, bool),
) -> Option<Vec<Vec3>> {
    let mut entries = Vec::new();
    body.tangent(state, free, clamp, &mut |block| {
        let (row, column) = (place[block.row as usize], place[block.column as usize]);
        if column != usize::MAX {
            push_block(&mut entries, 3 * row, 3 * column, &-block.position);
        }
    });
    let right = Matrix::from_iterator(3 * free.len(), 1, free.iter().flat_map(|&node| &forces[node as usize]).copied());
    let x = SparseFactor::new(3 * free.len(), &entries, order)?.solve(right);
    let is_finite = x.iter().all(|x| x.is_finite());
    is_finite.then(|| x.as_slice().as_chunks::<3>().0.iter().map(|&step| Vec3::from(step)).collect())
}

#[cfg(test)]
mod tests {
    use super::super::body::Block;
    use super::super::mesh::Face;
    use super::*;

    #[test]
    fn a_body_that_is_held_at_rest_is_in_equilibrium() {
        let mut block = Block::builder([4; 3], [0.03; 3]).fix(Face::ZMin).build().unwrap();
        let held = [(60, block.rest()[60])];
        assert_eq!(static_equilibrium(&mut block, &held).unwrap().positions, block.rest());
    }

    #[test]
    fn a_pulled_block_is_in_equilibrium_and_its_reactions_balance() {
        let mut block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let node = block.lattice().id([2, 2, 5]);
        let pulled = block.rest()[node as usize] + Vec3::new(0.002, 0.0, 0.01);
        let state = static_equilibrium(&mut block, &[(node, pulled)]).unwrap();
        let mut forces = vec![Vec3::zeros(); block.rest().len()];
        block.forces(&state, &mut forces);
        let total = forces.iter().fold(Vec3::zeros(), |sum, force| sum + force);
        let pull = forces[node as usize];
        assert!(pull.z < -0.1, "the body pulls back: {pull}");
        assert!(total.norm() < 1e-12, "tool force and reactions cancel: {total}");
        for (n, force) in forces.iter().enumerate() {
            if block.inverse_masses()[n] > 0.0 && n != node as usize {
                assert!(force.norm() < 1e-11, "node {n}: {force}");
            }
        }
    }

    #[test]
    fn an_unanchored_body_has_no_equilibrium_but_an_error() {
        let mut block = Block::builder([3; 3], [0.05; 3]).build().unwrap();
        let error = static_equilibrium(&mut block, &[(0, Vec3::new(0.0, 0.0, -0.01))]);
        assert!(error.is_err() || error.is_ok_and(|state| state.is_finite()));
    }
}
