//! How wrong a congruence can be, from its residual alone.

use nalgebra::Complex;
use palpate::model::ModelError;

use super::congruence::Congruence;
use super::krylov::Projection;
use super::linalg::{CMatrix, Matrix, complex, product_t, side_by_side, solve_complex};
use super::modal::slow_modes;
use super::system::{Rayleigh, SecondOrder};

/// The slowest mode is found up to this share of its frequency squared.
const CLOSE: f64 = 0.99;

/// Bounds the error of a [`Projection`] at any frequency.
///
/// Let D(s) = s^2 M + s C + K. By the residuals R = B - D T X of the answer and L = P + s V - D T Y of the dual one, the error of the
/// response is exactly L^T D^-1 R (Grimme 1997; Feng, Antoulas and Benner 2017, Int. J. Numer. Methods Eng.). With C = alpha M + beta K all
/// three matrices have the same modes, so that D^-1 is at most c(s) times A^-1, A = s0^2 M + s0 C + K at a real s0, with c(s) the largest
/// ratio of the two over all frequencies that a mode can have, from the slowest one up: one factorisation serves all s, and the bound is
/// rigorous. With other
/// damping alpha = 0 and beta = trace C / trace K stand for it, and what comes out is an estimate.
#[derive(Clone, Debug)]
pub struct ErrorBound {
    /// Products of A^-1 between all of B, P, V, M T, C T and K T.
    gram: Matrix,
    model: Congruence,
    rayleigh: Rayleigh,
    shift: f64,
    /// w^2 of the slowest mode, from below.
    slowest: f64,
}

impl ErrorBound {
    /// The bound for a model of `system`; `shift` is s0 (rad/s).
    ///
    /// # Errors
    /// If nothing holds the system.
    pub fn new(system: &SecondOrder, model: &Projection, shift: f64) -> Result<Self, ModelError> {
        let ports = &system.ports;
        let basis = &model.basis;
        let products = [system.times_mass(basis), system.times_damping(basis), system.times_stiffness(basis)];
        let [mass, damping, stiffness] = &products;
        let all = side_by_side(&[&ports.input, &ports.position, &ports.velocity, mass, damping, stiffness]);
        let gram = product_t(&all, &system.solve(shift, all.clone())?);
        // The iteration comes from above.
        let slowest = CLOSE * slow_modes(system, 1)?.0.first().copied().unwrap_or(0.0);
        let known = system.rayleigh();
        let rayleigh = known.unwrap_or_else(|| Rayleigh { mass: 0.0, stiffness: system.damping_over_stiffness() });
        Ok(Self { gram, model: model.model.clone(), rayleigh, shift, slowest })
    }

    /// No entry of the error of the response at s has a larger norm than this; `None` at a pole of the model.
    pub fn at(&self, s: Complex<f64>) -> Option<f64> {
        let model = &self.model;
        let (m, p, r) = (model.ports.inputs(), model.ports.outputs(), model.mass.nrows());
        // Both answers from one factorisation.
        let mut sides = CMatrix::zeros(r, m + p);
        sides.columns_mut(0, m).copy_from(&complex(&model.ports.input));
        sides.columns_mut(m, p).copy_from(&model.outputs(s));
        let answers = solve_complex(model.dynamic_stiffness(s), &sides)?;
        let (x, y) = (answers.columns(0, m).into_owned(), answers.columns(m, p).into_owned());
        // The residuals as combinations of the columns behind `gram`.
        let residual = |z: &CMatrix, of_input: bool| {
            let count = z.ncols();
            let mut weights = CMatrix::zeros(self.gram.nrows(), count);
            for column in 0..count {
                if of_input {
                    weights[(column, column)] = Complex::new(1.0, 0.0);
                } else {
                    weights[(m + column, column)] = Complex::new(1.0, 0.0);
                    weights[(m + p + column, column)] = s;
                }
                for (block, factor) in [s * s, s, Complex::new(1.0, 0.0)].into_iter().enumerate() {
                    for row in 0..r {
                        weights[(m + 2 * p + block * r + row, column)] = -factor * z[(row, column)];
                    }
                }
            }
            weights
        };
        let size = |weights: &CMatrix| {
            let gram = weights.adjoint() * complex(&self.gram) * weights;
            // The trace is at least the largest eigenvalue.
            gram.diagonal().iter().map(|z| z.re.max(0.0)).sum::<f64>().sqrt()
        };
        Some(self.ratio(s) * size(&residual(&x, true)) * size(&residual(&y, false)))
    }

    /// The bound at a frequency (Hz), see [`at`](Self::at).
    pub fn at_hz(&self, hz: f64) -> Option<f64> {
        self.at(Complex::new(0.0, 2.0 * std::f64::consts::PI * hz))
    }

    /// The largest |a0 + b0 l| / |a + b l| over all l from the slowest mode up, with a = s^2 + s alpha and b = 1 + s beta.
    fn ratio(&self, s: Complex<f64>) -> f64 {
        let Rayleigh { mass: alpha, stiffness: beta } = self.rayleigh;
        let (a0, b0) = (self.shift * self.shift + self.shift * alpha, 1.0 + self.shift * beta);
        let (a, b) = (s * s + s * alpha, s * beta + 1.0);
        let (p, q) = ((a * b.conj()).re, b.norm_sqr());
        let at = |l: f64| (a0 + b0 * l) / (a + b * l).norm();
        let stationary = (b0 * a.norm_sqr() - a0 * p) / (a0 * q - b0 * p);
        let largest = at(self.slowest).max(b0 / q.sqrt());
        if stationary > self.slowest && stationary.is_finite() { largest.max(at(stationary)) } else { largest }
    }
}
