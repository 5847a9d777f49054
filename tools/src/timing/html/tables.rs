//! The tables: what each group did, its distributions, and the cores.

use std::fmt::Write;

use super::causes::{CAUSES, badge};
use super::named_figures::Numbers;
use crate::drawing::html::escaped;
use crate::timing::analysis::ActorTiming;
use crate::timing::{GroupTiming, TimingReport, cause_name};
use crate::units::duration;

/// What is measured of a group: the figure and its name for people.
const MEASURES: [(&str, &str, &str); 4] = [
    ("lateness", "lateness", "from when a release was due until its thread was awake"),
    ("execution", "execution", "from the start of its work to the end"),
    (
        "period error",
        "period_error",
        "how far the time between two wake-ups was from the time that was scheduled, unsigned",
    ),
    ("jitter", "jitter", "how much the period error changed from one release to the next, unsigned"),
];
const PERCENTILES: [(&str, &str); 6] =
    [("p50", "p50"), ("p90", "p90"), ("p99", "p99"), ("p99.9", "p999"), ("max", "max"), ("samples", "count")];

/// Rates and counts of all groups.
pub(crate) fn groups(report: &TimingReport, numbers: &Numbers) -> String {
    let mut out = String::from(
        "<h2 id=\"groups\">Groups</h2>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Groups\"><table>\n<thead><tr>\
         <th scope=\"col\">group</th><th scope=\"col\">rate</th><th scope=\"col\">deadline</th><th scope=\"col\">released</th>\
         <th scope=\"col\">skipped</th><th scope=\"col\">missed</th><th scope=\"col\">degraded</th>\
         <th scope=\"col\">lost records</th><th scope=\"col\">busy</th><th scope=\"col\" class=\"why\">cause</th></tr></thead>\n<tbody>\n",
    );
    for (run, group) in report.run.groups.iter().zip(&report.groups) {
        let name = &run.name;
        let of = |figure: &str| numbers.show(&format!("{name}.{figure}"));
        let rate = run.rate_hz.filter(|&hz| hz > 0.0).map_or_else(|| measured_rate(group), |hz| format!("{hz} Hz"));
        let deadline = group.deadline.map_or("\u{2013}".to_owned(), |deadline| duration(deadline.0));
        let background = if group.background { "<br><span class=\"faint\">in the background</span>" } else { "" };
        // How often, and of how many periods or releases.
        let with_share = |what: &str| {
            let (count, share) = (of(what), of(&format!("{what}_share")));
            format!("{count}<br><span class=\"faint\">{share}</span>")
        };
        let _ = writeln!(
            out,
            "<tr><th scope=\"row\">{}{background}</th><td>{rate}</td><td>{deadline}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td>{}</td><td>{}</td><td>{}</td><td class=\"why\">{}</td></tr>",
            escaped(name),
            of("released"),
            with_share("skipped"),
            with_share("missed"),
            of("in_degraded_mode"),
            of("lost_records"),
            of("utilisation"),
            by_cause(name, numbers)
        );
    }
    out.push_str("</tbody>\n</table></div>\n");
    out
}

/// Of a log that says nothing about it.
fn measured_rate(group: &GroupTiming) -> String {
    match group.period {
        Some(period) if period.0 > 0 => format!("{:.4} Hz", 1e9 / period.0 as f64),
        _ => "\u{2013}".to_owned(),
    }
}

fn by_cause(group: &str, numbers: &Numbers) -> String {
    let mut parts = Vec::new();
    for cause in CAUSES {
        let of = |what: &str| format!("{group}.{what}.{}", cause_name(cause));
        let counts: Vec<String> = ["skipped", "missed"]
            .into_iter()
            .filter(|what| numbers.count(&of(what)) > 0)
            .map(|what| format!("{} {what}", numbers.show(&of(what))))
            .collect();
        if !counts.is_empty() {
            parts.push(format!("{} {}", badge(cause), counts.join(", ")));
        }
    }
    if parts.is_empty() { "none".to_owned() } else { parts.join("<br>") }
}

/// Percentiles of one group.
pub(crate) fn distributions(group: &GroupTiming, numbers: &Numbers) -> String {
    let name = &group.name;
    let measures = MEASURES.map(|(words, figure, meaning)| (words.to_owned(), meaning, format!("{name}.{figure}")));
    let actor = |actor: &ActorTiming| {
        let words = format!("execution of {}", actor.name);
        (words, "what this actor took of a release", format!("{name}.{}.execution", actor.name))
    };
    let rows = measures.into_iter().chain(group.actors.iter().map(actor));
    percentiles(&format!("{name}: distributions"), rows, numbers)
}

/// A table of percentiles; the rows have their words, what they mean, which may be empty, and the name of the figure.
pub(crate) fn percentiles<'a>(
    label: &str,
    rows: impl IntoIterator<Item = (String, &'a str, String)>,
    numbers: &Numbers,
) -> String {
    let mut out = format!(
        "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{}\"><table>\n<thead><tr>\
         <th scope=\"col\"></th>",
        escaped(label)
    );
    for (words, _) in PERCENTILES {
        let _ = write!(out, "<th scope=\"col\">{words}</th>");
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for (words, meaning, figure) in rows {
        let title = if meaning.is_empty() { String::new() } else { format!(" title=\"{meaning}\"") };
        let _ = write!(out, "<tr><th scope=\"row\"{title}>{}</th>", escaped(&words));
        for (_, percentile) in PERCENTILES {
            let _ = write!(out, "<td>{}</td>", numbers.show(&format!("{figure}.{percentile}")));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
    out
}

/// How much of each core was used.
pub(crate) fn cores(report: &TimingReport, numbers: &Numbers) -> String {
    if report.cores.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h2 id=\"cores\">Processor cores</h2>\n<p class=\"faint\">Share of the time in which a group was at work, from the \
         start of a release to its end; what took the core away meanwhile is in it.</p>\n<ul class=\"cores\">\n",
    );
    for core in &report.cores {
        let (words, figure) = match core.cpu {
            Some(cpu) => (format!("core {cpu}"), format!("core{cpu}")),
            None => ("any core".to_owned(), "anywhere".to_owned()),
        };
        let total = numbers.show(&format!("{figure}.utilisation"));
        let _ = write!(out, "<li><span class=\"core\">{words}</span><span class=\"meter\" aria-hidden=\"true\">");
        for (number, (_, share)) in core.groups.iter().enumerate() {
            let width = 100.0 * share.clamp(0.0, 1.0) / core.share().max(1.0);
            let _ = write!(out, "<span class=\"c{}\" style=\"width:{width:.2}%\"></span>", number % 7 + 1);
        }
        let _ = write!(out, "</span><span>{total}</span><span class=\"faint\">");
        for (number, (group, _)) in core.groups.iter().enumerate() {
            let share = numbers.show(&format!("{group}.utilisation"));
            let class = number % 7 + 1;
            let _ =
                write!(out, "<span class=\"badge\"><i class=\"dot c{class}\"></i>{} {share}</span>", escaped(group));
        }
        out.push_str("</span></li>\n");
    }
    out.push_str("</ul>\n");
    out
}
