//! Factors of the Gramians: of a modal system mode by mode, of any stable one by a Schur form.

use nalgebra::{Complex, Schur};

use super::linalg::{CMatrix, Matrix, complex, lower_factor, scaled_columns, svd};
use super::modal::Modal;

/// Modes whose share of the first one's energy is below this are left out: what they add to a Hankel singular value is below 1e-15
/// of the largest.
const NEGLIGIBLE: f64 = 1e-30;

/// A factor Z (2n x k) of the controllability Gramian P = Z Z^T for the states (w q, q'); `None` if a mode is not damped.
///
/// The factor is found directly: a Cholesky factor of the Gramian itself would lose all Hankel singular values below the root of
/// the machine's precision.
pub(super) fn controllability(modal: &Modal) -> Option<Matrix> {
    factor(&modal.frequencies, &modal.dampings, &modal.input())
}

/// A factor of the observability Gramian Q, as [`controllability`] has one of P.
pub(super) fn observability(modal: &Modal) -> Option<Matrix> {
    // A^T = [0, -w; w, -c].
    let reversed: Vec<f64> = modal.frequencies.iter().map(|w| -w).collect();
    factor(&reversed, &modal.dampings, &modal.output())
}

/// Z with A Z Z^T + Z Z^T A^T = -G G^T for a block diagonal A with blocks [0, w; -w, -c] and G with two rows a block, each column of
/// G on its own.
///
/// Low-rank alternating directions (Li and White 2002, SIAM J. Matrix Anal. 24; in real numbers Benner, Kuerschner and Saak 2013,
/// Numer. Algorithms 62) with the poles of A themselves as shifts, the mode with most energy left next: exact once all modes have had
/// their turn, and as good as that long before where damping is strong.
fn factor(frequencies: &[f64], dampings: &[f64], generator: &Matrix) -> Option<Matrix> {
    let stable = |(&w, &c): (&f64, &f64)| w != 0.0 && w.is_finite() && c > 0.0 && c.is_finite();
    if !frequencies.iter().zip(dampings).all(stable) {
        return None;
    }
    let mut columns = Vec::new();
    for column in generator.column_iter() {
        let blocks = column.as_slice().as_chunks::<2>().0.to_vec();
        let modes = frequencies.iter().zip(dampings).map(|(&w, &c)| Mode { w, c }).collect();
        Directions { modes, residual: blocks, open: vec![true; frequencies.len()] }.exhaust(&mut columns);
    }
    let rows = 2 * frequencies.len();
    let factor = Matrix::from_vec(rows, columns.len() / rows.max(1), columns);
    // Z Z^T = L L^T: no more columns than rows.
    Some(if factor.ncols() > rows { lower_factor(&factor) } else { factor })
}

/// A block [0, w; -w, -c].
#[derive(Clone, Copy)]
struct Mode {
    w: f64,
    c: f64,
}

impl Mode {
    /// (A + mu)^-1 g for a real mu.
    fn solve(self, mu: f64, [a, b]: [f64; 2]) -> [f64; 2] {
        let determinant = mu * (mu - self.c) + self.w * self.w;
        [((mu - self.c) * a - self.w * b) / determinant, (self.w * a + mu * b) / determinant]
    }

    /// (A - mu) v.
    fn shifted(self, mu: f64, [a, b]: [f64; 2]) -> [f64; 2] {
        [self.w * b - mu * a, -self.w * a - (self.c + mu) * b]
    }

    /// Real and imaginary part of (A + mu)^-1 g for mu = a + i b.
    fn solve_complex(self, (re, im): (f64, f64), [g, h]: [f64; 2]) -> [[f64; 2]; 2] {
        // Determinant mu (mu - c) + w^2.
        let (det_re, det_im) = (re * (re - self.c) - im * im + self.w * self.w, im * (2.0 * re - self.c));
        let size = det_re * det_re + det_im * det_im;
        let divide = |x: f64, y: f64| [(x * det_re + y * det_im) / size, (y * det_re - x * det_im) / size];
        let first = divide((re - self.c) * g - self.w * h, im * g);
        let second = divide(self.w * g + re * h, im * h);
        [[first[0], second[0]], [first[1], second[1]]]
    }

    /// The trace of P for this mode alone: A P + P A^T = -g g^T.
    fn energy(self, [a, b]: [f64; 2]) -> f64 {
        let x12 = -a * a / (2.0 * self.w);
        let x22 = (b * b - 2.0 * self.w * x12) / (2.0 * self.c);
        2.0 * x22 - (self.c * x12 - a * b) / self.w
    }
}

/// One column of G on its way to nothing.
struct Directions {
    modes: Vec<Mode>,
    residual: Vec<[f64; 2]>,
    /// Modes that have not had their turn.
    open: Vec<bool>,
}

impl Directions {
    /// Appends the columns of Z.
    fn exhaust(mut self, columns: &mut Vec<f64>) {
        let mut first = 0.0;
        while let Some((next, energy)) = self.most_energy() {
            if first == 0.0 {
                first = energy;
            }
            // Nothing is left if it is not a number.
            if energy.partial_cmp(&(NEGLIGIBLE * first)) != Some(std::cmp::Ordering::Greater) {
                break;
            }
            let Mode { w, c } = self.modes[next];
            let discriminant = 0.25 * c * c - w * w;
            if discriminant >= 0.0 {
                let fast = 0.5 * c + discriminant.sqrt();
                self.real_step(-w * w / fast, columns);
                self.real_step(-fast, columns);
            } else {
                self.complex_step((-0.5 * c, (-discriminant).sqrt()), columns);
            }
            self.open[next] = false;
            self.residual[next] = [0.0; 2];
        }
    }

    fn most_energy(&self) -> Option<(usize, f64)> {
        let energies = (0..self.modes.len()).filter(|&n| self.open[n]);
        energies.map(|n| (n, self.modes[n].energy(self.residual[n]))).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn real_step(&mut self, mu: f64, columns: &mut Vec<f64>) {
        let scale = (-2.0 * mu).sqrt();
        for (mode, residual) in self.modes.iter().zip(&mut self.residual) {
            let v = mode.solve(mu, *residual);
            columns.extend(v.map(|x| scale * x));
            *residual = mode.shifted(mu, v);
        }
    }

    fn complex_step(&mut self, mu: (f64, f64), columns: &mut Vec<f64>) {
        let (re, im) = mu;
        let (delta, gamma) = (re / im, 2.0 * (-re).sqrt());
        let second = gamma * (delta * delta + 1.0).sqrt();
        let mut imaginary = Vec::with_capacity(2 * self.modes.len());
        for (mode, residual) in self.modes.iter().zip(&mut self.residual) {
            let [v_re, v_im] = mode.solve_complex(mu, *residual);
            let sum = [v_re[0] + delta * v_im[0], v_re[1] + delta * v_im[1]];
            columns.extend(sum.map(|x| gamma * x));
            imaginary.extend(v_im.map(|x| second * x));
            *residual = [residual[0] - 4.0 * re * sum[0], residual[1] - 4.0 * re * sum[1]];
        }
        columns.append(&mut imaginary);
    }
}

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
