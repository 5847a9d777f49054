//! The forces of some of a lattice's springs, by nodes in any order.

use super::State;
use super::kernel::{LANES, LatticeKernel};
use super::lattice_springs::LatticeSprings;
use crate::Vec3;

/// So many places for a spring in a lattice, with one or without, take as long as a spring of a list (`cargo bench --bench spring_kernel`).
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

#[cfg(test)]
mod tests {
    use super::super::lattice_springs::LatticeSprings;
    use super::super::region::Material;
    use super::super::{Block, Body, Region, Shape};
    use super::*;
    use crate::mesh::Lattice;

    /// A block with a nodule, and a state of it in which no spring is as long as at rest and none at rest.
    fn moving() -> (Block, State) {
        let nodule = Region::new(Shape::Sphere { centre: [0.03; 3], radius: 0.02 }).stiffness(90.0);
        let block = Block::builder([9, 8, 7], [0.08, 0.07, 0.06]).region(nodule).build().unwrap();
        let noise = |n: usize, k: usize| Vec3::from_fn(|axis, _| (1.7 * (3 * n + axis + k) as f64).sin());
        let places = block.rest().iter().enumerate().map(|(n, x)| x + noise(n, 0) * 1e-3).collect();
        let state = State { positions: places, velocities: (0..block.rest().len()).map(|n| noise(n, 5)).collect() };
        (block, state)
    }

    #[test]
    fn nodes_feel_in_a_part_what_they_feel_in_the_body() {
        let (mut block, state) = moving();
        let lattice = block.lattice();
        let mut whole = vec![Vec3::zeros(); block.rest().len()];
        block.forces(&state, &mut whole);
        let is_in_window = |&node: &u32| lattice.coordinates(node).iter().all(|c| (2..6).contains(c));
        let window: Vec<u32> = (0..whole.len() as u32).filter(is_in_window).collect();
        let all: Vec<u32> = (0..whole.len() as u32).collect();
        let scattered: Vec<u32> = (0..whole.len() as u32).step_by(97).collect();
        for asked in [window, all, scattered] {
            let mut part = block.restriction(&asked).unwrap();
            let pick = |vectors: &[Vec3]| part.nodes.iter().map(|&node| vectors[node as usize]).collect();
            let state = State { positions: pick(&state.positions), velocities: pick(&state.velocities) };
            let mut forces = vec![Vec3::zeros(); part.nodes.len()];
            part.body.forces(&state, &mut forces);
            for (node, force) in asked.iter().zip(&forces) {
                let expected = whole[*node as usize];
                assert!((force - expected).norm() < 1e-12 * expected.norm(), "{node}: {force} and {expected}");
            }
            // What they pull at pulls back.
            assert!(forces.iter().sum::<Vec3>().norm() < 1e-12);
        }
    }

    #[test]
    fn a_lattice_of_few_springs_is_left_to_a_list() {
        let lattice = Lattice { nodes: [9, 8, 7] };
        let material = Material { stiffness: 30.0, damping_ratio: 0.3, node_mass: 1e-3 };
        let rest = vec![Vec3::zeros(); lattice.len()];
        let piece = |wanted: fn(usize) -> bool| {
            let mut springs = LatticeSprings::new(&lattice, [0.01; 3], &vec![material; lattice.len()]);
            springs.retain(wanted);
            LatticePiece::new(springs, Vec::new(), &rest)
        };
        assert!(piece(|_| true).is_some() && piece(|node| node % 97 == 0).is_none());
    }
}
