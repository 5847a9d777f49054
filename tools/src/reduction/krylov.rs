//! Structure-preserving moment matching: a congruence whose basis answers like the whole around chosen frequencies.

use palpate::model::ModelError;

use super::balance::Balanced;
use super::congruence::Congruence;
use super::linalg::{DEPENDENT, Matrix, append_orthonormal, orthogonal, push_column};
use super::system::SecondOrder;

/// A reduced model x = T z and its basis T.
#[derive(Clone, Debug)]
pub struct Projection {
    /// T, n x r.
    pub basis: Matrix,
    /// M_r, C_r, K_r and the ports.
    pub model: Congruence,
}

impl Projection {
    /// `system` in the span of the columns of `basis`.
    pub fn new(system: &SecondOrder, basis: Matrix) -> Self {
        Self { model: Congruence::new(system, &basis), basis }
    }
}

/// Matches `moments` moments of the response at one real frequency `shift` (rad/s): one factorisation, as many solutions as
/// moments and ports.
///
/// The congruence keeps the structure (Su and Craig 1991, J. Guid. Control Dyn. 14; Bai and Su 2005, SIAM J. Matrix Anal. 26).
/// Under proportional damping s^2 M + s C + K is a multiple of K + l(s) M: moments in l, from one Krylov space of (K + l M)^-1 M. Else the
/// recurrence of second order of the moments in s.
///
/// # Errors
/// If nothing holds the system.
pub fn one_shift(system: &SecondOrder, shift: f64, moments: usize) -> Result<Projection, ModelError> {
    let factor = system.factorised(shift)?;
    let solve = |columns: Matrix| factor.solve(columns);
    let mut basis = Matrix::zeros(system.coordinates(), 0);
    let mut last = append_orthonormal(&mut basis, &solve(system.ports.directions()), DEPENDENT);
    if system.rayleigh().is_none() {
        let basis = second_order_arnoldi(system, shift, moments, basis, &solve);
        return Ok(Projection::new(system, basis));
    }
    for _ in 1..moments {
        last = append_orthonormal(&mut basis, &solve(system.times_mass(&last)), DEPENDENT);
    }
    Ok(Projection::new(system, basis))
}

/// The space of the first `moments` moments of a system whose damping is not proportional: with s = shift + t they follow
/// (A + t (2 shift M + C) + t^2 M)(x_0 + t x_1 + ..) = b, each from the two before. Every vector is made orthogonal to those before it
/// while it comes into being, together with its predecessor (Bai and Su 2005): the moments themselves soon all point the same way.
/// `basis` has the first.
fn second_order_arnoldi(
    system: &SecondOrder,
    shift: f64,
    moments: usize,
    mut basis: Matrix,
    solve: &dyn Fn(Matrix) -> Matrix,
) -> Matrix {
    let width = basis.ncols();
    // Of each basis vector, what came before it.
    let mut before = Matrix::zeros(basis.nrows(), width);
    for _ in 1..moments {
        let from = basis.ncols() - width.min(basis.ncols());
        let (last, last_before) = (
            basis.columns(from, basis.ncols() - from).into_owned(),
            before.columns(from, before.ncols() - from).into_owned(),
        );
        let mut right = system.times_mass(&(&last * (2.0 * shift) + &last_before));
        right += system.times_damping(&last);
        let next = -solve(right);
        for (r, s) in next.column_iter().zip(last.column_iter()) {
            let (length, mut s) = (r.norm(), s.into_owned());
            let r = orthogonal(&basis, r.into_owned(), Some((&before, &mut s)));
            let left = r.norm();
            if left > DEPENDENT * length {
                push_column(&mut basis, &(r / left));
                push_column(&mut before, &(s / left));
            }
        }
    }
    basis
}

/// Matches the response and its slope at each of the real frequencies `shifts` (rad/s): one factorisation each (rational
/// Krylov, Grimme 1997; for collocated ports the slope comes with the congruence).
///
/// # Errors
/// If nothing holds the system.
pub fn many_shifts(system: &SecondOrder, shifts: &[f64]) -> Result<Projection, ModelError> {
    let directions = system.ports.directions();
    let mut basis = Matrix::zeros(system.coordinates(), 0);
    for &shift in shifts {
        append_orthonormal(&mut basis, &system.solve(shift, directions.clone())?, DEPENDENT);
    }
    Ok(Projection::new(system, basis))
}

/// Real frequencies that a response of `system` is matched at (rad/s): `count` of them, spread evenly over the logarithm from well below
/// its slow modes to its fastest.
pub fn spread_shifts(system: &SecondOrder, count: usize) -> Vec<f64> {
    let w = system.typical_frequency();
    let (low, high) = (SLOWEST * w, FASTEST * w);
    let step = (high / low).ln() / count.saturating_sub(1).max(1) as f64;
    (0..count).map(|n| low * (step * n as f64).exp()).collect()
}

/// The range of [`spread_shifts`], as shares of the typical frequency.
const SLOWEST: f64 = 0.02;
const FASTEST: f64 = 8.0;

/// A balanced model of a large system by way of a small one: rational Krylov first, what it leaves is balanced.
#[derive(Clone, Debug)]
pub struct LowRank {
    /// The system in the span of its answers to real frequencies.
    pub projection: Projection,
    /// The balanced model of that.
    pub balanced: Balanced,
}

/// Balances `system` through [`many_shifts`] with `count` frequencies.
///
/// # Errors
/// If nothing holds the system or it is not damped.
pub fn low_rank(system: &SecondOrder, count: usize) -> Result<LowRank, ModelError> {
    let projection = many_shifts(system, &spread_shifts(system, count))?;
    let balanced = Balanced::of(&projection.model)?;
    Ok(LowRank { projection, balanced })
}
