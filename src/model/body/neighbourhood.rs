//! The nodes around a patch: what a model of its surroundings may be limited to.

use super::Body;
use crate::Vec3;

/// Of a wide patch the neighbourhood has so many times its nodes at least: else it would be little more than the patch.
const SPREAD: usize = 4;

/// The least and the greatest corner of the box around `points`, both at 0 if there are none.
///
/// # Real-time
/// Bounded, by the points; does not allocate.
pub(crate) fn bounds<'a>(points: impl Iterator<Item = &'a Vec3> + Clone) -> [Vec3; 2] {
    let corner = |of: fn(&Vec3, &Vec3) -> Vec3| points.clone().copied().reduce(|a, b| of(&a, &b)).unwrap_or_default();
    [corner(Vec3::inf), corner(Vec3::sup)]
}

/// The nodes of `body` that can move and are nearest to `patch` at rest, at most about `count` or four times as many as the patch has,
/// in increasing order: those in a box that reaches equally far beyond the patch on all sides. `None` if those are all that can move.
///
/// # Real-time
/// Not real-time safe: allocates, and looks at every node.
pub(crate) fn neighbourhood(body: &dyn Body, patch: &[u32], count: usize) -> Option<Vec<u32>> {
    let (rest, inverse_masses) = (body.rest(), body.inverse_masses());
    let movable = || (0..rest.len()).filter(|&node| inverse_masses[node] > 0.0);
    let (all, count) = (movable().count(), count.max(SPREAD * patch.len()));
    if all <= count {
        return None;
    }
    let [low, high] = bounds(patch.iter().map(|&node| &rest[node as usize]));
    let beyond = |x: &Vec3| (low - x).max().max((x - high).max()).max(0.0);
    let mut distances: Vec<f64> = movable().map(|node| beyond(&rest[node])).collect();
    let (_, &mut reach, _) = distances.select_nth_unstable_by(count, f64::total_cmp);
    // All at the same distance are in or out; on a lattice they differ by rounding.
    let (reach, least) = (reach * (1.0 - 1e-9), patch.len());
    let nodes: Vec<u32> = movable().filter(|&node| beyond(&rest[node]) < reach).map(|node| node as u32).collect();
    Some(nodes).filter(|nodes| nodes.len() < all && nodes.len() > least)
}

#[cfg(test)]
mod tests {
    use super::super::Block;
    use super::*;
    use crate::mesh::Face;

    #[test]
    fn a_neighbourhood_is_a_box_that_reaches_equally_far_and_a_small_body_has_none() {
        let block = Block::builder([15; 3], [0.14; 3]).fix(Face::ZMin).build().unwrap();
        let at = |i, j, k| block.lattice().id([i, j, k]);
        // Two layers of four by four in the middle of the top.
        let range = |from: usize| from..from + 4;
        let mut patch: Vec<u32> = range(5)
            .flat_map(|i| range(5).flat_map(move |j| [13, 14].map(|k| (i, j, k))))
            .map(|(i, j, k)| at(i, j, k))
            .collect();
        patch.sort_unstable();
        // Three nodes beyond it: 10 x 10 x 5.
        let nodes = neighbourhood(&block, &patch, 500).unwrap();
        assert_eq!(nodes.len(), 500);
        assert!(nodes.is_sorted() && nodes.contains(&at(2, 2, 10)) && !nodes.contains(&at(1, 5, 14)));
        assert_eq!(neighbourhood(&block, &patch, 863).unwrap().len(), 500, "the next layer is not whole");
        assert_eq!(neighbourhood(&block, &patch, 864).unwrap().len(), 864);
        assert!(neighbourhood(&block, &patch, 15 * 15 * 14).is_none(), "held nodes do not count");
        // A patch of 10 x 10 x 4 is not its own neighbourhood.
        let wide: Vec<u32> = (0..3375)
            .filter(|&id| {
                let [i, j, k] = block.lattice().coordinates(id);
                (2..12).contains(&i) && (2..12).contains(&j) && k > 10
            })
            .collect();
        assert!(neighbourhood(&block, &wide, 500).unwrap().len() > 2 * wide.len());
    }
}
