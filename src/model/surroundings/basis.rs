//! The surroundings of a patch in few states: how its ring answers to forces, and where it goes by itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::accuracy::Estimate;
use super::products::Columns;
use super::reduced::{Reduced, ReducedMotion};
use crate::Vec3;
use crate::body::{Body, State};

/// A forecast is used where what it leaves out moves less than this share of what there is.
const LEFT_OUT: f64 = 0.02;

/// The surroundings of one patch, linear around rest, in few states.
///
/// The answers to forces on the ring span the leading left singular vectors of `[Z_0/|Z_0|, Z_1/|Z_1|, Z_2/|Z_2|]`,
/// Z_0 = A^-1 B the answers to unit forces on the ring, Z_(i+1) = A^-1 M Z_i, A = s0^2 M - s0 C - K of what does not
/// depend on the patch, at rest: moment matching at a real frequency (Grimme 1997) with a singular value truncation. It
/// depends on patch, material and topology, not on time. The forecast adds smooth fields, for what is under way already.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    pub(super) patch: Vec<u32>,
    pub(crate) answers: Reduced,
    pub(crate) forecast: Forecast,
    pub(super) estimate: Option<Estimate>,
}

impl Basis {
    /// Ids of the patch nodes, in increasing order.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn patch(&self) -> &[u32] {
        &self.patch
    }

    /// The number of states in which the ring answers.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn states(&self) -> usize {
        self.answers.states()
    }

    /// The estimate of the force error by which the number of states was chosen, if it was.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn estimate(&self) -> Option<Estimate> {
        self.estimate
    }
}

/// The surroundings as they go on from a given state of the whole body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Forecast {
    /// Ids of all movable nodes outside the patch.
    pub(super) nodes: Vec<u32>,
    pub(super) masses: Vec<f64>,
    /// Modes on those nodes as columns, three numbers a node (1/sqrt(kg)).
    pub(super) modes: Columns,
    pub(crate) model: Reduced,
}

impl Forecast {
    /// Sets `motion` to the present state of a body, with the forces in it (N); `span` is how far the forecast has to reach
    /// (s). False if the states leave out too much of the present motion.
    ///
    /// # Real-time
    /// For the global actor: reads all modes once; may allocate.
    pub(crate) fn launch(
        &self,
        motion: &mut ReducedMotion,
        (body, state, forces): (&dyn Body, &State, &[Vec3]),
        span: f64,
    ) -> bool {
        let (mut momentum, mut force) =
            (Vec::with_capacity(3 * self.nodes.len()), Vec::with_capacity(3 * self.nodes.len()));
        // In the norm of the mass, in which the modes are orthonormal.
        let (mut displacement, mut speed, mut acceleration) = (0.0, 0.0, 0.0);
        for (&node, mass) in self.nodes.iter().zip(&self.masses) {
            let node = node as usize;
            let (v, f) = (state.velocities[node], forces[node]);
            displacement += mass * (state.positions[node] - body.rest()[node]).norm_squared();
            speed += mass * v.norm_squared();
            acceleration += f.norm_squared() / mass;
            momentum.extend((v * *mass).iter());
            force.extend(f.iter());
        }
        let (mut rate, mut load) = (vec![0.0; self.model.states()], vec![0.0; self.model.states()]);
        self.modes.project_all([&momentum, &force], [&mut rate, &mut load]);
        motion.launch(&rate, &load);
        let missing = |all: f64, held: &[f64]| (all - held.iter().map(|x| x * x).sum::<f64>()).max(0.0).sqrt();
        // What is left out swings as fast as the faster modes, so that it does not come far.
        let swing = 1.0 / self.model.middle_frequency();
        let left_out = missing(speed, &rate) * span.min(swing)
            + missing(acceleration, &load) * (0.5 * span * span).min(2.0 * swing * swing);
        left_out <= LEFT_OUT * displacement.sqrt()
    }
}

/// A collection of bases, by patch.
#[derive(Clone, Debug, Default)]
pub struct Bases {
    /// In the order of the patches: of two that serve as well, every run takes the same.
    of: BTreeMap<Vec<u32>, Arc<Basis>>,
}

impl Bases {
    /// The basis for `patch` (ids in increasing order), if there is one.
    ///
    /// # Real-time
    /// Bounded, by the patch; does not allocate.
    pub fn get(&self, patch: &[u32]) -> Option<&Arc<Basis>> {
        self.of.get(patch)
    }

    /// The patch of the smallest basis that holds all nodes of `patch`.
    ///
    /// # Real-time
    /// For the global actor: looks at all bases.
    pub fn around(&self, patch: &[u32]) -> Option<&[u32]> {
        let holds = |basis: &&Arc<Basis>| patch.iter().all(|node| basis.patch.binary_search(node).is_ok());
        self.of.values().filter(holds).map(|basis| &basis.patch[..]).min_by_key(|patch| patch.len())
    }

    /// The patch that has most nodes of `wanted`, of a basis whose patch holds all of `nodes`.
    ///
    /// # Real-time
    /// For the global actor: looks at all bases.
    pub fn holding<I: Iterator<Item = u32>>(&self, nodes: impl Fn() -> I, wanted: &[u32]) -> Option<&[u32]> {
        let holds = |basis: &&Arc<Basis>| nodes().all(|node| basis.patch.binary_search(&node).is_ok());
        let common = |patch: &&[u32]| wanted.iter().filter(|&node| patch.binary_search(node).is_ok()).count();
        self.of.values().filter(holds).map(|basis| &basis.patch[..]).max_by_key(common)
    }

    /// All bases, in the order of their patches.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn iter(&self) -> impl Iterator<Item = &Basis> {
        self.of.values().map(|basis| &**basis)
    }

    /// Adds a basis, in place of one for the same patch.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn insert(&mut self, basis: Arc<Basis>) {
        self.of.insert(basis.patch.clone(), basis);
    }

    /// The number of bases.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn len(&self) -> usize {
        self.of.len()
    }

    /// True if there is no basis.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }
}
