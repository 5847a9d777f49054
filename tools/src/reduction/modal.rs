//! Modes of a proportionally damped system: its responses and Gramians in closed form; and the slowest ones of a large system.

use nalgebra::Complex;
use palpate::model::ModelError;

use super::congruence::Congruence;
use super::linalg::{CMatrix, Matrix, append_orthonormal, complex, pencil_eigen, product, symmetric_eigen};
use super::response::{Response, largest_gain, log_spaced};
use super::system::{Ports, Rayleigh, SecondOrder, not_held};

/// q'' + c q' + w^2 q = Phi^T B u for each mode, with x = Phi q.
#[derive(Clone, Debug)]
pub struct Modal {
    /// w of each mode (rad/s), in increasing order.
    pub frequencies: Vec<f64>,
    /// c of each mode (1/s).
    pub dampings: Vec<f64>,
    /// The ports: Phi^T B and what comes out.
    pub ports: Ports,
    /// Phi, n x n (1/sqrt(kg)).
    pub shapes: Matrix,
}

impl Modal {
    /// The modes of `system`; `None` if its damping is not proportional, its mass not positive definite or nothing holds it.
    pub fn new(system: &SecondOrder) -> Option<Self> {
        let rayleigh = system.rayleigh()?;
        match system.lumped_mass() {
            Some(masses) => {
                let roots: Vec<f64> = masses.iter().map(|m| 1.0 / m.sqrt()).collect();
                let mut stiffness = system.stiffness();
                let n = stiffness.nrows();
                for column in 0..n {
                    for row in 0..n {
                        stiffness[(row, column)] *= roots[row] * roots[column];
                    }
                }
                let (values, mut shapes) = symmetric_eigen(&stiffness)?;
                for mut column in shapes.column_iter_mut() {
                    column.iter_mut().zip(&roots).for_each(|(x, root)| *x *= root);
                }
                Self::from_eigen(values, shapes, rayleigh, &system.ports)
            }
            None => Self::of(&Congruence::whole(system)),
        }
    }

    /// The modes of a small system; `None` where [`new`](Self::new) has none.
    pub fn of(small: &Congruence) -> Option<Self> {
        let rayleigh = small.rayleigh()?;
        let (values, shapes) = pencil_eigen(&small.stiffness, &small.mass)?;
        Self::from_eigen(values, shapes, rayleigh, &small.ports)
    }

    fn from_eigen(values: Vec<f64>, shapes: Matrix, rayleigh: Rayleigh, ports: &Ports) -> Option<Self> {
        if values.iter().any(|&value| value <= 0.0) {
            return None;
        }
        let dampings = values.iter().map(|value| rayleigh.mass + rayleigh.stiffness * value).collect();
        let frequencies = values.iter().map(|value| value.sqrt()).collect();
        Some(Self { frequencies, dampings, ports: ports.project(&shapes), shapes })
    }

    /// Number of modes.
    pub fn modes(&self) -> usize {
        self.frequencies.len()
    }

    /// A X for the first-order states (w q, q'), one block of two rows per mode: A = [0, w; -w, -c].
    pub(super) fn times_a(&self, states: &Matrix) -> Matrix {
        let mut out = Matrix::zeros(states.nrows(), states.ncols());
        for (from, mut to) in states.column_iter().zip(out.column_iter_mut()) {
            for (mode, (&w, &c)) in self.frequencies.iter().zip(&self.dampings).enumerate() {
                let (position, velocity) = (from[2 * mode], from[2 * mode + 1]);
                to[2 * mode] = w * velocity;
                to[2 * mode + 1] = -w * position - c * velocity;
            }
        }
        out
    }

    /// B of the first-order states (w q, q'), 2n x m.
    pub(super) fn input(&self) -> Matrix {
        let b = &self.ports.input;
        Matrix::from_fn(
            2 * self.modes(),
            b.ncols(),
            |row, column| if row % 2 == 1 { b[(row / 2, column)] } else { 0.0 },
        )
    }

    /// C^T of the first-order states (w q, q'), 2n x p.
    pub(super) fn output(&self) -> Matrix {
        let Ports { position, velocity, .. } = &self.ports;
        Matrix::from_fn(2 * self.modes(), position.ncols(), |row, column| match row % 2 {
            0 => position[(row / 2, column)] / self.frequencies[row / 2],
            _ => velocity[(row / 2, column)],
        })
    }

    /// The displacements x = Phi q (n x columns) in first-order states (w q, q').
    pub(super) fn displacements(&self, states: &Matrix) -> Matrix {
        let q = Matrix::from_fn(self.modes(), states.ncols(), |mode, column| {
            states[(2 * mode, column)] / self.frequencies[mode]
        });
        product(&self.shapes, &q)
    }
}

impl Response for Modal {
    fn at(&self, s: Complex<f64>) -> Option<CMatrix> {
        let Ports { input, position, velocity, direct } = &self.ports;
        let mut out = complex(direct);
        for (mode, (&w, &c)) in self.frequencies.iter().zip(&self.dampings).enumerate() {
            let answer = (s * s + s * c + w * w).inv();
            for i in 0..position.ncols() {
                let left = (s * velocity[(mode, i)] + position[(mode, i)]) * answer;
                for j in 0..input.ncols() {
                    out[(i, j)] += left * input[(mode, j)];
                }
            }
        }
        out.iter().all(|z| z.is_finite()).then_some(out)
    }
}

/// The infinity norm of `modal` minus `other` over that of `modal`, %: over frequencies from well below its slowest mode to well above
/// the fastest, and at those of its modes that ring.
pub fn gain_error(modal: &Modal, other: &dyn Response) -> f64 {
    let hz = |w: f64| w / (2.0 * std::f64::consts::PI);
    let (Some(&slow), Some(&fast)) = (modal.frequencies.first(), modal.frequencies.last()) else { return 0.0 };
    let mut frequencies = log_spaced(hz(1e-2 * slow), hz(10.0 * fast), 200);
    let rings = |&(w, c): &(&f64, &f64)| c < w;
    frequencies.extend(modal.frequencies.iter().zip(&modal.dampings).filter(rings).map(|(w, _)| hz(*w)));
    frequencies.sort_by(f64::total_cmp);
    100.0 * largest_gain(modal, Some(other), &frequencies) / largest_gain(modal, None, &frequencies)
}

/// The error that [`gain_error`] measures, for a `model` of `system` that has no modes, %.
pub fn typical_gain_error(system: &SecondOrder, model: &dyn Response, other: &dyn Response) -> f64 {
    let hz = system.typical_frequency() / (2.0 * std::f64::consts::PI);
    let frequencies = log_spaced(1e-3 * hz, 1e2 * hz, 240);
    100.0 * largest_gain(model, Some(other), &frequencies) / largest_gain(model, None, &frequencies)
}

/// The largest number of steps of the iteration.
const STEPS: usize = 60;
/// Frequencies squared that change by less than this share in a step are found.
const TOLERANCE: f64 = 1e-10;

/// w^2 (rad^2/s^2) and shapes (n x count) of the `count` slowest undamped modes, by block inverse iteration (Bathe 1973) from the answers to forces that differ from
/// coordinate to coordinate.
pub(super) fn slow_modes(system: &SecondOrder, count: usize) -> Result<(Vec<f64>, Matrix), ModelError> {
    let n = system.coordinates();
    let count = count.min(n);
    let width = (2 * count + 4).min(n);
    let factor = system.factorised(0.0)?;
    let mut block =
        Matrix::from_fn(n, width, |row, column| ((row * (2 * column + 1)) as f64 * 0.7 + column as f64).sin());
    let mut last = vec![0.0; count];
    for _ in 0..STEPS {
        let answers = factor.solve(system.times_mass(&block));
        let mut basis = Matrix::zeros(n, 0);
        append_orthonormal(&mut basis, &answers, 1e-12);
        // Modes of the mass-normalised problem in that span.
        let small = Congruence::new(system, &basis);
        let (values, vectors) = pencil_eigen(&small.stiffness, &small.mass).ok_or_else(not_held)?;
        block = product(&basis, &vectors);
        let found = values.iter().take(count).zip(&last).all(|(new, old)| (new - old).abs() <= TOLERANCE * new);
        last = values[..count.min(values.len())].to_vec();
        if found {
            break;
        }
    }
    let count = count.min(block.ncols());
    Ok((last, block.columns(0, count).into_owned()))
}
