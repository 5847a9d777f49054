//! The springs that touch a patch, as they are: non-linear, between nodes in a window's numbering.

use super::window::Window;
use crate::Vec3;
use crate::body::kernel::NetworkKernel;
use crate::surroundings::SpringGraph;

/// Every spring with a node in the patch.
#[derive(Clone, Debug, Default)]
pub(super) struct NearSprings {
    kernel: Option<NetworkKernel>,
    /// Ids of the window's nodes that the springs were found for.
    nodes: Vec<u32>,
    movable: usize,
}

impl NearSprings {
    /// Those of `window`, which holds the patch and all its neighbours.
    pub(super) fn rebuild(&mut self, graph: &SpringGraph, window: &Window) {
        if self.nodes == window.nodes && self.movable == window.movable {
            return;
        }
        self.nodes.clone_from(&window.nodes);
        self.movable = window.movable;
        let mut springs = Vec::new();
        for place in 0..window.movable {
            for &link in graph.at_node(window.nodes[place]) {
                let link = graph.links()[link as usize];
                let [Some(a), Some(b)] = link.nodes.map(|node| window.node(node)) else { continue };
                // A spring inside the patch is met from both its nodes.
                let other = if a as usize == place { b } else { a };
                if other as usize >= window.movable || place < other as usize {
                    springs.push((a, b, link.spring));
                }
            }
        }
        self.kernel = Some(NetworkKernel::new(window.nodes.len(), &springs));
    }

    /// Writes the force that these springs put on each local node (N).
    pub(super) fn forces(&mut self, positions: &[Vec3], velocities: &[Vec3], forces: &mut [Vec3]) {
        match &mut self.kernel {
            Some(kernel) => kernel.forces(positions, velocities, forces),
            None => forces.fill(Vec3::zeros()),
        }
    }
}
