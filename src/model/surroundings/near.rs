//! A patch and the springs that touch it, linear around rest.

use super::graph::SpringGraph;
use crate::body::assemble;
use crate::linear_algebra::Matrix;

/// At most so many nodes of a patch are pressed.
const CONTACTS: usize = 12;

/// Mass, damping and stiffness (all positive) of the patch's movable coordinates, then of the ring's; the ring without its
/// mass, which belongs to the surroundings.
#[derive(Debug)]
pub(super) struct Near {
    pub(super) mass: Matrix,
    pub(super) damping: Matrix,
    pub(super) stiffness: Matrix,
    /// Coordinates of the patch.
    pub(super) patch: usize,
    /// The nodes that a tool presses: those of the patch with the least stiffness towards the ring, as a
    /// window leaves a node to spare around the tool.
    pub(super) pressed: Vec<Pressed>,
}

/// A node of the patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    /// Its id.
    pub(super) node: u32,
    /// The first of its coordinates.
    pub(super) coordinate: usize,
}

impl Near {
    /// Of `patch` and its `ring` (ids in increasing order).
    pub(super) fn new(graph: &SpringGraph, patch: &[u32], ring: &[u32]) -> Self {
        let movable: Vec<u32> =
            patch.iter().copied().filter(|&node| graph.inverse_masses()[node as usize] > 0.0).collect();
        let on_patch = 3 * movable.len();
        let place = |node: u32| {
            let of_ring = || ring.binary_search(&node).ok().map(|place| on_patch + 3 * place);
            movable.binary_search(&node).ok().map(|place| 3 * place).or_else(of_ring)
        };
        let total = on_patch + 3 * ring.len();
        let [mut mass, mut damping, mut stiffness] = [0; 3].map(|_| Matrix::zeros(total, total));
        let mut outward = vec![0.0; movable.len()];
        for (at, &node) in movable.iter().enumerate() {
            (0..3).for_each(|axis| mass[(3 * at + axis, 3 * at + axis)] = 1.0 / graph.inverse_masses()[node as usize]);
        }
        for link in graph.links() {
            let is_near = link.nodes.map(|node| patch.binary_search(&node).is_ok());
            let Some(direction) = graph.direction(link).filter(|_| is_near[0] || is_near[1]) else { continue };
            let places = link.nodes.map(place);
            for (matrix, weight) in [(&mut stiffness, link.spring.stiffness), (&mut damping, link.spring.damping)] {
                assemble(direction, weight, places, |row, column, block| {
                    let mut part = matrix.fixed_view_mut::<3, 3>(row, column);
                    part += block;
                });
            }
            if is_near[0] != is_near[1] {
                let inner = places[usize::from(is_near[1])].filter(|place| *place < on_patch);
                inner.into_iter().for_each(|place| outward[place / 3] += link.spring.stiffness);
            }
        }
        let least = outward.iter().copied().fold(f64::INFINITY, f64::min);
        let inner = (0..movable.len()).filter(|&at| outward[at] <= least * (1.0 + 1e-9));
        let pressed: Vec<Pressed> = inner.map(|at| Pressed { node: movable[at], coordinate: 3 * at }).collect();
        let stride = pressed.len().div_ceil(CONTACTS).max(1);
        Self { mass, damping, stiffness, patch: on_patch, pressed: pressed.into_iter().step_by(stride).collect() }
    }

    /// `own` with the ring's coordinates replaced by states, which are `on_ring` there (a column each) and have `sign` times
    /// the matrix `far` of their own.
    pub(super) fn beside(&self, own: &Matrix, on_ring: &Matrix, far: &Matrix, sign: f64) -> Matrix {
        let (patch, ring, states) = (self.patch, on_ring.nrows(), on_ring.ncols());
        let mut all = Matrix::zeros(patch + states, patch + states);
        all.view_mut((0, 0), (patch, patch)).copy_from(&own.view((0, 0), (patch, patch)));
        all.view_mut((patch, 0), (states, patch)).copy_from(&on_ring.tr_mul(&own.view((patch, 0), (ring, patch))));
        let of_ring = on_ring.tr_mul(&(own.view((patch, patch), (ring, ring)) * on_ring));
        all.view_mut((patch, patch), (states, states)).copy_from(&(of_ring + far * sign));
        all
    }
}
