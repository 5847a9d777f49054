//! The springs that touch a patch, as they are: non-linear, between nodes in a window's numbering.

use super::super::Vec3;
use super::super::body::Spring;
use super::super::surroundings::SpringGraph;
use super::window::Window;

/// A spring between two local nodes.
#[derive(Clone, Copy, Debug)]
struct NearSpring {
    nodes: [u32; 2],
    spring: Spring,
}

/// Every spring with a node in the patch.
#[derive(Clone, Debug, Default)]
pub(super) struct NearSprings {
    springs: Vec<NearSpring>,
}

impl NearSprings {
    /// Those of `window`, which holds the patch and all its neighbours.
    pub(super) fn rebuild(&mut self, graph: &SpringGraph, window: &Window) {
        self.springs.clear();
        for place in 0..window.movable {
            for &link in graph.at_node(window.nodes[place]) {
                let link = graph.links()[link as usize];
                let [Some(a), Some(b)] = link.nodes.map(|node| window.node(node)) else { continue };
                // A spring inside the patch is met from both its nodes.
                let other = if a as usize == place { b } else { a };
                if other as usize >= window.movable || place < other as usize {
                    self.springs.push(NearSpring { nodes: [a, b], spring: link.spring });
                }
            }
        }
    }

    /// Writes the force that these springs put on each local node (N).
    pub(super) fn forces(&self, positions: &[Vec3], velocities: &[Vec3], forces: &mut [Vec3]) {
        forces.fill(Vec3::zeros());
        for &NearSpring { nodes, spring } in &self.springs {
            let [a, b] = nodes.map(|node| node as usize);
            let force = spring.force(positions[b] - positions[a], velocities[b] - velocities[a]);
            forces[a] += force;
            forces[b] -= force;
        }
    }
}
