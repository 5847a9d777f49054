//! Numbers for people: three or four significant digits and the unit that keeps them short.

use std::fmt::{self, Display, Formatter};

/// A quantity that is printed with three or four significant digits and the unit that keeps them short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// A duration in nanoseconds, as `850 ns`, `52.1 us`, `1.23 ms` or `2.50 s`.
    Nanoseconds(u64),
    /// A duration in seconds, printed in the same units.
    Seconds(f64),
    /// A force in newtons, as `0 N`, `850 uN`, `12.3 mN` or `1.23 N`.
    Newtons(f64),
    /// A pressure in pascals, as `850 Pa`, `12.3 kPa` or `1.23 MPa`.
    Pascals(f64),
    /// An area in square metres, as `1.23 mm2` or `12.3 cm2`.
    SquareMetres(f64),
}

impl Display for Quantity {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Nanoseconds(ns @ 0..1_000) => write!(f, "{ns} ns"),
            Self::Nanoseconds(ns @ 1_000..1_000_000) => scaled(f, ns as f64 / 1e3, "us"),
            Self::Nanoseconds(ns @ 1_000_000..1_000_000_000) => scaled(f, ns as f64 / 1e6, "ms"),
            Self::Nanoseconds(ns) => scaled(f, ns as f64 / 1e9, "s"),
            Self::Seconds(s) if s.is_finite() => Self::Nanoseconds((s * 1e9).round() as u64).fmt(f),
            Self::Seconds(s) => write!(f, "{s} s"),
            Self::Newtons(n) => match n.abs() {
                0.0 => f.write_str("0 N"),
                ..1e-3 => scaled(f, n * 1e6, "uN"),
                ..1.0 => scaled(f, n * 1e3, "mN"),
                _ => scaled(f, n, "N"),
            },
            Self::Pascals(pa) => match pa.abs() {
                ..1e3 => scaled(f, pa, "Pa"),
                ..1e6 => scaled(f, pa * 1e-3, "kPa"),
                _ => scaled(f, pa * 1e-6, "MPa"),
            },
            Self::SquareMetres(m2) => match m2.abs() {
                ..1e-3 => scaled(f, m2 * 1e6, "mm2"),
                _ => scaled(f, m2 * 1e4, "cm2"),
            },
        }
    }
}

/// A number and its unit with three significant digits.
fn scaled(f: &mut Formatter<'_>, value: f64, unit: &str) -> fmt::Result {
    match value.abs() {
        ..10.0 => write!(f, "{value:.2} {unit}"),
        ..100.0 => write!(f, "{value:.1} {unit}"),
        _ => write!(f, "{value:.0} {unit}"),
    }
}

/// `count` things in words: `1 period`, `3 periods`.
pub fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_the_unit_that_keeps_them_short() {
        assert_eq!(
            [0, 999, 52_110, 1_234_567, 2_500_000_000].map(|ns| Quantity::Nanoseconds(ns).to_string()),
            ["0 ns", "999 ns", "52.1 us", "1.23 ms", "2.50 s"]
        );
        assert_eq!(
            [0.0, 8.5e-4, 0.0123, 1.234].map(|n| Quantity::Newtons(n).to_string()),
            ["0 N", "850 uN", "12.3 mN", "1.23 N"]
        );
        assert_eq!(
            [850.0, 12_340.0, 1.234e6].map(|pa| Quantity::Pascals(pa).to_string()),
            ["850 Pa", "12.3 kPa", "1.23 MPa"]
        );
        assert_eq!(
            [0.0, 1.234e-6, 1.234e-3].map(|m2| Quantity::SquareMetres(m2).to_string()),
            ["0.00 mm2", "1.23 mm2", "12.3 cm2"]
        );
        assert_eq!(Quantity::Seconds(f64::NAN).to_string(), "NaN s");
    }
}
