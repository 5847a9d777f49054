//! Logarithmic axes over many powers of ten: errors and Hankel singular values go from all to rounding.

use super::axis::{Axis, Tick};

/// More powers of ten than this have a line for each of them and none in between.
const FEW: f64 = 1e9;
/// Labels that fit beside each other.
const LABELS: i32 = 7;
/// Around the values.
const ROOM: f64 = 1.6;

/// The ticks of an axis that is too long for lines between its powers of ten; `None` for a shorter one.
pub(crate) fn decades([from, to]: [f64; 2]) -> Option<Vec<Tick>> {
    if to / from < FEW {
        return None;
    }
    // Half a decade of nothing at an end has no tick.
    let (first, last) = ((from.log10() - 1e-9).ceil() as i32, (to.log10() + 1e-9).floor() as i32);
    let every = (last - first) / LABELS + 1;
    let tick = |exponent: i32| {
        let value = 10_f64.powi(exponent);
        (value, (exponent % every == 0).then(|| power(value)))
    };
    Some((first..=last).map(tick).collect())
}

impl Axis {
    /// A logarithmic axis that shows all of `values` which are above zero and finite, with powers of ten for labels.
    pub(crate) fn decades(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let shown = values.filter(|value| value.is_finite() && *value > 0.0);
        let [low, high] = shown.fold([f64::INFINITY, 0.0], |[low, high], value| [value.min(low), value.max(high)]);
        let [low, high] = if low <= high { [low / ROOM, high * ROOM] } else { [0.1, 10.0] };
        // Less than a decade has too few ticks to be read.
        let short = (10.0 * low / high).max(1.0).sqrt();
        Self::log_down_to(label, [low / short, high * short]).in_words(power)
    }
}

/// A value as a label: written out, or as a power of ten where that is shorter.
pub(crate) fn power(value: f64) -> String {
    match value.abs() {
        // Ticks are 1, 2 or 5 times a power of ten, within rounding.
        0.009_9..=50_000.0 => format!("{value:.5}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().filter_map(|(_, label)| label).collect()
    }

    #[test]
    fn a_long_axis_has_as_many_labels_as_fit() {
        let axis = Axis::decades("", [1e-14, 0.0, 1.0, f64::NAN].into_iter());
        assert_eq!(labels(&axis), ["1e-12", "1e-9", "1e-6", "1e-3", "1"]);
        // A line at each power of ten.
        assert_eq!(axis.ticks().len(), 15);
        assert!(axis.place(1e-14) > 0.0 && axis.place(1.0) < 1.0);
    }

    #[test]
    fn a_short_axis_has_more_than_one_label() {
        assert!(labels(&Axis::decades("", [3.0].into_iter())).len() >= 2);
        assert!(labels(&Axis::decades("", [0.001, 0.0012].into_iter())).len() >= 2);
        assert_eq!(labels(&Axis::decades("", std::iter::empty())), ["0.1", "1", "10"]);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([1e-6, 0.001, 0.5, 20.0, 1e5, 1e6].map(power), ["1e-6", "1e-3", "0.5", "20", "1e5", "1e6"]);
    }
}
