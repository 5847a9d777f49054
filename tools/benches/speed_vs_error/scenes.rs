//! Every model on the reference scenes, with results of the global model at once and one period late.

use std::fmt::Write;

use palpate::Error;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate_cli::compare::{CompareOptions, Comparison, Measured};
use palpate_cli::drawing::{Picture, Series, Sign};

use crate::Part;
use crate::common::{colour, compared, figure, joined, scene, table, us};

const SCENES: [&str; 4] = ["hand", "wave", "drag_friction", "drag_slip"];
const ROUNDS: usize = 1;
/// Errors below are rounding (%).
const EXACT: f64 = 1e-6;
/// Costs that differ by less are called the same.
const MARGIN: f64 = 0.1;

pub fn part(is_quick: bool) -> Result<Part, Error> {
    let (names, rounds) = if is_quick { (&SCENES[..1], 1) } else { (&SCENES[..], ROUNDS) };
    let options = CompareOptions { duration_s: is_quick.then_some(0.2), ..CompareOptions::default() };
    let mut comparisons = Vec::new();
    for name in names {
        eprintln!("every model on {name}");
        let mut comparison = compared(&scene(name)?, &options, rounds)?;
        comparison.scene = (*name).to_owned();
        comparisons.push(comparison);
    }
    let mut text = "## The reference scenes\n\n".to_owned();
    for line in overall(&comparisons) {
        let _ = writeln!(text, "- {line}");
    }
    text.push_str(
        "\nEach cell has the figure with results that are there at once, then that with results one period (33.34 ms) late: discs and circles in the \
         pictures. `palpate compare scenes/NAME.toml` draws conclusions for one scene.\n",
    );
    let mut pictures = Vec::new();
    for comparison in &comparisons {
        let name = format!("speed_vs_error_{}", comparison.scene);
        let _ = write!(text, "\n### `{0}`\n\n![Speed against error on {0}](img/{name}.svg)\n\n", comparison.scene);
        text.push_str(&rows(comparison));
        pictures.push((name, picture(comparison).to_svg()));
    }
    Ok(Part { text, pictures })
}

/// The heads of [`cells`].
const HEADS: [&str; 7] = ["rms %", "max %", "jump %", "tick p50 us", "tick p99 us", "build p50 us", "both ms/s"];

/// Error and cost of a run.
fn cells(run: &Measured) -> Vec<String> {
    let (error, cost) = (&run.error, &run.cost);
    let errors = [error.rms, error.max, error.jump].map(figure);
    let costs = [us(cost.tick_p50), us(cost.tick_p99)].map(figure);
    let build = if cost.builds > 0 { figure(us(cost.build_p50)) } else { "-".to_owned() };
    errors.into_iter().chain(costs).chain([build, figure(1e3 * cost.total_load())]).collect()
}

fn rows(comparison: &Comparison) -> String {
    let full = ["`full`".to_owned()].into_iter().chain(cells(&comparison.full)).collect();
    // The runs of one model follow each other.
    let models = comparison.runs.chunk_by(|one, next| one.model == next.model).map(|runs| {
        let figures: Vec<Vec<String>> = runs
            .iter()
            .map(|run| match run.measured() {
                Some(measured) => cells(measured),
                None => vec![run.missing().unwrap_or_default().to_owned()],
            })
            .collect();
        [format!("`{}`", runs[0].model)].into_iter().chain(joined(&figures)).collect()
    });
    let heads: Vec<&str> = ["model"].into_iter().chain(HEADS).collect();
    table(&heads, 1, &[full].into_iter().chain(models).collect::<Vec<_>>())
}

fn picture(comparison: &Comparison) -> Picture {
    let one = |model: &str, is_hollow: bool, run: &Measured, label: String| Series {
        name: model.to_owned(),
        colour: colour(model),
        is_joined: false,
        sign: Sign::Disc,
        is_hollow,
        // What is exact but for rounding would stretch the axis by ten decades: it lies on the edge.
        points: vec![(us(run.cost.tick_p50), if run.error.rms < EXACT { 0.0 } else { run.error.rms }, label)],
    };
    let runs = comparison
        .runs
        .iter()
        .filter_map(|run| Some(one(&run.model, run.latency != Nanos::ZERO, run.measured()?, run.model.clone())));
    let full = one("full", false, &comparison.full, "full, error 0".to_owned());
    Picture {
        title: format!("{}: speed against error", comparison.scene),
        x: "CPU per haptic tick, p50 (us)".to_owned(),
        y: "rms error (% of peak)".to_owned(),
        marks: vec![(us(comparison.haptic_period), "haptic period".to_owned())],
        levels: Vec::new(),
        series: [full].into_iter().chain(runs).collect(),
    }
}

/// What a run is judged by: less is better.
type Cost = fn(&Measured) -> f64;

/// What holds for all scenes together.
fn overall(comparisons: &[Comparison]) -> Vec<String> {
    let fits = comparisons.iter().filter(|scene| scene.full.cost.tick_p99 <= scene.haptic_period).count();
    let slowest = comparisons.iter().map(|scene| us(scene.full.cost.tick_p99)).fold(0.0, f64::max);
    let nodes = comparisons.first().map_or(0, |scene| scene.nodes);
    let first = format!(
        "`full` fits the 1 kHz tick on {fits} of {} scenes ({nodes} nodes, p99 at most {slowest:.0} us on one core). Where it \
         fits nothing beats it: it has no error, no resyncs and no second group.",
        comparisons.len()
    );
    let per_tick: Cost = |run| us(run.cost.tick_p50);
    let in_total: Cost = |run| run.cost.total_load();
    let lines = [
        ("per haptic tick", per_tick, "what decides whether a rate can be kept"),
        ("for both groups together", in_total, "what decides on one core"),
    ];
    let lines = lines.map(|(what, cost, why)| {
        let never: Vec<String> = LocalModelKind::ALL
            .into_iter()
            .filter(|kind| *kind != LocalModelKind::Full)
            .filter(|kind| !comparisons.iter().any(|scene| wins(scene, kind.name(), cost)))
            .map(|kind| format!("`{}`", kind.name()))
            .collect();
        let never = if never.is_empty() { "no model".to_owned() } else { never.join(", ") };
        format!("Never the best choice by error and cost {what} ({why}), on any of these scenes and at either latency: {never}.")
    });
    [first].into_iter().chain(lines).collect()
}

/// True if at some latency no other model, `full` included, is as near and, but for what a measurement is unsure of, as cheap.
fn wins(scene: &Comparison, model: &str, cost: Cost) -> bool {
    let runs = || scene.runs.iter().filter_map(|run| Some((run, run.measured()?)));
    runs().filter(|(run, _)| run.model == model).any(|(run, measured)| {
        let others = runs().filter(|(other, _)| other.latency == run.latency && other.model != model);
        let others = others.map(|(_, other)| other).chain([&scene.full]);
        let beats =
            |other: &Measured| other.error.rms <= measured.error.rms && cost(other) <= (1.0 + MARGIN) * cost(measured);
        !others.into_iter().any(beats)
    })
}
