//! Runs a scene with every local model in virtual time and compares what each computes and costs with `full`.

use std::time::Duration;

use palpate::log::DeviceReport;
use palpate::model::body::Block;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Histogram;
use palpate::runtime::{Nanos, Rate, Stopwatch};
use palpate::scene::{BodySpec, Scene};
use palpate::session::{Session, SessionBuilder, Summary};
use palpate::{Error, ErrorKind};

use super::figures::{
    ComparedRun, Comparison, ForceDeviation, ForceTrace, Measured, MeasuredDevice, ModelCost, RunOutcome,
};
use super::finer::finer;

/// How much of a run passes between two calls of the progress callback.
const STEP: Duration = Duration::from_millis(50);
/// A latency of one period is rounded up to a multiple of this, so that it can be written in a scene file.
const LATENCY_GRAIN: u64 = 10_000;

/// The choice of what is compared; by default every model, with results of the global model that are there at once and one
/// period late.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompareOptions {
    /// Models beside `full`, which always runs; all of them if empty.
    pub models: Vec<LocalModelKind>,
    /// Compute latencies of the global model, in place of the scene's own; zero and one period if empty.
    pub latencies: Vec<Nanos>,
    /// Simulated time in place of the scene's own (s).
    pub duration_s: Option<f64>,
    /// True if `full` is also run with smaller steps and on a finer mesh.
    pub finer: bool,
}

/// How far a comparison is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareProgress {
    /// The run that is at work, from 0.
    pub run: usize,
    /// Runs in all.
    pub runs: usize,
    /// Name of what is at work: a model, or `full` in another size.
    pub model: &'static str,
    /// Compute latency of the run that is at work.
    pub latency: Nanos,
    /// Simulated time that has passed in it.
    pub elapsed: Nanos,
    /// Simulated time that it will take; `None` while it is prepared.
    pub until: Option<Nanos>,
}

impl CompareOptions {
    /// The latency of results that take one whole period at `rate`, rounded up to 10 us: 33.34 ms at 30 Hz.
    pub fn one_period(rate: Rate) -> Nanos {
        Nanos(rate.period().0.div_ceil(LATENCY_GRAIN) * LATENCY_GRAIN)
    }
}

impl Comparison {
    /// Runs `scene` with `full` and with each other model in turn, on this thread, in virtual time, and measures error and
    /// cost. Sizes, feedback, blending and substeps are the scene's; its model and its compute latency are not used. `progress`
    /// is called before each run and after every 50 ms of simulated time.
    ///
    /// Forces are the same every time; costs are measured and are not. A model that cannot run on this scene, or whose run ends
    /// in a fault, has a row that says so.
    ///
    /// # Errors
    /// If `full` cannot run on the scene, or its run ends in a fault.
    pub fn measure(
        scene: &Scene,
        options: &CompareOptions,
        mut progress: impl FnMut(CompareProgress),
    ) -> Result<Self, Error> {
        let global = rate("global.rate_hz", scene.global.rate_hz)?;
        let latencies = match options.latencies.is_empty() {
            true => vec![Nanos::ZERO, CompareOptions::one_period(global)],
            false => options.latencies.clone(),
        };
        let is_compared = |kind: &LocalModelKind| {
            let asked = options.models.is_empty() || options.models.contains(kind);
            asked && *kind != LocalModelKind::Full
        };
        let pairs: Vec<(LocalModelKind, Nanos)> = LocalModelKind::ALL
            .into_iter()
            .filter(is_compared)
            .flat_map(|kind| latencies.iter().map(move |&latency| (kind, latency)))
            .collect();
        let finer = if options.finer { finer(scene) } else { Vec::new() };
        let (runs, last) = (1 + pairs.len() + finer.len(), 1 + pairs.len());
        let mut report = |run, model, latency, elapsed, until| {
            progress(CompareProgress { run, runs, model, latency, elapsed, until });
        };
        let reference = (LocalModelKind::Full, Nanos::ZERO);
        report(0, reference.0.name(), reference.1, Nanos::ZERO, None);
        let session = build(scene, reference, options.duration_s)?;
        let at_work = |elapsed, until| report(0, reference.0.name(), reference.1, elapsed, until);
        let mut comparison = full(session, about(scene, global)?, at_work)?;
        let full = &comparison.full;
        type Build<'a> = Box<dyn FnOnce() -> Result<Session, Error> + 'a>;
        let mut compare = |run, model: &'static str, latency, session: Build<'_>| {
            report(run, model, latency, Nanos::ZERO, None);
            let at_work = |elapsed, until| report(run, model, latency, elapsed, until);
            let ran = session().and_then(|session| execute(session, at_work));
            ComparedRun { model: model.to_owned(), latency, outcome: outcome(ran, full) }
        };
        let models = pairs.into_iter().zip(1..).map(|(pair, run)| {
            compare(run, pair.0.name(), pair.1, Box::new(move || build(scene, pair, options.duration_s)))
        });
        let models = models.collect();
        let finer = finer.into_iter().zip(last..).map(|(finer, run)| {
            let session = || build(&finer.scene?, reference, options.duration_s);
            compare(run, finer.name, Nanos::ZERO, Box::new(session))
        });
        (comparison.finer, comparison.runs) = (finer.collect(), models);
        Ok(comparison)
    }
}

impl Measured {
    /// Runs a session of `full` on this thread, in virtual time, and measures it: for a body that no scene describes. Its errors are those
    /// against itself.
    ///
    /// # Errors
    /// If it cannot be run, or its run ends in a fault.
    pub fn of_full(session: SessionBuilder) -> Result<Self, Error> {
        let session = session.model(LocalModelKind::Full).virtual_time().keep_records().measure_cost().build()?;
        sound(&execute(session, |_, _| ())?.1)
    }
}

/// How a run went, with its distance from `full`.
fn outcome(ran: Result<(Nanos, Summary), Error>, full: &Measured) -> RunOutcome {
    match ran {
        Err(refusal) => RunOutcome::Refused(refusal.to_string()),
        Ok((_, summary)) => match &summary.runtime.fault {
            Some(fault) => RunOutcome::Failed(fault.to_string()),
            None => RunOutcome::Measured(Box::new(measured(&summary, Some(full)))),
        },
    }
}

/// The reference, and what the runs have in common.
fn full(
    session: Session,
    comparison: Comparison,
    at_work: impl FnMut(Nanos, Option<Nanos>),
) -> Result<Comparison, Error> {
    let (duration, summary) = execute(session, at_work)?;
    Ok(Comparison { full: sound(&summary)?, duration, ..comparison })
}

/// What a run of `full` says, unless it ended in a fault.
fn sound(summary: &Summary) -> Result<Measured, Error> {
    match &summary.runtime.fault {
        Some(fault) => Err(Error::new(ErrorKind::Fault, format!("the run of `full`: {fault}"))),
        None => Ok(measured(summary, None)),
    }
}

fn build(scene: &Scene, (model, latency): (LocalModelKind, Nanos), duration_s: Option<f64>) -> Result<Session, Error> {
    let mut scene = scene.clone().with_model(model);
    scene.global.compute_latency_ms = latency.0 as f64 / 1e6;
    scene.run.duration_s = duration_s.unwrap_or(scene.run.duration_s);
    Session::from_scene(scene).virtual_time().keep_records().measure_cost().build()
}

fn execute(session: Session, mut progress: impl FnMut(Nanos, Option<Nanos>)) -> Result<(Nanos, Summary), Error> {
    let running = session.start()?;
    while !running.finished() {
        running.wait_for(STEP);
        progress(running.elapsed(), running.until());
    }
    Ok((running.until().unwrap_or_default(), running.stop()))
}

/// What the runs have in common.
fn about(scene: &Scene, global: Rate) -> Result<Comparison, Error> {
    let haptic = rate("local.rate_hz", scene.local.rate_hz)?;
    Ok(Comparison {
        nodes: scene.body.as_ref().map_or(0, BodySpec::node_count),
        haptic_period: haptic.period(),
        global_period: global.period(),
        link: scene.link.clone(),
        clock: Stopwatch::reading(),
        is_debug_build: cfg!(debug_assertions),
        palpate_version: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: Block::instruction_set().to_owned(),
        ..Comparison::default()
    })
}

fn rate(field: &str, hz: f64) -> Result<Rate, Error> {
    Rate::from_hz(hz).ok_or_else(|| Error::scene(field, format!("is {hz}, which is no rate")))
}

/// What a run says, against `full` if it is not `full` itself.
fn measured(summary: &Summary, full: Option<&Measured>) -> Measured {
    let device = |(number, report): (u16, &DeviceReport)| {
        let trace = ForceTrace::of_device(&summary.records, number);
        let full = full.and_then(|full| full.devices.get(usize::from(number))).map(|device| &device.trace);
        MeasuredDevice {
            name: report.name.clone(),
            error: ForceDeviation::between(&trace, full.unwrap_or(&trace)),
            served: report.force.shares().collect(),
            trace,
        }
    };
    let degraded = summary.runtime.groups.iter().map(|group| group.degraded).sum();
    Measured::new(cost(summary), degraded, (0..).zip(&summary.report.devices).map(device).collect())
}

fn cost(summary: &Summary) -> ModelCost {
    let simulated_s = summary.report.duration.as_secs_f64();
    let of = |name: &str| summary.runtime.costs.iter().find(|cost| cost.name == name).map(|cost| &cost.cpu);
    let load = |cpu: Option<&Histogram>| cpu.map_or(0.0, |cpu| cpu.sum().as_secs_f64() / simulated_s);
    let percentile = |cpu: Option<&Histogram>, q: f64| cpu.map_or(Nanos::ZERO, |cpu| cpu.percentile(q));
    let (haptic, builds) = (of("local"), summary.builds.as_ref());
    ModelCost {
        tick_p50: percentile(haptic, 0.5),
        tick_p99: percentile(haptic, 0.99),
        tick_max: haptic.map_or(Nanos::ZERO, Histogram::max),
        haptic_load: load(haptic),
        global_load: load(of("global")),
        builds: builds.map_or(0, Histogram::count),
        build_p50: percentile(builds, 0.5),
        build_p99: percentile(builds, 0.99),
    }
}
