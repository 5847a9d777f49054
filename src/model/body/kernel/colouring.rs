//! Batches of springs or elements without a common node, so that the additions of a batch do not wait for each other.

use super::nodes::LANES;

/// Members that a batch is chosen from: enough to find eight without a common node, few enough to stay near.
const WINDOW: usize = 512;

/// Numbers of `members`, each given by its nodes below `count`, in batches of up to eight of which no two share a node; near
/// their order.
pub(super) fn colour<const N: usize>(members: &[[u32; N]], count: usize) -> Vec<Vec<usize>> {
    let mut batches = Vec::with_capacity(members.len().div_ceil(LANES));
    // The number of the last batch that touches a node, counted from 1.
    let mut touched = vec![0; count];
    let mut left = 0..members.len();
    let mut window: Vec<usize> = Vec::new();
    loop {
        window.extend(left.by_ref().take(WINDOW - window.len()));
        if window.is_empty() {
            return batches;
        }
        let (number, mut batch) = (batches.len() + 1, Vec::with_capacity(LANES));
        window.retain(|&member| {
            let nodes = &members[member];
            let is_free = batch.len() < LANES && nodes.iter().all(|&node| touched[node as usize] != number);
            if is_free {
                nodes.iter().for_each(|&node| touched[node as usize] = number);
                batch.push(member);
            }
            !is_free
        });
        batches.push(batch);
    }
}
