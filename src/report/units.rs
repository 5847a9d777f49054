//! Numbers for people: three or four significant digits and the unit that keeps them short.

use crate::log::timing::{Unit, Value};

/// A duration in nanoseconds, as `850 ns`, `52.1 us`, `1.23 ms` or `2.50 s`.
pub(super) fn duration(ns: u64) -> String {
    match ns {
        0..1_000 => format!("{ns} ns"),
        1_000..1_000_000 => scaled(ns as f64 / 1e3, "us"),
        1_000_000..1_000_000_000 => scaled(ns as f64 / 1e6, "ms"),
        _ => scaled(ns as f64 / 1e9, "s"),
    }
}

/// A duration in seconds.
pub(super) fn seconds(s: f64) -> String {
    if s.is_finite() { duration((s * 1e9).round() as u64) } else { format!("{s} s") }
}

/// A force in newtons, as `0 N`, `850 uN`, `12.3 mN` or `1.23 N`.
pub(super) fn force(n: f64) -> String {
    match n.abs() {
        0.0 => "0 N".into(),
        ..1e-3 => scaled(n * 1e6, "uN"),
        ..1.0 => scaled(n * 1e3, "mN"),
        _ => scaled(n, "N"),
    }
}

/// A share, 0 to 1, in percent.
pub(super) fn share(share: f64) -> String {
    match 100.0 * share {
        percent if percent >= 10.0 => format!("{percent:.1} %"),
        percent if percent >= 1.0 => format!("{percent:.2} %"),
        percent => format!("{percent:.3} %"),
    }
}

/// A figure of a report with its unit.
pub(super) fn figure(value: Value, unit: Unit) -> String {
    match (unit, value) {
        (Unit::Nanoseconds, Value::Integer(ns)) => duration(ns),
        (Unit::Nanoseconds, Value::Real(ns)) => seconds(ns / 1e9),
        (Unit::Seconds, value) => seconds(value.as_f64()),
        (Unit::Newtons, value) => force(value.as_f64()),
        (Unit::Joules, value) => format!("{:.3} mJ", 1e3 * value.as_f64()),
        (Unit::Share, value) => share(value.as_f64()),
        (Unit::Count, Value::Integer(count)) => count.to_string(),
        (Unit::Count, Value::Real(count)) => count.to_string(),
    }
}

/// A number with its unit without zeros at the end, `10 us` in place of `10.0 us`, as axes are labelled.
pub(super) fn trimmed(text: String) -> String {
    match text.split_once(' ') {
        Some((number, unit)) if number.contains('.') => {
            format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

/// `count` things in words: `1 period`, `3 periods`.
pub(super) fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn scaled(value: f64, unit: &str) -> String {
    match value.abs() {
        ..10.0 => format!("{value:.2} {unit}"),
        ..100.0 => format!("{value:.1} {unit}"),
        _ => format!("{value:.0} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_the_unit_that_keeps_them_short() {
        assert_eq!(
            [0, 999, 52_110, 1_234_567, 2_500_000_000].map(duration),
            ["0 ns", "999 ns", "52.1 us", "1.23 ms", "2.50 s"]
        );
        assert_eq!([0.0, 8.5e-4, 0.0123, 1.234].map(force), ["0 N", "850 uN", "12.3 mN", "1.23 N"]);
        assert_eq!(seconds(f64::NAN), "NaN s");
        assert_eq!([0.5, 0.0321, 0.000_04].map(share), ["50.0 %", "3.21 %", "0.004 %"]);
        assert_eq!(["10.0 us", "850 ns", "1.20 N"].map(|text| trimmed(text.to_owned())), ["10 us", "850 ns", "1.2 N"]);
        assert_eq!(figure(Value::Real(0.0321), Unit::Seconds), "32.1 ms");
    }
}
