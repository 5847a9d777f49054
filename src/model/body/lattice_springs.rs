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
        let rest_lengths = Lattice::FORWARD.map(|offset| {
            let along: [f64; 3] = std::array::from_fn(|axis| offset[axis] as f64 * spacing[axis]);
            along.iter().map(|c| c * c).sum::<f64>().sqrt()
        });
        let first = materials[0];
        if materials.iter().all(|material| *material == first) {
            let uniform = Elasticity::Uniform { stiffness: first.stiffness, damping: first.damping() };
            return Self::with(lattice, rest_lengths, |_| uniform);
        }
        let of = |node: usize, direction: usize| {
            let (at, a) = (lattice.coordinates(node as u32), materials[node]);
            let b =
                lattice.neighbour(at, Lattice::FORWARD[direction]).map_or(a, |to| materials[lattice.id(to) as usize]);
            (in_series(a.stiffness, b.stiffness), in_series(a.damping(), b.damping()))
        };
        Self::with(lattice, rest_lengths, |exist| Elasticity::varied(exist, of))
    }

    /// Those of a part: the `lattice` whose nodes have the ids `whole` in that of these springs.
    pub(super) fn part(&self, lattice: &Lattice, whole: &[u32]) -> Self {
        let of = |node: usize, direction: usize| self.elasticity.of(whole[node], direction);
        Self::with(lattice, self.offsets.map(|offset| offset.rest_length), |exist| match &self.elasticity {
            &Elasticity::Uniform { stiffness, damping } => Elasticity::Uniform { stiffness, damping },
            Elasticity::Varied { .. } => Elasticity::varied(exist, of),
        })
    }

    fn with(lattice: &Lattice, rest_lengths: [f64; 13], elasticity: impl FnOnce(&[[u8; 13]]) -> Elasticity) -> Self {
        let nodes = lattice.len();
        let [nx, ny, _] = lattice.nodes.map(|n| n as isize);
        let offsets = std::array::from_fn(|direction| {
            let [x, y, z] = Lattice::FORWARD[direction];
            Offset { delta: (x + nx * (y + ny * z)) as usize, rest_length: rest_lengths[direction] }
        });
        let mut exist = vec![[0; 13]; nodes.div_ceil(LANES)];
        for p in 0..nodes {
            let at = lattice.coordinates(p as u32);
            for (bits, &offset) in exist[p / LANES].iter_mut().zip(&Lattice::FORWARD) {
                *bits |= u8::from(lattice.neighbour(at, offset).is_some()) << (p % LANES);
            }
        }
        Self { nodes, elasticity: elasticity(&exist), offsets, exist }
    }

    /// Leaves only the springs of nodes that are `wanted`.
    pub(super) fn retain(&mut self, wanted: impl Fn(usize) -> bool) {
        for (eight, exist) in self.exist.iter_mut().enumerate() {
            for (bits, offset) in exist.iter_mut().zip(&self.offsets) {
                let is_left = |lane: &usize| {
                    let first = eight * LANES + lane;
                    *bits >> lane & 1 == 1 && (wanted(first) || wanted(first + offset.delta))
                };
                *bits = (0..LANES).filter(is_left).map(|lane| 1 << lane).sum();
            }
        }
    }

    /// In how many directions springs begin at eight nodes, over all eights.
    pub(super) fn directions(&self) -> usize {
        self.exist.iter().flatten().filter(|&&bits| bits != 0).count()
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
    /// Stiffness and damping that differ: `of` gives those of the spring from a node in a forward direction, or where there is
    /// none those of something near.
    fn varied(exist: &[[u8; 13]], of: impl Fn(usize, usize) -> (f64, f64)) -> Self {
        let (mut sets, mut set_of) = (Vec::new(), Vec::with_capacity(exist.len()));
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        for (eight, exist) in exist.iter().enumerate() {
            let set = Coefficients::new(eight * LANES, exist, &of);
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
    fn new(first: usize, exist: &[u8; 13], of: impl Fn(usize, usize) -> (f64, f64)) -> Self {
        let mut new = Self { stiffness: [[0.0; LANES]; 13], damping: [[0.0; LANES]; 13] };
        for (direction, bits) in exist.iter().enumerate() {
            // A lane without a spring has what the lane before has: fewer sets differ. Whatever it is, it is masked.
            let mut last = of(first, direction);
            for lane in 0..LANES {
                if bits >> lane & 1 == 1 {
                    last = of(first + lane, direction);
                }
                (new.stiffness[direction][lane], new.damping[direction][lane]) = last;
            }
        }
        new
    }
}
