//! The connected parts of a mesh.

use super::{Group, TetrahedralMesh};

impl TetrahedralMesh {
    /// The parts that hang together, each with all its elements and their nodes, the largest first: `part 1`, `part 2`, ...
    /// Elements with a common node are in one part; nodes that no element uses are in none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn parts(&self) -> Vec<Group> {
        // Every node points to one with a lower number in its part, the first of all to itself.
        let mut towards: Vec<u32> = (0..self.points.len() as u32).collect();
        for [a, b, c, d] in &self.tetrahedra {
            for other in [b, c, d] {
                let (a, b) = (first(&mut towards, *a), first(&mut towards, *other));
                towards[a.max(b) as usize] = a.min(b);
            }
        }
        let mut part_of = vec![usize::MAX; self.points.len()];
        let mut parts: Vec<Group> = Vec::new();
        for (element, nodes) in self.tetrahedra.iter().enumerate() {
            let first = first(&mut towards, nodes[0]) as usize;
            if part_of[first] == usize::MAX {
                part_of[first] = parts.len();
                parts.push(Group::default());
            }
            let part = &mut parts[part_of[first]];
            part.tetrahedra.push(element as u32);
            part.nodes.extend(nodes);
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.tetrahedra.len()));
        for (number, part) in parts.iter_mut().enumerate() {
            part.name = format!("part {}", number + 1);
            part.nodes.sort_unstable();
            part.nodes.dedup();
        }
        parts
    }
}

/// The first node of the part that `node` is in.
fn first(towards: &mut [u32], mut node: u32) -> u32 {
    while towards[node as usize] != node {
        // Half of the way is saved to whoever comes next.
        towards[node as usize] = towards[towards[node as usize] as usize];
        node = towards[node as usize];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn elements_with_a_common_node_are_one_part_and_the_largest_comes_first() {
        let tetrahedra = vec![[12, 11, 10, 9], [0, 1, 2, 3], [7, 6, 5, 4], [3, 4, 2, 8]];
        let mesh = TetrahedralMesh { points: vec![Vec3::zeros(); 14], tetrahedra, groups: vec![] };
        let parts = mesh.parts();
        let group = |name: &str, nodes: std::ops::Range<u32>, tetrahedra: &[u32]| Group {
            name: name.to_owned(),
            nodes: nodes.collect(),
            tetrahedra: tetrahedra.to_vec(),
        };
        assert_eq!(parts, [group("part 1", 0..9, &[1, 2, 3]), group("part 2", 9..13, &[0])]);
    }
}
