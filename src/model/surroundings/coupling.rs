//! How the nodes of a body answer to each other, linear around its rest state.

use std::collections::HashMap;

use crate::Mat3;
use crate::body::{Body, State};

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
    /// Adds `share` of `other`.
    pub(super) fn add(&mut self, other: &Self, share: f64) {
        self.stiffness += other.stiffness * share;
        self.damping += other.damping * share;
    }

    /// This less `other`, with nothing where the two cancel but for rounding.
    pub(super) fn less(&self, other: &Self) -> Self {
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

    pub(super) fn transposed(&self) -> Self {
        Self { stiffness: self.stiffness.transpose(), damping: self.damping.transpose() }
    }

    pub(super) fn is_zero(&self) -> bool {
        self.stiffness == Mat3::zeros() && self.damping == Mat3::zeros()
    }
}

/// A symmetric matrix of couplings in the making. Where a law has no energy, half of each side is taken.
#[derive(Debug, Default)]
pub(super) struct LowerTriangle {
    of: HashMap<(u32, u32), [Coupling; 2]>,
}

impl LowerTriangle {
    /// Adds `share` of `coupling`, by which `row` answers to `column`.
    pub(super) fn add(&mut self, (row, column): (u32, u32), coupling: &Coupling, share: f64) {
        let pair = (row.max(column), row.min(column));
        self.of.entry(pair).or_default()[usize::from(row < column)].add(coupling, share);
    }

    /// Each pair once, the higher one first, in increasing order.
    pub(super) fn symmetrised(self) -> Vec<((u32, u32), Coupling)> {
        let whole = |(pair, [below, above]): ((u32, u32), [Coupling; 2])| {
            let (row, column) = pair;
            (pair, below.symmetrised(if row == column { &below } else { &above }))
        };
        let mut all: Vec<_> = self.of.into_iter().map(whole).collect();
        all.sort_unstable_by_key(|&(pair, _)| pair);
        all
    }
}

/// The lower triangle of the stiffness and damping of a body at rest: for pairs of nodes that can move, the higher one
/// first, each once and in increasing order.
pub(super) fn couplings(body: &dyn Body) -> Vec<((u32, u32), Coupling)> {
    let is_movable = |node: u32| body.inverse_masses()[node as usize] > 0.0;
    let rows: Vec<u32> = (0..body.rest().len() as u32).filter(|&node| is_movable(node)).collect();
    let mut all = LowerTriangle::default();
    body.tangent(&State::at_rest(body.rest()), &rows, false, &mut |block| {
        if is_movable(block.column) {
            let coupling = Coupling { stiffness: -block.position, damping: -block.velocity };
            all.add((block.row, block.column), &coupling, 1.0);
        }
    });
    all.symmetrised()
}
