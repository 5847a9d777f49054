//! Sparse symmetric positive definite systems.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::Matrix;
use crate::Mat3;

/// Appends what `block` adds to the lower triangle of a symmetric matrix, with its corner at `row` and `column`.
pub(crate) fn push_block(entries: &mut Vec<(usize, usize, f64)>, row: usize, column: usize, block: &Mat3) {
    for r in 0..3 {
        let of_row = (0..3).filter(|c| row + r >= column + c);
        entries.extend(of_row.map(|c| (row + r, column + c, block[(r, c)])));
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

impl std::fmt::Debug for SparseFactor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SparseFactor").field("n", &self.n).finish_non_exhaustive()
    }
}

impl SparseFactor {
    /// Factorises the n x n matrix given by the sum of `entries` (row, column, value) of its lower triangle. The unknowns are eliminated in the given `order`, each of 0 .. n once, or in one of approximate minimum degree
    /// (Amestoy, Davis, Duff 1996). `None` if it is not positive definite, or the order is none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(n: usize, entries: &[(usize, usize, f64)], order: Option<&[usize]>) -> Option<Self> {
        let (starts, rows, values) = assembled(n, entries)?;
        let matrix = SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows), &values);
        let Some(order) = order else { return Self::factorise(matrix, SymmetricOrdering::Amd) };
        let mut places = vec![n; n];
        order.iter().enumerate().for_each(|(place, &unknown)| places[unknown] = place);
        let is_order = order.len() == n && places.iter().all(|&place| place < n);
        is_order.then(|| Self::factorise(matrix, SymmetricOrdering::Custom(PermRef::new_checked(order, &places, n))))?
    }

    fn factorise(matrix: SparseColMatRef<'_, usize, f64>, ordering: SymmetricOrdering<'_, usize>) -> Option<Self> {
        let symbolic =
            factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, ordering, Default::default()).ok()?;
        let mut factor = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        let stack = MemStack::new(&mut memory);
        let (side, regularization) = (Side::Lower, LltRegularization::default());
        symbolic
            .factorize_numeric_llt(&mut factor, matrix, side, regularization, Par::Seq, stack, Default::default())
            .ok()?;
        Some(Self { symbolic, values: factor, n: matrix.ncols() })
    }

    /// The solution for each column of `right` (n numbers).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn solve(&self, mut right: Matrix) -> Matrix {
        let factor = LltRef::new(&self.symbolic, &self.values);
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(GROUP, Par::Seq));
        for group in right.as_mut_slice().chunks_mut(GROUP * self.n.max(1)) {
            let count = group.len() / self.n;
            let columns = MatMut::from_column_major_slice_mut(group, self.n, count);
            factor.solve_in_place_with_conj(Conj::No, columns, Par::Seq, MemStack::new(&mut memory));
        }
        right
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
    fn a_factor_solves_many_columns_in_any_order_of_elimination() {
        let n = 60;
        let mut entries: Vec<_> = (0..n).map(|at| (at, at, 2.0 + at as f64)).collect();
        // Given twice, they add up.
        entries.extend((0..n).map(|at| (at, at, 2.0)));
        entries.extend((1..n).map(|at| (at, at - 1, -1.0)));
        entries.extend((7..n).map(|at| (at, at - 7, -0.5)));
        let exact = Matrix::from_fn(n, 100, |row, column| ((column * n + row) as f64).sin());
        let mut whole = Matrix::zeros(n, n);
        for &(row, column, value) in &entries {
            whole[(row, column)] += value;
            if row != column {
                whole[(column, row)] += value;
            }
        }
        let odd_first: Vec<usize> = (1..n).step_by(2).chain((0..n).step_by(2)).collect();
        for order in [None, Some(&odd_first[..])] {
            let found = SparseFactor::new(n, &entries, order).unwrap().solve(&whole * &exact);
            assert!((found - &exact).amax() < 1e-13);
        }
        assert!(SparseFactor::new(n, &entries, Some(&vec![0; n])).is_none(), "no order");
        assert!(SparseFactor::new(2, &[(0, 0, 1.0), (1, 1, -1.0)], None).is_none(), "not positive definite");
        assert!(SparseFactor::new(2, &[(2, 0, 1.0)], None).is_none(), "outside");
    }
}
