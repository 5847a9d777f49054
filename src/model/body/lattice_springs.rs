//! The springs of a lattice, by forward offset and lower node.

use super::super::mesh::Lattice;
use super::kernel::LANES;
use super::spring::Spring;

/// All springs in one direction: from node p to p + `delta`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offset {
    pub(super) delta: usize,
    pub(super) rest_length: f64,
}

/// Springs of one stiffness and damping to all 26 neighbours of every node.
#[derive(Clone, Debug)]
pub(super) struct LatticeSprings {
    nodes: usize,
    stiffness: f64,
    damping: f64,
    offsets: [Offset; 13],
    /// For every eight nodes p and every offset, whose bit n says that the spring from p + n is there: where the
    /// lattice ends there is none.
    exist: Vec<[u8; 13]>,
}

impl LatticeSprings {
    /// Equal springs everywhere; `spacing` between nodes (m), `stiffness` (N/m), `damping` (N s/m).
    pub(super) fn uniform(lattice: &Lattice, spacing: [f64; 3], stiffness: f64, damping: f64) -> Self {
        let nodes = lattice.len();
        let [nx, ny, _] = lattice.nodes.map(|n| n as isize);
        let offsets = Lattice::FORWARD.map(|offset| {
            let along: [f64; 3] = std::array::from_fn(|axis| offset[axis] as f64 * spacing[axis]);
            Offset {
                delta: (offset[0] + nx * (offset[1] + ny * offset[2])) as usize,
                rest_length: along.iter().map(|c| c * c).sum::<f64>().sqrt(),
            }
        });
        let mut exist = vec![[0; 13]; nodes.div_ceil(LANES)];
        for p in 0..nodes {
            let at = lattice.coordinates(p as u32);
            for (bits, &offset) in exist[p / LANES].iter_mut().zip(&Lattice::FORWARD) {
                *bits |= u8::from(lattice.neighbour(at, offset).is_some()) << (p % LANES);
            }
        }
        Self { nodes, stiffness, damping, offsets, exist }
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.nodes
    }

    /// How far the nodes of a spring are apart at most, in the numbering.
    pub(super) fn reach(&self) -> usize {
        self.offsets.iter().map(|offset| offset.delta).max().unwrap_or(0)
    }

    /// Stiffness k (N/m) of every spring.
    pub(super) fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Damping b (N s/m) of every spring.
    pub(super) fn damping(&self) -> f64 {
        self.damping
    }

    pub(super) fn offsets(&self) -> &[Offset; 13] {
        &self.offsets
    }

    /// Which springs are there, for every eight nodes.
    pub(super) fn exist(&self) -> &[[u8; 13]] {
        &self.exist
    }

    /// Number of springs.
    pub(super) fn len(&self) -> usize {
        self.exist.iter().flatten().map(|bits| bits.count_ones() as usize).sum()
    }

    /// The neighbours of `node` and the springs that lead to them.
    pub(super) fn neighbours(&self, lattice: &Lattice, node: u32) -> impl Iterator<Item = (u32, Spring)> {
        let at = lattice.coordinates(node);
        let (lattice, stiffness, damping) = (*lattice, self.stiffness, self.damping);
        Lattice::FORWARD.iter().zip(&self.offsets).flat_map(move |(&direction, offset)| {
            let spring = Spring { stiffness, damping, rest_length: offset.rest_length };
            let forward = lattice.neighbour(at, direction);
            let backward = lattice.neighbour(at, direction.map(|c| -c));
            [forward, backward].into_iter().flatten().map(move |to| (lattice.id(to), spring))
        })
    }
}
