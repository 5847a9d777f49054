//! Numbers for people, as in a run's report, and those that only analyses show.

use palpate::report::Quantity;

use crate::timing::{FigureValue, Unit};

/// A duration in nanoseconds.
pub(crate) fn duration(ns: u64) -> String {
    Quantity::Nanoseconds(ns).to_string()
}

/// A duration in seconds.
pub(crate) fn seconds(s: f64) -> String {
    Quantity::Seconds(s).to_string()
}

/// A force in newtons.
pub(crate) fn force(n: f64) -> String {
    Quantity::Newtons(n).to_string()
}

/// `count` things in words: `1 period`, `3 periods`.
pub(crate) fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A share, 0 to 1, in percent.
pub(crate) fn share(share: f64) -> String {
    match 100.0 * share {
        percent if percent >= 10.0 => format!("{percent:.1} %"),
        percent if percent >= 1.0 => format!("{percent:.2} %"),
        percent => format!("{percent:.3} %"),
    }
}

/// A figure of a report with its unit.
pub(crate) fn figure(value: FigureValue, unit: Unit) -> String {
    match (unit, value) {
        (Unit::Nanoseconds, FigureValue::Integer(ns)) => duration(ns),
        (Unit::Nanoseconds, FigureValue::Real(ns)) => seconds(ns / 1e9),
        (Unit::Seconds, value) => seconds(value.as_f64()),
        (Unit::Newtons, value) => force(value.as_f64()),
        (Unit::Joules, value) => format!("{:.3} mJ", 1e3 * value.as_f64()),
        (Unit::Share, value) => share(value.as_f64()),
        (Unit::Count, FigureValue::Integer(count)) => count.to_string(),
        (Unit::Count, FigureValue::Real(count)) => count.to_string(),
    }
}

/// A number with its unit without zeros at the end, `10 us` in place of `10.0 us`, as axes are labelled.
pub(crate) fn trimmed(text: String) -> String {
    match text.split_once(' ') {
        Some((number, unit)) if number.contains('.') => {
            format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_their_unit_and_axes_no_zeros_at_the_end() {
        assert_eq!([0.5, 0.0321, 0.000_04].map(share), ["50.0 %", "3.21 %", "0.004 %"]);
        assert_eq!(["10.0 us", "850 ns", "1.20 N"].map(|text| trimmed(text.to_owned())), ["10 us", "850 ns", "1.2 N"]);
        assert_eq!(figure(FigureValue::Real(0.0321), Unit::Seconds), "32.1 ms");
    }
}
