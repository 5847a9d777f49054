//! A comparison as a page with plots, in one file.

use std::fmt::Write;

use super::charts::{Plots, WIDTHS, colour, models, speed_against_error};
use super::figures::Comparison;
use super::table::{COLUMNS, cell, clock, facts, latency_head, rows};
use crate::drawing::html::{escaped, page, sentence};

/// The comparison as an HTML page that needs nothing else: no network, no script.
pub fn to_html(comparison: &Comparison) -> String {
    let mut body = String::new();
    head(&mut body, comparison);
    table(&mut body, comparison);
    let style = plots(&mut body, comparison);
    page(&format!("palpate compare: {}", comparison.scene), &style, &body)
}

// Writing to a string cannot fail.
fn head(body: &mut String, comparison: &Comparison) {
    let _ = writeln!(body, "<h1>Local models against <code>full</code></h1>\n<p>{}</p>", escaped(&facts(comparison)));
    let _ = writeln!(
        body,
        "<p class=\"faint\">palpate {}, {}; virtual time; CPU time of one thread; {}</p>\n<h2>Conclusions</h2>\n<ul>",
        escaped(&comparison.palpate_version),
        escaped(&comparison.instruction_set),
        escaped(&clock(comparison))
    );
    for line in comparison.conclusions() {
        let _ = writeln!(body, "<li>{}</li>", sentence(&line));
    }
    body.push_str("</ul>\n");
}

fn table(body: &mut String, comparison: &Comparison) {
    let late = latency_head(comparison);
    let _ = write!(
        body,
        "<h2>Error and cost</h2>\n<div class=\"wide\"><table>\n<thead><tr><th>model</th><th>{late}<br>ms</th>"
    );
    for column in &COLUMNS {
        let _ = write!(body, "<th title=\"{}\">{}</th>", escaped(column.meaning), column.head.join("<br>"));
    }
    body.push_str("</tr></thead>\n<tbody>\n");
    for row in rows(comparison) {
        let indent = if row.is_of_device() { "&emsp;" } else { "" };
        let _ = write!(body, "<tr><td>{indent}{}</td><td>{}</td>", escaped(row.name), row.late);
        match &row.figures {
            Ok(figures) => COLUMNS.iter().for_each(|column| {
                let _ = write!(body, "<td>{}</td>", cell(column, figures));
            }),
            Err(why) => {
                let _ = write!(body, "<td class=\"why\" colspan=\"{}\">{}</td>", COLUMNS.len(), escaped(why));
            }
        }
        body.push_str("</tr>\n");
    }
    body.push_str("</tbody>\n</table></div>\n<details><summary>What the columns mean</summary>\n<dl>\n");
    for column in &COLUMNS {
        let head = column.head.join(" ");
        let _ = writeln!(body, "<dt>{}</dt><dd>{}</dd>", escaped(&head), escaped(column.meaning));
    }
    body.push_str("</dl></details>\n");
}

/// The plots; returns the style by which their keys hide and show the models.
fn plots(body: &mut String, comparison: &Comparison) -> String {
    let mut style = String::new();
    let _ = writeln!(body, "<h2 id=\"plots\">Plots</h2>\n<div class=\"keys\">");
    for (number, model) in models(comparison).into_iter().enumerate() {
        let _ = writeln!(
            body,
            "<label><input type=\"checkbox\" id=\"k{number}\" checked><span class=\"swatch c{}\"></span>{}</label>",
            colour(number),
            escaped(model)
        );
        let _ = writeln!(style, "body:has(#k{number}:not(:checked)) .m{number} {{ display: none; }}");
    }
    body.push_str("</div>\n");
    // Twice, for a broad page and for a narrow one: the letters of a chart that is shrunk cannot be read.
    let mut figure = |id: &str, [broad, narrow]: [String; 2], caption: &str| {
        let _ = write!(body, "<figure id=\"{id}\"><div class=\"broad\">\n{broad}</div>");
        let _ = writeln!(body, "<div class=\"narrow\">\n{narrow}</div>");
        let _ = writeln!(body, "<figcaption>{}</figcaption></figure>", sentence(caption));
    };
    let [filled, hollow] = match comparison.link {
        None => ["results of the global model are there at once", "late"],
        Some(_) => ["nothing is added to what the link makes late", "a latency is"],
    };
    let caption = format!("Left is cheaper, down is nearer to `full`. Filled: {filled}; hollow: {hollow}.");
    figure("speed", WIDTHS.map(|wide| speed_against_error(comparison, wide)), &caption);
    for device in 0..comparison.full.devices.len() {
        let plots = Plots::new(comparison, device);
        for (number, latency) in comparison.latencies().into_iter().enumerate() {
            let [[whole, near], [small_whole, small_near]] = WIDTHS.map(|wide| plots.forces(latency, wide));
            let errors = WIDTHS.map(|wide| plots.errors(latency, wide));
            let around = "The same around two resyncs in the middle of the contact. Dashed: a result of the global model \
                          becomes visible.";
            for (what, charts, caption) in [
                ("force", [whole, small_whole], "Magnitude of the force on the tool. The shaded part is shown below."),
                ("resync", [near, small_near], around),
                ("error", errors, "Distance from the force of `full`; what is below the lowest line is drawn on it."),
            ] {
                figure(&plots.id(&format!("{what}-{number}")), charts, caption);
            }
        }
    }
    style
}

#[cfg(test)]
mod tests {
    use super::super::figures::{ComparedRun, RunOutcome};
    use super::*;
    use palpate::runtime::Nanos;

    #[test]
    fn a_scene_without_any_force_and_a_refused_model_still_make_a_page() {
        let outcome = RunOutcome::Refused("too <large>".into());
        let runs = vec![
            ComparedRun { model: "patch".into(), latency: Nanos(33_340_000), outcome },
            ComparedRun { model: "hold".into(), latency: Nanos::ZERO, outcome: RunOutcome::Measured(Box::default()) },
        ];
        let mut comparison = Comparison { scene: "a&b".into(), runs, ..Comparison::default() };
        let page = to_html(&comparison);
        assert!(page.contains("<td class=\"why\" colspan=\"11\">too &lt;large&gt;</td>"), "{page}");
        assert_eq!(page.matches("<div class=\"broad\">").count(), page.matches("<div class=\"narrow\">").count());
        assert!(page.contains("viewBox=\"0 0 400 400\""), "a phone has its own");
        assert!(page.contains("results of the global model are there at once"), "{page}");
        assert!(page.contains("nothing to compare") && page.contains("a&amp;b") && !page.contains("NaN"), "{page}");
        // A link makes them late.
        comparison.link = Some(palpate::scene::LinkSpec::default());
        comparison.full.devices = vec![super::super::figures::MeasuredDevice::default()];
        let page = to_html(&comparison);
        assert!(page.contains("global results with nothing added") && !page.contains("at once"), "{page}");
    }
}
