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
            // A tick allocates nothing, where nothing asks for forces before it either.
            let nodes = self.len();
            self.state.positions.resize(nodes, Vec3::zeros());
            self.state.velocities.resize(nodes, Vec3::zeros());
        }
        self.restriction.as_ref().map_or([&[], &[]], |near| [near.ring(patch.len()), near.held(patch.len())])
    }

    /// The number of its nodes: patch, ring and held ones, the first of the window.
    pub(super) fn len(&self) -> usize {
        self.restriction.as_ref().map_or(0, |restriction| restriction.nodes.len())
    }

    /// The longest stable step where its forces were asked for last, over that at rest.
    pub(super) fn stable_share(&mut self) -> f64 {
        let Self { restriction, state, .. } = self;
        restriction.as_mut().map_or(1.0, |near| near.body.stable_share(state))
    }

    /// Writes the force that it puts on each node of the window (N); patch, ring and held nodes come first there as here.
    pub(super) fn forces(&mut self, window: &State, forces: &mut [Vec3]) {
        let (near, rest) = forces.split_at_mut(self.len());
        if let Some(Restriction { body, .. }) = &mut self.restriction {
            window.positions[..near.len()].clone_into(&mut self.state.positions);
            window.velocities[..near.len()].clone_into(&mut self.state.velocities);
            body.forces(&self.state, near);
        }
        rest.fill(Vec3::zeros());
    }
}

/// The predicted motion of the ring: positions (m), velocities (m/s) and near forces (N), three numbers for each
/// ring node.
#[derive(Clone, Debug, Default)]
pub(super) struct RingPath {
    /// Numbers of one quantity: three times the ring nodes.
    numbers: usize,
    /// Substep of the local model (s).
    step: f64,
    /// Substeps from one sample to the next.
    stride: usize,
    /// Positions, velocities and forces at the start of each step of what ran ahead, one after the other.
    samples: Vec<f64>,
}

/// The ring at one time, between two samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct RingSample<'a> {
    /// Positions, velocities and forces before and after.
    around: [[&'a [f64]; 3]; 2],
    /// How far it is from the one to the other, below 1.
    share: f64,
    /// How long the ring has gone on with its velocity since (s).
    coasted: f64,
    /// False once it stands still.
    moves: bool,
}

impl RingPath {
    /// Forgets all samples; the next are of `ring` nodes, `stride` substeps of `step` seconds apart, and there is room for `count`.
    pub(super) fn clear(&mut self, ring: usize, (step, stride): (f64, usize), count: usize) {
        (self.numbers, self.step, self.stride) = (3 * ring, step, stride);
        self.samples.clear();
        self.samples.reserve(3 * self.numbers * count);
    }

    /// Appends the nodes of `ring` with the `forces` on them.
    pub(super) fn push(&mut self, state: &State, forces: &[Vec3], ring: Range<usize>) {
        assert_eq!(3 * ring.len(), self.numbers);
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

    /// Positions (m), velocities (m/s) and forces (N) at the start of each step, one after the other.
    pub(super) fn samples(&self) -> &[f64] {
        &self.samples
    }

    /// Takes the last `count` samples back, all but the first at most.
    pub(super) fn drop_last(&mut self, count: usize) {
        let size = 3 * self.numbers;
        self.samples.truncate(self.samples.len().saturating_sub(count * size).max(size));
    }

    /// The ring `substeps` after the first sample, which may lie past the end.
    pub(super) fn at(&self, substeps: f64) -> RingSample<'_> {
        let last = (self.samples.len() / (3 * self.numbers).max(1)).saturating_sub(1);
        let stride = self.stride.max(1) as f64;
        let before = (substeps / stride) as usize;
        let since = substeps - before as f64 * stride;
        let sample = |at: usize| {
            let sample = &self.samples[at.min(last) * 3 * self.numbers..];
            [0, 1, 2].map(|quantity| &sample[quantity * self.numbers..(quantity + 1) * self.numbers])
        };
        let beyond = (substeps - last as f64 * stride).max(0.0) * self.step;
        RingSample {
            around: [sample(before), sample(if since == 0.0 { before } else { before + 1 })],
            share: since / stride,
            coasted: beyond.min(COASTING),
            moves: beyond < COASTING,
        }
    }
}

impl RingSample<'_> {
    /// Writes where the ring is (m) and its velocity (m/s).
    pub(super) fn write(&self, positions: &mut [f64], velocities: &mut [f64]) {
        self.between(0, positions);
        self.between(1, velocities);
        if self.coasted > 0.0 {
            positions.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += v * self.coasted);
        }
        if !self.moves {
            velocities.fill(0.0);
        }
    }

    /// Writes the forces on it (N).
    pub(super) fn write_forces(&self, forces: &mut [f64]) {
        self.between(2, forces);
    }

    fn between(&self, quantity: usize, out: &mut [f64]) {
        let [before, after] = self.around.map(|sample| sample[quantity]);
        if self.share == 0.0 {
            out.copy_from_slice(before);
            return;
        }
        for ((out, before), after) in out.iter_mut().zip(before).zip(after) {
            *out = before + (after - before) * self.share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn past_its_end_the_ring_coasts_and_then_stands_still() {
        let mut path = RingPath::default();
        path.clear(1, (1e-3, 1), 3);
        for n in 0..3 {
            let state = State { positions: vec![Vec3::x() * f64::from(n)], velocities: vec![Vec3::x()] };
            path.push(&state, &[Vec3::y() * f64::from(n)], 0..1);
        }
        let at = |n| at(&path, n);
        assert_eq!((at(1), at(2)), ((1.0, 1.0, 1.0), (2.0, 1.0, 2.0)));
        assert!((at(12).0 - 2.010).abs() < 1e-12 && at(12).1 == 1.0);
        assert!((at(100).0 - 2.015).abs() < 1e-12 && at(100).1 == 0.0 && at(100).2 == 2.0);
        path.drop_last(1);
        assert_eq!(self::at(&path, 2).2, 1.0);
        path.drop_last(9);
        assert_eq!(self::at(&path, 2).2, 0.0, "the first stays");
    }

    /// Position and velocity along x, and force along y.
    fn at(path: &RingPath, n: u32) -> (f64, f64, f64) {
        let [mut x, mut v, mut f] = [[0.0; 3]; 3];
        path.at(n.into()).write(&mut x, &mut v);
        path.at(n.into()).write_forces(&mut f);
        (x[0], v[0], f[1])
    }

    #[test]
    fn between_the_steps_of_what_ran_ahead_the_ring_goes_straight() {
        let mut path = RingPath::default();
        path.clear(1, (1e-3, 3), 2);
        for n in [0.0, 1.0] {
            let state = State { positions: vec![Vec3::x() * n], velocities: vec![Vec3::x() * (2.0 + n)] };
            path.push(&state, &[Vec3::y() * 6.0 * n], 0..1);
        }
        let third = 1.0 / 3.0;
        assert_eq!([at(&path, 0), at(&path, 1)], [(0.0, 2.0, 0.0), (third, 2.0 + third, 2.0)]);
        assert_eq!(at(&path, 3), (1.0, 3.0, 6.0));
        assert!((at(&path, 5).0 - 1.006).abs() < 1e-12, "two substeps past the end");
    }
}
