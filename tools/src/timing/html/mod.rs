//! The timing of a run as a page: who was late, why, and what it did to the force.
//!
//! Everything is drawn here and works without a script, but for the timeline around the worst ticks, which can be zoomed. Every
//! number that the JSON report has too carries its name and its raw value in the attributes `data-figure` and `data-value`.

mod causes;
mod device;
mod distributions;
mod environment;
mod named_figures;
mod over_time;
mod summary;
mod tables;
mod worst;

use std::fmt::Write;

use crate::drawing::html::{escaped, page};
use crate::timing::{GroupTiming, TimingReport};
use named_figures::Numbers;

const STYLE: &str = include_str!("timing.css");
/// Sizes of charts: two beside each other, one across the page, and the same on a narrow screen.
const HALF: [f64; 2] = [440.0, 230.0];
const BROAD: [f64; 2] = [920.0, 240.0];
const NARROW: [f64; 2] = [440.0, 240.0];

/// The report as an HTML page that needs nothing else; `name` is that of the log.
pub fn timing_html(report: &TimingReport, name: &str) -> String {
    let numbers = Numbers::of(report);
    let mut body = summary::summary(report, name, &numbers);
    body.push_str(&tables::groups(report, &numbers));
    body.push_str(&tables::cores(report, &numbers));
    let range = report.span.map(|time| time.as_secs_f64());
    body.push_str("<h2 id=\"lateness\">How each group kept time</h2>\n");
    for group in &report.groups {
        body.push_str(&group_chapter(group, &numbers, range));
    }
    body.push_str(&worst::worst(report));
    body.push_str(&device::devices(report, &numbers, range));
    body.push_str(&environment::environment(&report.run, &numbers));
    page(&format!("palpate timing: {name}"), STYLE, &body)
}

fn group_chapter(group: &GroupTiming, numbers: &Numbers, range: [f64; 2]) -> String {
    let mut out = format!("<section class=\"group\">\n<h3>{}</h3>\n", escaped(&group.name));
    if group.lateness.percentiles.count == 0 {
        out.push_str("<p class=\"faint\">No release of this group is in the log.</p>\n</section>\n");
        return out;
    }
    out.push_str(&tables::distributions(group, numbers));
    if !distributions::is_measured(&group.lateness) && !distributions::is_measured(&group.execution) {
        out.push_str("<p class=\"faint\">All of it is zero: in virtual time nothing is late and work takes no time, so there is nothing to draw.</p>\n");
    }
    out.push_str(&over_time::lateness(group, range));
    out.push_str(&distributions::charts(group));
    out.push_str("</section>\n");
    out
}

/// A chart with what it shows, which is text.
fn chart_figure(svg: &str, caption: &str) -> String {
    format!("<figure class=\"chart\">\n{svg}<figcaption>{}</figcaption></figure>\n", escaped(caption))
}

/// A chart as `draw` makes it for a broad page and for a narrow one; `legend` is HTML.
fn chart_figure_in_two(draw: impl Fn([f64; 2]) -> String, legend: &str) -> String {
    let mut out = String::from("<figure class=\"chart across\">\n");
    for (class, size) in [("broad", BROAD), ("narrow", NARROW)] {
        let _ = writeln!(out, "<div class=\"{class}\">{}</div>", draw(size));
    }
    let _ = writeln!(out, "{legend}</figure>");
    out
}

#[cfg(test)]
mod tests;
