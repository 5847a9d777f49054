//! Shared by the examples that compare runs: the force of a run and how far two of them are apart.

use palpate::log::LogRecord;
use palpate::prelude::*;

/// The force on the tool (N), one entry per haptic tick.
pub fn forces(records: &[LogRecord]) -> Vec<Vec3> {
    let of = |record: &LogRecord| match record {
        LogRecord::Force(sample) => Some(sample.force_n.into()),
        _ => None,
    };
    records.iter().filter_map(of).collect()
}

/// How a run differs from its reference, in % of the reference's peak.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Root mean square of |F - F_ref|.
    pub rms: f64,
    /// Largest |F - F_ref|.
    pub max: f64,
    /// Largest change of F from one tick to the next.
    pub jump: f64,
}

impl Difference {
    /// Of `run` from `reference`, tick by tick; `peak` is what counts as 100 %.
    pub fn of(run: &[Vec3], reference: &[Vec3], peak: f64) -> Self {
        let apart: Vec<f64> = run.iter().zip(reference).map(|(f, r)| (f - r).norm()).collect();
        let mean_square = apart.iter().map(|d| d * d).sum::<f64>() / apart.len() as f64;
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        Self {
            rms: 100.0 * mean_square.sqrt() / peak,
            max: 100.0 * largest(&mut apart.iter().copied()) / peak,
            jump: 100.0 * largest(&mut run.windows(2).map(|pair| (pair[1] - pair[0]).norm())) / peak,
        }
    }
}

/// The largest magnitude.
pub fn peak(values: &[Vec3]) -> f64 {
    values.iter().map(Vec3::norm).fold(0.0, f64::max)
}
