//! The ring around a patch: the part of the body that reaches it, as it is, and what is predicted for it, substep by substep.

use std::ops::Range;

use crate::Vec3;
use crate::body::{Body, Restriction, State, Stiffness};

/// Past its end the prediction coasts with its last velocity for this long (s), then stands still.
const COASTING: f64 = 15e-3;

/// What of the body depends on the patch, with the body's own law.
#[derive(Debug, Default)]
pub(super) struct NearBody {
    restriction: Option<Restriction>,
    /// Ids of the patch's nodes, that it was made for.
    patch: Vec<u32>,
    /// How stiff the body was then.
    stiffness: Stiffness,
    /// Working memory, of the restriction's nodes.
    state: State,
    forces: Vec<Vec3>,
}

impl NearBody {
    /// The body is so stiff from now on.
    pub(super) fn expect(&mut self, stiffness: Stiffness) {
        if self.stiffness != stiffness {
            (self.restriction, self.stiffness) = (None, stiffness);
        }
    }

    /// That of `patch` in `body`; returns its other nodes: the ring, and held ones.
    pub(super) fn rebuild(&mut self, body: &dyn Body, patch: &[u32]) -> [&[u32]; 2] {
        if self.restriction.is_none() || self.patch != patch {
            patch.clone_into(&mut self.patch);
            self.restriction = body.restriction(patch);
            let nodes = self.restriction.as_ref().map_or(0, |restriction| restriction.nodes.len());
            self.forces.resize(nodes, Vec3::zeros());
        }
        self.restriction.as_ref().map_or([&[], &[]], |near| [near.ring(patch.len()), near.held(patch.len())])
    }

    /// The number of its nodes: patch, ring and held ones, the first of the window.
    pub(super) fn len(&self) -> usize {
        self.forces.len()
    }

    /// Writes the force that it puts on each node of the window (N); patch, ring and held nodes come first there as here.
    pub(super) fn forces(&mut self, window: &State, forces: &mut [Vec3]) {
        let count = self.forces.len();
        if let Some(Restriction { body, .. }) = &mut self.restriction {
            window.positions[..count].clone_into(&mut self.state.positions);
            window.velocities[..count].clone_into(&mut self.state.velocities);
            body.forces(&self.state, &mut self.forces);
        }
        forces[..count].copy_from_slice(&self.forces);
        forces[count..].fill(Vec3::zeros());
    }
}

/// The predicted motion of the ring: positions (m), velocities (m/s) and near forces (N), three numbers for each
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

    /// Takes samples as [`samples`](Self::samples) gives them; false if they are not of these nodes, or none.
    pub(super) fn take(&mut self, samples: &[f64]) -> bool {
        let fits = self.numbers > 0 && !samples.is_empty() && samples.len().is_multiple_of(3 * self.numbers);
        if fits {
            self.samples.extend_from_slice(samples);
        }
        fits
    }

    /// Positions (m), velocities (m/s) and forces (N) at the start of each substep, one after the other.
    pub(super) fn samples(&self) -> &[f64] {
        &self.samples
    }

    /// Takes the last `count` samples back, all but the first at most.
    pub(super) fn drop_last(&mut self, count: usize) {
        let size = 3 * self.numbers;
        self.samples.truncate(self.samples.len().saturating_sub(count * size).max(size));
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
        path.drop_last(1);
        assert_eq!(path.at(2).forces[1], 1.0);
        path.drop_last(9);
        assert_eq!(path.at(2).forces[1], 0.0, "the first stays");
    }
}
