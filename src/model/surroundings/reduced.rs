//! A linear model in few states, in modal form, that answers to forces on a ring of nodes.

use super::products::{Columns, Scratch};
use super::square::{Square, SquareScratch};
use crate::body::Stiffness;
use crate::linear_algebra::Matrix;

/// What the velocities do to the states' accelerations.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Damping {
    /// Proportional to the stiffness: one number per state (1/s).
    Diagonal(Vec<f64>),
    /// Of every state to every other (1/s).
    Full(Square),
}

impl Damping {
    /// Row by row, with the zeros of a diagonal one.
    #[cfg(test)]
    pub(super) fn to_matrix(&self) -> Matrix {
        match self {
            Self::Diagonal(damping) => Matrix::from_diagonal(&damping.clone().into()),
            Self::Full(damping) => damping.to_matrix(),
        }
    }

    fn scratch(&self) -> SquareScratch {
        match self {
            Self::Diagonal(_) => SquareScratch::default(),
            Self::Full(damping) => damping.scratch(),
        }
    }
}

/// eta'' = K eta + C eta' + Phi^T f with Phi^T M Phi = 1 and a diagonal K; the ring moves by Phi eta.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reduced {
    pub(super) states: usize,
    /// Phi on the ring (1/sqrt(kg)): three numbers for each node.
    pub(super) shapes: Columns,
    /// One number per state (1/s^2), negative, in increasing order.
    pub(super) stiffness: Vec<f64>,
    pub(super) damping: Damping,
}

impl Reduced {
    /// Of a ring without nodes.
    pub(super) fn of_nothing() -> Self {
        let shapes = Columns::new(&Matrix::zeros(0, 0));
        Self { states: 0, shapes, stiffness: Vec::new(), damping: Damping::Diagonal(Vec::new()) }
    }

    pub(crate) fn states(&self) -> usize {
        self.states
    }

    /// True if it answers to a ring of so many numbers, and all its parts are of one size.
    pub(crate) fn is_of(&self, ring: usize) -> bool {
        let damping = match &self.damping {
            Damping::Diagonal(damping) => damping.len() == self.states,
            Damping::Full(damping) => damping.size() == self.states,
        };
        damping && self.stiffness.len() == self.states && self.shapes.shape() == (ring, self.states)
    }

    /// One step of `d` seconds under `forces` on the ring (N, three numbers for each node).
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub(crate) fn step(&self, motion: &mut ReducedMotion, forces: &[f64], d: f64) {
        let ReducedMotion { eta, rate, acceleration, damped, displacements, velocities, scratch, square, stiffness } =
            motion;
        let (s, root) = (stiffness.factor(), stiffness.root());
        self.shapes.project(forces, scratch, acceleration);
        match &self.damping {
            Damping::Diagonal(damping) => {
                for ((a, c), rate) in acceleration.iter_mut().zip(damping).zip(&*rate) {
                    *a += root * (c * rate);
                }
            }
            Damping::Full(damping) => {
                damping.times(rate, square, damped);
                acceleration.iter_mut().zip(&*damped).for_each(|(a, damped)| *a += root * damped);
            }
        }
        for (((eta, rate), a), k) in eta.iter_mut().zip(&mut *rate).zip(acceleration).zip(&self.stiffness) {
            *rate += d * (*a + s * (k * *eta));
            *eta += d * *rate;
        }
        // The ring's displacements are Phi eta: they grow as eta does, and are no second product.
        self.shapes.combine(rate, scratch, velocities);
        displacements.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += d * v);
    }
}

/// The state of a [`Reduced`] model.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReducedMotion {
    eta: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
    /// What of it damping makes, where that takes a product.
    damped: Vec<f64>,
    /// Of the ring (m, m/s), three numbers for each node.
    displacements: Vec<f64>,
    velocities: Vec<f64>,
    scratch: Scratch,
    square: SquareScratch,
    /// Of the body, in that of the basis.
    stiffness: Stiffness,
}

impl ReducedMotion {
    /// Of `model` at rest, or of none, in a body that is so stiff: its shapes are the same, its stiffness is s K and its damping
    /// sqrt(s) C.
    ///
    /// # Real-time
    /// Not called in a tick: may allocate.
    pub(crate) fn rest(&mut self, model: Option<&Reduced>, stiffness: Stiffness) {
        self.stiffness = stiffness;
        let Self { eta, rate, acceleration, damped, displacements, velocities, scratch, square, .. } = self;
        let (rows, states) = model.map_or((0, 0), |model| model.shapes.shape());
        let of_states = [eta, rate, acceleration, damped].map(|vector| (vector, states));
        let of_ring = [displacements, velocities].map(|vector| (vector, rows));
        for (vector, length) in of_states.into_iter().chain(of_ring) {
            vector.clear();
            vector.resize(length, 0.0);
        }
        *scratch = model.map(|model| model.shapes.scratch()).unwrap_or_default();
        *square = model.map(|model| model.damping.scratch()).unwrap_or_default();
    }

    /// Adds the displacements (m) and velocities (m/s) of the ring, three numbers for each node.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub(crate) fn add_ring(&self, positions: &mut [f64], velocities: &mut [f64]) {
        positions.iter_mut().zip(&self.displacements).for_each(|(x, more)| *x += more);
        velocities.iter_mut().zip(&self.velocities).for_each(|(v, more)| *v += more);
    }
}
