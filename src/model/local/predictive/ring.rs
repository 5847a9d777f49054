//! The ring around a patch: the springs that reach it, as they are, and what is predicted for it, substep by substep.

use std::ops::Range;

use super::super::patch::Window;
use crate::Vec3;
use crate::body::State;
use crate::body::kernel::NetworkKernel;
use crate::surroundings::SpringGraph;

/// Past its end the prediction coasts with its last velocity for this long (s), then stands still.
const COASTING: f64 = 15e-3;

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

/// The predicted motion of the ring: positions (m), velocities (m/s) and near springs' forces (N), three numbers for each
/// ring node.
#[derive(Clone, Debug, Default)]
pub(super) struct RingPath {
    /// Numbers of one quantity: three times the ring nodes.
    numbers: usize,
    /// Substep (s).
    step: f64,
    /// Positions, velocities and forces at the start of each substep, one after the other.
    samples: Vec<f64>,
}

/// The ring at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct RingSample<'a> {
    pub(super) positions: &'a [f64],
    pub(super) velocities: &'a [f64],
    pub(super) forces: &'a [f64],
    /// How long the ring has gone on with its velocity since (s).
    pub(super) coasted: f64,
    /// False once it stands still.
    pub(super) moves: bool,
}

impl RingPath {
    /// Forgets all samples; the next are of `ring` nodes, `step` seconds apart, and there is room for `count`.
    pub(super) fn clear(&mut self, ring: usize, step: f64, count: usize) {
        (self.numbers, self.step) = (3 * ring, step);
        self.samples.clear();
        self.samples.reserve(3 * self.numbers * count);
    }

    /// Appends the nodes of `ring` with the `forces` on them.
    pub(super) fn push(&mut self, state: &State, forces: &[Vec3], ring: Range<usize>) {
        debug_assert_eq!(3 * ring.len(), self.numbers);
        for vectors in [&state.positions, &state.velocities, forces] {
            vectors[ring.clone()].iter().for_each(|vector| self.samples.extend_from_slice(vector.as_slice()));
        }
    }

    /// The ring at the start of substep `n`, which may lie past the end.
    pub(super) fn at(&self, n: usize) -> RingSample<'_> {
        let last = (self.samples.len() / (3 * self.numbers).max(1)).saturating_sub(1);
        let sample = &self.samples[n.min(last) * 3 * self.numbers..];
        let beyond = n.saturating_sub(last) as f64 * self.step;
        RingSample {
            positions: &sample[..self.numbers],
            velocities: &sample[self.numbers..2 * self.numbers],
            forces: &sample[2 * self.numbers..3 * self.numbers],
            coasted: beyond.min(COASTING),
            moves: beyond < COASTING,
        }
    }
}

impl RingSample<'_> {
    /// Writes where the ring is (m) and its velocity (m/s).
    pub(super) fn write(&self, positions: &mut [f64], velocities: &mut [f64]) {
        positions.copy_from_slice(self.positions);
        if self.moves {
            velocities.copy_from_slice(self.velocities);
        } else {
            velocities.fill(0.0);
        }
        if self.coasted > 0.0 {
            positions.iter_mut().zip(self.velocities).for_each(|(x, v)| *x += v * self.coasted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn past_its_end_the_ring_coasts_and_then_stands_still() {
        let mut path = RingPath::default();
        path.clear(1, 1e-3, 3);
        for n in 0..3 {
            let state = State { positions: vec![Vec3::x() * f64::from(n)], velocities: vec![Vec3::x()] };
            path.push(&state, &[Vec3::y() * f64::from(n)], 0..1);
        }
        let at = |n| {
            let (mut x, mut v) = ([0.0; 3], [0.0; 3]);
            path.at(n).write(&mut x, &mut v);
            (x[0], v[0], path.at(n).forces[1])
        };
        assert_eq!((at(1), at(2)), ((1.0, 1.0, 1.0), (2.0, 1.0, 2.0)));
        assert!((at(12).0 - 2.010).abs() < 1e-12 && at(12).1 == 1.0);
        assert!((at(100).0 - 2.015).abs() < 1e-12 && at(100).1 == 0.0 && at(100).2 == 2.0);
    }
}
