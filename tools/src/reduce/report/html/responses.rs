//! Frequency responses: gain and phase of every model, and how far each is from the reference.

use std::fmt::Write;

use super::super::figures::decibels;
use super::super::table::prose;
use super::super::{tables, words};
use super::{SIZE, figure};
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, Chart, Line, power};
use crate::reduce::findings::{ModelResponse, ResponseFigure};

/// The colours of a page, besides the reference's.
const COLOURS: usize = 7;
/// Kinds of dashes.
const DASHES: usize = 5;
/// Errors below this are not told apart (%).
const SMALLEST_ERROR: f64 = 1e-6;

/// All responses; adds to `style` how their keys hide and show the models.
pub(super) fn responses(all: &[ResponseFigure], style: &mut String) -> String {
    let mut out = String::new();
    if all.is_empty() {
        return out;
    }
    // Writing to a string cannot fail.
    let note = prose(words::RESPONSES);
    let _ = writeln!(out, "<h2 id=\"responses\">Frequency responses</h2>\n<p class=\"faint\">{note}</p>");
    for (number, response) in all.iter().enumerate() {
        let _ = writeln!(out, "<section>\n<h3>{}</h3>", escaped(&response.title));
        out.push_str(&tables::models(response).to_html());
        out.push_str(&keys(response, number, style));
        out.push_str("<div class=\"charts\">\n");
        match range(response) {
            Some(range) => charts(&mut out, response, number, range),
            None => out.push_str("<p class=\"faint\">Fewer than two frequencies above 0: nothing to draw.</p>\n"),
        }
        out.push_str("</div>\n<details><summary>Gains in numbers</summary>\n");
        for channel in 0..response.channels.len() {
            let table = tables::decibel_table(response, channel);
            let _ = writeln!(out, "<h4>{}</h4>\n{}", escaped(&table.title), table.to_html());
        }
        out.push_str("</details>\n</section>\n");
    }
    out
}

fn class(figure: usize, model: usize) -> String {
    format!("f{figure}m{model} {}", look(model))
}

/// Colour and dashes of a model.
fn look(model: usize) -> String {
    match model {
        0 => "c0 reference".to_owned(),
        _ => format!("c{} d{}", (model - 1) % COLOURS + 1, (model - 1 + (model - 1) / DASHES) % DASHES),
    }
}

/// A box for each model, to hide and show it.
fn keys(response: &ResponseFigure, number: usize, style: &mut String) -> String {
    let mut out = String::from("<div class=\"keys\">\n");
    for (model, ModelResponse { name, .. }) in response.models.iter().enumerate() {
        let id = format!("f{number}m{model}");
        let _ = writeln!(
            out,
            "<label><input type=\"checkbox\" id=\"{id}\" checked><svg class=\"key\" viewBox=\"0 0 30 10\"><path class=\"line {}\" d=\"M0 5H30\"/></svg>{}</label>",
            look(model),
            escaped(name)
        );
        let _ = writeln!(style, "body:has(#{id}:not(:checked)) .chart .{id} {{ display: none; }}");
    }
    out.push_str("</div>\n");
    out
}

/// From the least to the greatest frequency above rest.
fn range(response: &ResponseFigure) -> Option<[f64; 2]> {
    let above = response.hz.iter().copied().filter(|hz| hz.is_finite() && *hz > 0.0);
    let [low, high] = above.fold([f64::INFINITY, 0.0], |[low, high], hz| [hz.min(low), hz.max(high)]);
    (low < high).then_some([low, high])
}

fn charts(out: &mut String, response: &ResponseFigure, number: usize, range: [f64; 2]) {
    let axis = || Axis::log("frequency (Hz)", range).in_words(power);
    let of = |model: usize, channel: usize| {
        let gains = response.models[model].gains.get(channel).map_or(&[][..], Vec::as_slice);
        response.hz.iter().copied().zip(gains.iter().copied()).filter(|(hz, _)| *hz > 0.0)
    };
    let lines = |points: &dyn Fn(usize) -> Vec<(f64, f64)>| -> Vec<Line<'_>> {
        // The reference below the others, broad and pale: what lies on it is seen. What is not finite is left out.
        let line = |model: usize| {
            let points = points(model).into_iter().filter(|point| point.1.is_finite()).collect();
            Line { class: class(number, model), name: &response.models[model].name, points }
        };
        (0..response.models.len()).map(line).collect()
    };
    for (channel, name) in response.channels.iter().enumerate() {
        // The phase stands below its gain.
        out.push_str("<div>\n");
        let gains = lines(&|model| of(model, channel).map(|(hz, gain)| (hz, decibels(gain))).collect());
        let label = format!("gain (dB re 1 {})", response.unit);
        let mut chart = Chart::new(format!("{name}: gain"), SIZE, axis(), Axis::around(&label, ends(&gains)));
        chart.lines = gains;
        out.push_str(&figure(&chart.to_svg(), ""));
        let phases = lines(&|model| unwrapped(of(model, channel)));
        let y = Axis::around("phase (deg)", ends(&phases));
        let mut chart = Chart::new(format!("{name}: phase"), SIZE, axis(), y);
        chart.lines = phases;
        out.push_str(&figure(&chart.to_svg(), ""));
        out.push_str("</div>\n");
    }
    let mut errors = lines(&|model| response_errors(response, model));
    if errors.len() < 2 {
        return;
    }
    errors.remove(0);
    let values = errors.iter().flat_map(|line| line.points.iter().map(|point| point.1.max(SMALLEST_ERROR)));
    let mut chart = Chart::new("Error over all channels", SIZE, axis(), Axis::decades("error (%)", values));
    chart.lines = errors;
    let caption = format!("Difference from `{}`, over its norm at the same frequency.", response.models[0].name);
    out.push_str(&figure(&chart.to_svg(), &caption));
}

/// Least and greatest y.
fn ends(lines: &[Line<'_>]) -> [f64; 2] {
    let values = lines.iter().flat_map(|line| line.points.iter().map(|point| point.1));
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [y.min(low), y.max(high)]);
    if low <= high { [low, high] } else { [0.0, 1.0] }
}

/// Phases (deg) without jumps of a whole turn.
fn unwrapped(gains: impl Iterator<Item = (f64, [f64; 2])>) -> Vec<(f64, f64)> {
    let mut before = 0.0;
    let mut points = Vec::new();
    for (hz, [re, im]) in gains.filter(|(_, gain)| gain[0].is_finite() && gain[1].is_finite()) {
        let phase = im.atan2(re).to_degrees();
        before = phase + 360.0 * ((before - phase) / 360.0).round();
        points.push((hz, before));
    }
    points
}

/// Norm of the difference over all channels over the norm of the reference (%), by frequency.
fn response_errors(response: &ResponseFigure, model: usize) -> Vec<(f64, f64)> {
    let (Some(reference), Some(model)) = (response.models.first(), response.models.get(model)) else {
        return Vec::new();
    };
    let mut points = Vec::new();
    for (at, &hz) in response.hz.iter().enumerate().filter(|(_, hz)| **hz > 0.0) {
        let (mut difference, mut whole) = (0.0, 0.0);
        for (gains, references) in model.gains.iter().zip(&reference.gains) {
            if let (Some(gain), Some(reference)) = (gains.get(at), references.get(at)) {
                difference += (gain[0] - reference[0]).powi(2) + (gain[1] - reference[1]).powi(2);
                whole += reference[0].powi(2) + reference[1].powi(2);
            }
        }
        if whole > 0.0 {
            points.push((hz, 100.0 * (difference / whole).sqrt()));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::super::super::sample::sample;
    use super::*;

    #[test]
    fn every_model_is_drawn_in_every_chart_and_rest_is_not() {
        let study = sample();
        let mut style = String::new();
        let html = responses(&study.responses, &mut style);
        let charts: Vec<&str> = html.split("<figure").skip(1).collect();
        // Gain and phase of two channels, and the error.
        assert_eq!(charts.len(), 5);
        let curves = |chart: &&str| chart.matches("<path class=\"line f0m").count();
        assert_eq!(charts.iter().map(curves).collect::<Vec<_>>(), [6, 6, 6, 6, 5]);
        assert_eq!(style.lines().count(), 6);
        assert_eq!(range(&study.responses[0]), Some([1.0, 10_f64.powf(119.0 / 34.0)]));
    }

    #[test]
    fn phases_have_no_jump_of_a_turn() {
        let turn = (0..20).map(|at| {
            let angle = f64::from(at) * 0.7;
            (f64::from(at), [angle.cos(), angle.sin()])
        });
        let phases = unwrapped(turn);
        assert!(phases.windows(2).all(|pair| (pair[1].1 - pair[0].1 - 0.7_f64.to_degrees()).abs() < 1e-9));
    }

    #[test]
    fn the_error_is_that_of_all_channels_together() {
        let gains = |x: f64| vec![vec![[3.0 * x, 0.0]], vec![[0.0, 4.0 * x]]];
        let model = |x| ModelResponse { gains: gains(x), ..ModelResponse::default() };
        let response =
            ResponseFigure { hz: vec![1.0], models: vec![model(1.0), model(1.1)], ..ResponseFigure::default() };
        let errors = response_errors(&response, 1);
        assert!((errors[0].1 - 10.0).abs() < 1e-9, "{errors:?}");
    }
}
