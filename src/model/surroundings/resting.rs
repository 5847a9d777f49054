//! A body linear around its rest state: what reductions and condensations are made from.

use std::collections::HashMap;

use crate::body::{Body, Restriction, State};
use crate::{Mat3, Vec3};

/// What is left of two couplings that cancel counts as nothing below this share of them.
const CANCELLED: f64 = 1e-11;

/// How one node answers to another: the force on it is -K x - C v.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Coupling {
    /// K (N/m).
    pub(super) stiffness: Mat3,
    /// C (N s/m).
    pub(super) damping: Mat3,
}

impl Coupling {
    /// This less `other`, with nothing where the two cancel but for rounding.
    fn less(&self, other: &Self) -> Self {
        let without = |a: Mat3, b: Mat3| if (a - b).amax() <= CANCELLED * a.amax() { Mat3::zeros() } else { a - b };
        Self { stiffness: without(self.stiffness, other.stiffness), damping: without(self.damping, other.damping) }
    }

    /// The mean of this and the transpose of `other`.
    fn symmetrised(&self, other: &Self) -> Self {
        Self {
            stiffness: (self.stiffness + other.stiffness.transpose()) * 0.5,
            damping: (self.damping + other.damping.transpose()) * 0.5,
        }
    }

    fn transposed(&self) -> Self {
        Self { stiffness: self.stiffness.transpose(), damping: self.damping.transpose() }
    }

    fn is_zero(&self) -> bool {
        self.stiffness == Mat3::zeros() && self.damping == Mat3::zeros()
    }
}

/// The lower triangle of the stiffness and damping of a body at rest: for pairs of nodes that can move, the higher one
/// first, each once and in increasing order. Symmetric: where a law has no energy, half of each side is taken.
pub(super) fn couplings(body: &dyn Body) -> Vec<((u32, u32), Coupling)> {
    let is_movable = |node: u32| body.inverse_masses()[node as usize] > 0.0;
    let rows: Vec<u32> = (0..body.rest().len() as u32).filter(|&node| is_movable(node)).collect();
    let mut all: HashMap<(u32, u32), [Coupling; 2]> = HashMap::new();
    body.tangent(&State::at_rest(body.rest()), &rows, false, &mut |block| {
        if is_movable(block.column) {
            let pair = (block.row.max(block.column), block.row.min(block.column));
            let side = &mut all.entry(pair).or_default()[usize::from(block.row < block.column)];
            side.stiffness -= block.position;
            side.damping -= block.velocity;
        }
    });
    let whole = |(pair, [below, above]): ((u32, u32), [Coupling; 2])| {
        let (row, column) = pair;
        (pair, below.symmetrised(if row == column { &below } else { &above }))
    };
    let mut all: Vec<_> = all.into_iter().map(whole).collect();
    all.sort_unstable_by_key(|&(pair, _)| pair);
    all
}

/// A body around its rest state: sparse stiffness, damping and masses, and the body itself for its restrictions.
#[derive(Debug)]
pub struct RestingBody {
    body: Box<dyn Body>,
    couplings: Vec<((u32, u32), Coupling)>,
    digest: u64,
}

impl RestingBody {
    /// Of `body`; `None` if it has no duplicate or no restriction.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(body: &dyn Body) -> Option<Self> {
        let body = Self::is_of(body).then(|| body.duplicate()).flatten()?;
        let couplings = couplings(&*body);
        let digest = digest_of(body.rest(), body.inverse_masses(), &couplings);
        Some(Self { body, couplings, digest })
    }

    /// True if `body` has what is needed: a duplicate, and a restriction.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn is_of(body: &dyn Body) -> bool {
        let movable = body.inverse_masses().iter().position(|&w| w > 0.0);
        movable.is_some_and(|node| body.restriction(&[node as u32]).is_some()) && body.duplicate().is_some()
    }

    /// A number that differs for bodies of other nodes, masses, stiffness or damping at rest.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Rest positions (m).
    pub(super) fn rest(&self) -> &[Vec3] {
        self.body.rest()
    }

    /// Inverse masses (1/kg), zero for held nodes.
    pub(super) fn inverse_masses(&self) -> &[f64] {
        self.body.inverse_masses()
    }

    /// Stiffness and damping of all pairs of nodes that can move, the higher one first.
    pub(super) fn couplings(&self) -> &[((u32, u32), Coupling)] {
        &self.couplings
    }

    /// What of the body depends on `nodes`; `None` if the body has no restriction to them.
    pub(super) fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        self.body.restriction(nodes)
    }

    /// The couplings of what does not depend on `nodes` (in increasing order): the whole body's less those of its
    /// `restriction` to them.
    pub(super) fn couplings_without(&self, nodes: &[u32], restriction: &Restriction) -> Vec<((u32, u32), Coupling)> {
        let near = couplings(&*restriction.body).into_iter().map(|((row, column), coupling)| {
            let [row, column] = [row, column].map(|node| restriction.nodes[node as usize]);
            // The order of the nodes is another.
            if row >= column { ((row, column), coupling) } else { ((column, row), coupling.transposed()) }
        });
        let near: HashMap<(u32, u32), Coupling> = near.collect();
        let is_far = |node: &u32| nodes.binary_search(node).is_err();
        let far = self.couplings.iter().filter(|((row, column), _)| is_far(row) && is_far(column));
        let rest = far.map(|(pair, coupling)| (*pair, near.get(pair).map_or(*coupling, |near| coupling.less(near))));
        rest.filter(|(_, coupling)| !coupling.is_zero()).collect()
    }
}

fn digest_of(rest: &[Vec3], inverse_masses: &[f64], couplings: &[((u32, u32), Coupling)]) -> u64 {
    let coordinates = rest.iter().flat_map(|x| x.iter()).chain(inverse_masses).map(|x| x.to_bits());
    let couplings = couplings.iter().flat_map(|((row, column), Coupling { stiffness, damping })| {
        let numbers = stiffness.iter().chain(damping).map(|x| x.to_bits());
        std::iter::once(u64::from(*row) << 32 | u64::from(*column)).chain(numbers)
    });
    let bytes: Vec<u8> = coordinates.chain(couplings).flat_map(u64::to_le_bytes).collect();
    digest(&bytes)
}

/// FNV-1a over whole words: fast enough for megabytes, and any changed bit changes it.
pub(super) fn digest(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut words = bytes.chunks_exact(size_of::<u64>());
    let mut add = |word: u64| hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(29);
    for word in &mut words {
        add(u64::from_le_bytes(word.try_into().unwrap_or_default()));
    }
    words.remainder().iter().for_each(|&byte| add(u64::from(byte)));
    add(bytes.len() as u64);
    hash
}
