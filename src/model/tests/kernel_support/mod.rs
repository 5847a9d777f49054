//! What the tests of spring forces share: the forces of springs one by one, and how near a body's own must be to them.

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, InstructionSet, Spring, State};
use proptest::prelude::*;

/// The instruction sets of this machine.
pub fn sets() -> impl Iterator<Item = InstructionSet> {
    InstructionSet::ALL.into_iter().filter(|set| set.is_available())
}

/// Deformed and moving, the same each time.
pub fn deformed(block: &Block) -> State {
    let mut state = State::at_rest(block.rest());
    for (n, x) in state.positions.iter_mut().enumerate() {
        let phase = n as f64;
        *x += Vec3::new(phase.sin(), (2.0 * phase).cos(), (3.0 * phase).sin()) * 2e-3;
        state.velocities[n] = *x * 3.0;
    }
    state
}

/// The forces of `springs` one by one, and for each node the sum of the magnitudes that went into it: rounding is a
/// share of those.
pub fn one_by_one(springs: &[(u32, u32, Spring)], state: &State) -> (Vec<Vec3>, Vec<f64>) {
    let nodes = state.positions.len();
    let (mut forces, mut sizes) = (vec![Vec3::zeros(); nodes], vec![0.0; nodes]);
    for &(i, j, spring) in springs {
        let (i, j) = (i as usize, j as usize);
        let along = state.positions[j] - state.positions[i];
        let closing = state.velocities[j] - state.velocities[i];
        let force = spring.force(along, closing);
        forces[i] += force;
        forces[j] -= force;
        // k L and k L0 cancel, and so may the terms of u . closing.
        let terms = spring.stiffness * (along.norm() + spring.rest_length) + spring.damping * closing.norm();
        sizes[i] += terms;
        sizes[j] += terms;
    }
    (forces, sizes)
}

/// The body's own.
pub fn forces(body: &mut dyn Body, state: &State) -> Vec<Vec3> {
    let mut forces = vec![Vec3::from_element(f64::NAN); state.positions.len()];
    body.forces(state, &mut forces);
    forces
}

/// Up to rounding.
pub fn agree(what: &str, got: &[Vec3], expected: &(Vec<Vec3>, Vec<f64>)) -> Result<(), TestCaseError> {
    for (n, (got, (expected, size))) in got.iter().zip(expected.0.iter().zip(&expected.1)).enumerate() {
        let off = (got - expected).norm();
        prop_assert!(off <= 2e-14 * size, "{what}, node {n}: {got:?} and {expected:?}, {off:e} of {size:e}");
    }
    Ok(())
}
