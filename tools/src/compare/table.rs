//! The table of a comparison: its columns, and the text for a terminal of 100 columns.

use super::figures::{Comparison, Measured};
use super::{figure, milliseconds};
use crate::units::{duration, force};

/// A column: three lines of head, its width in text, what it means, and its figure.
pub(super) struct Column {
    pub(super) head: [&'static str; 3],
    pub(super) width: usize,
    pub(super) meaning: &'static str,
    pub(super) value: fn(&Measured) -> Option<f64>,
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
        value: |run| Some(run.error.rms),
    },
    Column {
        head: ["error", "max", "%"],
        width: 7,
        meaning: "largest error of the force in one tick, in % of the largest force of full",
        value: |run| Some(run.error.max),
    },
    Column {
        head: ["jump", "worst", "%"],
        width: 7,
        meaning: "largest change of the force from one tick to the next, in % of the largest force of full",
        value: |run| Some(run.error.jump),
    },
    Column {
        head: ["resync", "before", "p99 %"],
        width: 8,
        meaning: "jump of the force at a resync before blending, p99, in % of the largest force of full",
        value: |run| is_resynced(run).then_some(run.error.resync_before_p99),
    },
    Column {
        head: ["resync", "after", "p99 %"],
        width: 8,
        meaning: "largest one-tick change that blending leaves of a resync's jump, p99, in % of the largest force of full",
        value: |run| is_resynced(run).then_some(run.error.resync_after_p99),
    },
    Column {
        head: ["energy", "error", "%"],
        width: 7,
        meaning: "energy given to the body at the end of the run against full, in % of the largest energy of full",
        value: |run| Some(run.error.energy),
    },
    Column {
        head: ["haptic", "p50", "us"],
        width: 7,
        meaning: "CPU time of a haptic tick, device and local model, p50",
        value: |run| Some(run.cost.tick_p50.0 as f64 * 1e-3),
    },
    Column {
        head: ["tick", "p99", "us"],
        width: 6,
        meaning: "CPU time of a haptic tick, p99",
        value: |run| Some(run.cost.tick_p99.0 as f64 * 1e-3),
    },
    Column {
        head: ["global", "load", "ms/s"],
        width: 7,
        meaning: "CPU time of the global group per second of simulated time",
        value: |run| (run.cost.global_load > 0.0).then_some(1e3 * run.cost.global_load),
    },
    Column {
        head: ["total", "load", "ms/s"],
        width: 7,
        meaning: "CPU time of the haptic and the global group together, per second of simulated time",
        value: |run| Some(1e3 * run.cost.total_load()),
    },
    Column {
        head: ["build", "p50", "us"],
        width: 7,
        meaning: "CPU time of building a local model, once per resync, p50",
        value: |run| (run.cost.builds > 0).then_some(run.cost.build_p50.0 as f64 * 1e-3),
    },
];

fn is_resynced(run: &Measured) -> bool {
    !run.trace.resyncs.is_empty()
}

/// The comparison as text, every line ended by a newline.
pub fn to_text(comparison: &Comparison) -> String {
    let mut lines = vec![facts(comparison), String::new()];
    for line in 0..3 {
        let (model, latency) = [("", ""), ("model", "late"), ("", "ms")][line];
        lines.push(row(model, latency, COLUMNS.iter().map(|column| column.head[line].to_owned())));
    }
    let full = &comparison.full;
    lines.push(row("full", "", COLUMNS.iter().map(|column| cell(column, full))));
    for run in comparison.runs.iter().chain(&comparison.finer) {
        let latency = milliseconds(run.latency);
        lines.push(match run.measured() {
            Some(measured) => row(&run.model, &latency, COLUMNS.iter().map(|column| cell(column, measured))),
            None => row(&run.model, &latency, ["  ".to_owned() + run.missing().unwrap_or_default()].into_iter()),
        });
    }
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
        force(comparison.full.trace.peak_n())
    )
}

/// What the measurement adds to itself.
pub(super) fn clock(comparison: &Comparison) -> String {
    format!("reading the clock adds {} to each tick and build", duration(comparison.clock.0))
}

/// The figure of a column, `-` where there is none.
pub(super) fn cell(column: &Column, run: &Measured) -> String {
    (column.value)(run).map_or("-".to_owned(), figure)
}

fn row(model: &str, latency: &str, cells: impl Iterator<Item = String>) -> String {
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
