//! The paper's tables: published and computed beside each other.

use std::fmt::Write;

use super::super::table::prose;
use super::super::{tables, words};
use super::{Curve, SIZE, heights, with_points};
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, Chart, power};
use crate::reduce::findings::{ReductionRow, ReductionTable};

/// Errors that are not told apart (%): what is less is rounding of what is less.
const SMALLEST_ERROR: f64 = 1e-16;

/// All tables with their charts.
pub(super) fn tables(all: &[ReductionTable]) -> String {
    let mut out = String::new();
    if all.is_empty() {
        return out;
    }
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "<h2 id=\"tables\">Published and computed</h2>\n<p>The paper: Jacobs, Moore and Cavusoglu, <i>High Fidelity Haptic \
         Rendering of Frictional Contact with Deformable Objects in Virtual Environments using Multi-rate Simulation</i>, \
         2010.</p>\n<p>{}</p>\n<p class=\"faint\">{}</p>",
        prose(words::MEASURES),
        prose(words::ROUNDING)
    );
    for table in all {
        let shown = tables::published(table);
        let _ = writeln!(out, "<section>\n<h3>{}</h3>\n{}", escaped(&shown.title), shown.to_html());
        out.push_str(&charts(table));
        out.push_str("</section>\n");
    }
    out
}

fn charts(table: &ReductionTable) -> String {
    let is_by_damping = table.rows.windows(2).any(|pair| pair[0].damping_ratio != pair[1].damping_ratio);
    let x = |row: &ReductionRow| {
        if is_by_damping { row.damping_ratio } else { row.cells.first().map_or(f64::NAN, |n| *n as f64) }
    };
    let axis = || match is_by_damping {
        true => Axis::decades("damping ratio zeta", table.rows.iter().map(x)),
        false => {
            let ends = table.rows.iter().map(x).fold([f64::INFINITY, 0.0], |[low, high], n| [n.min(low), n.max(high)]);
            Axis::linear("cells along an axis", [ends[0] - 1.0, ends[1] + 1.0])
        }
    };
    if table.rows.len() < 2 {
        return String::new();
    }
    type Of = fn(&ReductionRow) -> f64;
    let by = |of: Of| {
        let mut points: Vec<(f64, f64)> = table.rows.iter().map(|row| (x(row), of(row))).collect();
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        points.into_iter()
    };
    let errors = [
        Curve::new("published", "c2", by(|row| row.published_error_pct)).hollow(),
        Curve::new("computed, Hankel sums", "c1", by(|row| at_least(row.error_pct))),
        Curve::new("computed, H-infinity", "c3", by(|row| at_least(row.hinf_pct))),
    ];
    let times = [
        Curve::new("published", "c2", by(|row| row.published_s.unwrap_or(f64::NAN))).hollow(),
        Curve::new("here", "c1", by(|row| row.seconds)),
    ];
    let mut out = String::from("<div class=\"charts\">\n");
    let chart = Chart::new("Error", SIZE, axis(), Axis::decades("error (%)", heights(&errors)));
    let is_cut = table.rows.iter().any(|row| row.error_pct < SMALLEST_ERROR || row.hinf_pct < SMALLEST_ERROR);
    let caption = if is_cut { "Computed errors below 1e-16 % are drawn there." } else { "" };
    out.push_str(&with_points(chart, &errors, caption));
    let chart = Chart::new("Time", SIZE, axis(), Axis::decades("time (s)", heights(&times)).in_words(power));
    out.push_str(&with_points(chart, &times, ""));
    out.push_str("</div>\n");
    out
}

/// An error where it is drawn; one that is not known is not.
fn at_least(error_pct: f64) -> f64 {
    if error_pct.is_nan() { error_pct } else { error_pct.max(SMALLEST_ERROR) }
}

#[cfg(test)]
mod tests {
    use super::super::super::sample::sample;
    use super::*;

    #[test]
    fn an_error_of_nothing_is_drawn_and_one_that_is_not_known_is_not() {
        let mut table = sample().tables.remove(1);
        let discs = |table: &ReductionTable| charts(table).matches("<circle class=\"point\" cx").count();
        // Two rows: two computed errors and a time, and each of these once more in the keys.
        assert_eq!(discs(&table), 2 * 3 + 3);
        table.rows[0].error_pct = 0.0;
        assert_eq!(discs(&table), 2 * 3 + 3);
        assert!(charts(&table).contains("below 1e-16"));
        table.rows[0].error_pct = f64::NAN;
        assert_eq!(discs(&table), 2 * 3 + 2);
    }
}
