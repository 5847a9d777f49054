//! Frequency responses, and how far one is from another.

use nalgebra::Complex;

use super::linalg::{CMatrix, Matrix};

/// A linear model between m inputs and p outputs.
pub trait Response {
    /// The transfer matrix G(s), p x m; `None` at a pole.
    fn at(&self, s: Complex<f64>) -> Option<CMatrix>;

    /// G at a frequency (Hz).
    fn at_hz(&self, hz: f64) -> Option<CMatrix> {
        self.at(Complex::new(0.0, 2.0 * std::f64::consts::PI * hz))
    }
}

/// Frequencies with even steps of the logarithm, both ends among them (Hz).
pub fn log_spaced(from_hz: f64, to_hz: f64, count: usize) -> Vec<f64> {
    let steps = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|n| from_hz * (to_hz / from_hz).powf(n as f64 / steps)).collect()
}

/// The largest gain of `model` minus `other` and of `model`, over rest and `frequencies` (Hz) and what lies between them: each of the
/// largest values found is refined by a golden section. The infinity norms of the difference and of the model, up to the
/// resolution of the grid. `other` = `None` stands for zero.
pub fn largest_gain(model: &dyn Response, other: Option<&dyn Response>, frequencies: &[f64]) -> f64 {
    let gain = |hz: f64| -> f64 {
        let Some(of_model) = model.at_hz(hz) else { return f64::INFINITY };
        match other {
            None => norm2(&of_model),
            Some(other) => other.at_hz(hz).map_or(f64::INFINITY, |of_other| norm2(&(of_model - of_other))),
        }
    };
    let values: Vec<f64> = frequencies.iter().map(|&hz| gain(hz)).collect();
    let mut largest = values.iter().fold(gain(0.0), |largest, &value| largest.max(value));
    // Peaks lie between the samples: the three largest local maxima are searched.
    let mut peaks: Vec<usize> = (0..values.len())
        .filter(|&n| (n == 0 || values[n] >= values[n - 1]) && (n + 1 == values.len() || values[n] >= values[n + 1]))
        .collect();
    peaks.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    for &peak in peaks.iter().take(3) {
        let (low, high) = (frequencies[peak.saturating_sub(1)], frequencies[(peak + 1).min(values.len() - 1)]);
        largest = largest.max(golden_maximum(low.ln(), high.ln(), |ln_hz| gain(ln_hz.exp())));
    }
    largest
}

/// The maximum of a function with one peak between `low` and `high`.
fn golden_maximum(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> f64 {
    let share = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut at_a, mut at_b) = (of(a), of(b));
    for _ in 0..24 {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - share * (high - low);
            at_a = of(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + share * (high - low);
            at_b = of(b);
        }
    }
    at_a.max(at_b)
}

/// The largest singular value of a small complex matrix.
fn norm2(matrix: &CMatrix) -> f64 {
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
