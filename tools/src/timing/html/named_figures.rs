//! Numbers with the name that the JSON report has for them: the page computes nothing of its own, and a program can check it.

use std::collections::HashMap;

use crate::drawing::html::escaped;
use crate::timing::{FigureValue, TimingReport, Unit};
use crate::units::figure;

/// What stands for a figure that there is none of.
const NONE: &str = "\u{2013}";
/// Digits between the separators of thousands.
const DIGITS: usize = 3;

/// All figures of a report by name.
pub(crate) struct Numbers(HashMap<String, (FigureValue, Unit)>);

impl Numbers {
    pub(crate) fn of(report: &TimingReport) -> Self {
        Self(report.figures().into_iter().map(|figure| (figure.name, (figure.value, figure.unit))).collect())
    }

    /// The figure as HTML, for people and, in attributes, for programs; a dash if there is no such figure.
    pub(crate) fn show(&self, name: &str) -> String {
        let Some(&(value, unit)) = self.0.get(name) else { return NONE.to_owned() };
        let (raw, words) = (raw(value), words(value, unit));
        format!("<span data-figure=\"{}\" data-value=\"{raw}\">{words}</span>", escaped(name))
    }

    /// The value of a count; zero if there is no such figure.
    pub(crate) fn count(&self, name: &str) -> u64 {
        match self.0.get(name) {
            Some((FigureValue::Integer(count), _)) => *count,
            _ => 0,
        }
    }
}

/// As JSON has it; what is not finite is `null` there.
fn raw(value: FigureValue) -> String {
    match value {
        FigureValue::Integer(value) => value.to_string(),
        FigureValue::Real(value) if value.is_finite() => value.to_string(),
        FigureValue::Real(_) => "null".to_owned(),
    }
}

/// As a terminal has it, but for counts, whose thousands are set apart here.
fn words(value: FigureValue, unit: Unit) -> String {
    match (unit, value) {
        (Unit::Count, FigureValue::Integer(count)) => grouped(count),
        _ => figure(value, unit),
    }
}

/// A count with its thousands set apart by narrow spaces that do not break.
pub(crate) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(DIGITS) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_carries_its_name_and_its_raw_value() {
        let numbers = Numbers([("a<b.p99".to_owned(), (FigureValue::Integer(52_110), Unit::Nanoseconds))].into());
        let shown = "<span data-figure=\"a&lt;b.p99\" data-value=\"52110\">52.1 us</span>";
        assert_eq!((numbers.show("a<b.p99").as_str(), numbers.show("c").as_str()), (shown, NONE));
        assert_eq!((numbers.count("a<b.p99"), numbers.count("c")), (52_110, 0));
    }

    #[test]
    fn values_are_exact_for_programs_and_short_for_people() {
        assert_eq!(raw(FigureValue::Integer(u64::MAX)), "18446744073709551615");
        assert_eq!(
            (raw(FigureValue::Real(0.1 + 0.2)), raw(FigureValue::Real(f64::NAN))),
            ("0.30000000000000004".into(), "null".into())
        );
        assert_eq!([7, 999, 1000, 3_600_000].map(grouped), ["7", "999", "1\u{202f}000", "3\u{202f}600\u{202f}000"]);
        assert_eq!(words(FigureValue::Integer(1000), Unit::Count), "1\u{202f}000");
        assert_eq!(words(FigureValue::Integer(1000), Unit::Nanoseconds), "1.00 us");
    }
}
