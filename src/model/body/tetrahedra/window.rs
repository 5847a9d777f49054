//! The nodes around a place of the surface.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::Tetrahedra;
use crate::Vec3;
use crate::body::Body;

/// A node on the edge of what has grown: the nearest comes first, of equally near ones that with the lowest number.
#[derive(Debug, PartialEq)]
struct Candidate {
    square: f64,
    node: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.square.total_cmp(&self.square).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Appends the `count` movable nodes that are nearest to the centroid of `triangle` at rest and that elements join to it on the
/// way: what lies beyond a gap is not near. Held nodes are passed, as many at the most as are looked for. `seen` has for every node the
/// number of the last growth that met it, 0 if none has, and `number` is that of this one.
pub(super) fn grow(
    body: &Tetrahedra,
    triangle: [u32; 3],
    count: usize,
    (seen, number): (&mut [u32], u32),
    nodes: &mut Vec<u32>,
) {
    let (rest, inverse_masses) = (body.rest(), body.inverse_masses());
    let centre = triangle.iter().map(|&node| rest[node as usize]).sum::<Vec3>() / 3.0;
    let candidate = |node: u32| Candidate { square: (rest[node as usize] - centre).norm_squared(), node };
    let mut edge: BinaryHeap<Candidate> = triangle.map(candidate).into();
    triangle.iter().for_each(|&node| seen[node as usize] = number);
    let mut is_new = |node: u32| std::mem::replace(&mut seen[node as usize], number) != number;
    let (mut found, mut passed) = (0, 0);
    while found < count && passed <= count {
        let Some(Candidate { node, .. }) = edge.pop() else { return };
        if inverse_masses[node as usize] > 0.0 {
            nodes.push(node);
            found += 1;
        } else {
            passed += 1;
        }
        for element in body.solid.at(node) {
            edge.extend(element.nodes.into_iter().filter(|&other| is_new(other)).map(candidate));
        }
    }
}
