//! The plots of a comparison: force and error over time, and speed against error.

use palpate::log::magnitude;
use palpate::runtime::Nanos;

use super::figures::{ComparedRun, Comparison, ForceTrace, Measured};
use super::{latency_in_words, milliseconds};
use crate::drawing::svg::{Axis, Chart, Line, Mark, Point, Sign};

/// Widths of a chart on a page, and on a narrow one.
pub(super) const WIDTHS: [f64; 2] = [960.0, 400.0];
/// A force below this part of the peak is no contact to look at.
const TOUCHING: f64 = 0.01;
/// Errors below this are not told apart over time (% of the peak).
const SMALLEST_ERROR: f64 = 0.01;
/// A model that diverges leaves the plot at this many times the peak, so that the others can be seen.
const HIGHEST: f64 = 1.6;
const LARGEST_ERROR: f64 = 1e3;
/// Around the points of a logarithmic plot.
const ROOM: f64 = 1.8;
/// The colours of a page, besides the reference's.
const COLOURS: usize = 7;

/// The models in the order of their runs: a key of the page and a colour each, after `full` with number 0.
pub(super) fn models(comparison: &Comparison) -> Vec<&str> {
    let mut models = vec!["full"];
    for run in &comparison.runs {
        if !models.contains(&&*run.model) {
            models.push(&run.model);
        }
    }
    models
}

/// The colour of a model.
pub(super) fn colour(model: usize) -> usize {
    if model == 0 { 0 } else { (model - 1) % COLOURS + 1 }
}

/// The style of a model.
fn class(models: &[&str], model: &str) -> String {
    let number = models.iter().position(|known| *known == model).unwrap_or(0);
    format!("m{number} c{}", colour(number))
}

/// Draws the plots of one device in a comparison.
pub(super) struct Plots<'a> {
    comparison: &'a Comparison,
    models: Vec<&'a str>,
    device: usize,
    full: &'a ForceTrace,
    peak: f64,
}

impl<'a> Plots<'a> {
    /// # Panics
    /// If there is no such device.
    pub(super) fn new(comparison: &'a Comparison, device: usize) -> Self {
        let full = &comparison.full.devices[device].trace;
        Self { comparison, models: models(comparison), device, full, peak: full.peak_n() }
    }

    /// The device's name, if there are several.
    fn name(&self) -> Option<&'a str> {
        self.comparison.full.several().get(self.device).map(|device| &*device.name)
    }

    /// The id of a plot that is called `what`: each of several devices has its own.
    pub(super) fn id(&self, what: &str) -> String {
        self.name().map_or(what.to_owned(), |name| format!("{name}-{what}"))
    }

    /// The title of a plot of `what` with results `late`.
    fn title(&self, what: &str, late: Nanos) -> String {
        let of = self.name().map_or(String::new(), |name| format!(" on {name}"));
        format!("{what}{of}, global results {}", latency_in_words(self.comparison, late, "at once"))
    }

    fn runs(&self, latency: Nanos) -> impl Iterator<Item = (&'a ComparedRun, &'a ForceTrace)> + use<'a> {
        let device = self.device;
        let at = self.comparison.runs.iter().filter(move |run| run.latency == latency);
        at.filter_map(move |run| Some((run, &run.measured()?.devices.get(device)?.trace)))
    }

    /// The values of the ticks over time: each belongs to the end of its tick.
    fn over_time(&self, values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
        let period = self.comparison.haptic_period.as_secs_f64();
        values.enumerate().map(|(tick, value)| ((tick + 1) as f64 * period, value)).collect()
    }

    fn whole(&self) -> [f64; 2] {
        [0.0, self.comparison.duration.as_secs_f64()]
    }

    /// The resyncs to look at with results `latency` late, two that follow each other in the middle of the contact.
    fn resyncs(&self, latency: Nanos) -> [f64; 2] {
        let magnitudes = magnitudes(self.full);
        let touching: Vec<usize> =
            magnitudes.enumerate().filter(|(_, force)| *force > TOUCHING * self.peak).map(|(tick, _)| tick).collect();
        let middle = touching.get(touching.len() / 2).copied().unwrap_or(0) as f64;
        let (tick, period) = (self.comparison.haptic_period.as_secs_f64(), self.comparison.global_period.as_secs_f64());
        let first = (middle * tick / period).floor().max(1.0) * period;
        [first, first + period].map(|resync| resync + latency.as_secs_f64())
    }

    /// Around those two resyncs, within the run.
    fn zoom(&self, latency: Nanos) -> [f64; 2] {
        let [first, second] = self.resyncs(latency);
        let period = self.comparison.global_period.as_secs_f64();
        let end = self.comparison.duration.as_secs_f64();
        [(first - 0.4 * period).clamp(0.0, end), (second + 0.6 * period).min(end)]
    }

    fn force_lines(&self, latency: Nanos) -> Vec<Line<'a>> {
        let line = |name: &'a str, trace: &ForceTrace| Line {
            class: class(&self.models, name),
            name,
            points: self.over_time(magnitudes(trace)),
        };
        let runs = self.runs(latency).map(|(run, trace)| line(&run.model, trace));
        // Last, to be seen above the others.
        runs.chain([line("full", self.full)]).collect()
    }

    /// The forces over the whole run, and two resyncs of it, `wide`.
    pub(super) fn forces(&self, latency: Nanos, wide: f64) -> [String; 2] {
        let (zoom, lines) = (self.zoom(latency), self.force_lines(latency));
        let shown = |range: [f64; 2]| {
            let points = lines.iter().flat_map(|line| &line.points);
            let forces =
                points.copied().filter(move |&(x, force)| (range[0]..=range[1]).contains(&x) && force.is_finite());
            let highest = HIGHEST * self.peak;
            forces.fold([highest, 0.0], |[low, high], (_, force)| {
                [f64::min(force, low), f64::min(force, highest).max(high)]
            })
        };
        let y_whole = Axis::from_zero("force (N)", shown(self.whole())[1]);
        let y_near = Axis::around("force (N)", shown(zoom));
        let chart = |title: String, range: [f64; 2], y: Axis| Chart {
            lines: lines.clone(),
            ..Chart::new(title, [wide, 270.0], Axis::linear("t (s)", range), y)
        };
        let mut whole = chart(self.title("Force", latency), self.whole(), y_whole);
        whole.band = Some(zoom);
        let mut near = chart(self.title("Two resyncs", latency), zoom, y_near);
        let mark = |x| Mark { at: x, label: "resync".to_owned() };
        near.marks = self.resyncs(latency).into_iter().filter(|x| (zoom[0]..zoom[1]).contains(x)).map(mark).collect();
        [whole, near].map(|chart| chart.to_svg())
    }

    /// The error of each model over time, `wide`.
    pub(super) fn errors(&self, latency: Nanos, wide: f64) -> String {
        let lines: Vec<Line<'a>> = self
            .runs(latency)
            .map(|(run, trace)| Line {
                class: class(&self.models, &run.model),
                name: &run.model,
                points: self.over_time(trace.errors(self.full)),
            })
            .collect();
        let values = lines.iter().flat_map(|line| &line.points).map(|(_, error)| *error);
        let largest = values.filter(|error| error.is_finite()).fold(1.0, f64::max).min(LARGEST_ERROR);
        let y = Axis::log("error (% of peak)", [SMALLEST_ERROR, largest * 1.2]);
        let chart = Chart::new(self.title("Error", latency), [wide, 250.0], Axis::linear("t (s)", self.whole()), y);
        Chart { band: Some(self.zoom(latency)), lines, ..chart }.to_svg()
    }
}

/// Cost of a haptic tick against the error, `wide`: every model and latency is a point, `full` lies on the bottom.
pub(super) fn speed_against_error(comparison: &Comparison, wide: f64) -> String {
    let models = models(comparison);
    let us = |run: &Measured| run.cost.tick_p50.0.max(1) as f64 * 1e-3;
    let period_us = comparison.haptic_period.0 as f64 * 1e-3;
    let measured: Vec<(&ComparedRun, &Measured)> =
        comparison.runs.iter().filter_map(|run| Some((run, run.measured()?))).collect();
    let costs = || measured.iter().map(|(_, run)| us(run)).chain([us(&comparison.full), period_us]);
    let errors = || measured.iter().map(|(_, run)| run.error.rms).filter(|rms| *rms > 0.0 && rms.is_finite());
    let least_error = errors().fold(1.0, f64::min);
    let range = [costs().fold(f64::MAX, f64::min) / ROOM, costs().fold(0.0, f64::max) * ROOM];
    let y = Axis::log(
        "rms error (% of peak)",
        [least_error / ROOM, errors().fold(1.0, f64::max).min(LARGEST_ERROR) * ROOM],
    );
    let point = |model: &str, late: Nanos, run: &Measured| Point {
        class: class(&models, model),
        label: match (model, late) {
            ("full", _) => "full, error 0".to_owned(),
            (model, Nanos::ZERO) => model.to_owned(),
            (model, late) => format!("{model} {} ms", milliseconds(late)),
        },
        at: (us(run), run.error.rms),
        sign: Sign::Disc,
        is_hollow: late != Nanos::ZERO,
    };
    let runs = measured.iter().map(|(run, measured)| point(&run.model, run.latency, measured));
    let x = Axis::log("CPU per haptic tick, p50 (us)", range);
    Chart {
        marks: vec![Mark { at: period_us, label: "haptic period".to_owned() }],
        points: [point("full", Nanos::ZERO, &comparison.full)].into_iter().chain(runs).collect(),
        ..Chart::new("Speed against error", [wide, 400.0], x, y)
    }
    .to_svg()
}

fn magnitudes(trace: &ForceTrace) -> impl Iterator<Item = f64> {
    trace.forces_n.iter().copied().map(magnitude)
}
