//! Two logs side by side, for a terminal.

use palpate::report::Page;

use crate::timing::{Against, ComparedFigure, Figure, TimingReport};
use crate::units;

/// Beside what differs without doubt, what a table shows: the ends of names.
const SHOWN: [&str; 5] = ["skipped", "missed", "lost_records", "jump_after.p99", "force.model_age.p99"];
/// Of the groups' lateness and execution.
const PERCENTILES: [&str; 3] = ["p50", "p99", "max"];

/// `this` and `other` are names of the logs.
pub fn against_to_text(against: &Against, [this, other]: [(&str, &TimingReport); 2]) -> String {
    let mut page = Page::default();
    for (name, (log, report)) in [("this", this), ("other", other)] {
        let (verdict, reason) = report.run.verdict();
        page.named(name, &format!("{log}: {}: {reason}", verdict.name()));
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
    page.line("* no doubt; intervals are of a block bootstrap; all figures: --json".to_owned());
    if !against.unmatched.is_empty() {
        page.named("unmatched", &against.unmatched.join(", "));
    }
    page.text
}

/// The rest is in the JSON document; zero on both sides says nothing.
fn is_shown(figure: &ComparedFigure) -> bool {
    let name = figure.this.name.as_str();
    let parts: Vec<&str> = name.split('.').collect();
    let is_of_releases = matches!(parts[..], [_, "lateness" | "execution", which] if PERCENTILES.contains(&which));
    let is_zero = figure.this.value.as_f64() == 0.0 && figure.other.value.as_f64() == 0.0;
    figure.differs()
        || !is_zero && (is_of_releases || SHOWN.iter().any(|end| name.ends_with(end)) || name.starts_with("core"))
}

/// The value of a figure with its unit.
pub fn figure_to_text(figure: &Figure) -> String {
    units::figure(figure.value, figure.unit)
}
