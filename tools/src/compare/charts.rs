//! The plots of a comparison: force and error over time, and speed against error.

use palpate::log::magnitude;
use palpate::runtime::Nanos;

use super::figures::{ComparedRun, Comparison, Measured};
use super::milliseconds;
use crate::drawing::svg::{Axis, Chart, Line, Mark, Point, Sign};

const WIDE: f64 = 960.0;
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

/// Draws the plots of one comparison.
pub(super) struct Plots<'a> {
    comparison: &'a Comparison,
    models: Vec<&'a str>,
    peak: f64,
}

impl<'a> Plots<'a> {
    pub(super) fn new(comparison: &'a Comparison) -> Self {
        Self { comparison, models: models(comparison), peak: comparison.full.trace.peak_n() }
    }

    fn class(&self, model: &str) -> String {
        let number = self.models.iter().position(|known| *known == model).unwrap_or(0);
        format!("m{number} c{}", colour(number))
    }

    fn runs(&self, latency: Nanos) -> impl Iterator<Item = (&'a ComparedRun, &'a Measured)> + use<'a> {
        let at = self.comparison.runs.iter().filter(move |run| run.latency == latency);
        at.filter_map(|run| Some((run, run.measured()?)))
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
        let magnitudes = magnitudes(&self.comparison.full);
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
        let line = |class: String, name, run: &Measured| Line { class, name, points: self.over_time(magnitudes(run)) };
        let runs = self.runs(latency).map(|(run, measured)| line(self.class(&run.model), &run.model, measured));
        // Last, to be seen above the others.
        runs.chain([line(self.class("full"), "full", &self.comparison.full)]).collect()
    }

    /// The forces over the whole run, and two resyncs of it.
    pub(super) fn forces(&self, latency: Nanos) -> [String; 2] {
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
            ..Chart::new(title, [WIDE, 270.0], Axis::linear("t (s)", range), y)
        };
        let mut whole = chart(format!("Force, {}", in_words(latency)), self.whole(), y_whole);
        whole.band = Some(zoom);
        let mut near = chart(format!("Two resyncs, {}", in_words(latency)), zoom, y_near);
        let mark = |x| Mark { at: x, label: "resync".to_owned() };
        near.marks = self.resyncs(latency).into_iter().filter(|x| (zoom[0]..zoom[1]).contains(x)).map(mark).collect();
        [whole, near].map(|chart| chart.to_svg())
    }

    /// The error of each model over time.
    pub(super) fn errors(&self, latency: Nanos) -> String {
        let lines: Vec<Line<'a>> = self
            .runs(latency)
            .map(|(run, measured)| Line {
                class: self.class(&run.model),
                name: &run.model,
                points: self.over_time(self.comparison.errors(measured)),
            })
            .collect();
        let values = lines.iter().flat_map(|line| &line.points).map(|(_, error)| *error);
        let largest = values.filter(|error| error.is_finite()).fold(1.0, f64::max).min(LARGEST_ERROR);
        let y = Axis::log("error (% of peak)", [SMALLEST_ERROR, largest * 1.2]);
        let title = format!("Error, {}", in_words(latency));
        let chart = Chart::new(title, [WIDE, 250.0], Axis::linear("t (s)", self.whole()), y);
        Chart { band: Some(self.zoom(latency)), lines, ..chart }.to_svg()
    }

    /// Cost of a haptic tick against the error: every model and latency is a point, `full` lies on the bottom.
    pub(super) fn speed_against_error(&self) -> String {
        let us = |run: &Measured| run.cost.tick_p50.0.max(1) as f64 * 1e-3;
        let period_us = self.comparison.haptic_period.0 as f64 * 1e-3;
        let measured: Vec<(&ComparedRun, &Measured)> =
            self.comparison.runs.iter().filter_map(|run| Some((run, run.measured()?))).collect();
        let costs = || measured.iter().map(|(_, run)| us(run)).chain([us(&self.comparison.full), period_us]);
        let errors = || measured.iter().map(|(_, run)| run.error.rms).filter(|rms| *rms > 0.0 && rms.is_finite());
        let least_error = errors().fold(1.0, f64::min);
        let range = [costs().fold(f64::MAX, f64::min) / ROOM, costs().fold(0.0, f64::max) * ROOM];
        let y = Axis::log(
            "rms error (% of peak)",
            [least_error / ROOM, errors().fold(1.0, f64::max).min(LARGEST_ERROR) * ROOM],
        );
        let point = |model: &str, late: Nanos, run: &Measured| Point {
            class: self.class(model),
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
            points: [point("full", Nanos::ZERO, &self.comparison.full)].into_iter().chain(runs).collect(),
            ..Chart::new("Speed against error", [WIDE, 400.0], x, y)
        }
        .to_svg()
    }
}

fn magnitudes(run: &Measured) -> impl Iterator<Item = f64> {
    run.trace.forces_n.iter().copied().map(magnitude)
}

/// A latency as a plot's title says it.
fn in_words(latency: Nanos) -> String {
    match latency {
        Nanos::ZERO => "results of the global model there at once".to_owned(),
        late => format!("results of the global model {} ms late", milliseconds(late)),
    }
}
