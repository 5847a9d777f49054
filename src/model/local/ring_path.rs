//! What the global model predicts for the ring around a patch, substep by substep.

use super::super::Vec3;
use super::super::body::State;

/// Past its end the prediction coasts with its last velocity for this long (s), then stands still.
const COASTING: f64 = 15e-3;

/// Position (m), velocity (m/s) and the near springs' force (N) of one ring node at the start of a substep.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RingSample {
    pub position: Vec3,
    pub velocity: Vec3,
    pub force: Vec3,
}

impl RingSample {
    pub(super) fn at(node: usize, state: &State, forces: &[Vec3]) -> Self {
        Self { position: state.positions[node], velocity: state.velocities[node], force: forces[node] }
    }
}

/// The predicted motion of the ring.
#[derive(Clone, Debug, Default)]
pub(super) struct RingPath {
    ring: usize,
    /// Substep (s).
    step: f64,
    /// One after the other the samples of each substep, and of the end.
    samples: Vec<RingSample>,
}

impl RingPath {
    /// Forgets all samples; the next are of `ring` nodes, `step` seconds apart.
    pub(super) fn clear(&mut self, ring: usize, step: f64) {
        (self.ring, self.step) = (ring, step);
        self.samples.clear();
    }

    pub(super) fn push(&mut self, samples: impl Iterator<Item = RingSample>) {
        self.samples.extend(samples);
        debug_assert!(self.ring == 0 || self.samples.len().is_multiple_of(self.ring));
    }

    /// The ring at the start of substep `n`, which may lie past the end.
    pub(super) fn at(&self, n: usize) -> impl Iterator<Item = RingSample> {
        let last = (self.samples.len() / self.ring.max(1)).saturating_sub(1);
        let beyond = n.saturating_sub(last) as f64 * self.step;
        let first = n.min(last) * self.ring;
        let samples = &self.samples[first..(first + self.ring).min(self.samples.len())];
        samples.iter().map(move |sample| {
            if beyond == 0.0 {
                return *sample;
            }
            let velocity = if beyond < COASTING { sample.velocity } else { Vec3::zeros() };
            RingSample { position: sample.position + sample.velocity * beyond.min(COASTING), velocity, ..*sample }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn past_its_end_the_ring_coasts_and_then_stands_still() {
        let mut path = RingPath::default();
        path.clear(1, 1e-3);
        for n in 0..3 {
            let position = Vec3::x() * f64::from(n);
            path.push(std::iter::once(RingSample { position, velocity: Vec3::x(), force: Vec3::zeros() }));
        }
        let at = |n| path.at(n).next().unwrap();
        assert_eq!((at(1).position.x, at(2).position.x), (1.0, 2.0));
        assert!((at(12).position.x - 2.010).abs() < 1e-12 && at(12).velocity.x == 1.0);
        assert!((at(100).position.x - 2.015).abs() < 1e-12 && at(100).velocity.x == 0.0);
        assert_eq!(RingPath::default().at(5).count(), 0);
    }
}
