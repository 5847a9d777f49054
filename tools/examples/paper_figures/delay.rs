//! The delay of one signal behind another, by cross-correlation.

/// Lags are tried from this many ticks early to this many late.
const EARLIEST: isize = -100;
const LATEST: isize = 150;

/// How far a signal runs behind another.
#[derive(Clone, Copy, Debug)]
pub struct Delay {
    /// In ticks, with a fraction; negative if it runs ahead.
    pub ticks: f64,
    /// The correlation coefficient at that lag: 1 if one signal is the other, shifted and scaled.
    pub correlation: f64,
}

impl Delay {
    /// Of `late` behind `early`, one value per tick each.
    ///
    /// For every whole lag L the correlation coefficient of early(t) with late(t + L) is taken over all t that both
    /// have, each with its mean over these t removed; the delay is the vertex of the parabola through the largest
    /// coefficient and its two neighbours. Without the normalisation a decaying signal would pull the peak towards zero.
    pub fn of(late: &[f64], early: &[f64]) -> Self {
        let at = |lag: isize| {
            let (skip_late, skip_early) = (lag.max(0) as usize, (-lag).max(0) as usize);
            correlation(&late[skip_late..], &early[skip_early..])
        };
        let best = (EARLIEST + 1..LATEST).max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap_or_default();
        let (before, peak, after) = (at(best - 1), at(best), at(best + 1));
        let curvature = before - 2.0 * peak + after;
        let fraction = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
        Self { ticks: best as f64 + fraction, correlation: peak }
    }
}

/// The correlation coefficient of `a` and `b` over their common length.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (mut together, mut of_a, mut of_b) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        together += a * b;
        of_a += a * a;
        of_b += b * b;
    }
    together / (of_a * of_b).sqrt()
}
