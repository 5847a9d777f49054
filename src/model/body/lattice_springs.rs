//! The springs of a lattice, by forward offset and lower node.

use super::super::mesh::Lattice;
use super::spring::Spring;

/// Nodes that the force kernel takes at once; arrays are padded to whole blocks of them.
pub(super) const LANES: usize = 8;

/// All springs in one direction: `stiffness[p]` and `damping[p]` belong to the spring from node p to p + delta and are
/// zero where the lattice has no such spring.
#[derive(Clone, Debug)]
pub(super) struct Offset {
    pub(super) delta: usize,
    pub(super) rest_length: f64,
    pub(super) stiffness: Vec<f64>,
    pub(super) damping: Vec<f64>,
}

/// The springs to all 26 neighbours of every node.
#[derive(Clone, Debug)]
pub(super) struct LatticeSprings {
    nodes: usize,
    offsets: Vec<Offset>,
}

impl LatticeSprings {
    /// Equal springs everywhere; `spacing` between nodes (m), `stiffness` (N/m), `damping` (N s/m).
    pub(super) fn uniform(lattice: &Lattice, spacing: [f64; 3], stiffness: f64, damping: f64) -> Self {
        let nodes = lattice.len();
        let blocks = nodes.next_multiple_of(LANES);
        let offsets = Lattice::FORWARD
            .iter()
            .map(|&offset| {
                let [nx, ny, _] = lattice.nodes.map(|n| n as isize);
                let delta = offset[0] + nx * (offset[1] + ny * offset[2]);
                let along: [f64; 3] = std::array::from_fn(|axis| offset[axis] as f64 * spacing[axis]);
                let exists = |p: &usize| lattice.neighbour(lattice.coordinates(*p as u32), offset).is_some();
                let mut springs = Offset {
                    delta: delta as usize,
                    rest_length: along.iter().map(|c| c * c).sum::<f64>().sqrt(),
                    stiffness: vec![0.0; blocks],
                    damping: vec![0.0; blocks],
                };
                for p in (0..nodes).filter(exists) {
                    springs.stiffness[p] = stiffness;
                    springs.damping[p] = damping;
                }
                springs
            })
            .collect();
        Self { nodes, offsets }
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.nodes
    }

    /// Length that coordinate arrays need so that no block of the kernel reads past the end.
    pub(super) fn padded(&self) -> usize {
        let reach = self.offsets.iter().map(|offset| offset.delta).max().unwrap_or(0);
        self.nodes.next_multiple_of(LANES) + reach + LANES
    }

    pub(super) fn offsets(&self) -> &[Offset] {
        &self.offsets
    }

    /// Number of springs.
    pub(super) fn len(&self) -> usize {
        self.offsets.iter().map(|offset| offset.stiffness.iter().filter(|&&k| k > 0.0).count()).sum()
    }

    /// The neighbours of `node` and the springs that lead to them.
    pub(super) fn neighbours(&self, lattice: &Lattice, node: u32) -> impl Iterator<Item = (u32, Spring)> {
        let at = lattice.coordinates(node);
        let (lattice, node) = (*lattice, node as usize);
        Lattice::FORWARD.iter().zip(&self.offsets).flat_map(move |(&direction, springs)| {
            let forward = lattice.neighbour(at, direction).map(|to| (lattice.id(to), node));
            let backward =
                lattice.neighbour(at, direction.map(|c| -c)).map(|to| (lattice.id(to), lattice.id(to) as usize));
            [forward, backward].into_iter().flatten().map(move |(other, lower)| {
                let spring = Spring {
                    stiffness: springs.stiffness[lower],
                    damping: springs.damping[lower],
                    rest_length: springs.rest_length,
                };
                (other, spring)
            })
        })
    }
}
