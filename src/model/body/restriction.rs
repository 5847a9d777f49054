//! What of a body depends on some of its nodes: the part around a tool, with the body's own law.

use super::Body;

/// The part of a body's elastic energy and damping that depends on some of its nodes, as a body of its own.
///
/// For springs it is every spring at one of the nodes, for elements every element that touches one. On the nodes that were
/// asked for it exerts the forces that the whole body does; on the others it exerts its share of them, so that what is
/// left, the whole body less its restriction, does not depend on the nodes that were asked for. Its surface may be empty.
#[derive(Debug)]
pub struct Restriction {
    /// The id that each node of `body` has in the whole one; see [`Restriction::order`].
    pub nodes: Vec<u32>,
    /// The part, in the numbering of `nodes`.
    pub body: Box<dyn Body>,
}

impl Restriction {
    /// The nodes of a restriction to `asked` whose parts touch the nodes `touched`, in the order that it has to have: those
    /// asked for as they are, then the others that can move, then those that are held, both in increasing order.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded by the nodes; allocates.
    pub fn order(asked: &[u32], touched: impl IntoIterator<Item = u32>, inverse_masses: &[f64]) -> Vec<u32> {
        let mut sorted = asked.to_vec();
        sorted.sort_unstable();
        let mut others: Vec<u32> = touched.into_iter().filter(|node| sorted.binary_search(node).is_err()).collect();
        others.sort_unstable_by_key(|&node| (inverse_masses[node as usize] == 0.0, node));
        others.dedup();
        asked.iter().copied().chain(others).collect()
    }

    /// The nodes beside the `asked` first ones that can move, by their ids in the whole body.
    pub(crate) fn ring(&self, asked: usize) -> &[u32] {
        &self.nodes[asked..asked + self.ring_len(asked)]
    }

    /// The nodes that are held beside the `asked` first ones, by their ids in the whole body.
    pub(crate) fn held(&self, asked: usize) -> &[u32] {
        &self.nodes[asked + self.ring_len(asked)..]
    }

    fn ring_len(&self, asked: usize) -> usize {
        self.body.inverse_masses()[asked..].iter().take_while(|&&w| w > 0.0).count()
    }
}
