//! A body's springs by node.

use crate::Vec3;
use crate::body::{Body, Link};
use crate::mesh::Lists;

/// The springs of a body at rest, to be found by the nodes that they join.
#[derive(Clone, Debug)]
pub struct SpringGraph {
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    links: Vec<Link>,
    at_node: Lists,
    digest: u64,
}

impl SpringGraph {
    /// The springs of `body`; `None` if it is not made of springs.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(body: &dyn Body) -> Option<Self> {
        let (links, rest) = (body.springs()?, body.rest().to_vec());
        let ends = links.iter().enumerate().flat_map(|(index, link)| link.nodes.map(|node| (node, index as u32)));
        let at_node = Lists::new(rest.len(), ends);
        let inverse_masses = body.inverse_masses().to_vec();
        let digest = digest_of(&rest, &inverse_masses, &links);
        Some(Self { inverse_masses, rest, links, at_node, digest })
    }

    /// A number that differs for bodies of other nodes, masses or springs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Rest positions (m).
    pub(crate) fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    /// Inverse masses (1/kg), zero for held nodes.
    pub(crate) fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    /// All springs.
    pub(crate) fn links(&self) -> &[Link] {
        &self.links
    }

    /// The springs at `node`, by their place in [`links`](Self::links).
    pub(crate) fn at_node(&self, node: u32) -> &[u32] {
        self.at_node.of(node)
    }

    /// The direction of a spring at rest; `None` for one that is too short to have one.
    pub(super) fn direction(&self, link: &Link) -> Option<Vec3> {
        let [a, b] = link.nodes.map(|node| self.rest[node as usize]);
        link.spring.direction(b - a).map(|(direction, _)| direction)
    }

    /// Puts the nodes outside `patch` (in increasing order) that a spring joins to it in place of `ring` if they can move,
    /// of `held` if not; both in increasing order.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded by the patch; the lists may grow.
    pub(crate) fn neighbours(&self, patch: &[u32], ring: &mut Vec<u32>, held: &mut Vec<u32>) {
        ring.clear();
        held.clear();
        for &node in patch {
            for &link in self.at_node(node) {
                let [a, b] = self.links[link as usize].nodes;
                let other = if a == node { b } else { a };
                if patch.binary_search(&other).is_err() {
                    let list = if self.inverse_masses[other as usize] > 0.0 { &mut *ring } else { &mut *held };
                    list.push(other);
                }
            }
        }
        for list in [ring, held] {
            list.sort_unstable();
            list.dedup();
        }
    }
}

fn digest_of(rest: &[Vec3], inverse_masses: &[f64], links: &[Link]) -> u64 {
    let coordinates = rest.iter().flat_map(|x| x.iter()).chain(inverse_masses).map(|x| x.to_bits());
    let springs = links.iter().flat_map(|Link { nodes: [a, b], spring }| {
        let numbers = [spring.stiffness, spring.damping, spring.rest_length].map(f64::to_bits);
        [u64::from(*a) << 32 | u64::from(*b), numbers[0], numbers[1], numbers[2]]
    });
    let bytes: Vec<u8> = coordinates.chain(springs).flat_map(u64::to_le_bytes).collect();
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
