//! The bridge to faer: sparse symmetric positive definite systems. With `dense.rs` the only file that names it.

use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, MatMut, Side};

/// A Cholesky solver for matrices of one sparsity pattern.
#[derive(Debug, Default)]
pub(super) struct SparseCholesky {
    symbolic: Option<SymbolicLlt<usize>>,
}

impl SparseCholesky {
    /// Solves A x = b for the symmetric A given by the sum of `entries` (row, column, value), lower triangle and all;
    /// `x` holds b on entry. `None` if A is not positive definite. The ordering is found once and kept: every call
    /// must give entries at the same places.
    pub(super) fn solve(&mut self, entries: &[(usize, usize, f64)], x: &mut [f64]) -> Option<()> {
        let n = x.len();
        let lower: Vec<_> = entries
            .iter()
            .filter(|&&(row, column, _)| row >= column)
            .map(|&(row, column, value)| Triplet::new(row, column, value))
            .collect();
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &lower).ok()?;
        if self.symbolic.is_none() {
            self.symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).ok();
        }
        let factor = Llt::try_new_with_symbolic(self.symbolic.clone()?, matrix.as_ref(), Side::Lower).ok()?;
        let solution = factor.solve(Mat::from_fn(n, 1, |row, _| x[row]));
        for (row, x) in x.iter_mut().enumerate() {
            *x = solution[(row, 0)];
        }
        x.iter().all(|x| x.is_finite()).then_some(())
    }
}

/// A factorised symmetric positive definite matrix, for many right-hand sides.
pub(super) struct SparseFactor {
    factor: Llt<usize, f64>,
    n: usize,
}

impl SparseFactor {
    /// Factorises the n x n matrix given by the sum of `entries` (row, column, value) of its lower triangle. `None` if it
    /// is not positive definite.
    pub(super) fn new(n: usize, entries: &[(usize, usize, f64)]) -> Option<Self> {
        let lower: Vec<_> = entries.iter().map(|&(row, column, value)| Triplet::new(row, column, value)).collect();
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &lower).ok()?;
        let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).ok()?;
        let factor = Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).ok()?;
        Some(Self { factor, n })
    }

    /// Replaces each column of `columns` (n numbers, one column after the other) by its solution.
    pub(super) fn solve(&self, columns: &mut [f64]) {
        let count = columns.len() / self.n;
        self.factor.solve_in_place(MatMut::from_column_major_slice_mut(columns, self.n, count));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_small_system_and_refuses_an_indefinite_one() {
        let entries = [(0, 0, 4.0), (1, 0, 1.0), (0, 1, 1.0), (1, 1, 3.0)];
        let mut x = [1.0, 2.0];
        assert!(SparseCholesky::default().solve(&entries, &mut x).is_some());
        assert!((4.0 * x[0] + x[1] - 1.0).abs() < 1e-14 && (x[0] + 3.0 * x[1] - 2.0).abs() < 1e-14);
        assert!(SparseCholesky::default().solve(&[(0, 0, -1.0), (1, 1, 1.0)], &mut [1.0, 1.0]).is_none());
    }
}
