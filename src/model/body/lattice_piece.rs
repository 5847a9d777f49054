//! The forces of some of a lattice's springs, by nodes in any order.

use super::State;
use super::kernel::{LANES, LatticeKernel};
use super::lattice_springs::LatticeSprings;
use crate::Vec3;

/// How many springs of a list take as long as one of a lattice, there or not (`cargo bench --bench spring_kernel`).
const QUICKER: usize = 2;

/// Springs of a lattice and some of its nodes. The rest of the nodes stay where they are at rest: no spring is there.
#[derive(Clone, Debug)]
pub(super) struct LatticePiece {
    springs: LatticeSprings,
    kernel: LatticeKernel,
    /// Where in the lattice each of the nodes is.
    places: Vec<u32>,
    /// Of all nodes of the lattice.
    state: State,
    forces: Vec<Vec3>,
}

impl LatticePiece {
    /// The nodes at `places` of a lattice with these `springs`, which is at `rest` (m); none if the lattice is so empty that a list of
    /// its springs is quicker.
    pub(super) fn new(springs: LatticeSprings, places: Vec<u32>, rest: &[Vec3]) -> Option<Self> {
        let lanes = LANES * springs.directions();
        (lanes <= QUICKER * springs.len()).then(|| Self {
            kernel: LatticeKernel::new(&springs),
            springs,
            places,
            state: State::at_rest(rest),
            forces: vec![Vec3::zeros(); rest.len()],
        })
    }

    /// Writes the spring force on every node to `out`.
    pub(super) fn forces(&mut self, positions: &[Vec3], velocities: &[Vec3], out: &mut [Vec3]) {
        let Self { springs, kernel, places, state, forces } = self;
        for ((&place, x), v) in places.iter().zip(positions).zip(velocities) {
            (state.positions[place as usize], state.velocities[place as usize]) = (*x, *v);
        }
        kernel.forces(springs, &state.positions, &state.velocities, forces);
        for (&place, force) in places.iter().zip(out) {
            *force = forces[place as usize];
        }
    }
}
