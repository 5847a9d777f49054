//! How the Hankel singular values fall, and what a truncation costs.

use std::fmt::Write;

use super::super::tables;
use super::{Curve, SIZE, figure, heights, with_points};
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, Bars, Chart};
use crate::reduce::findings::HankelDecay;

/// All decays.
pub(super) fn decays(all: &[HankelDecay]) -> String {
    let mut out = String::new();
    if all.is_empty() {
        return out;
    }
    out.push_str("<h2 id=\"hankel\">Hankel singular values</h2>\n");
    for decay in all {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "<section>\n<h3>{}</h3>\n<div class=\"charts\">", escaped(&decay.title));
        out.push_str(&values(decay));
        if !decay.truncations.is_empty() {
            out.push_str(&truncations(decay));
        }
        let _ = writeln!(out, "</div>\n<p class=\"faint\">{}</p>", escaped(&tables::hankel_values(decay)));
        if !decay.truncations.is_empty() {
            out.push_str(&tables::truncations(decay).to_html());
        }
        out.push_str("</section>\n");
    }
    out
}

fn values(decay: &HankelDecay) -> String {
    let Some(largest) = decay.values.first().copied().filter(|largest| *largest > 0.0) else {
        return String::new();
    };
    let relative = || decay.values.iter().map(move |value| value / largest);
    let x = Axis::linear("number", [0.0, decay.values.len() as f64 + 1.0]);
    let mut chart = Chart::new("Hankel singular values", SIZE, x, Axis::decades("over the largest", relative()));
    let bar = |(at, value): (usize, f64)| {
        let middle = at as f64 + 1.0;
        (middle - 0.35, middle + 0.35, value)
    };
    let bars = relative().enumerate().filter(|(_, value)| value.is_finite()).map(bar).collect();
    chart.bars = vec![Bars { class: "c1", name: "Hankel singular values over the largest", bars }];
    let caption = format!("{} of {} are above the numerical rank.", decay.values.len(), decay.order);
    figure(&chart.to_svg(), &caption)
}

fn truncations(decay: &HankelDecay) -> String {
    let cuts = || decay.truncations.iter();
    let curves = [
        Curve::new("2 (sum left out) / (sum of all)", "c1", cuts().map(|cut| (cut.order as f64, cut.error_pct))),
        Curve::new("H-infinity", "c3", cuts().map(|cut| (cut.order as f64, cut.hinf_pct))),
    ];
    let most = cuts().map(|cut| cut.order).max().unwrap_or(1) as f64;
    let y = Axis::decades("error (%)", heights(&curves));
    let chart = Chart::new("Truncation", SIZE, Axis::linear("states kept", [0.0, most + 1.0]), y);
    with_points(chart, &curves, "")
}
