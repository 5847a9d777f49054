//! Dense linear algebra on nalgebra's matrices, the large parts done by faer. Beside `sparse.rs` and `dense.rs` the only file
//! that names it.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{SelfAdjointEigen, Svd};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use nalgebra::{Complex, DMatrix};

/// A real matrix, column after column.
pub type Matrix = DMatrix<f64>;
/// A complex one.
pub type CMatrix = DMatrix<Complex<f64>>;

fn view(matrix: &Matrix) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

fn owned(matrix: MatRef<'_, f64>) -> Matrix {
    Matrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)])
}

fn product_of(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Matrix {
    let mut out = Matrix::zeros(a.nrows(), b.ncols());
    let (rows, columns) = out.shape();
    let to = MatMut::from_column_major_slice_mut(out.as_mut_slice(), rows, columns);
    matmul(to, Accum::Replace, a, b, 1.0, Par::Seq);
    out
}

/// A B.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    product_of(view(a), view(b))
}

/// A^T B.
pub(super) fn product_t(a: &Matrix, b: &Matrix) -> Matrix {
    product_of(view(a).transpose(), view(b))
}

/// Eigenvalues in increasing order and orthonormal eigenvectors of a symmetric matrix; `None` if a number is not finite.
pub(super) fn symmetric_eigen(matrix: &Matrix) -> Option<(Vec<f64>, Matrix)> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    if matrix.is_empty() {
        return Some((Vec::new(), Matrix::zeros(0, 0)));
    }
    let eigen = SelfAdjointEigen::new(view(matrix), Side::Lower).ok()?;
    Some((eigen.S().column_vector().iter().copied().collect(), owned(eigen.U())))
}

/// U, the singular values in decreasing order and V of A = U S V^T, thin; `None` if a number is not finite.
pub(super) fn svd(matrix: &Matrix) -> Option<(Matrix, Vec<f64>, Matrix)> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let svd = Svd::new_thin(view(matrix)).ok()?;
    Some((owned(svd.U()), svd.S().column_vector().iter().copied().collect(), owned(svd.V())))
}

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

/// The lower factor of a symmetric positive definite matrix; `None` if it is not.
fn cholesky(matrix: &Matrix) -> Option<Matrix> {
    let factor = view(matrix).llt(Side::Lower).ok()?;
    Some(owned(factor.L()))
}

/// X with A X = B for a symmetric positive definite A; `None` if it is not.
pub(super) fn solve_positive(a: &Matrix, b: &Matrix) -> Option<Matrix> {
    use faer::prelude::Solve;
    let factor = view(a).llt(Side::Lower).ok()?;
    let mut x: Mat<f64> = view(b).to_owned();
    factor.solve_in_place(x.as_mut());
    Some(owned(x.as_ref()))
}

/// X with A X = B for a small complex A; `None` if it is singular.
pub(super) fn solve_complex(a: CMatrix, b: &CMatrix) -> Option<CMatrix> {
    a.lu().solve(b)
}

/// L with L L^T = Z Z^T, square, for a Z with more columns than rows.
pub(super) fn lower_factor(z: &Matrix) -> Matrix {
    owned(view(z).transpose().qr().thin_R().transpose())
}

/// The largest singular value of a small complex matrix.
pub(super) fn norm2(matrix: &CMatrix) -> f64 {
    match matrix.shape() {
        (0, _) | (_, 0) => 0.0,
        (1, 1) => matrix[(0, 0)].norm(),
        _ => {
            // The Hermitian A^H A as a real symmetric matrix of twice the size.
            let gram = matrix.adjoint() * matrix;
            let n = gram.nrows();
            let real = Matrix::from_fn(2 * n, 2 * n, |i, j| {
                let z = gram[(i % n, j % n)];
                match (i < n, j < n) {
                    (true, true) | (false, false) => z.re,
                    (true, false) => -z.im,
                    (false, true) => z.im,
                }
            });
            let eigen = real.symmetric_eigenvalues();
            eigen.iter().fold(0.0_f64, |largest, &value| largest.max(value)).sqrt()
        }
    }
}

/// The symmetric part.
pub(super) fn symmetrised(matrix: &Matrix) -> Matrix {
    (matrix + matrix.transpose()) * 0.5
}

/// A real matrix with complex numbers.
pub(super) fn complex(matrix: &Matrix) -> CMatrix {
    matrix.map(|x| Complex::new(x, 0.0))
}

/// Eigenvalues of a general real matrix.
pub(super) fn eigenvalues(matrix: &Matrix) -> Option<Vec<Complex<f64>>> {
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    view(matrix).eigenvalues().ok()
}

/// The columns of `matrix` scaled by `factors`.
pub(super) fn scaled_columns(matrix: &Matrix, factors: impl Iterator<Item = f64>) -> Matrix {
    let mut out = matrix.clone();
    for (mut column, factor) in out.column_iter_mut().zip(factors) {
        column *= factor;
    }
    out
}

/// Appends the columns of `block` to the orthonormal ones of `basis`, made orthonormal; those that are combinations of what is there,
/// but for a share of `tolerance` of their length, are left out. Returns the columns appended.
pub(super) fn append_orthonormal(basis: &mut Matrix, block: &Matrix, tolerance: f64) -> Matrix {
    let (n, before) = basis.shape();
    for column in block.column_iter() {
        let mut v = column.into_owned();
        let norm = v.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            continue;
        }
        v /= norm;
        // Twice is enough (Kahan and Parlett).
        for _ in 0..2 {
            let overlap = basis.tr_mul(&v);
            v.gemv(-1.0, basis, &overlap, 1.0);
        }
        let left = v.norm();
        if left > tolerance {
            let at = basis.ncols();
            let grown = std::mem::replace(basis, Matrix::zeros(0, 0));
            *basis = grown.insert_column(at, 0.0);
            basis.set_column(at, &(v / left));
        }
    }
    basis.view((0, before), (n, basis.ncols() - before)).into_owned()
}
