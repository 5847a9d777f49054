//! A body's springs by node.

use super::super::Vec3;
use super::super::body::{Body, Link};
use super::stored::digest;

/// The springs of a body at rest, to be found by the nodes that they join.
#[derive(Clone, Debug)]
pub struct SpringGraph {
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    links: Vec<Link>,
    /// The links at node n are `at_nodes[first[n]..first[n + 1]]`.
    first: Vec<u32>,
    at_nodes: Vec<u32>,
    digest: u64,
}

impl SpringGraph {
    /// The springs of `body`; `None` if it is not made of springs.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(body: &dyn Body) -> Option<Self> {
        let (links, rest) = (body.springs()?, body.rest().to_vec());
        let mut first = vec![0_u32; rest.len() + 1];
        for node in links.iter().flat_map(|link| link.nodes) {
            first[node as usize + 1] += 1;
        }
        for node in 0..rest.len() {
            first[node + 1] += first[node];
        }
        let (mut next, mut at_nodes) = (first.clone(), vec![0; 2 * links.len()]);
        for (index, link) in links.iter().enumerate() {
            for node in link.nodes {
                at_nodes[next[node as usize] as usize] = index as u32;
                next[node as usize] += 1;
            }
        }
        let inverse_masses = body.inverse_masses().to_vec();
        let digest = digest_of(&rest, &inverse_masses, &links);
        Some(Self { inverse_masses, rest, links, first, at_nodes, digest })
    }

    /// A number that differs for bodies of other nodes, masses or springs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Rest positions (m).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    /// Inverse masses (1/kg), zero for held nodes.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    /// All springs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The springs at `node`, by their place in [`links`](Self::links).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn at_node(&self, node: u32) -> &[u32] {
        &self.at_nodes[self.first[node as usize] as usize..self.first[node as usize + 1] as usize]
    }

    /// Puts the nodes outside `patch` (in increasing order) that a spring joins to it in place of `ring` if they can move,
    /// of `held` if not; both in increasing order.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded by the patch; the lists may grow.
    pub fn neighbours(&self, patch: &[u32], ring: &mut Vec<u32>, held: &mut Vec<u32>) {
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
