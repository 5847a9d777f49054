//! The table of a comparison: its columns, and the text for a terminal of 100 columns.

use super::figures::{Comparison, ForceDeviation, Measured, MeasuredDevice, ModelCost};
use super::{figure, milliseconds};
use crate::units::{duration, force};

/// A column: three lines of head, its width in text, what it means, and its figure.
pub(super) struct Column {
    pub(super) head: [&'static str; 3],
    pub(super) width: usize,
    pub(super) meaning: &'static str,
    pub(super) value: fn(&Figures<'_>) -> Option<f64>,
}

/// A row of the table: `full`, another run, or one of several devices in the run above it.
pub(super) struct Row<'a> {
    pub(super) name: &'a str,
    /// The latency (ms); empty for `full` and for a device.
    pub(super) late: String,
    /// The figures, or the reason for which there are none.
    pub(super) figures: Result<Figures<'a>, &'a str>,
}

/// What the columns of a row are taken from.
pub(super) struct Figures<'a> {
    error: &'a ForceDeviation,
    is_resynced: bool,
    /// A device has none of its own.
    cost: Option<&'a ModelCost>,
}

impl<'a> Figures<'a> {
    fn of(run: &'a Measured) -> Self {
        Self { error: &run.error, is_resynced: run.resyncs() > 0, cost: Some(&run.cost) }
    }

    fn of_device(device: &'a MeasuredDevice) -> Self {
        Self { error: &device.error, is_resynced: !device.trace.resyncs.is_empty(), cost: None }
    }
}

impl Row<'_> {
    /// True for one of several devices.
    pub(super) fn is_of_device(&self) -> bool {
        self.figures.as_ref().is_ok_and(|figures| figures.cost.is_none())
    }
}

/// The rows in their order.
pub(super) fn rows<'a>(comparison: &'a Comparison) -> impl Iterator<Item = Row<'a>> {
    let full = ("full", String::new(), Ok(&comparison.full));
    let others = comparison.runs.iter().chain(&comparison.finer).map(|run| {
        let measured = run.measured().ok_or(run.missing().unwrap_or_default());
        (&*run.model, milliseconds(run.latency), measured)
    });
    [full].into_iter().chain(others).flat_map(|(name, late, measured)| {
        let whole = Row { name, late, figures: measured.map(Figures::of) };
        let devices = measured.map_or(&[][..], Measured::several).iter();
        let of_device = |device: &'a MeasuredDevice| Row {
            name: &device.name,
            late: String::new(),
            figures: Ok(Figures::of_device(device)),
        };
        [whole].into_iter().chain(devices.map(of_device))
    })
}

/// Columns of the terminal.
const WIDTH: usize = 100;
const MODEL_WIDTH: usize = 15;
const LATENCY_WIDTH: usize = 6;

/// Where the meaning of a figure is told at length.
const MEANINGS: &str = "docs/compare.md says what each column means";

pub(super) const COLUMNS: [Column; 11] = [
    Column {
        head: ["error", "rms", "%"],
        width: 7,
        meaning: "root mean square of the force's error over all ticks, in % of the largest force of full",
        value: |of| Some(of.error.rms),
    },
    Column {
        head: ["error", "max", "%"],
        width: 7,
        meaning: "largest error of the force in one tick, in % of the largest force of full",
        value: |of| Some(of.error.max),
    },
    Column {
        head: ["jump", "worst", "%"],
        width: 7,
        meaning: "largest change of the force from one tick to the next, in % of the largest force of full",
        value: |of| Some(of.error.jump),
    },
    Column {
        head: ["resync", "before", "p99 %"],
        width: 8,
        meaning: "jump of the force at a resync before blending, p99, in % of the largest force of full",
        value: |of| of.is_resynced.then_some(of.error.resync_before_p99),
    },
    Column {
        head: ["resync", "after", "p99 %"],
        width: 8,
        meaning: "largest one-tick change that blending leaves of a resync's jump, p99, in % of the largest force of full",
        value: |of| of.is_resynced.then_some(of.error.resync_after_p99),
    },
    Column {
        head: ["energy", "error", "%"],
        width: 7,
        meaning: "energy given to the body at the end of the run against full, in % of the largest energy of full",
        value: |of| Some(of.error.energy),
    },
    Column {
        head: ["haptic", "p50", "us"],
        width: 7,
        meaning: "CPU time of a haptic tick, device and local model, p50",
        value: |of| Some(of.cost?.tick_p50.0 as f64 * 1e-3),
    },
    Column {
        head: ["tick", "p99", "us"],
        width: 6,
        meaning: "CPU time of a haptic tick, p99",
        value: |of| Some(of.cost?.tick_p99.0 as f64 * 1e-3),
    },
    Column {
        head: ["global", "load", "ms/s"],
        width: 7,
        meaning: "CPU time of the global group per second of simulated time",
        value: |of| of.cost.map(|cost| 1e3 * cost.global_load).filter(|load| *load > 0.0),
    },
    Column {
        head: ["total", "load", "ms/s"],
        width: 7,
        meaning: "CPU time of the haptic and the global group together, per second of simulated time",
        value: |of| Some(1e3 * of.cost?.total_load()),
    },
    Column {
        head: ["build", "p50", "us"],
        width: 7,
        meaning: "CPU time of building the local models of a resync, p50",
        value: |of| of.cost.filter(|cost| cost.builds > 0).map(|cost| cost.build_p50.0 as f64 * 1e-3),
    },
];

/// The comparison as text, every line ended by a newline.
pub fn to_text(comparison: &Comparison) -> String {
    let mut lines = vec![facts(comparison), String::new()];
    for line in 0..3 {
        let (model, latency) = [("", ""), ("model", "late"), ("", "ms")][line];
        lines.push(self::line(model, latency, COLUMNS.iter().map(|column| column.head[line].to_owned())));
    }
    lines.extend(rows(comparison).map(|row| {
        let name = if row.is_of_device() { format!("  {}", row.name) } else { row.name.to_owned() };
        match &row.figures {
            Ok(figures) => line(&name, &row.late, COLUMNS.iter().map(|column| cell(column, figures))),
            Err(why) => line(&name, &row.late, [format!("  {why}")].into_iter()),
        }
    }));
    lines.push(String::new());
    lines.extend(comparison.conclusions());
    lines.push(String::new());
    lines.push(format!("{}; {MEANINGS}", clock(comparison)));
    lines.iter().map(|line| wrapped(line)).collect()
}

/// On as many lines as it takes, those after the first indented.
fn wrapped(line: &str) -> String {
    const INDENT: usize = 4;
    let mut text = String::new();
    let mut rest = line.trim_end();
    loop {
        let width = if text.is_empty() { WIDTH } else { WIDTH - INDENT };
        let end = rest.char_indices().nth(width).map(|(at, _)| at);
        // A word that is longer than a line stays whole.
        let cut = end.and_then(|end| rest[..end].rfind(' ').filter(|cut| !rest[..*cut].trim().is_empty()));
        if !text.is_empty() {
            text.push_str(&" ".repeat(INDENT));
        }
        let Some(cut) = cut else { break };
        text.push_str(rest[..cut].trim_end());
        text.push('\n');
        rest = rest[cut..].trim_start();
    }
    text.push_str(rest);
    text.push('\n');
    text
}

/// What was compared, in one line.
pub(super) fn facts(comparison: &Comparison) -> String {
    let hz = |period: palpate::runtime::Nanos| format!("{:.0} Hz", 1.0 / period.as_secs_f64());
    format!(
        "{}: {} nodes, {:.3} s simulated at {} and {}, largest force of full {}",
        comparison.scene,
        comparison.nodes,
        comparison.duration.as_secs_f64(),
        hz(comparison.haptic_period),
        hz(comparison.global_period),
        peaks(&comparison.full)
    )
}

/// The largest force, of each device if there are several.
fn peaks(full: &Measured) -> String {
    let of_device = |device: &MeasuredDevice| format!("{} on {}", force(device.trace.peak_n()), device.name);
    match full.several() {
        [] => force(full.peak_n()),
        several => several.iter().map(of_device).collect::<Vec<_>>().join(", "),
    }
}

/// What the measurement adds to itself.
pub(super) fn clock(comparison: &Comparison) -> String {
    format!("reading the clock adds {} to each tick and build", duration(comparison.clock.0))
}

/// The figure of a column, `-` where there is none.
pub(super) fn cell(column: &Column, figures: &Figures<'_>) -> String {
    (column.value)(figures).map_or("-".to_owned(), figure)
}

fn line(model: &str, latency: &str, cells: impl Iterator<Item = String>) -> String {
    // What is too long for its column, a reason, is the only one.
    let cells = cells.zip(&COLUMNS).map(|(cell, column)| format!("{cell:>width$}", width = column.width));
    format!("{model:<MODEL_WIDTH$}{latency:>LATENCY_WIDTH$}{}", cells.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::super::figures::{ComparedRun, RunOutcome};
    use super::*;
    use palpate::runtime::Nanos;

    #[test]
    fn the_table_fits_a_hundred_columns_and_a_refused_model_has_its_reason() {
        let width = MODEL_WIDTH + LATENCY_WIDTH + COLUMNS.iter().map(|column| column.width).sum::<usize>();
        assert!(width <= WIDTH, "{width}");
        let long = format!("local.patch: {}", "is too large ".repeat(20));
        let run = |outcome| ComparedRun { model: "patch".into(), latency: Nanos(33_340_000), outcome };
        let comparison = Comparison {
            runs: vec![
                run(RunOutcome::Measured(Box::default())),
                run(RunOutcome::Refused("local.patch: is too large".into())),
                run(RunOutcome::Refused(long)),
            ],
            ..Comparison::default()
        };
        let text = to_text(&comparison);
        assert!(text.contains("\npatch           33.34  local.patch: is too large\n"), "{text}");
        assert!(text.lines().all(|line| line.len() <= WIDTH), "{text}");
        assert!(text.contains("\n    large is too large is too large"), "{text}");
        assert_eq!(wrapped(&"x".repeat(120)), "x".repeat(120) + "\n");
    }
}
