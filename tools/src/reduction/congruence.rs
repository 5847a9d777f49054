//! A second-order system with small dense matrices: what a congruence leaves of a sparse one.

use nalgebra::Complex;

use super::linalg::{CMatrix, Matrix, complex, product_t, solve_complex, solve_positive, symmetrised};
use super::response::Response;
use super::system::{Ports, Rayleigh, SecondOrder};

/// M_r z'' + C_r z' + K_r z = B_r u with x = T z, M_r = T^T M T and so on.
///
/// A congruence keeps M_r and K_r positive definite and C_r positive semi-definite where M, K and C are: the reduced model is
/// stable, and passive between a force and a velocity at the same place, whatever T is.
#[derive(Clone, Debug)]
pub struct Congruence {
    /// M_r, r x r.
    pub mass: Matrix,
    /// C_r, r x r.
    pub damping: Matrix,
    /// K_r, r x r.
    pub stiffness: Matrix,
    /// The ports: B_r and what comes out.
    pub ports: Ports,
    rayleigh: Option<Rayleigh>,
}

impl Congruence {
    /// `system` in the span of the columns of `basis` T (n x r).
    pub fn new(system: &SecondOrder, basis: &Matrix) -> Self {
        Self::with(system, basis, system.ports.project(basis), system.rayleigh())
    }

    /// `system` in the span of `basis` with other `ports`, those of z already, where it is known whether the damping is
    /// proportional.
    pub(super) fn with(system: &SecondOrder, basis: &Matrix, ports: Ports, rayleigh: Option<Rayleigh>) -> Self {
        let stiffness = symmetrised(&product_t(basis, &system.times_stiffness(basis)));
        let mass = symmetrised(&product_t(basis, &system.times_mass(basis)));
        let damping = match rayleigh {
            Some(Rayleigh { mass: alpha, stiffness: beta }) => &mass * alpha + &stiffness * beta,
            None => symmetrised(&product_t(basis, &system.times_damping(basis))),
        };
        Self { mass, damping, stiffness, ports, rayleigh }
    }

    /// `system` with all its coordinates.
    pub fn whole(system: &SecondOrder) -> Self {
        Self {
            mass: system.mass(),
            damping: system.damping(),
            stiffness: system.stiffness(),
            ports: system.ports.clone(),
            rayleigh: system.rayleigh(),
        }
    }

    /// The system with the mass of only some coordinates, such as a condensation without the mass of what it leaves out.
    pub(super) fn with_mass(mut self, mass: Matrix) -> Self {
        self.mass = mass;
        if self.rayleigh.is_some_and(|rayleigh| rayleigh.mass != 0.0) {
            self.rayleigh = None;
        }
        self
    }

    /// Number of states: twice that of coordinates.
    pub fn order(&self) -> usize {
        2 * self.mass.nrows()
    }

    /// alpha and beta, if C = alpha M + beta K.
    pub fn rayleigh(&self) -> Option<Rayleigh> {
        self.rayleigh
    }

    /// s^2 M_r + s C_r + K_r at a complex s.
    pub(super) fn dynamic_stiffness(&self, s: Complex<f64>) -> CMatrix {
        let (mass, damping, stiffness) = (&self.mass, &self.damping, &self.stiffness);
        let n = mass.nrows();
        CMatrix::from_fn(n, n, |i, j| s * s * mass[(i, j)] + s * damping[(i, j)] + stiffness[(i, j)])
    }

    /// P + s V, r x p.
    pub(super) fn outputs(&self, s: Complex<f64>) -> CMatrix {
        complex(&self.ports.position) + complex(&self.ports.velocity) * s
    }

    /// The smallest eigenvalues of M_r, C_r and K_r, each as a share of the largest: all must be above zero, but for the rounding
    /// of a singular C, for the model to be stable and passive.
    #[cfg(test)]
    pub fn definiteness(&self) -> [f64; 3] {
        [&self.mass, &self.damping, &self.stiffness].map(|matrix| {
            let values = matrix.clone().symmetric_eigenvalues();
            let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            values.iter().fold(f64::INFINITY, |least, &value| least.min(value)) / largest.max(f64::MIN_POSITIVE)
        })
    }

    /// z'' = -M^-1 (K z + C z') + M^-1 B u as x' = A x + B u: A (2r x 2r), for states z, z'/w with w a typical frequency, and w.
    /// `None` if M is not positive definite.
    pub(super) fn first_order(&self) -> Option<(Matrix, Matrix, Matrix)> {
        let r = self.mass.nrows();
        let w = (self.stiffness.trace() / self.mass.trace()).abs().sqrt();
        let right = |matrix: &Matrix| solve_positive(&self.mass, matrix);
        let (k, c, b) = (right(&self.stiffness)?, right(&self.damping)?, right(&self.ports.input)?);
        let mut a = Matrix::zeros(2 * r, 2 * r);
        (0..r).for_each(|at| a[(at, r + at)] = w);
        a.view_mut((r, 0), (r, r)).copy_from(&(k / -w));
        a.view_mut((r, r), (r, r)).copy_from(&-c);
        let mut input = Matrix::zeros(2 * r, b.ncols());
        input.rows_mut(r, r).copy_from(&(b / w));
        let mut output = Matrix::zeros(self.ports.outputs(), 2 * r);
        output.columns_mut(0, r).copy_from(&self.ports.position.transpose());
        output.columns_mut(r, r).copy_from(&(self.ports.velocity.transpose() * w));
        Some((a, input, output))
    }
}

impl Response for Congruence {
    fn at(&self, s: Complex<f64>) -> Option<CMatrix> {
        let x = solve_complex(self.dynamic_stiffness(s), &complex(&self.ports.input))?;
        Some(complex(&self.ports.direct) + self.outputs(s).transpose() * x)
    }
}
