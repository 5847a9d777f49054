//! First-order models.

use nalgebra::Complex;

use super::linalg::{CMatrix, Matrix, complex, eigenvalues};
use super::response::Response;

/// x' = A x + B u, y = C x + D u.
///
/// # Real-time
/// Not real-time safe: allocates. For the analysis of a scene, not for its run.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// A (1/s), r x r.
    pub a: Matrix,
    /// B, r x m.
    pub b: Matrix,
    /// C, p x r.
    pub c: Matrix,
    /// D, p x m.
    pub d: Matrix,
}

impl StateSpace {
    /// Number of states r.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// The eigenvalues of A (1/s); `None` if a number is not finite.
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        eigenvalues(&self.a)
    }

    /// True if every pole lies in the left half plane.
    pub fn is_stable(&self) -> bool {
        self.poles().is_some_and(|poles| poles.iter().all(|pole| pole.re < 0.0))
    }
}

impl Response for StateSpace {
    fn at(&self, s: Complex<f64>) -> Option<CMatrix> {
        let mut matrix = complex(&(-&self.a));
        (0..self.order()).for_each(|at| matrix[(at, at)] += s);
        let x = matrix.lu().solve(&complex(&self.b))?;
        Some(complex(&self.c) * x + complex(&self.d))
    }
}
