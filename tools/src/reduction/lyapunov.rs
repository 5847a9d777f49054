//! Factors of the Gramians of any stable system.

use nalgebra::{Complex, Schur};

use super::linalg::{CMatrix, Matrix, complex, scaled_columns, svd};

/// Singular values of a factor below this share of the largest are rounding.
const RANK: f64 = 1e-16;

/// Real factors Z_P and Z_Q of the Gramians, A P + P A^T = -B B^T and A^T Q + Q A = -C^T C, by a complex Schur form and the method of
/// Hammarling (1982, IMA J. Numer. Anal. 2; as in Sorensen and Zhou 2003, J. Appl. Math.), which finds the factors themselves.
/// `None` if A (n x n) is not stable. `input` is B (n x m), `output` C^T (n x p).
pub(super) fn factors(a: &Matrix, input: &Matrix, output: &Matrix) -> Option<(Matrix, Matrix)> {
    let (basis, triangle) = Schur::try_new(complex(a), f64::EPSILON, 0)?.unpack();
    let forward = triangular(&triangle, basis.adjoint() * complex(input))?;
    // A^T Q + Q A with the order of rows and columns reversed has an upper triangular matrix again.
    let n = a.nrows();
    let reversed = CMatrix::from_fn(n, n, |i, j| triangle[(n - 1 - j, n - 1 - i)].conj());
    let right = basis.adjoint() * complex(output);
    let backward = triangular(&reversed, CMatrix::from_fn(n, right.ncols(), |i, j| right[(n - 1 - i, j)]))?;
    let backward = CMatrix::from_fn(n, n, |i, j| backward[(n - 1 - i, j)]);
    Some((real(&(&basis * forward))?, real(&(basis * backward))?))
}

/// U with T U U^H + U U^H T^H = -B B^H for an upper triangular T.
fn triangular(t: &CMatrix, mut b: CMatrix) -> Option<CMatrix> {
    let (n, m) = b.shape();
    let mut u = CMatrix::zeros(n, n);
    for j in (0..n).rev() {
        let rate = -2.0 * t[(j, j)].re;
        if !(rate > 0.0 && rate.is_finite()) {
            return None;
        }
        let norm = b.row(j).norm();
        if norm == 0.0 {
            continue;
        }
        let mu = norm / rate.sqrt();
        let direction: Vec<Complex<f64>> = b.row(j).iter().map(|x| x / mu).collect();
        u[(j, j)] = Complex::new(mu, 0.0);
        // (T + conj(t_jj)) x = -B direction^H - mu t_j, from the last row up.
        let shift = t[(j, j)].conj();
        for i in (0..j).rev() {
            let mut right = -t[(i, j)] * mu;
            right -= (0..m).map(|k| b[(i, k)] * direction[k].conj()).sum::<Complex<f64>>();
            right -= (i + 1..j).map(|k| t[(i, k)] * u[(k, j)]).sum::<Complex<f64>>();
            u[(i, j)] = right / (t[(i, i)] + shift);
        }
        for i in 0..j {
            for k in 0..m {
                let taken = u[(i, j)] * direction[k];
                b[(i, k)] -= taken;
            }
        }
    }
    Some(u)
}

/// A real factor of the real matrix Z Z^H.
fn real(z: &CMatrix) -> Option<Matrix> {
    let (n, k) = z.shape();
    let both = Matrix::from_fn(n, 2 * k, |i, j| if j < k { z[(i, j)].re } else { z[(i, j - k)].im });
    let (u, sigma, _) = svd(&both)?;
    let rank = sigma.iter().take_while(|&&s| s > RANK * sigma[0]).count();
    Some(scaled_columns(&u.columns(0, rank).into_owned(), sigma.into_iter()))
}
