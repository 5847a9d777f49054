//! Dense linear algebra for reduced models. With `sparse.rs` the only file that names faer.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{Llt, SelfAdjointEigen};
use faer::prelude::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};

/// Singular values below this share of the largest are rounding: the Gram matrix squares them.
const NUMERICAL_RANK: f64 = 1e-7;

/// The left singular vectors of the largest singular values of `matrix` (column after column, `rows` numbers each), at
/// most `count` of them, column after column.
pub(super) fn leading_left_singular_vectors(matrix: &[f64], rows: usize, count: usize) -> Vec<f64> {
    let columns = matrix.len() / rows.max(1);
    let s = MatRef::from_column_major_slice(matrix, rows, columns);
    let mut gram = Mat::<f64>::zeros(columns, columns);
    matmul(gram.as_mut(), Accum::Replace, s.transpose(), s, 1.0, Par::Seq);
    let Ok(eigen) = SelfAdjointEigen::new(gram.as_ref(), Side::Lower) else { return Vec::new() };
    // In increasing order.
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let largest = values[columns - 1].max(0.0).sqrt();
    let sigma = |n: usize| values[columns - 1 - n].max(0.0).sqrt();
    let count = (0..count.min(columns)).take_while(|&n| sigma(n) > NUMERICAL_RANK * largest).count();
    let scaled = Mat::from_fn(columns, count, |row, n| vectors[(row, columns - 1 - n)] / sigma(n));
    let mut left = Mat::<f64>::zeros(rows, count);
    matmul(left.as_mut(), Accum::Replace, s, scaled.as_ref(), 1.0, Par::Seq);
    let mut shapes = Vec::with_capacity(rows * count);
    for n in 0..count {
        shapes.extend(left.col(n).iter());
    }
    shapes
}

/// A matrix of `n` rows of `n` zeros.
pub(super) fn zeros(n: usize) -> Vec<f64> {
    vec![0.0; n * n]
}

/// matrix += scale v v^T.
pub(super) fn add_outer(matrix: &mut [f64], v: &[f64], scale: f64) {
    for (row, &x) in matrix.chunks_exact_mut(v.len().max(1)).zip(v) {
        let x = scale * x;
        if x != 0.0 {
            row.iter_mut().zip(v).for_each(|(entry, y)| *entry += x * y);
        }
    }
}

/// For the symmetric positive definite `matrix` A (n rows of n) and `right` R (any number of rows of n): R A^-1 in rows of
/// n, which for a symmetric R is the transpose of A^-1 R.
pub(super) fn solve_rows(matrix: &[f64], right: &[f64], n: usize) -> Vec<f64> {
    let a = MatRef::from_column_major_slice(matrix, n, n);
    let Ok(factor) = Llt::new(a, Side::Lower) else { return vec![f64::NAN; right.len()] };
    let mut columns = MatRef::from_column_major_slice(right, n, right.len() / n.max(1)).to_owned();
    factor.solve_in_place(columns.as_mut());
    let mut rows = Vec::with_capacity(right.len());
    for n in 0..columns.ncols() {
        rows.extend(columns.col(n).iter());
    }
    rows
}
