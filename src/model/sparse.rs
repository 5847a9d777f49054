//! The bridge to faer: sparse symmetric positive definite systems. With `dense.rs` the only file that names it.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::prelude::Solve;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SparseColMatRef, SymbolicSparseColMatRef, Triplet};
use faer::{Conj, Mat, MatMut, Par, Side};

/// A Cholesky solver for matrices of one sparsity pattern.
#[derive(Debug, Default)]
pub struct SparseCholesky {
    symbolic: Option<SymbolicLlt<usize>>,
}

impl SparseCholesky {
    /// Solves A x = b for the symmetric A given by the sum of `entries` (row, column, value), lower triangle and all;
    /// `x` holds b on entry. `None` if A is not positive definite. The ordering is found once and kept: every call
    /// must give entries at the same places.
    pub fn solve(&mut self, entries: &[(usize, usize, f64)], x: &mut [f64]) -> Option<()> {
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

/// Columns that are solved at once: enough for dense kernels, few enough that they stay in the cache.
const GROUP: usize = 48;

/// A factorised symmetric positive definite matrix, for many right-hand sides.
pub struct SparseFactor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    n: usize,
}

impl SparseFactor {
    /// Factorises the n x n matrix given by the sum of `entries` (row, column, value) of its lower triangle, in an order of
    /// approximate minimum degree (Amestoy, Davis, Duff 1996). `None` if it is not positive definite.
    pub fn new(n: usize, entries: &[(usize, usize, f64)]) -> Option<Self> {
        Self::factorise(n, entries, SymmetricOrdering::Amd)
    }

    /// The same with the unknowns eliminated in the given order, each of 0 .. n once.
    pub fn new_ordered(n: usize, entries: &[(usize, usize, f64)], order: &[usize]) -> Option<Self> {
        let mut places = vec![n; n];
        order.iter().enumerate().for_each(|(place, &unknown)| places[unknown] = place);
        let is_order = order.len() == n && places.iter().all(|&place| place < n);
        is_order
            .then(|| Self::factorise(n, entries, SymmetricOrdering::Custom(PermRef::new_checked(order, &places, n))))?
    }

    fn factorise(n: usize, entries: &[(usize, usize, f64)], ordering: SymmetricOrdering<'_, usize>) -> Option<Self> {
        let (starts, rows, values) = assembled(n, entries)?;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, ordering, Default::default()).ok()?;
        let matrix = SparseColMatRef::new(pattern, &values);
        let mut factor = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        let stack = MemStack::new(&mut memory);
        let (side, regularization) = (Side::Lower, LltRegularization::default());
        symbolic
            .factorize_numeric_llt(&mut factor, matrix, side, regularization, Par::Seq, stack, Default::default())
            .ok()?;
        Some(Self { symbolic, values: factor, n })
    }

    /// Replaces each column of `columns` (n numbers, one column after the other) by its solution.
    pub fn solve(&self, columns: &mut [f64]) {
        let factor = LltRef::new(&self.symbolic, &self.values);
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(GROUP, Par::Seq));
        for group in columns.chunks_mut(GROUP * self.n.max(1)) {
            let count = group.len() / self.n;
            let right = MatMut::from_column_major_slice_mut(group, self.n, count);
            factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, MemStack::new(&mut memory));
        }
    }
}

/// The sum of `entries` by columns: where each begins, its rows in increasing order, their values. `None` if an entry is
/// outside.
fn assembled(n: usize, entries: &[(usize, usize, f64)]) -> Option<(Vec<usize>, Vec<usize>, Vec<f64>)> {
    let mut first = vec![0; n + 1];
    for &(row, column, _) in entries {
        (row < n).then_some(())?;
        *first.get_mut(column + 1)? += 1;
    }
    (0..n).for_each(|column| first[column + 1] += first[column]);
    let (mut next, mut sorted) = (first.clone(), vec![(0, 0.0); entries.len()]);
    for &(row, column, value) in entries {
        sorted[next[column]] = (row, value);
        next[column] += 1;
    }
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    // Where the entry of a row is, if it is behind the column's start.
    let mut place = vec![usize::MAX; n];
    for column in 0..n {
        let begin = rows.len();
        let entries = &sorted[first[column]..first[column + 1]];
        for &(row, _) in entries {
            if place[row] == usize::MAX || place[row] < begin {
                place[row] = rows.len();
                rows.push(row);
            }
        }
        rows[begin..].sort_unstable();
        rows[begin..].iter().enumerate().for_each(|(at, &row)| place[row] = begin + at);
        values.resize(rows.len(), 0.0);
        entries.iter().for_each(|&(row, value)| values[place[row]] += value);
        starts.push(rows.len());
    }
    Some((starts, rows, values))
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

    #[test]
    fn a_factor_solves_many_columns_in_any_order_of_elimination() {
        let n = 60;
        let mut entries: Vec<_> = (0..n).map(|at| (at, at, 2.0 + at as f64)).collect();
        // Given twice, they add up.
        entries.extend((0..n).map(|at| (at, at, 2.0)));
        entries.extend((1..n).map(|at| (at, at - 1, -1.0)));
        entries.extend((7..n).map(|at| (at, at - 7, -0.5)));
        let exact: Vec<f64> = (0..100 * n).map(|at| (at as f64).sin()).collect();
        let mut right = vec![0.0; exact.len()];
        for (x, right) in exact.chunks_exact(n).zip(right.chunks_exact_mut(n)) {
            for &(row, column, value) in &entries {
                right[row] += value * x[column];
                if row != column {
                    right[column] += value * x[row];
                }
            }
        }
        let odd_first: Vec<usize> = (1..n).step_by(2).chain((0..n).step_by(2)).collect();
        for factor in [SparseFactor::new(n, &entries), SparseFactor::new_ordered(n, &entries, &odd_first)] {
            let mut columns = right.clone();
            factor.unwrap().solve(&mut columns);
            assert!(columns.iter().zip(&exact).all(|(ours, exact)| (ours - exact).abs() < 1e-13));
        }
        assert!(SparseFactor::new_ordered(n, &entries, &vec![0; n]).is_none(), "no order");
        assert!(SparseFactor::new(2, &[(0, 0, 1.0), (1, 1, -1.0)]).is_none(), "not positive definite");
        assert!(SparseFactor::new(2, &[(2, 0, 1.0)]).is_none(), "outside");
    }
}
