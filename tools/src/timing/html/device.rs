//! What timing did to the force: force, model age and resyncs of each device over the run.

use std::fmt::Write;

use palpate::log::DeviceReport;
use palpate::runtime::SlipCause;

use super::causes::{CAUSES, key, legend};
use super::chart_figure_in_two;
use super::distributions::short;
use super::named_figures::Numbers;
use super::over_time::{Troubles, signs, troubles};
use super::tables::percentiles;
use crate::drawing::html::escaped;
use crate::drawing::svg::{Axis, Chart, Line, Mark};
use crate::timing::{DeviceTiming, ForceBin, ResyncBin, TimingReport};
use crate::units::{duration, force, trimmed};

/// Newtons that a logarithmic axis does not tell from zero.
const SMALLEST_STEP_N: f64 = 1e-6;

/// Tables and charts of all devices.
pub(crate) fn devices(report: &TimingReport, numbers: &Numbers, range: [f64; 2]) -> String {
    let mut out = String::from("<h2 id=\"force\">Force and model age</h2>\n");
    if report.run.devices.iter().all(|device| device.force.ticks == 0) {
        out.push_str(
            "<p class=\"faint\">The log holds no forces: it says when work was done and not what was felt.</p>\n",
        );
        return out;
    }
    // Of groups in the foreground only: nobody waits for the others.
    let groups = report.groups.iter().filter(|group| !group.background);
    let troubles: Vec<Troubles> = groups.flat_map(troubles).collect();
    for (run, timing) in report.run.devices.iter().zip(&report.devices) {
        if !run.name.is_empty() {
            let _ = writeln!(out, "<h3>{}</h3>", escaped(&run.name));
        }
        out.push_str(&table(run, numbers));
        out.push_str(&force_chart(timing, &troubles, range));
        out.push_str(&age_chart(timing, report, range));
        out.push_str(&resync_chart(timing, range));
    }
    out
}

fn table(device: &DeviceReport, numbers: &Numbers) -> String {
    let prefix = if device.name.is_empty() { String::new() } else { format!("{}.", device.name) };
    let rows = [
        ("model age at each tick", "force.model_age"),
        ("force jump of a resync, before blending", "resync.jump_before"),
        ("largest step that blending leaves", "resync.jump_after"),
        ("age of a new model on arrival", "resync.age"),
    ];
    let rows = rows.map(|(words, figure)| (words.to_owned(), "", format!("{prefix}{figure}")));
    let mut out = percentiles("Model age and resyncs", rows, numbers) + "<p class=\"faint\">";
    let of = |figure: &str| numbers.show(&format!("{prefix}{figure}"));
    let _ = writeln!(
        out,
        "Peak force {}, commanded {} in {} haptic ticks; {} limited, {} not finite.</p>",
        of("force.peak"),
        of("force.peak_commanded"),
        of("force.ticks"),
        of("limits.limited"),
        of("force.not_finite")
    );
    out
}

fn titled(device: &DeviceTiming, title: &str) -> String {
    if device.name.is_empty() { title.to_owned() } else { format!("{}: {title}", device.name) }
}

fn force_line(device: &DeviceTiming, class: &str, name: &'static str, value: fn(&ForceBin) -> f64) -> Line<'static> {
    let middle = device.force.width().as_secs_f64() / 2.0;
    let bins = device.force.iter().filter(|(_, bin)| bin.ticks > 0);
    let points = bins.map(|(from, bin)| (from.as_secs_f64() + middle, value(bin))).collect();
    Line { class: class.to_owned(), name, points }
}

fn highest(lines: &[Line<'_>]) -> f64 {
    lines.iter().flat_map(|line| &line.points).map(|point| point.1).filter(|y| y.is_finite()).fold(0.0, f64::max)
}

fn force_chart(device: &DeviceTiming, troubles: &[Troubles], range: [f64; 2]) -> String {
    let lines = [
        force_line(device, "c6", "least before safety", |bin| bin.force_n[0]),
        force_line(device, "c1", "largest before safety", |bin| bin.force_n[1]),
        force_line(device, "c2", "largest commanded", |bin| bin.commanded_n),
    ];
    let top = highest(&lines);
    if top <= 0.0 {
        return "<p class=\"faint\">The force was zero all the time.</p>\n".to_owned();
    }
    let room = if troubles.is_empty() { 1.05 } else { 1.3 };
    let draw = |size: [f64; 2]| {
        let y = Axis::from_zero("force (N)", top * room);
        let mut chart = Chart::new(titled(device, "force over time"), size, Axis::linear("t (s)", range), y);
        chart.lines = lines.to_vec();
        chart.signs = signs(troubles, range, size[0] - 66.0);
        chart.to_svg()
    };
    let is_seen = |cause: &SlipCause| troubles.iter().any(|troubles| troubles.cause == *cause);
    let causes: Vec<_> = CAUSES.into_iter().filter(is_seen).collect();
    let more = format!("magnitudes in each {} of the run", duration(device.force.width().0));
    let lines = [("c1", "largest before safety"), ("c6", "least before safety"), ("c2", "largest commanded")];
    chart_figure_in_two(draw, &(key(&lines, &more) + &legend(&causes)))
}

fn age_chart(device: &DeviceTiming, report: &TimingReport, range: [f64; 2]) -> String {
    let lines = [force_line(device, "c4", "model age, largest", |bin| 1e3 * bin.model_age_s)];
    let top = highest(&lines);
    if top <= 0.0 {
        return "<p class=\"faint\">The local model is the global one, or was never resynced: its age is zero.</p>\n"
            .to_owned();
    }
    let global_hz = report.run.environment.as_ref().map_or(0.0, |environment| environment.global_hz);
    let period_ms = (global_hz > 0.0).then(|| 1e3 / global_hz).filter(|&ms| ms < 2.0 * top);
    let draw = |size: [f64; 2]| {
        let y = Axis::from_zero("age (ms)", top * 1.05);
        let mut chart = Chart::new(titled(device, "model age over time"), size, Axis::linear("t (s)", range), y);
        chart.lines = lines.to_vec();
        let period = period_ms.map(|at| Mark { at, label: "one period of the global model".to_owned() });
        chart.levels = period.into_iter().collect();
        chart.to_svg()
    };
    let caption = "<p class=\"legend\"><span class=\"faint\">How old the state of the local model was, at most, in each bin: it \
                   rises until the global model delivers again.</span></p>\n";
    chart_figure_in_two(draw, caption)
}

fn resync_chart(device: &DeviceTiming, range: [f64; 2]) -> String {
    let middle = device.resyncs.width().as_secs_f64() / 2.0;
    let bins = || device.resyncs.iter().filter(|(_, bin)| bin.count > 0);
    let line = |class: &str, name: &'static str, value: fn(&ResyncBin) -> f64| Line {
        class: class.to_owned(),
        name,
        points: bins().map(|(from, bin)| (from.as_secs_f64() + middle, value(bin).max(SMALLEST_STEP_N))).collect(),
    };
    let lines = [
        line("c1", "before blending", |bin| bin.jump_before_n),
        line("c3 dashed", "after blending", |bin| bin.jump_after_n),
    ];
    let values = || lines.iter().flat_map(|line| &line.points).map(|point| point.1);
    let (least, most) = (values().fold(f64::MAX, f64::min), highest(&lines));
    if most <= SMALLEST_STEP_N {
        return "<p class=\"faint\">No resync made the force jump.</p>\n".to_owned();
    }
    let draw = |size: [f64; 2]| {
        let y = Axis::log("", [least.max(most * 1e-5) / 1.5, most * 1.5]).in_words(newtons);
        let mut chart = Chart::new(titled(device, "resync jumps"), size, Axis::linear("t (s)", range), y);
        chart.lines = lines.to_vec();
        chart.to_svg()
    };
    let more = format!("largest of the resyncs in each {}", short(device.resyncs.width().0 as f64));
    let caption = key(&[("c1", "jump before blending"), ("c3 dashed", "largest step after blending")], &more);
    chart_figure_in_two(draw, &caption)
}

/// A force as a label of an axis.
fn newtons(n: f64) -> String {
    trimmed(force(n))
}
