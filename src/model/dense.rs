//! Dense linear algebra for reduced models. With `sparse.rs` the only file that names faer.
//!
//! A matrix is a slice, column after column.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::SelfAdjointEigen;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

/// Singular values below this share of the largest are rounding: the Gram matrix squares them.
const NUMERICAL_RANK: f64 = 1e-7;

/// The left singular vectors of the largest singular values of `matrix` (columns of `rows` numbers), at most `count`.
pub(super) fn leading_left_singular_vectors(matrix: &[f64], rows: usize, count: usize) -> Vec<f64> {
    let columns = matrix.len() / rows.max(1);
    let Some((values, vectors)) = eigen(&gram(matrix, rows)) else { return Vec::new() };
    let sigma = |n: usize| values[columns - 1 - n].max(0.0).sqrt();
    let count = (0..count.min(columns)).take_while(|&n| sigma(n) > NUMERICAL_RANK * sigma(0)).count();
    let mut scaled = Vec::with_capacity(columns * count);
    for n in 0..count {
        scaled.extend(vectors[(columns - 1 - n) * columns..][..columns].iter().map(|x| x / sigma(n)));
    }
    combinations(matrix, &scaled, rows, columns)
}

/// The combinations of the columns of `matrix` (of `rows` numbers) along its leading right singular vectors, at most
/// `count`: what is left out is the smallest part that `count` columns can leave out.
pub(super) fn leading_combinations(matrix: &[f64], rows: usize, count: usize) -> Vec<f64> {
    let columns = matrix.len() / rows.max(1);
    let Some((_, vectors)) = eigen(&gram(matrix, rows)) else { return matrix.to_vec() };
    combinations(matrix, &vectors[columns.saturating_sub(count) * columns..], rows, columns)
}

/// The modes of the symmetric pencil (`stiffness`, `mass`) in the directions that `mass` can tell apart: T with
/// T^T M T = I and T^T K T diagonal, as the columns of T and the diagonal. Empty if a number is not finite.
pub(super) fn modes(mass: &[f64], stiffness: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let n = mass.len().isqrt();
    let Some((values, vectors)) = eigen(mass) else { return Default::default() };
    let largest = values.last().copied().unwrap_or(0.0);
    let mut white = Vec::with_capacity(n * n);
    for (value, vector) in values.iter().zip(vectors.chunks_exact(n.max(1))) {
        if *value > DEPENDENT * largest {
            white.extend(vector.iter().map(|x| x / value.sqrt()));
        }
    }
    let projected = product(&white, &combinations(stiffness, &white, n, n), n);
    let Some((values, vectors)) = eigen(&projected) else { return Default::default() };
    (combinations(&white, &vectors, n, values.len()), values)
}

/// Directions with less than this share of the largest mass are combinations of others.
const DEPENDENT: f64 = 1e-9;

/// A^T B for matrices with columns of `rows` numbers.
pub(super) fn product(a: &[f64], b: &[f64], rows: usize) -> Vec<f64> {
    let [a, b] = [a, b].map(|matrix| MatRef::from_column_major_slice(matrix, rows, matrix.len() / rows.max(1)));
    let mut out = Mat::<f64>::zeros(a.ncols(), b.ncols());
    matmul(out.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    slice_of(&out)
}

/// The lower triangle of A^T A for a matrix with columns of `rows` numbers; zeros above it.
pub(super) fn gram(a: &[f64], rows: usize) -> Vec<f64> {
    let a = MatRef::from_column_major_slice(a, rows, a.len() / rows.max(1));
    let mut out = Mat::<f64>::zeros(a.ncols(), a.ncols());
    let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(out.as_mut(), lower, Accum::Replace, a.transpose(), whole, a, whole, 1.0, Par::Seq);
    slice_of(&out)
}

/// A^T A for a matrix with columns of `rows` numbers.
pub(super) fn symmetric_product(a: &[f64], rows: usize) -> Vec<f64> {
    let mut out = gram(a, rows);
    let n = out.len().isqrt();
    for row in 0..n {
        (row + 1..n).for_each(|column| out[column * n + row] = out[row * n + column]);
    }
    out
}

/// A B for A with columns of `rows` numbers and B with columns of `inner` numbers.
pub(super) fn combinations(a: &[f64], b: &[f64], rows: usize, inner: usize) -> Vec<f64> {
    let a = MatRef::from_column_major_slice(a, rows, inner);
    let b = MatRef::from_column_major_slice(b, inner, b.len() / inner.max(1));
    let mut out = Mat::<f64>::zeros(rows, b.ncols());
    matmul(out.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    slice_of(&out)
}

/// Columns that are eliminated at once.
const BLOCK: usize = 32;

/// Eliminates the unknowns of the symmetric positive definite A from the first to the last: A = L D L^T. `matrix` has
/// `rows` numbers in each of its columns: the lower triangle of A, then B^T. Afterwards D is on the diagonal, L below it, and
/// (D^-1 L^-1 B)^T in the place of B^T. `None` if a pivot is not above zero.
pub(super) fn eliminate(matrix: &mut [f64], rows: usize) -> Option<()> {
    let columns = matrix.len() / rows.max(1);
    for begin in (0..columns).step_by(BLOCK) {
        let end = (begin + BLOCK).min(columns);
        for j in begin..end {
            let (done, open) = matrix.split_at_mut((j + 1) * rows);
            let pivoted = &mut done[j * rows..];
            let pivot = pivoted[j];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let inverse = 1.0 / pivot;
            pivoted[j + 1..].iter_mut().for_each(|x| *x *= inverse);
            for (column, open) in open.chunks_exact_mut(rows).take(end - j - 1).enumerate() {
                let from = j + 1 + column;
                let factor = pivoted[from] * pivot;
                open[from..].iter_mut().zip(&pivoted[from..]).for_each(|(x, l)| *x -= l * factor);
            }
        }
        let (done, open) = matrix.split_at_mut(end * rows);
        let panel = MatRef::from_column_major_slice(&done[begin * rows..], rows, end - begin);
        let open = MatMut::from_column_major_slice_mut(open, rows, columns - end);
        let (square, below) = open.subrows_mut(end, rows - end).split_at_row_mut(columns - end);
        let (of_square, of_below) = panel.subrows(end, rows - end).split_at_row(columns - end);
        let scaled = Mat::from_fn(end - begin, columns - end, |j, i| of_square[(i, j)] * panel[(begin + j, j)]);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        triangular::matmul(square, lower, Accum::Add, of_square, whole, scaled.as_ref(), whole, -1.0, Par::Seq);
        matmul(below, Accum::Add, of_below, scaled.as_ref(), -1.0, Par::Seq);
    }
    Some(())
}

/// Eigenvalues in increasing order and eigenvectors of a symmetric matrix, of which the lower triangle is read; `None` if a number is not finite.
fn eigen(matrix: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = matrix.len().isqrt();
    if n == 0 || !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SelfAdjointEigen::new(MatRef::from_column_major_slice(matrix, n, n), Side::Lower).ok()?;
    Some((eigen.S().column_vector().iter().copied().collect(), slice_of(&eigen.U().to_owned())))
}

fn slice_of(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.ncols()).flat_map(|n| matrix.col(n).iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn singular_vectors_come_in_order_and_stop_at_the_numerical_rank() {
        // Columns 3 e_0, 2 e_1 and their sum: rank two.
        let matrix = [3.0, 0.0, 0.0, 0.0, 2.0, 0.0, 3.0, 2.0, 0.0];
        let shapes = leading_left_singular_vectors(&matrix, 3, 5);
        assert_eq!(shapes.len(), 6);
        let gram = product(&shapes, &shapes, 3);
        assert!((gram[0] - 1.0).abs() < 1e-12 && gram[1].abs() < 1e-12 && (gram[3] - 1.0).abs() < 1e-12);
        assert!(shapes[0].abs() > shapes[1].abs(), "the first leans to the largest column");
    }

    #[test]
    fn modes_diagonalise_both_matrices_and_drop_dependent_directions() {
        let (mass, stiffness) = ([2.0, 0.5, 0.5, 1.0], [-5.0, 1.0, 1.0, -3.0]);
        let (t, values) = modes(&mass, &stiffness);
        let m = product(&t, &combinations(&mass, &t, 2, 2), 2);
        let k = product(&t, &combinations(&stiffness, &t, 2, 2), 2);
        for (at, (m, k)) in m.iter().zip(&k).enumerate() {
            let (row, column) = (at % 2, at / 2);
            let on_diagonal = if row == column { [1.0, values[row]] } else { [0.0, 0.0] };
            assert!((m - on_diagonal[0]).abs() < 1e-12 && (k - on_diagonal[1]).abs() < 1e-12);
        }
        assert_eq!(modes(&[1.0, 1.0, 1.0, 1.0], &stiffness).1.len(), 1);
        assert!(modes(&[f64::NAN], &[1.0]).1.is_empty());
    }
}
