//! Elements and how they hang together: forces and tangents in the rows of some nodes.

use super::element::{EdgeTangent, Element, Moved};
use crate::body::{State, TangentBlock};
use crate::mesh::Lists;
use crate::{Mat3, Vec3};

/// Elements between numbered nodes.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub(super) elements: Vec<Element>,
    /// The elements at each node.
    pub(super) at_node: Lists,
    /// 1 / sum V_e of the elements at each node (1/m^3), if pressures are averaged; a node with 0 has no pressure.
    pub(super) inverse_volumes: Option<Vec<f64>>,
}

impl Solid {
    pub(super) fn new(nodes: usize, elements: Vec<Element>, inverse_volumes: Option<Vec<f64>>) -> Self {
        let corners = elements.iter().zip(0..).flat_map(|(element, number)| element.nodes.map(|node| (node, number)));
        Self { at_node: Lists::new(nodes, corners), elements, inverse_volumes }
    }

    pub(super) fn at(&self, node: u32) -> impl Iterator<Item = &Element> {
        self.at_node.of(node).iter().map(|&element| &self.elements[element as usize])
    }

    /// Numbers of the elements that have one of `nodes`, in increasing order.
    pub(super) fn touching(&self, nodes: &[u32]) -> Vec<u32> {
        sorted(nodes.iter().flat_map(|&node| self.at_node.of(node)).copied().collect())
    }

    /// All nodes of `elements`, in increasing order.
    pub(super) fn corners(&self, elements: &[u32]) -> Vec<u32> {
        sorted(elements.iter().flat_map(|&element| self.elements[element as usize].nodes).collect())
    }

    /// J - 1 of each of `nodes`; empty if pressures are the elements' own.
    fn dilations(&self, state: &State, nodes: &[u32]) -> Vec<f64> {
        let Some(inverse_volumes) = &self.inverse_volumes else { return Vec::new() };
        let growth = |element: &Element| element.growth(&element.moved(state));
        let dilation = |&node: &u32| self.at(node).map(growth).sum::<f64>() * inverse_volumes[node as usize];
        nodes.iter().map(dilation).collect()
    }

    /// The forces on `nodes` (N).
    pub(super) fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        let ring = self.corners(&self.touching(nodes));
        let dilations = self.dilations(state, &ring);
        for (&node, force) in nodes.iter().zip(forces) {
            *force = Vec3::zeros();
            for element in self.at(node) {
                let moved = element.moved(state);
                let of_edges = element.forces(&moved, dilation(element, &ring, &dilations, element.growth(&moved)));
                *force += match element.nodes.iter().position(|&corner| corner == node) {
                    Some(corner @ 1..) => of_edges.column(corner - 1).into_owned(),
                    _ => -of_edges.column_sum(),
                };
            }
        }
    }

    /// What of Cauchy's stress shears at `node` (Pa): the mean over its elements, by their volumes at rest. An element that is turned
    /// inside out has none.
    pub(super) fn shear_stress(&self, state: &State, node: u32) -> Option<Mat3> {
        let mut sum = (Mat3::zeros(), 0.0);
        for element in self.at(node) {
            if let Some(stress) = element.shear_stress(&element.moved(state)) {
                sum = (sum.0 + stress * element.volume, sum.1 + element.volume);
            }
        }
        (sum.1 > 0.0).then(|| sum.0 / sum.1)
    }

    /// The tangent in the rows of `nodes`, each block once.
    pub(super) fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        let elements = self.touching(nodes);
        let ring = self.corners(&elements);
        let dilations = self.dilations(state, &ring);
        let tangents: Vec<([u32; 4], EdgeTangent)> = elements
            .iter()
            .map(|&number| {
                let element = &self.elements[number as usize];
                let moved = element.moved(state);
                let dilation = dilation(element, &ring, &dilations, element.growth(&moved));
                (element.nodes, element.tangent(&moved, dilation, self.inverse_volumes.is_some(), clamp))
            })
            .collect();
        let shares = self.pressure_shares(state, &ring);
        let mut row_blocks = Row::new(self.at_node.owners());
        for &row in nodes {
            for number in self.at_node.of(row) {
                let (corners, tangent) = &tangents[elements.binary_search(number).unwrap_or(0)];
                let corner = corners.iter().position(|&corner| corner == row).unwrap_or(0);
                for (n, &column) in corners.iter().enumerate() {
                    let [position, velocity] = [&tangent.position, &tangent.velocity].map(|t| of_corners(t, corner, n));
                    row_blocks.add(column, position, velocity);
                }
            }
            self.add_pressure(state, row, &ring, &shares, &mut row_blocks);
            row_blocks.drain(row, emit);
        }
    }

    /// For each of `nodes` the nodes that its J - 1 hangs on, and its gradient by their positions (1/m).
    fn pressure_shares(&self, state: &State, nodes: &[u32]) -> Vec<Vec<(u32, Vec3)>> {
        let Some(inverse_volumes) = &self.inverse_volumes else { return Vec::new() };
        let share = |&node: &u32| {
            let mut share: Vec<(u32, Vec3)> = Vec::new();
            for element in self.at(node) {
                for (corner, gradient) in element.nodes.into_iter().zip(volume_gradients(&element.moved(state))) {
                    let gradient = gradient * inverse_volumes[node as usize];
                    match share.iter_mut().find(|(other, _)| *other == corner) {
                        Some((_, sum)) => *sum += gradient,
                        None => share.push((corner, gradient)),
                    }
                }
            }
            share
        };
        nodes.iter().map(share).collect()
    }

    /// What the force on `row` answers to the averages of its elements' nodes.
    fn add_pressure(&self, state: &State, row: u32, ring: &[u32], shares: &[Vec<(u32, Vec3)>], blocks: &mut Row) {
        if shares.is_empty() {
            return;
        }
        // By how much a node's J - 1 pushes the row's node (N).
        let mut pushes: Vec<(u32, Vec3)> = Vec::new();
        for element in self.at(row) {
            let corner = element.nodes.iter().position(|&corner| corner == row).unwrap_or(0);
            let push = volume_gradients(&element.moved(state))[corner] * (-0.25 * element.bulk);
            for node in element.nodes {
                match pushes.iter_mut().find(|(other, _)| *other == node) {
                    Some((_, sum)) => *sum += push,
                    None => pushes.push((node, push)),
                }
            }
        }
        for (node, push) in pushes {
            let place = ring.binary_search(&node).unwrap_or(0);
            for (column, gradient) in &shares[place] {
                blocks.add(*column, push * gradient.transpose(), Mat3::zeros());
            }
        }
    }
}

/// The gradients of an element's volume by the positions of its nodes (m^2).
pub(super) fn volume_gradients(moved: &Moved) -> [Vec3; 4] {
    let areas = moved.areas / 6.0;
    let column = |n: usize| areas.column(n).into_owned();
    [-areas.column_sum(), column(0), column(1), column(2)]
}

/// The mean J - 1 of the element's nodes, which are in `ring`; its own if there are no `dilations`.
fn dilation(element: &Element, ring: &[u32], dilations: &[f64], growth: f64) -> f64 {
    if dilations.is_empty() {
        return growth / element.volume;
    }
    let of_node = |node: u32| ring.binary_search(&node).map_or(0.0, |place| dilations[place]);
    element.nodes.map(of_node).iter().sum::<f64>() * 0.25
}

/// The block of two corners from those of edges: corner 0 is the opposite of all edges.
fn of_corners(edges: &[[Mat3; 3]; 3], row: usize, column: usize) -> Mat3 {
    match (row, column) {
        (0, 0) => edges.iter().flatten().sum(),
        (0, l) => -(edges[0][l - 1] + edges[1][l - 1] + edges[2][l - 1]),
        (k, 0) => -(edges[k - 1][0] + edges[k - 1][1] + edges[k - 1][2]),
        (k, l) => edges[k - 1][l - 1],
    }
}

fn sorted(mut numbers: Vec<u32>) -> Vec<u32> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// The blocks of one row, added up.
struct Row {
    /// Where each column's block is, or `NONE`.
    place: Vec<u32>,
    blocks: Vec<(u32, Mat3, Mat3)>,
}

impl Row {
    const NONE: u32 = u32::MAX;

    fn new(columns: usize) -> Self {
        Self { place: vec![Self::NONE; columns], blocks: Vec::new() }
    }

    fn add(&mut self, column: u32, position: Mat3, velocity: Mat3) {
        let place = &mut self.place[column as usize];
        if *place == Self::NONE {
            *place = self.blocks.len() as u32;
            self.blocks.push((column, Mat3::zeros(), Mat3::zeros()));
        }
        let block = &mut self.blocks[*place as usize];
        block.1 += position;
        block.2 += velocity;
    }

    fn drain(&mut self, row: u32, emit: &mut dyn FnMut(TangentBlock)) {
        for (column, position, velocity) in self.blocks.drain(..) {
            self.place[column as usize] = Self::NONE;
            emit(TangentBlock { row, column, position, velocity });
        }
    }
}
