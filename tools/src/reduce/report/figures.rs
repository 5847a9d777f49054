//! Numbers of a reduction for people: three digits, however small.

use crate::reduce::findings::ReductionRow;
use crate::units::seconds;

/// Published errors below this (%) are rounding, to which nothing can be held.
const ROUNDING_PCT: f64 = 1e-10;
/// What stands where there is no figure.
pub(super) const NONE: &str = "-";

/// Three digits, a power of ten where it takes one.
pub(super) fn figure(value: f64) -> String {
    match value.abs() {
        _ if !value.is_finite() => NONE.to_owned(),
        0.0 => "0".to_owned(),
        ..9.995e-4 => format!("{value:.2e}"),
        ..0.009_995 => format!("{value:.5}"),
        ..0.099_95 => format!("{value:.4}"),
        ..0.9995 => format!("{value:.3}"),
        ..9.995 => format!("{value:.2}"),
        ..99.95 => format!("{value:.1}"),
        ..99_999.5 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

/// The same of a figure that may be missing.
pub(super) fn optional(value: Option<f64>) -> String {
    value.map_or(NONE.to_owned(), figure)
}

/// In %.
pub(super) fn percent(value: f64) -> String {
    if value.is_finite() { format!("{} %", figure(value)) } else { "an unknown part".to_owned() }
}

/// A time (s), `-` for one that was not measured.
pub(super) fn time(s: f64) -> String {
    if s.is_finite() && s > 0.0 { seconds(s) } else { NONE.to_owned() }
}

/// Computed over published, where both are there.
pub(super) fn ratio(computed: f64, published: f64) -> Option<f64> {
    (is_there(published) && computed.is_finite()).then(|| computed / published)
}

/// The same of a row, but for published errors that are rounding.
pub(super) fn published_ratio(row: &ReductionRow) -> Option<f64> {
    ratio(row.error_pct, row.published_error_pct).filter(|_| row.published_error_pct > ROUNDING_PCT)
}

/// A published figure is above zero.
pub(super) fn is_there(published: f64) -> bool {
    published.is_finite() && published > 0.0
}

/// Sizes along several axes: `12 x 12`.
pub(super) fn by(sizes: &[usize]) -> String {
    sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
}

/// A frequency with its digits and not more: `0`, `0.5`, `1000`.
pub(super) fn hertz(hz: f64) -> String {
    match hz.abs() {
        _ if !hz.is_finite() => NONE.to_owned(),
        0.0 => "0".to_owned(),
        ..1e-3 => format!("{hz:.2e}"),
        ..10.0 => format!("{hz:.3}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        ..1e3 => format!("{hz:.1}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => format!("{hz:.0}"),
    }
}

/// The gain of a complex number in dB; `-inf` for none.
pub(super) fn decibels([re, im]: [f64; 2]) -> f64 {
    20.0 * re.hypot(im).log10()
}

/// A gain in dB as a cell.
pub(super) fn decibel_cell(gain: [f64; 2]) -> String {
    let db = decibels(gain);
    if db.is_finite() { format!("{db:.2}") } else { NONE.to_owned() }
}

/// The value below which a share of the sorted `values` lies, nearest rank; `None` of nothing.
pub(super) fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0, 4.84e-13, 0.003961, 0.9996, 6.543, 51.13, 120.4, 2.5e7, f64::NAN].map(figure);
        assert_eq!(figures, ["0", "4.84e-13", "0.00396", "1.00", "6.54", "51.1", "120", "2.50e7", "-"]);
        assert_eq!([0.0, 0.5, 12.25, 31.62, 1000.0].map(hertz), ["0", "0.5", "12.2", "31.6", "1000"]);
        assert_eq!((time(0.0), time(0.0123)), ("-".into(), "12.3 ms".into()));
        assert_eq!((ratio(2.0, 4.0), ratio(2.0, 0.0), ratio(f64::NAN, 1.0)), (Some(0.5), None, None));
    }

    #[test]
    fn gains_are_in_decibels_and_nothing_has_none() {
        assert_eq!([decibel_cell([0.0, 10.0]), decibel_cell([0.0, 0.0])], ["20.00", "-"]);
    }

    #[test]
    fn percentiles_are_values_of_the_list() {
        let values = [1.0, 2.0, 3.0, 4.0];
        assert_eq!([0.0, 0.5, 0.9, 1.0].map(|share| percentile(&values, share)), [1.0, 2.0, 4.0, 4.0].map(Some));
        assert_eq!(percentile(&[], 0.5), None);
    }
}
