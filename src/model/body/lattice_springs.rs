//! The springs of a lattice, by forward offset and lower node.

use std::collections::HashMap;

use super::kernel::{LANES, Lane};
use super::region::{Material, in_series};
use super::spring::Spring;
use crate::mesh::Lattice;

/// All springs in one direction: from node p to p + `delta`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offset {
    pub(super) delta: usize,
    pub(super) rest_length: f64,
}

/// Stiffness k (N/m) and damping b (N s/m) of the springs that begin at eight nodes, by offset.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coefficients {
    pub(super) stiffness: [Lane; 13],
    pub(super) damping: [Lane; 13],
}

/// Stiffness and damping of every spring.
#[derive(Clone, Debug)]
pub(super) enum Elasticity {
    /// The same for all.
    Uniform { stiffness: f64, damping: f64 },
    /// Of several materials.
    Varied {
        /// Each different set once: a body of few materials has few, which stay in the cache.
        sets: Vec<Coefficients>,
        /// For every eight nodes the number of its set.
        set_of: Vec<u32>,
    },
}

/// Springs to all 26 neighbours of every node.
#[derive(Clone, Debug)]
pub(super) struct LatticeSprings {
    /// Number of nodes.
    pub(super) nodes: usize,
    pub(super) elasticity: Elasticity,
    pub(super) offsets: [Offset; 13],
    /// For every eight nodes p and every offset, whose bit n says that the spring from p + n is there: where the
    /// lattice ends there is none.
    pub(super) exist: Vec<[u8; 13]>,
}

impl LatticeSprings {
    /// Springs of the `materials` of their nodes, half of each; `spacing` between nodes (m).
    pub(super) fn new(lattice: &Lattice, spacing: [f64; 3], materials: &[Material]) -> Self {
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
        let elasticity = Elasticity::new(lattice, materials, &exist);
        Self { nodes, elasticity, offsets, exist }
    }

    /// How far the nodes of a spring are apart at most, in the numbering.
    pub(super) fn reach(&self) -> usize {
        self.offsets.iter().map(|offset| offset.delta).max().unwrap_or(0)
    }

    /// Number of springs.
    pub(super) fn len(&self) -> usize {
        self.exist.iter().flatten().map(|bits| bits.count_ones() as usize).sum()
    }

    /// The neighbours of `node` and the springs that lead to them.
    pub(super) fn neighbours(&self, lattice: &Lattice, node: u32) -> impl Iterator<Item = (u32, Spring)> {
        let at = lattice.coordinates(node);
        let lattice = *lattice;
        Lattice::FORWARD.iter().zip(&self.offsets).enumerate().flat_map(move |(direction, (&step, offset))| {
            let forward = lattice.neighbour(at, step).map(|to| (node, to));
            let backward = lattice.neighbour(at, step.map(|c| -c)).map(|to| (lattice.id(to), to));
            [forward, backward].into_iter().flatten().map(move |(first, to)| {
                let (stiffness, damping) = self.elasticity.of(first, direction);
                (lattice.id(to), Spring { stiffness, damping, rest_length: offset.rest_length })
            })
        })
    }
}

impl Elasticity {
    fn new(lattice: &Lattice, materials: &[Material], exist: &[[u8; 13]]) -> Self {
        let uniform = Self::Uniform { stiffness: materials[0].stiffness, damping: materials[0].damping() };
        if materials.windows(2).all(|pair| pair[0] == pair[1]) {
            return uniform;
        }
        let (mut sets, mut set_of) = (Vec::new(), Vec::with_capacity(exist.len()));
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        for (eight, exist) in exist.iter().enumerate() {
            let set = Coefficients::new(lattice, materials, eight * LANES, exist);
            let bits = set.stiffness.iter().chain(&set.damping).flatten().map(|value| value.to_bits()).collect();
            set_of.push(*known.entry(bits).or_insert_with(|| {
                sets.push(set);
                sets.len() as u32 - 1
            }));
        }
        Self::Varied { sets, set_of }
    }

    /// Stiffness and damping of the spring from node `first` in forward `direction`.
    fn of(&self, first: u32, direction: usize) -> (f64, f64) {
        match self {
            Self::Uniform { stiffness, damping } => (*stiffness, *damping),
            Self::Varied { sets, set_of } => {
                let (eight, lane) = (first as usize / LANES, first as usize % LANES);
                let set = &sets[set_of[eight] as usize];
                (set.stiffness[direction][lane], set.damping[direction][lane])
            }
        }
    }
}

impl Coefficients {
    /// Those of the springs that begin at the eight nodes from `first` on.
    fn new(lattice: &Lattice, materials: &[Material], first: usize, exist: &[u8; 13]) -> Self {
        let mut new = Self { stiffness: [[0.0; LANES]; 13], damping: [[0.0; LANES]; 13] };
        for (direction, &offset) in Lattice::FORWARD.iter().enumerate() {
            // A lane without a spring has what the lane before has: fewer sets differ. Whatever it is, it is masked.
            let mut last = (materials[first].stiffness, materials[first].damping());
            for lane in 0..LANES {
                if exist[direction] >> lane & 1 == 1 {
                    let here = (first + lane) as u32;
                    let to = lattice.neighbour(lattice.coordinates(here), offset).map_or(here, |to| lattice.id(to));
                    let [a, b] = [here, to].map(|node| materials[node as usize]);
                    last = (in_series(a.stiffness, b.stiffness), in_series(a.damping(), b.damping()));
                }
                (new.stiffness[direction][lane], new.damping[direction][lane]) = last;
            }
        }
        new
    }
}
