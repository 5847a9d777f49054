//! Products, eigenvalues and factors of dense matrices.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::{SelfAdjointEigen, Svd};
use faer::prelude::Solve;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use nalgebra::{Complex, DMatrix};

/// A real matrix, kept column after column.
pub type Matrix = DMatrix<f64>;

/// A matrix of complex numbers, kept column after column.
pub type ComplexMatrix = DMatrix<Complex<f64>>;

/// Singular values below this share of the largest are rounding: the Gram matrix squares them.
const NUMERICAL_RANK: f64 = 1e-7;
/// Directions with less than this share of the largest mass are combinations of others.
const DEPENDENT: f64 = 1e-9;
/// Columns that are eliminated at once.
const BLOCK: usize = 32;
/// So many times a matrix's norm its eigenvalues are shifted by while they are looked for: more than the least is below 0, also where
/// one triangle alone was written.
const SHIFT: f64 = 1.5;

fn view(matrix: &Matrix) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

fn view_mut(matrix: &mut Matrix) -> MatMut<'_, f64> {
    let (rows, columns) = matrix.shape();
    MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), rows, columns)
}

fn owned(matrix: MatRef<'_, f64>) -> Matrix {
    Matrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)])
}

fn is_finite(matrix: &Matrix) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

fn product_of(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Matrix {
    let mut out = Matrix::zeros(a.nrows(), b.ncols());
    matmul(view_mut(&mut out), Accum::Replace, a, b, 1.0, Par::Seq);
    out
}

/// The product A B.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    product_of(view(a), view(b))
}

/// The product A^T B.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn product_t(a: &Matrix, b: &Matrix) -> Matrix {
    product_of(view(a).transpose(), view(b))
}

/// The lower triangle of A^T A, and zeros above it.
fn gram(a: &Matrix) -> Matrix {
    let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    let mut out = Matrix::zeros(a.ncols(), a.ncols());
    let (to, a) = (view_mut(&mut out), view(a));
    triangular::matmul(to, lower, Accum::Replace, a.transpose(), whole, a, whole, 1.0, Par::Seq);
    out
}

/// Eigenvalues in increasing order and orthonormal eigenvectors of a symmetric matrix, of which the lower triangle is read;
/// `None` if a number is not finite.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn symmetric_eigen(matrix: &Matrix) -> Option<(Vec<f64>, Matrix)> {
    // Faer 0.24 measures what couples two eigenvalues by these two alone: next to a large one, small ones never come to rest. None is
    // small once all are shifted.
    let shift = SHIFT * matrix.norm();
    let mut shifted = matrix.clone();
    (0..matrix.ncols()).for_each(|n| shifted[(n, n)] += shift);
    let (mut values, vectors) = eigen(&shifted)?;
    values.iter_mut().for_each(|value| *value -= shift);
    Some((values, vectors))
}

/// The same without a shift. With it forces by a basis, whose shapes are kept in 16 bits, were up to 0.0055 % off those by what was
/// rounded, in place of less than 0.005.
fn eigen(matrix: &Matrix) -> Option<(Vec<f64>, Matrix)> {
    if !is_finite(matrix) {
        return None;
    }
    if matrix.is_empty() {
        return Some((Vec::new(), Matrix::zeros(0, 0)));
    }
    let eigen = SelfAdjointEigen::new(view(matrix), Side::Lower).ok()?;
    Some((eigen.S().column_vector().iter().copied().collect(), owned(eigen.U())))
}

/// U, the singular values in decreasing order and V of A = U S V^T, thin; `None` if a number is not finite.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn svd(matrix: &Matrix) -> Option<(Matrix, Vec<f64>, Matrix)> {
    if !is_finite(matrix) {
        return None;
    }
    let svd = Svd::new_thin(view(matrix)).ok()?;
    Some((owned(svd.U()), svd.S().column_vector().iter().copied().collect(), owned(svd.V())))
}

/// Eigenvalues of a general real matrix; `None` if a number is not finite.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn eigenvalues(matrix: &Matrix) -> Option<Vec<Complex<f64>>> {
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    if is_finite(matrix) { view(matrix).eigenvalues().ok() } else { None }
}

/// L with A = L L^T for a symmetric positive definite A; `None` if it is not.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn cholesky(a: &Matrix) -> Option<Matrix> {
    Some(owned(view(a).llt(Side::Lower).ok()?.L()))
}

/// X with A X = B for a symmetric positive definite A; `None` if it is not.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn solve_positive(a: &Matrix, b: &Matrix) -> Option<Matrix> {
    let factor = view(a).llt(Side::Lower).ok()?;
    let mut x: Mat<f64> = view(b).to_owned();
    factor.solve_in_place(x.as_mut());
    Some(owned(x.as_ref()))
}

/// X with A X = B for complex numbers, by elimination with pivots; `None` if A is singular.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn solve_complex(a: ComplexMatrix, b: &ComplexMatrix) -> Option<ComplexMatrix> {
    a.lu().solve(b)
}

/// L with L L^T = Z Z^T, square, for a Z with more columns than rows.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn lower_factor(z: &Matrix) -> Matrix {
    owned(view(z).transpose().qr().thin_R().transpose())
}

/// The left singular vectors of the largest singular values of `matrix`, at most `count`, as columns.
pub(crate) fn leading_left_singular_vectors(matrix: &Matrix, count: usize) -> Matrix {
    let columns = matrix.ncols();
    let Some((values, vectors)) = eigen(&gram(matrix)) else { return Matrix::zeros(matrix.nrows(), 0) };
    let sigma = |n: usize| values[columns - 1 - n].max(0.0).sqrt();
    let count = (0..count.min(columns)).take_while(|&n| sigma(n) > NUMERICAL_RANK * sigma(0)).count();
    product(matrix, &Matrix::from_fn(columns, count, |row, n| vectors[(row, columns - 1 - n)] / sigma(n)))
}

/// The combinations of the columns of `matrix` along its leading right singular vectors, at most `count`: what is left out
/// is the smallest part that `count` columns can leave out.
pub(crate) fn leading_combinations(matrix: Matrix, count: usize) -> Matrix {
    let count = count.min(matrix.ncols());
    let Some((_, vectors)) = eigen(&gram(&matrix)) else { return matrix };
    product(&matrix, &vectors.columns(matrix.ncols() - count, count).into_owned())
}

/// The modes of the symmetric pencil (`stiffness`, `mass`) in the directions that `mass` can tell apart: T with
/// T^T M T = I and T^T K T diagonal, and the diagonal. `None` if a number is not finite.
pub(crate) fn modes(mass: &Matrix, stiffness: &Matrix) -> Option<(Matrix, Vec<f64>)> {
    let (values, mut white) = eigen(mass)?;
    let largest = values.last().copied().unwrap_or(0.0);
    let dependent = values.iter().take_while(|&&value| value <= DEPENDENT * largest).count();
    white = white.remove_columns(0, dependent);
    for (mut vector, value) in white.column_iter_mut().zip(&values[dependent..]) {
        vector /= value.sqrt();
    }
    let (values, vectors) = eigen(&product_t(&white, &product(stiffness, &white)))?;
    Some((product(&white, &vectors), values))
}

/// Eliminates the unknowns of the symmetric positive definite A from the first to the last: A = L D L^T. `matrix` has the
/// lower triangle of A, and below it B^T. Afterwards D is on the diagonal, L below it, and (D^-1 L^-1 B)^T in the place of
/// B^T. `None` if a pivot is not above zero.
pub(crate) fn eliminate(matrix: &mut Matrix) -> Option<()> {
    let (rows, columns) = matrix.shape();
    let matrix = matrix.as_mut_slice();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn singular_vectors_come_in_order_and_stop_at_the_numerical_rank() {
        // Columns 3 e_0, 2 e_1 and their sum: rank two.
        let matrix = Matrix::from_column_slice(3, 3, &[3.0, 0.0, 0.0, 0.0, 2.0, 0.0, 3.0, 2.0, 0.0]);
        let shapes = leading_left_singular_vectors(&matrix, 5);
        assert_eq!(shapes.shape(), (3, 2));
        assert!((product_t(&shapes, &shapes) - Matrix::identity(2, 2)).amax() < 1e-12);
        assert!(shapes[0].abs() > shapes[1].abs(), "the first leans to the largest column");
    }

    #[test]
    fn modes_diagonalise_both_matrices_and_drop_dependent_directions() {
        let square = |entries: &[f64]| Matrix::from_column_slice(2, 2, entries);
        let (mass, stiffness) = (square(&[2.0, 0.5, 0.5, 1.0]), square(&[-5.0, 1.0, 1.0, -3.0]));
        let (t, values) = modes(&mass, &stiffness).unwrap();
        assert!((t.tr_mul(&(mass * &t)) - Matrix::identity(2, 2)).amax() < 1e-12);
        let diagonal = Matrix::from_diagonal(&nalgebra::DVector::from_vec(values));
        assert!((t.tr_mul(&(&stiffness * &t)) - diagonal).amax() < 1e-12);
        assert_eq!(modes(&square(&[1.0; 4]), &stiffness).unwrap().1.len(), 1);
        assert!(modes(&Matrix::repeat(1, 1, f64::NAN), &Matrix::identity(1, 1)).is_none());
    }
}
