//! A closed or open triangle surface with its adjacency, as contact walks over it.

use std::collections::HashMap;

use super::Lists;
use crate::error::ModelError;

/// Triangles over numbered nodes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surface {
    /// Node ids of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle the neighbour across the edge opposite to its first, second and third node, or [`Surface::NONE`].
    pub neighbours: Vec<[u32; 3]>,
    /// The triangles at each node.
    at_node: Lists,
}

impl Surface {
    /// No triangle, or no neighbour across an edge.
    pub const NONE: u32 = u32::MAX;

    /// A surface of `triangles` over `nodes` nodes, with its adjacency.
    ///
    /// # Errors
    /// If a triangle names a node that does not exist or twice the same, or an edge has more than two triangles.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(nodes: usize, triangles: Vec<[u32; 3]>) -> Result<Self, ModelError> {
        let mut edges: HashMap<(u32, u32), (u32, usize)> = HashMap::with_capacity(triangles.len() * 2);
        let mut neighbours = vec![[Surface::NONE; 3]; triangles.len()];
        for (t, triangle) in triangles.iter().enumerate() {
            let [a, b, c] = *triangle;
            if triangle.iter().any(|&node| node as usize >= nodes) || a == b || b == c || c == a {
                let message =
                    format!("triangle {t} has nodes {triangle:?}: three different ones below {nodes} are needed");
                return Err(ModelError::new(message));
            }
            for opposite in 0..3 {
                let (p, q) = (triangle[(opposite + 1) % 3], triangle[(opposite + 2) % 3]);
                let edge = (p.min(q), p.max(q));
                match edges.get(&edge) {
                    None => {
                        edges.insert(edge, (t as u32, opposite));
                    }
                    Some(&(other, across)) if neighbours[other as usize][across] == Surface::NONE => {
                        neighbours[other as usize][across] = t as u32;
                        neighbours[t][opposite] = other;
                    }
                    Some(_) => {
                        let message =
                            format!("edge {edge:?} has more than two triangles: the surface must be a manifold");
                        return Err(ModelError::new(message));
                    }
                }
            }
        }
        let mut surface = Self { triangles, neighbours, ..Self::default() };
        surface.index_nodes(nodes);
        Ok(surface)
    }

    /// Fills the node -> triangle lists, reusing their memory.
    pub(crate) fn index_nodes(&mut self, nodes: usize) {
        let triangles = self.triangles.iter().enumerate();
        self.at_node.fill(nodes, triangles.flat_map(|(t, triangle)| triangle.map(|node| (node, t as u32))));
    }

    /// The triangles at `node`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn at_node(&self, node: u32) -> &[u32] {
        self.at_node.of(node)
    }

    /// The nodes that are corners of triangles, in increasing order.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn nodes(&self) -> Vec<u32> {
        let mut nodes = self.triangles.as_flattened().to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// True if `node` is a corner of some triangle.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn has_node(&self, node: u32) -> bool {
        !self.at_node(node).is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Lattice;
    use super::*;

    #[test]
    fn a_block_is_closed_and_every_neighbour_points_back() {
        let lattice = Lattice { nodes: [4, 3, 5] };
        let surface = Surface::new(lattice.len(), lattice.surface_triangles()).unwrap();
        assert_eq!(surface.triangles.len(), 2 * 2 * (3 * 2 + 3 * 4 + 2 * 4));
        for (t, neighbours) in surface.neighbours.iter().enumerate() {
            for (opposite, &across) in neighbours.iter().enumerate() {
                assert_ne!(across, Surface::NONE);
                assert!(surface.neighbours[across as usize].contains(&(t as u32)));
                let edge = [surface.triangles[t][(opposite + 1) % 3], surface.triangles[t][(opposite + 2) % 3]];
                assert!(edge.iter().all(|node| surface.triangles[across as usize].contains(node)));
            }
        }
        for node in 0..lattice.len() as u32 {
            assert!(surface.at_node(node).iter().all(|&t| surface.triangles[t as usize].contains(&node)));
        }
        assert_eq!(surface.nodes().len(), lattice.len() - 2 * 3);
        assert!(surface.nodes().iter().all(|&node| surface.has_node(node)));
        let listed: usize = (0..lattice.len() as u32).map(|node| surface.at_node(node).len()).sum();
        assert_eq!(listed, 3 * surface.triangles.len());
    }

    #[test]
    fn a_triangle_outside_the_nodes_is_refused() {
        assert!(Surface::new(3, vec![[0, 1, 3]]).is_err());
        assert!(Surface::new(3, vec![[0, 1, 1]]).is_err());
    }
}
