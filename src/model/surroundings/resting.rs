//! A body linear around its rest state: what reductions and condensations are made from.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::basis::Basis;
use super::beyond::Beyond;
use super::coupling::{Coupling, couplings};
use crate::Vec3;
use crate::body::{Body, Cutout, Restriction, State, bounds, neighbourhood};

/// A body around its rest state: sparse stiffness, damping and masses, and the body itself for its restrictions.
#[derive(Debug)]
pub struct RestingBody {
    body: Box<dyn Body>,
    /// Of a part of a larger one: the rest of that, once somebody needs it.
    beyond: Option<Beyond>,
    /// Once somebody asks for them: of a large body mostly nobody does.
    couplings: OnceLock<Vec<((u32, u32), Coupling)>>,
    digest: OnceLock<u64>,
    /// Bases of windows around which a large body looks the same in many places.
    alike: Mutex<HashMap<u64, Arc<Basis>>>,
    /// Nodes around a patch that are unknowns of their own.
    neighbours: usize,
}

/// Nodes around a patch that are unknowns of their own. Beyond them a larger body is coarse.
const NEIGHBOURS: usize = 2048;

/// Steps in which it is told how far a body goes on beyond a part of it, in extents of the part.
const FARTHER: f64 = 0.25;

/// What of a large body is around a patch.
#[derive(Debug)]
pub(super) struct Around {
    /// The nodes around the patch, between nodes that are held.
    pub(super) body: RestingBody,
    /// The patch in its numbering.
    pub(super) patch: Vec<u32>,
    /// The id of each of its nodes in the whole body.
    nodes: Vec<u32>,
}

impl Around {
    /// Adds what of `whole` is beyond, coarsely: those that were held follow it.
    pub(super) fn look_beyond(&mut self, whole: &RestingBody) {
        let is_movable = |&(_, place): &(u32, u32)| self.body.inverse_masses()[place as usize] > 0.0;
        let places = self.nodes.iter().copied().zip(0..).filter(is_movable).collect();
        self.body.beyond = Some(Beyond::new(&*whole.body, &places));
    }

    /// A number that is the same for a basis of so many states in bodies that are the same but for where they are and for rounding, and
    /// that go on beyond nearly as far: to steps of a quarter of what is around the patch, up to all of it.
    pub(super) fn likeness(&self, whole: &RestingBody, states: usize) -> u64 {
        let gives_way = self.nodes.iter().map(|&node| u64::from(whole.inverse_masses()[node as usize] > 0.0));
        let [[low, high], [least, most]] = [self.body.rest(), whole.rest()].map(|rest| bounds(rest.iter()));
        let extent = (high - low).max();
        let beyond = (low - least).iter().chain(&(most - high)).map(|far| far.clamp(0.0, extent)).collect::<Vec<_>>();
        let steps = beyond.into_iter().map(|far| (far / (FARTHER * extent)).round() as u64);
        self.body.likeness(&self.patch, states, gives_way.chain(steps))
    }
}

impl RestingBody {
    /// Of `body`; `None` if it has no duplicate or no restriction.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(body: &dyn Body) -> Option<Self> {
        Self::is_of(body).then(|| body.duplicate()).flatten().map(Self::of)
    }

    fn of(body: Box<dyn Body>) -> Self {
        let (beyond, couplings, digest, alike) = Default::default();
        Self { body, beyond, couplings, digest, alike, neighbours: NEIGHBOURS }
    }

    /// With so many nodes around a patch that are unknowns of their own.
    #[cfg(test)]
    pub(super) fn with_neighbours(self, neighbours: usize) -> Self {
        Self { neighbours, ..self }
    }

    /// What of a large body is around `patch` (ids in increasing order). `None` if that is all of it. All that depends on the patch can
    /// move there as it does here.
    pub(super) fn around(&self, patch: &[u32]) -> Option<Around> {
        let near = self.restriction(patch)?;
        let (mut count, mut around) = (self.neighbours, neighbourhood(&*self.body, patch, self.neighbours)?);
        while near.ring(patch.len()).iter().any(|node| around.binary_search(node).is_err()) {
            count *= 2;
            around = neighbourhood(&*self.body, patch, count)?;
        }
        let Cutout { nodes, body, .. } = self.body.cutout(&around)?;
        let place: HashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
        let patch = patch.iter().filter_map(|node| place.get(node).copied()).collect();
        Some(Around { body: Self::of(body), patch, nodes })
    }

    /// True if `body` has what is needed: a duplicate, and a restriction.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn is_of(body: &dyn Body) -> bool {
        let movable = body.inverse_masses().iter().position(|&w| w > 0.0);
        movable.is_some_and(|node| body.restriction(&[node as u32]).is_some()) && body.duplicate().is_some()
    }

    /// A number that differs for bodies of other nodes, masses, stiffness or damping.
    ///
    /// # Real-time
    /// Not real-time safe: the first call allocates, and evaluates the body's forces.
    pub fn digest(&self) -> u64 {
        *self.digest.get_or_init(|| digest_of(&*self.body))
    }

    /// The basis that was made for surroundings of this [`likeness`](Around::likeness).
    pub(super) fn alike(&self, likeness: u64) -> Option<Arc<Basis>> {
        self.alike.lock().unwrap_or_else(PoisonError::into_inner).get(&likeness).cloned()
    }

    /// Keeps `basis` for other windows of this [`likeness`](Around::likeness).
    pub(super) fn keep_alike(&self, likeness: u64, basis: &Basis) {
        let basis = Arc::new(basis.clone());
        self.alike.lock().unwrap_or_else(PoisonError::into_inner).insert(likeness, basis);
    }

    /// A number that differs for bases of so many states of `patch` (ids in increasing order) in bodies that differ by more than where they
    /// are and rounding, and for `more` of them.
    fn likeness(&self, patch: &[u32], states: usize, more: impl Iterator<Item = u64>) -> u64 {
        let (rest, couplings) = (self.rest(), self.couplings());
        let origin = rest[patch.first().map_or(0, |&node| node as usize)];
        let extent = rest.iter().fold(0.0, |most: f64, x| most.max((x - origin).amax()));
        let stiffest = couplings.iter().fold(0.0, |most: f64, (_, coupling)| most.max(coupling.stiffness.amax()));
        let mut words: Vec<u64> = patch.iter().map(|&node| node.into()).collect();
        let places = rest.iter().flat_map(|x| (0..3).map(|i| alike((x[i] - origin[i]) / extent)));
        words.extend(places.chain(self.inverse_masses().iter().map(|&w| single(w))));
        words.extend([single(extent), single(stiffest), states as u64]);
        words.extend(more);
        for ((row, column), Coupling { stiffness, damping }) in couplings {
            words.push(u64::from(*row) << 32 | u64::from(*column));
            words.extend(stiffness.iter().chain(damping).map(|x| alike(x / stiffest)));
        }
        digest(&words.into_iter().flat_map(u64::to_le_bytes).collect::<Vec<u8>>())
    }

    /// What is beyond it, coarsely, where it is a part of a larger body.
    pub(super) fn beyond(&self) -> Option<&Beyond> {
        self.beyond.as_ref()
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
        self.couplings.get_or_init(|| couplings(&*self.body))
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
        let far = self.couplings().iter().filter(|((row, column), _)| is_far(row) && is_far(column));
        let rest = far.map(|(pair, coupling)| (*pair, near.get(pair).map_or(*coupling, |near| coupling.less(near))));
        rest.filter(|(_, coupling)| !coupling.is_zero()).collect()
    }
}

/// `share` in steps of 1e-7; no step ends at a number that is round.
fn alike(share: f64) -> u64 {
    (share * (1e7 / std::f64::consts::SQRT_2)).round() as i64 as u64
}

/// To seven digits.
fn single(value: f64) -> u64 {
    u64::from(((value * (1.0 + 1e-9)) as f32).to_bits())
}

/// Of the nodes, and of their forces when all of them are a little aside and move.
fn digest_of(body: &dyn Body) -> u64 {
    let (rest, nodes) = (body.rest(), (0..body.rest().len() as u32).collect::<Vec<_>>());
    let extent = rest.iter().fold(0.0, |most: f64, x| most.max(x.amax()));
    let aside = |n: usize, x: &Vec3| {
        x + Vec3::new((1.9 * n as f64).sin(), (2.3 * n as f64).cos(), (2.9 * n as f64).sin()) * (1e-3 * extent)
    };
    let moves = |n: usize| Vec3::new((1.3 * n as f64).cos(), (1.7 * n as f64).sin(), (3.1 * n as f64).cos());
    let state = State {
        positions: rest.iter().enumerate().map(|(n, x)| aside(n, x)).collect(),
        velocities: (0..rest.len()).map(moves).collect(),
    };
    let mut forces = vec![Vec3::zeros(); rest.len()];
    body.node_forces(&state, &nodes, &mut forces);
    let numbers = rest.iter().chain(&forces).flat_map(|x| x.iter()).chain(body.inverse_masses());
    digest(&numbers.flat_map(|x| x.to_bits().to_le_bytes()).collect::<Vec<u8>>())
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
