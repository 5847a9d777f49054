//! An order of nodes in which joined ones are near each other: reverse Cuthill-McKee.

/// Old numbers in the new order, of `nodes` nodes that `pairs` join.
///
/// Cuthill and McKee 1969, reversed as George 1971: breadth first, neighbours by increasing degree. Each connected piece
/// begins at the node that a first search from its node of least degree reached last.
pub(super) fn near_first(nodes: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<u32> {
    let neighbours = neighbours(nodes, pairs);
    let mut by_degree: Vec<u32> = (0..nodes as u32).collect();
    by_degree.sort_by_key(|&node| neighbours[node as usize].len());
    let mut is_seen = vec![false; nodes];
    let mut order: Vec<u32> = Vec::with_capacity(nodes);
    for start in by_degree {
        if is_seen[start as usize] {
            continue;
        }
        let first = order.len();
        search(start, &neighbours, &mut is_seen, &mut order);
        let last = order.last().copied().unwrap_or(start);
        for node in order.drain(first..) {
            is_seen[node as usize] = false;
        }
        search(last, &neighbours, &mut is_seen, &mut order);
    }
    order.reverse();
    order
}

/// Each node's neighbours by increasing degree.
fn neighbours(nodes: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); nodes];
    for [i, j] in pairs {
        neighbours[i as usize].push(j);
        neighbours[j as usize].push(i);
    }
    let degrees: Vec<usize> = neighbours.iter().map(Vec::len).collect();
    for list in &mut neighbours {
        list.sort_by_key(|&node| (degrees[node as usize], node));
        list.dedup();
    }
    neighbours
}

/// Appends what can be reached from `start`, breadth first.
fn search(start: u32, neighbours: &[Vec<u32>], is_seen: &mut [bool], order: &mut Vec<u32>) {
    let mut next = order.len();
    order.push(start);
    is_seen[start as usize] = true;
    while next < order.len() {
        for &node in &neighbours[order[next] as usize] {
            if !std::mem::replace(&mut is_seen[node as usize], true) {
                order.push(node);
            }
        }
        next += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffled_chain_and_a_lone_node_come_out_in_line() {
        // The chain 0 - 5 - 1 - 4 - 2, and 3 alone.
        let pairs = [[5, 1], [0, 5], [4, 2], [1, 4]];
        let order = near_first(6, pairs.into_iter());
        let place = |node: u32| order.iter().position(|&n| n == node).unwrap();
        assert_eq!(order.len(), 6);
        assert!((0..6).all(|node| order.contains(&node)));
        assert!(pairs.iter().all(|&[i, j]| place(i).abs_diff(place(j)) == 1), "{order:?}");
    }
}
