//! A comparison of local models: for a terminal, for programs, and as a page with plots.

mod charts;
mod conclusions;
mod figures;
mod finer;
mod html;
mod json;
mod study;
mod table;

pub(crate) use figures::ComparedRun;
pub use figures::{Comparison, ForceDeviation, ForceTrace, Measured};
pub(crate) use html::to_html;
pub use json::to_json;
pub use study::{CompareOptions, CompareProgress};
pub(crate) use table::to_text;

use palpate::runtime::Nanos;

/// A latency in milliseconds, as short as it can be written: `0`, `33.34`.
fn milliseconds(latency: Nanos) -> String {
    format!("{}", latency.0 as f64 / 1e6)
}

/// A run in words: the model, and its latency if it has one.
fn name(run: &ComparedRun) -> String {
    match run.latency {
        Nanos::ZERO => run.model.clone(),
        late => format!("{} {} ms late", run.model, milliseconds(late)),
    }
}

/// A compute latency in words, `none` where there is none: what a link of the scene makes late comes on top of it.
fn latency_in_words(comparison: &Comparison, latency: Nanos, none: &str) -> String {
    match (latency, &comparison.link) {
        (Nanos::ZERO, None) => none.to_owned(),
        (Nanos::ZERO, Some(_)) => "with nothing added".to_owned(),
        (late, None) => format!("{} ms late", milliseconds(late)),
        (late, Some(_)) => format!("with {} ms added", milliseconds(late)),
    }
}

/// A figure of at most six characters: three digits, more before the point if it takes them.
fn figure(value: f64) -> String {
    match value.abs() {
        _ if value.is_nan() => "-".to_owned(),
        0.0 => "0".to_owned(),
        ..1e-3 => format!("{value:.0e}"),
        ..0.9995 => format!("{value:.3}"),
        ..9.995 => format!("{value:.2}"),
        ..99.95 => format!("{value:.1}"),
        ..99_999.5 => format!("{value:.0}"),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short_and_keep_three_digits() {
        let figures = [0.0, 2.34e-5, 0.0123, 0.9996, 6.543, 99.96, 1234.5, 2.5e7, f64::NAN].map(figure);
        assert_eq!(figures, ["0", "2e-5", "0.012", "1.00", "6.54", "100", "1234", "2e7", "-"]);
        assert!(figures.iter().all(|figure| figure.len() < 6));
    }
}
