//! The table of a comparison: its columns, and the text for a terminal of 100 columns.

use super::figures::{Comparison, ForceDeviation, Measured, MeasuredDevice, ModelCost};
use super::{figure, milliseconds};
use crate::units::{duration, force};
use palpate::runtime::{Nanos, Rate};
use palpate::scene::LinkSpec;

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
        let (model, latency) = [("", ""), ("model", latency_head(comparison)), ("", "ms")][line];
        lines.push(self::line(model, latency, COLUMNS.iter().map(|column| column.head[line].to_owned())));
    }
    for row in rows(comparison) {
        let mut name = if row.is_of_device() { format!("  {}", row.name) } else { row.name.to_owned() };
        // A name that would move the figures has a line of its own.
        if name.chars().count() > MODEL_WIDTH {
            lines.push(std::mem::take(&mut name));
        }
        lines.push(match &row.figures {
            Ok(figures) => line(&name, &row.late, COLUMNS.iter().map(|column| cell(column, figures))),
            Err(why) => line(&name, &row.late, [format!("  {why}")].into_iter()),
        });
    }
    lines.push(String::new());
    lines.extend(comparison.conclusions());
    lines.push(String::new());
    lines.push(format!("{}; {MEANINGS}", clock(comparison)));
    lines.iter().map(|line| wrapped(line)).collect()
}

/// The head of the latencies: what a link makes late is not among them.
pub(super) fn latency_head(comparison: &Comparison) -> &'static str {
    if comparison.link.is_some() { "added" } else { "late" }
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
    format!(
        "{}: {} nodes, {:.3} s simulated at {} and {}{}, largest force of full {}",
        comparison.scene,
        comparison.nodes,
        comparison.duration.as_secs_f64(),
        rate(comparison.haptic_period),
        rate(comparison.global_period),
        comparison.link.as_ref().map_or(String::new(), over),
        peaks(&comparison.full)
    )
}

/// The rate with the fewest decimals that has this period.
fn rate(period: Nanos) -> String {
    let hz = 1.0 / period.as_secs_f64();
    let rounded = [1.0, 10.0, 100.0, 1e3].map(|parts| (parts * hz).round() / parts);
    let found = rounded.into_iter().find(|hz| Rate::from_hz(*hz).is_some_and(|rate| rate.period() == period));
    format!("{} Hz", found.unwrap_or(rounded[3]))
}

/// The link that makes results late without a compute latency.
fn over(link: &LinkSpec) -> String {
    let LinkSpec { delay_ms, jitter_ms, loss, .. } = link;
    let up_to = if *jitter_ms > 0.0 { format!(" to {}", delay_ms + jitter_ms) } else { String::new() };
    let lost = if *loss > 0.0 { format!(", {} % lost", figure(100.0 * loss)) } else { String::new() };
    format!(" over a link of {delay_ms}{up_to} ms each way{lost}")
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

    #[test]
    fn a_long_name_of_a_device_moves_no_figure() {
        let device = |name: &str| MeasuredDevice { name: name.into(), ..MeasuredDevice::default() };
        let devices = vec![device("left"), device("the_right_hand_of_the_surgeon")];
        let full = Measured::new(ModelCost::default(), 0, devices);
        let text = to_text(&Comparison { full, ..Comparison::default() });
        let short = text.lines().find(|line| line.starts_with("  left ")).unwrap();
        let long = text.split("  the_right_hand_of_the_surgeon\n").last().unwrap().lines().next().unwrap();
        assert_eq!(long.trim_start(), short["  left".len()..].trim_start(), "{text}");
        assert_eq!(long.len(), short.len(), "{text}");
    }

    #[test]
    fn the_head_has_the_rates_as_they_are_and_the_link() {
        let of = |hz: f64| rate(Rate::from_hz(hz).unwrap().period());
        let rates = [1000.0, 30.0, 12.5, 29.97, 3000.0, 0.125].map(of);
        assert_eq!(rates, ["1000 Hz", "30 Hz", "12.5 Hz", "29.97 Hz", "3000 Hz", "0.125 Hz"]);
        let link = LinkSpec { delay_ms: 33.0, loss: 0.01, ..LinkSpec::default() };
        assert_eq!(over(&link), " over a link of 33 ms each way, 1.00 % lost");
        assert_eq!(
            over(&LinkSpec { jitter_ms: 4.5, loss: 0.0, ..link.clone() }),
            " over a link of 33 to 37.5 ms each way"
        );
        let comparison = Comparison { link: Some(link), ..Comparison::default() };
        assert!(facts(&comparison).contains(" Hz over a link of 33 ms each way, 1.00 % lost, largest force"));
        assert!(to_text(&comparison).contains("added"));
    }
}
