//! Two logs side by side, for a terminal.

use super::page::Page;
use crate::log::timing::{Against, ComparedFigure, Figure, TimingReport, Unit, Value};
use crate::report::units::{duration, force, seconds};
use crate::report::verdict::verdict;

/// Figures that a table leaves out unless they differ: the parts of others, and counts of what is in the log at all.
const LEFT_OUT: [&str; 5] = [".count", ".released", ".elapsed_periods", ".ticks", ".p90"];

/// `this` and `other` are names of the logs.
pub fn against_to_text(against: &Against, [this, other]: [(&str, &TimingReport); 2]) -> String {
    let mut page = Page::default();
    for (name, (log, report)) in [("this", this), ("other", other)] {
        let (verdict, reason) = verdict(&report.run);
        page.wrapped(name, &format!("{log}: {}: {reason}", verdict.name()));
    }
    page.line(String::new());
    page.line(format!("{:<30}{:>10}{:>10}{:>9}   {}", "", "this", "other", "ratio", "95 % of ratios"));
    for figure in against.figures.iter().filter(|figure| is_shown(figure)) {
        let ratio = figure.ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.3}"));
        let sure = if figure.differs() { " *" } else { "" };
        let interval = figure.interval.map_or(String::new(), |[low, high]| format!("{low:.3} to {high:.3}{sure}"));
        let name: String = figure.this.name.chars().take(29).collect();
        page.line(format!(
            "{name:<30}{:>10}{:>10}{ratio:>9}   {interval}",
            figure_to_text(&figure.this),
            figure_to_text(&figure.other)
        ));
    }
    page.line(String::new());
    page.line("* the interval leaves no doubt; intervals are of a block bootstrap, see docs/timing.md".to_owned());
    if !against.unmatched.is_empty() {
        page.wrapped("only one has", &against.unmatched.join(", "));
    }
    page.text
}

/// Zero on both sides says nothing, and what is left out is in the JSON document.
fn is_shown(figure: &ComparedFigure) -> bool {
    let zero = |value: Value| value.as_f64() == 0.0;
    let is_detail = LEFT_OUT.iter().any(|ending| figure.this.name.ends_with(ending));
    figure.differs() || !is_detail && !(zero(figure.this.value) && zero(figure.other.value))
}

/// The value of a figure with its unit.
pub fn figure_to_text(figure: &Figure) -> String {
    match (figure.unit, figure.value) {
        (Unit::Nanoseconds, Value::Integer(ns)) => duration(ns),
        (Unit::Nanoseconds, Value::Real(ns)) => seconds(ns / 1e9),
        (Unit::Seconds, value) => seconds(value.as_f64()),
        (Unit::Newtons, value) => force(value.as_f64()),
        (Unit::Joules, value) => format!("{:.3} mJ", 1e3 * value.as_f64()),
        (Unit::Share, value) => format!("{:.3} %", 100.0 * value.as_f64()),
        (Unit::Count, Value::Integer(count)) => count.to_string(),
        (Unit::Count, Value::Real(count)) => count.to_string(),
    }
}
