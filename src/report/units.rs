//! Numbers for people: three or four significant digits and the unit that keeps them short.

/// A duration in nanoseconds, as `850 ns`, `52.1 us`, `1.23 ms` or `2.50 s`.
pub fn duration(ns: u64) -> String {
    match ns {
        0..1_000 => format!("{ns} ns"),
        1_000..1_000_000 => scaled(ns as f64 / 1e3, "us"),
        1_000_000..1_000_000_000 => scaled(ns as f64 / 1e6, "ms"),
        _ => scaled(ns as f64 / 1e9, "s"),
    }
}

/// A duration in seconds, as [`duration`] writes it.
pub fn seconds(s: f64) -> String {
    if s.is_finite() { duration((s * 1e9).round() as u64) } else { format!("{s} s") }
}

/// A force in newtons, as `0 N`, `850 uN`, `12.3 mN` or `1.23 N`.
pub fn force(n: f64) -> String {
    match n.abs() {
        0.0 => "0 N".into(),
        ..1e-3 => scaled(n * 1e6, "uN"),
        ..1.0 => scaled(n * 1e3, "mN"),
        _ => scaled(n, "N"),
    }
}

/// `count` things in words: `1 period`, `3 periods`.
pub fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A number and its unit with three significant digits.
pub fn scaled(value: f64, unit: &str) -> String {
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
    }
}
