//! A body of a program's own may have springs between nodes at the same place: without a direction they do nothing.

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, Link, Spring, State, TangentBlock};
use palpate_model::mesh::{Face, Surface};
use palpate_model::surroundings::{Basis, Condensation, SpringGraph};

/// A block, and one more spring, from a node to another that stands where the first one is.
#[derive(Debug)]
struct Doubled {
    block: Block,
    rest: Vec<Vec3>,
    collapsed: Link,
}

impl Body for Doubled {
    fn rest(&self) -> &[Vec3] {
        &self.rest
    }
    fn inverse_masses(&self) -> &[f64] {
        self.block.inverse_masses()
    }
    fn surface(&self) -> &Surface {
        self.block.surface()
    }
    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        self.block.forces(state, forces);
    }
    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        self.block.node_forces(state, nodes, forces);
    }
    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        self.block.tangent(state, nodes, clamp, emit);
    }
    fn springs(&self) -> Option<Vec<Link>> {
        let others = self.block.springs()?.into_iter().filter(|link| link.nodes != self.collapsed.nodes);
        Some(others.chain([self.collapsed]).collect())
    }
}

fn doubled(stiffness: f64) -> Doubled {
    let block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
    let nodes = [[2, 2, 4], [2, 3, 4]].map(|place| block.lattice().id(place));
    let mut rest = block.rest().to_vec();
    rest[nodes[1] as usize] = rest[nodes[0] as usize];
    Doubled { block, rest, collapsed: Link { nodes, spring: Spring { stiffness, damping: 0.1, rest_length: 0.01 } } }
}

#[test]
fn a_spring_without_a_direction_adds_nothing_to_the_compliance_of_surroundings() {
    let compliance = |stiffness| {
        let body = doubled(stiffness);
        let mut patch = Vec::new();
        body.block.patch(&[body.surface().triangles.len() as u32 - 5], [4, 4, 2], &mut patch);
        let graph = SpringGraph::new(&body).unwrap();
        let basis = Basis::compute(&graph, &patch, 10).unwrap().unwrap();
        assert_eq!(basis.states(), 10);
        Condensation::new(graph).unwrap().compliance(&patch).expect("finite")
    };
    assert_eq!(compliance(30.0), compliance(3000.0));
}
