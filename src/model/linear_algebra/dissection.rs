//! The order in which the unknowns of a body in space are eliminated: halves first, what lies between them last.

use crate::Vec3;
use crate::mesh::Lists;

/// Sets of so few nodes are not divided.
const SMALL: usize = 24;
/// A cut that takes more than this share of a set divides nothing: its nodes are not neighbours of those beside them.
const WIDEST_CUT: f64 = 0.4;

/// Nested dissection (George 1973) by planes: the order in which to eliminate the unknowns, three for each of the nodes at
/// `points` that `pairs` join. `None` if no plane divides them well, so that an order which does not look at places is better.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn dissection(points: &[Vec3], pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Option<Vec<usize>> {
    let adjacency = Lists::new(points.len(), pairs.flat_map(|[a, b]| [(a, b), (b, a)]));
    let mut order = Vec::with_capacity(points.len());
    let mut side = vec![0_u8; points.len()];
    let all = (0..points.len() as u32).collect();
    divide(points, &adjacency, all, &mut side, &mut order)?;
    Some(order.into_iter().flat_map(|node| 3 * node as usize..3 * node as usize + 3).collect())
}

/// Appends `nodes` to `order`. `side` is working memory, zero for all nodes.
fn divide(points: &[Vec3], adjacency: &Lists, nodes: Vec<u32>, side: &mut [u8], order: &mut Vec<u32>) -> Option<()> {
    if nodes.len() <= SMALL {
        order.extend(nodes);
        return Some(());
    }
    let cuts = (0..3).filter_map(|axis| cut(points, adjacency, &nodes, axis, side));
    let [low, between, high] =
        cuts.min_by_key(|[low, between, high]| (between.len(), low.len().abs_diff(high.len())))?;
    if between.len() as f64 > WIDEST_CUT * nodes.len() as f64 {
        // A thin rest of a body that was divided well is no reason against it.
        let is_whole = nodes.len() == points.len();
        order.extend(nodes);
        return (!is_whole).then_some(());
    }
    divide(points, adjacency, low, side, order)?;
    divide(points, adjacency, high, side, order)?;
    order.extend(between);
    Some(())
}

/// `nodes` below the middle plane across `axis`, those from there on that they touch, and the rest; `None` if all are in one
/// plane.
fn cut(points: &[Vec3], adjacency: &Lists, nodes: &[u32], axis: usize, side: &mut [u8]) -> Option<[Vec<u32>; 3]> {
    const LOW: u8 = 1;
    let at = |node: u32| points[node as usize][axis];
    let mut places: Vec<f64> = nodes.iter().map(|&node| at(node)).collect();
    let middle = places.len() / 2;
    let middle = *places.select_nth_unstable_by(middle, f64::total_cmp).1;
    let (mut low, mut rest): (Vec<u32>, Vec<u32>) = nodes.iter().partition(|&&node| at(node) < middle);
    if low.is_empty() {
        (low, rest) = nodes.iter().partition(|&&node| at(node) <= middle);
    }
    if low.is_empty() || rest.is_empty() {
        return None;
    }
    low.iter().for_each(|&node| side[node as usize] = LOW);
    let (between, high) = rest.iter().partition(|&&node| adjacency.of(node).iter().any(|&n| side[n as usize] == LOW));
    low.iter().for_each(|&node| side[node as usize] = 0);
    Some([low, between, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_cut_in_the_middle_and_a_bundle_is_not() {
        let count = 100;
        let points: Vec<Vec3> = (0..count).map(|n| Vec3::new(f64::from(n), 0.0, 0.0)).collect();
        let order = dissection(&points, (1..count).map(|n| [n - 1, n])).unwrap();
        assert_eq!(order[order.len() - 3..], [150, 151, 152]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..3 * count as usize), "each once");
        let pairs = (0..count).flat_map(|a| (0..a).map(move |b| [a, b]));
        assert_eq!(dissection(&points, pairs), None);
    }
}
