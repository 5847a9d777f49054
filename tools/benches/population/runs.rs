//! Runs the cases, one on each core.

use std::fmt;
use std::sync::Mutex;
use std::time::Instant;

use palpate::log::ServedBy;
use palpate::model::local::Kind;
use palpate::runtime::Nanos;
use palpate::scene::{LinkSpec, ModelChoice, Scene};
use palpate::{Error, Session};
use palpate_cli::compare::{CompareOptions, Comparison, Measured};

use super::cases::{Case, Class, Variety};
use super::paths::Motion;

/// What is tried in place of the defaults.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The models to run, besides the one that `auto` chooses.
    pub models: Vec<Kind>,
    pub budget: Option<f64>,
    pub patch: Option<[usize; 3]>,
    pub basis: Option<usize>,
    pub latency_ms: Option<f64>,
    pub variety: Variety,
    /// What is between local and global model.
    pub link: Option<LinkSpec>,
}

impl Settings {
    fn apply(&self, scene: &mut Scene) {
        if let Some(patch) = self.patch {
            scene.local.patch = Some(patch);
            if let Some(block) = scene.body.as_ref().and_then(|body| body.mass_spring()).map(|spec| spec.block.nodes) {
                scene.local.patch = Some(std::array::from_fn(|n| patch[n].min(block[n] - 1).max(2)));
            }
        }
        scene.local.basis = self.basis.or(scene.local.basis);
        scene.local.error_pct = self.budget.or(scene.local.error_pct);
        scene.link.clone_from(&self.link);
        scene.global.basis_latency_ms = self.latency_ms.or(scene.global.basis_latency_ms);
    }
}

/// One model with one lateness on one case, against `full`.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Error of the force, rms and greatest (% of the peak).
    pub rms: f64,
    pub max: f64,
    /// Its greatest change in a tick beyond that of `full` (% of the peak).
    pub jump: f64,
    /// Its peak over that of `full`.
    pub peak: f64,
    /// Share of ticks that `predicted` made, and that were held.
    pub fallen_back: [f64; 2],
    /// CPU time of a tick: p50, p99 (us).
    pub tick_us: [f64; 2],
    /// CPU time of the global group over that of `full` for the same time: periods of simulation per period.
    pub periods: f64,
}

impl Run {
    fn of(run: &Measured, full: &Measured) -> Self {
        let us = |time: Nanos| time.0 as f64 * 1e-3;
        Self {
            rms: run.error.rms,
            max: run.error.max,
            jump: (run.error.jump - full.error.jump).max(0.0),
            peak: run.peak_n() / full.peak_n(),
            fallen_back: [ServedBy::Predicted, ServedBy::Hold].map(|model| {
                run.devices[0].served.iter().find(|(served, _)| *served == model).map_or(0.0, |(_, share)| *share)
            }),
            tick_us: [us(run.cost.tick_p50), us(run.cost.tick_p99)],
            periods: run.cost.global_load / full.cost.haptic_load,
        }
    }
}

/// The models on one case.
pub struct CaseResult {
    pub seed: u64,
    pub class: Class,
    pub motion: Motion,
    name: String,
    /// Of `full` (N).
    pub peak_n: f64,
    /// What `auto` chooses, and whether it says that the error may be larger than what was asked for.
    pub auto: (Kind, bool),
    /// Models by name, in time and late; `None` with the reason for what did not run to its end.
    pub runs: Vec<(Kind, [Result<Run, String>; 2])>,
    /// `full` in twice as many steps.
    pub finer: Option<Run>,
    seconds: f64,
}

impl CaseResult {
    pub fn of(&self, kind: Kind) -> Option<&[Result<Run, String>; 2]> {
        self.runs.iter().find(|(of, _)| *of == kind).map(|(_, runs)| runs)
    }
}

impl fmt::Display for CaseResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:60} {:5.2} N", self.name, self.peak_n)?;
        for (kind, runs) in &self.runs {
            write!(f, " | {}", kind.name())?;
            for run in runs {
                match run {
                    Ok(run) => write!(
                        f,
                        " {:.3} max {:.1} jump {:.1} peak {:.2} pred {:.2} hold {:.2}, {:.0} {:.0} us {:.1}P;",
                        run.rms,
                        run.max,
                        run.jump,
                        run.peak,
                        run.fallen_back[0],
                        run.fallen_back[1],
                        run.tick_us[0],
                        run.tick_us[1],
                        run.periods
                    )?,
                    Err(why) => write!(f, " {why};")?,
                }
            }
        }
        if let Some(finer) = &self.finer {
            write!(f, " | 2x steps {:.3} max {:.1}", finer.rms, finer.max)?;
        }
        let (auto, warns) = self.auto;
        write!(f, " | auto {}{} ({:.1} s)", auto.name(), if warns { ", unsure" } else { "" }, self.seconds)
    }
}

/// Runs all of `seeds`; `told` is called after each.
pub fn run_all(
    seeds: &[u64],
    settings: &Settings,
    told: impl Fn(&CaseResult) + Sync,
) -> Result<Vec<CaseResult>, Error> {
    let (waiting, results) = (Mutex::new(seeds.iter()), Mutex::new(Vec::new()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let work = || -> Result<(), Error> {
        loop {
            let Some(&seed) = waiting.lock().expect("no thread panics with it").next() else { return Ok(()) };
            let result = run(seed, settings)?;
            let mut results = results.lock().expect("no thread panics with it");
            results.push(result);
            told(results.last().expect("just pushed"));
            eprintln!("{} of {}", results.len(), seeds.len());
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("a worker does not panic"))
    })?;
    let mut results = results.into_inner().expect("no thread panics with it");
    results.sort_by_key(|result| result.seed);
    Ok(results)
}

fn run(seed: u64, settings: &Settings) -> Result<CaseResult, Error> {
    let begun = Instant::now();
    let mut case = Case::new(seed, settings.variety)?;
    settings.apply(&mut case.scene);
    let session = Session::from_scene(case.scene.clone().with_model(ModelChoice::Auto)).virtual_time().build()?;
    let choice = session.choice().expect("auto chooses");
    let auto = (choice.model, choice.reason.warning.is_some());
    let mut models = settings.models.clone();
    if auto.0 != Kind::Full && !models.contains(&auto.0) {
        models.push(auto.0);
    }
    let options = CompareOptions { models, finer: true, ..CompareOptions::default() };
    let comparison = Comparison::measure(&case.scene, &options, |_| ())
        .map_err(|error| Error::new(error.kind(), format!("case {case}: {error}")))?;
    let full = &comparison.full;
    let of = |kind: Kind| {
        let mut runs = comparison.runs.iter().filter(|run| run.model == kind.name()).map(|run| match run.measured() {
            Some(measured) => Ok(Run::of(measured, full)),
            None => Err(run.missing().unwrap_or_default().to_owned()),
        });
        (kind, std::array::from_fn(|_| runs.next().expect("in time and late")))
    };
    Ok(CaseResult {
        seed,
        class: case.class,
        motion: case.motion,
        name: case.to_string(),
        peak_n: full.peak_n(),
        auto,
        runs: options.models.iter().map(|&kind| of(kind)).collect(),
        finer: comparison.finer.first().and_then(|run| run.measured()).map(|run| Run::of(run, full)),
        seconds: begun.elapsed().as_secs_f64(),
    })
}
