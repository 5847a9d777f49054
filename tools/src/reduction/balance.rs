//! Balanced truncation by the square-root method, and the first-order models that it gives.

use nalgebra::Complex;
use palpate::model::ModelError;

use super::congruence::Congruence;
use super::gramian;
use super::linalg::{CMatrix, Matrix, complex, eigenvalues, product, product_t, scaled_columns, solve_complex, svd};
use super::modal::Modal;
use super::response::Response;

/// Hankel singular values below this share of the largest are rounding: cut before balancing.
pub const NUMERICAL_RANK: f64 = 1e-14;

/// A system with its states in balance: as hard to reach as to see.
///
/// The square-root method (Laub, Heath, Paige and Ward 1987, IEEE Trans. Autom. Control 32; Tombs and Postlethwaite 1987,
/// Int. J. Control 46) on factors of the Gramians, with a cut at `NUMERICAL_RANK`: what is below is never divided by.
#[derive(Clone, Debug)]
pub struct Balanced {
    /// Hankel singular values, in decreasing order: all of those that the factors of the Gramians hold.
    pub hankel: Vec<f64>,
    /// A, B, C and D of the states up to the numerical rank.
    whole: StateSpace,
    /// Displacements of the coordinates in each balanced state, n x rank.
    pub displacements: Matrix,
}

/// A realisation as balancing needs it.
struct Realisation<'a> {
    times_a: &'a dyn Fn(&Matrix) -> Matrix,
    input: Matrix,
    /// C^T.
    output: Matrix,
    direct: &'a Matrix,
    displacements: &'a dyn Fn(&Matrix) -> Matrix,
}

impl Balanced {
    /// Balances a proportionally damped system: its Gramians are known in closed form.
    ///
    /// # Errors
    /// If a mode has no damping or no stiffness: the system is not asymptotically stable.
    pub fn modal(modal: &Modal) -> Result<Self, ModelError> {
        let factors = gramian::controllability(modal).zip(gramian::observability(modal));
        let realisation = Realisation {
            times_a: &|x| modal.times_a(x),
            input: modal.input(),
            output: modal.output(),
            direct: &modal.ports.direct,
            displacements: &|x| modal.displacements(x),
        };
        Self::new(&realisation, factors.as_ref()).ok_or_else(unstable)
    }

    /// Balances any damped system, by a Schur form: some 10 s for a thousand states.
    ///
    /// # Errors
    /// If it is not asymptotically stable.
    pub fn general(small: &Congruence) -> Result<Self, ModelError> {
        let (a, input, output) = small.first_order().ok_or_else(unstable)?;
        let output = output.transpose();
        let factors = gramian::factors(&a, &input, &output);
        let n = small.mass.nrows();
        let realisation = Realisation {
            times_a: &|x| product(&a, x),
            input,
            output,
            direct: &small.ports.direct,
            displacements: &|x| x.rows(0, n).into_owned(),
        };
        Self::new(&realisation, factors.as_ref()).ok_or_else(unstable)
    }

    /// Balances a small system by the quickest way that it allows.
    ///
    /// # Errors
    /// If it is not asymptotically stable.
    pub fn of(small: &Congruence) -> Result<Self, ModelError> {
        match Modal::of(small) {
            Some(modal) => {
                let mut balanced = Self::modal(&modal)?;
                balanced.displacements = balanced.displacements.rows(0, small.mass.nrows()).into_owned();
                Ok(balanced)
            }
            None => Self::general(small),
        }
    }

    fn new(of: &Realisation<'_>, factors: Option<&(Matrix, Matrix)>) -> Option<Self> {
        let (p, q) = factors?;
        let (u, hankel, v) = svd(&product_t(q, p))?;
        let rank = hankel.iter().take_while(|&&sigma| sigma > NUMERICAL_RANK * hankel[0]).count();
        let roots = || hankel[..rank].iter().map(|sigma| 1.0 / sigma.sqrt());
        let right = scaled_columns(&product(p, &v.columns(0, rank).into_owned()), roots());
        let left = scaled_columns(&product(q, &u.columns(0, rank).into_owned()), roots());
        let whole = StateSpace {
            a: product_t(&left, &(of.times_a)(&right)),
            b: product_t(&left, &of.input),
            c: product_t(&of.output, &right),
            d: of.direct.clone(),
        };
        Some(Self { displacements: (of.displacements)(&right), hankel, whole })
    }

    /// How many balanced states there are: the numerical rank.
    pub fn rank(&self) -> usize {
        self.whole.order()
    }

    /// The first `order` states, or all that there are.
    pub fn truncated(&self, order: usize) -> StateSpace {
        let r = order.min(self.rank());
        let StateSpace { a, b, c, d } = &self.whole;
        StateSpace {
            a: a.view((0, 0), (r, r)).into_owned(),
            b: b.rows(0, r).into_owned(),
            c: c.columns(0, r).into_owned(),
            d: d.clone(),
        }
    }

    /// 2 (sum of the Hankel singular values left out by `order` states) / (sum of all), in %: the measure that fits the paper's
    /// Table 2. Twice the sum itself bounds the infinity norm of the error (Enns 1984, Glover 1984).
    pub fn tail_pct(&self, order: usize) -> f64 {
        let all: f64 = self.hankel.iter().sum();
        100.0 * self.error_bound(order) / all
    }

    /// 2 (sum of the Hankel singular values left out): no frequency has a larger error, in the largest singular value. States beyond the
    /// numerical rank are always left out.
    pub fn error_bound(&self, order: usize) -> f64 {
        // Small ones first.
        let kept = order.min(self.rank());
        2.0 * self.hankel.iter().skip(kept).rev().fold(0.0, |sum, sigma| sum + sigma)
    }
}

fn unstable() -> ModelError {
    let message = "the system is not asymptotically stable: it needs damping, and something that holds it";
    ModelError::of("body.material.damping_ratio", message)
}

/// x' = A x + B u, y = C x + D u.
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
        let x = solve_complex(matrix, &complex(&self.b))?;
        Some(complex(&self.c) * x + complex(&self.d))
    }
}
