//! Errors of `predictive` on large bodies: whole sessions in virtual time, results one period late.

use std::time::Instant;

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::{Nanos, Rate};
use palpate::scene::{BodySpec, Scene};
use palpate::session::{Session, Summary};
use palpate_cli::compare::{CompareOptions, ForceDeviation, ForceTrace};

use crate::common::{figure, scene, table, us};

/// Which body, scene and rate.
struct Case {
    nodes: usize,
    rate: f64,
    scene: &'static str,
    /// The scene's own path, or a drag of 0.6 s.
    is_whole: bool,
    models: &'static [LocalModelKind],
}

const BOTH: &[LocalModelKind] = &[LocalModelKind::Patch, LocalModelKind::Predicted, LocalModelKind::Predictive];
/// Without reduced surroundings: where a basis takes too long for a bench.
const WITHOUT: &[LocalModelKind] = &[LocalModelKind::Patch, LocalModelKind::Predicted];

const fn case(nodes: usize, rate: f64, scene: &'static str, is_whole: bool, models: &'static [LocalModelKind]) -> Case {
    Case { nodes, rate, scene, is_whole, models }
}

/// The cases with bases of large bodies, which take longest, come last.
const CASES: [Case; 8] = [
    case(12, 4000.0, "drag_friction", false, BOTH),
    case(16, 4000.0, "drag_friction", false, BOTH),
    case(24, 1000.0, "drag_friction", false, WITHOUT),
    case(24, 4000.0, "drag_friction", false, WITHOUT),
    case(32, 1000.0, "drag_friction", false, WITHOUT),
    case(32, 1000.0, "drag_slip", false, WITHOUT),
    case(20, 4000.0, "drag_friction", true, BOTH),
    case(20, 4000.0, "drag_slip", true, BOTH),
];
const QUICK: [Case; 1] = [case(6, 4000.0, "drag_friction", false, BOTH)];

/// One model on one case.
pub struct Run {
    what: String,
    rate: f64,
    model: LocalModelKind,
    outcome: Result<Outcome, String>,
}

struct Outcome {
    error: ForceDeviation,
    tick: [Nanos; 3],
    haptic: f64,
    global: f64,
    /// CPU of the group that reduces surroundings (s).
    basis_s: f64,
    builds: [Nanos; 2],
    served: String,
}

/// Runs all cases; `done` gets what is there after each.
pub fn all(is_quick: bool, mut done: impl FnMut(&[Run]) -> Result<(), Error>) -> Result<(), Error> {
    let mut runs = Vec::new();
    for case in if is_quick { &QUICK[..] } else { &CASES[..] } {
        let what = match case.is_whole {
            true => format!("{}^3 `{}`", case.nodes, case.scene),
            false => format!("{}^3 `{}`, 0.6 s", case.nodes, case.scene),
        };
        let scene = of(case)?;
        let begun = Instant::now();
        let reference = run(&scene, LocalModelKind::Full)?;
        let full = trace(&reference);
        let mut add = |model, outcome| {
            let run = Run { what: what.clone(), rate: case.rate, model, outcome };
            eprintln!("{} ({:.0} s)", row(&run).join(" | "), begun.elapsed().as_secs_f64());
            runs.push(run);
        };
        add(LocalModelKind::Full, Ok(measured(&reference, &full)));
        for &model in case.models {
            let outcome = run(&scene, model).map_err(|error| error.to_string()).and_then(|summary| {
                match &summary.runtime.fault {
                    Some(fault) => Err(fault.to_string()),
                    None => Ok(measured(&summary, &full)),
                }
            });
            add(model, outcome);
        }
        done(&runs)?;
    }
    Ok(())
}

fn of(case: &Case) -> Result<Scene, Error> {
    let mut scene = scene(case.scene)?;
    if let Some(body) = scene.body.as_mut().and_then(BodySpec::mass_spring_mut) {
        body.block.nodes = [case.nodes; 3];
    }
    scene.local.rate_hz = case.rate;
    // As the stability limit asks for.
    scene.global.substeps_per_ms = None;
    if !case.is_whole {
        let at = |x: f64, z: f64| [x, 0.0512, z];
        let places = vec![at(0.04, 0.101), at(0.04, 0.092), at(0.05, 0.092), at(0.05, 0.101)];
        scene.devices[0].path = Some(ToolPath::new(vec![0.0, 0.2, 0.5, 0.6], places)?);
        scene.run.duration_s = 0.6;
    }
    let global = Rate::from_hz(scene.global.rate_hz).expect("a scene has a rate");
    scene.global.compute_latency_ms = us(CompareOptions::one_period(global)) * 1e-3;
    Ok(scene)
}

fn run(scene: &Scene, model: LocalModelKind) -> Result<Summary, Error> {
    let scene = scene.clone().with_model(model);
    Session::from_scene(scene).virtual_time().keep_records().measure_cost().build()?.run()
}

fn trace(summary: &Summary) -> ForceTrace {
    ForceTrace::of(&summary.records)
}

fn measured(summary: &Summary, full: &ForceTrace) -> Outcome {
    let seconds = summary.report.duration.as_secs_f64();
    let cost = |name: &str| summary.runtime.costs.iter().find(|cost| cost.name == name).map(|cost| &cost.cpu);
    let total = |name: &str| cost(name).map_or(0.0, |cpu| cpu.sum().as_secs_f64());
    let haptic = cost("local");
    let builds = summary.builds.as_ref();
    let served = summary.report.devices[0]
        .force
        .shares()
        .map(|(model, share)| format!("{} {:.1} %", model.name(), 100.0 * share));
    Outcome {
        error: ForceDeviation::between(&trace(summary), full),
        tick: [0.5, 0.99, 1.0].map(|q| haptic.map_or(Nanos::ZERO, |cpu| cpu.percentile(q))),
        haptic: total("local") / seconds,
        global: total("global") / seconds,
        basis_s: total("basis"),
        builds: [0.5, 0.99].map(|q| builds.map_or(Nanos::ZERO, |cpu| cpu.percentile(q))),
        served: served.collect::<Vec<_>>().join(", "),
    }
}

fn row(run: &Run) -> Vec<String> {
    let first = [run.what.clone(), format!("{} kHz", run.rate * 1e-3), format!("`{}`", run.model.name())];
    let figures = match &run.outcome {
        Err(why) => vec![why.clone()],
        Ok(outcome) => {
            let error = [outcome.error.rms, outcome.error.max, outcome.error.jump].map(figure);
            let tick = outcome.tick.map(|tick| figure(us(tick))).join(" / ");
            let builds = outcome.builds.map(|build| figure(us(build) * 1e-3)).join(" / ");
            let loads = [outcome.haptic, outcome.global].map(|load| figure(1e3 * load));
            let basis = figure(outcome.basis_s);
            error.into_iter().chain([tick, builds]).chain(loads).chain([basis, outcome.served.clone()]).collect()
        }
    };
    first.into_iter().chain(figures).collect()
}

/// The table of errors.
pub fn text(runs: &[Run]) -> String {
    let heads = [
        "body and scene",
        "rate",
        "model",
        "rms %",
        "max %",
        "jump %",
        "tick p50 / p99 / max us",
        "build p50 / p99 ms",
        "haptic ms/s",
        "global ms/s",
        "bases s",
        "served",
    ];
    let rows: Vec<Vec<String>> = runs.iter().map(row).collect();
    format!(
        "## Errors\n\nWhole sessions in virtual time, results of the global model one period late, against `full` at the same \
         rate; in % of its largest force. The scenes are those of the repository with more nodes; *0.6 s* is a shorter drag of \
         1 cm. *Bases* is the CPU time of the background group in the whole run: in virtual time its results are there at \
         once, on threads the model does without until they are. The tick has catching up in it.\n\n{}",
        table(&heads, 3, &rows)
    )
}
