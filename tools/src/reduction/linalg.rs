//! What reductions do with dense matrices, beside what [`palpate::model::linear_algebra`] does.

use nalgebra::{Complex, DVector};

pub use palpate::model::linear_algebra::{ComplexMatrix as CMatrix, Matrix};
pub(super) use palpate::model::linear_algebra::{
    SparseFactor, cholesky, eigenvalues, lower_factor, product, product_t, solve_complex, solve_positive, svd,
    symmetric_eigen,
};

/// Directions of which this share of their length is new are combinations of those that are there.
pub(super) const DEPENDENT: f64 = 1e-11;

/// A column of real numbers.
pub(super) type Vector = DVector<f64>;

/// The columns of all `parts`, which have as many rows, one part after the other.
pub(super) fn side_by_side(parts: &[&Matrix]) -> Matrix {
    let rows = parts.first().map_or(0, |part| part.nrows());
    let columns = parts.iter().map(|part| part.ncols()).sum();
    // They are kept column after column.
    Matrix::from_iterator(rows, columns, parts.iter().flat_map(|part| part.iter().copied()))
}

/// Eigenvalues in increasing order and vectors of K x = l M x with X^T M X = 1; `None` if M is not positive definite.
pub(super) fn pencil_eigen(stiffness: &Matrix, mass: &Matrix) -> Option<(Vec<f64>, Matrix)> {
    let factor = cholesky(mass)?;
    // L^-1 K L^-T
    let half = factor.solve_lower_triangular(stiffness)?;
    let whole = factor.solve_lower_triangular(&half.transpose())?;
    let (values, vectors) = symmetric_eigen(&symmetrised(&whole))?;
    Some((values, factor.transpose().solve_upper_triangular(&vectors)?))
}

/// Orthonormal columns for the span of `matrix`, those directions left out whose share of the largest is below `tolerance`.
/// Columns are scaled to length 1 first.
pub(super) fn span(matrix: &Matrix, tolerance: f64) -> Matrix {
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    if scaled.ncols() == 0 {
        return scaled;
    }
    let Some((u, sigma, _)) = svd(&scaled) else { return Matrix::zeros(matrix.nrows(), 0) };
    let kept = sigma.iter().take_while(|&&s| s > tolerance * sigma[0]).count();
    u.columns(0, kept).into_owned()
}

/// The symmetric part.
pub(super) fn symmetrised(matrix: &Matrix) -> Matrix {
    (matrix + matrix.transpose()) * 0.5
}

/// A real matrix with complex numbers.
pub(super) fn complex(matrix: &Matrix) -> CMatrix {
    matrix.map(|x| Complex::new(x, 0.0))
}

/// The columns of `matrix` scaled by `factors`.
pub(super) fn scaled_columns(matrix: &Matrix, factors: impl Iterator<Item = f64>) -> Matrix {
    let mut out = matrix.clone();
    for (mut column, factor) in out.column_iter_mut().zip(factors) {
        column *= factor;
    }
    out
}

/// What is left of `column` without its part in the span of the orthonormal columns of `basis`. What is taken of each of
/// these is taken of the column of `other` at the same place from `follower` too.
pub(super) fn orthogonal(basis: &Matrix, mut column: Vector, mut also: Option<(&Matrix, &mut Vector)>) -> Vector {
    // Twice is enough (Kahan and Parlett).
    for _ in 0..2 {
        let overlap = basis.tr_mul(&column);
        column.gemv(-1.0, basis, &overlap, 1.0);
        if let Some((other, follower)) = &mut also {
            follower.gemv(-1.0, other, &overlap, 1.0);
        }
    }
    column
}

/// Appends a column.
pub(super) fn push_column(matrix: &mut Matrix, column: &Vector) {
    let at = matrix.ncols();
    matrix.resize_horizontally_mut(at + 1, 0.0);
    matrix.set_column(at, column);
}

/// Appends the columns of `block` to the orthonormal ones of `basis`, made orthonormal; those that are combinations of what is there,
/// but for a share of `tolerance` of their length, are left out. Returns the columns appended.
pub(super) fn append_orthonormal(basis: &mut Matrix, block: &Matrix, tolerance: f64) -> Matrix {
    let before = basis.ncols();
    for column in block.column_iter() {
        let norm = column.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            continue;
        }
        let left = orthogonal(basis, column / norm, None);
        let length = left.norm();
        if length > tolerance {
            push_column(basis, &(left / length));
        }
    }
    basis.columns(before, basis.ncols() - before).into_owned()
}
