//! `palpate` and `palpate run SCENE`: runs a scene, writes its log and reports how it went.

use std::path::{Path, PathBuf};

use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::{BuiltIn, ModelChoice};
use palpate::session::{Session, SessionBuilder};
use palpate::{Error, ErrorKind};

use super::link::GlobalArgs;
use super::{files, progress, shared};

/// Where the log goes if nothing is said.
const DEFAULT_LOG: &str = "palpate-run.mcap";
/// Of a run in virtual time: it does not take the place of a real one, whose timing is still to be read.
const VIRTUAL_LOG: &str = "palpate-virtual.mcap";

/// What `palpate` alone runs: a body that `full` does not carry, or a small one where the machine is too slow for it.
const FLAGSHIP: &str = "torso";
const SHOWN_S: f64 = 10.0;
const SMALL: &str = "demo";

/// The arguments of `palpate run`.
#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// A scene file (TOML), or the name of a built-in scene (`palpate list`)
    pub scene: PathBuf,
    /// Run in simulated time, as fast as the machine allows and bit-identically every time
    #[arg(long = "virtual")]
    pub virtual_time: bool,
    /// Run for this many seconds instead of the scene's own duration
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Use this local model instead of the scene's own
    #[arg(long, value_name = "NAME", value_parser = shared::choice)]
    pub model: Option<ModelChoice>,
    /// Also log the topic /scene for viewers: surface, tools and forces, 30 times a second
    #[arg(long)]
    pub log_scene: bool,
    /// Keep no reduced surroundings from run to run, and take none that were kept
    #[arg(long)]
    pub no_cache: bool,
    /// Print the schedule and what this system would refuse, and run nothing
    #[arg(long)]
    pub plan: bool,
    #[command(flatten)]
    pub global: GlobalArgs,
    /// The log to write, overwritten if it exists; palpate-run.mcap if left out, palpate-virtual.mcap in virtual time
    #[arg(long, value_name = "LOG.mcap")]
    pub out: Option<PathBuf>,
}

/// Runs, in real time, the first [`SHOWN_S`] seconds of the built-in scene that shows what the method is for.
///
/// # Errors
/// If the log cannot be written or the run fails.
pub fn flagship() -> Result<(), Error> {
    let scene = |name| Session::from_scene(BuiltIn::named(name).expect("it is built in").load());
    let log = Path::new(DEFAULT_LOG);
    match execute(scene(FLAGSHIP).duration_s(SHOWN_S), log, FLAGSHIP) {
        // Nothing is wrong with a scene that is built in.
        Err(error) if error.kind() == ErrorKind::Scene => {
            shared::complain(format_args!(" WARN {error}; the scene `{SMALL}` runs instead"));
            execute(scene(SMALL), log, SMALL)
        }
        ended => ended,
    }
}

/// Runs a scene file.
///
/// # Errors
/// Input errors of the scene, or a failed run.
pub fn run(args: &RunArgs) -> Result<(), Error> {
    args.global.check()?;
    let mut scene = progress::load(&args.scene)?;
    let out = args.out.as_deref().unwrap_or(Path::new(if args.virtual_time { VIRTUAL_LOG } else { DEFAULT_LOG }));
    files::keep_inputs(&files::inputs_of(&args.scene, &scene), out)?;
    let name = shared::name_of(&args.scene);
    if let Some(model) = args.model {
        scene = scene.with_model(model);
    }
    let mut builder = Session::from_scene(scene);
    if let Some(seconds) = args.duration {
        builder = builder.duration_s(seconds);
    }
    if args.virtual_time {
        builder = builder.virtual_time();
    }
    if args.log_scene {
        builder = builder.log_scene();
    }
    if args.no_cache {
        builder = builder.forget_bases();
    }
    builder = args.global.of(builder)?;
    if args.plan { plan(builder, &name) } else { execute(builder, out, &name) }
}

fn plan(builder: SessionBuilder, name: &str) -> Result<(), Error> {
    let planned = builder
        .open_haply_with(palpate_haply::open)
        .build()
        .and_then(|session| Ok((session.plan()?, session.choice().cloned())));
    let (plan, choice) = planned.map_err(|error| error.at(name))?;
    let choice = choice.map_or(String::new(), |choice| format!("model      {choice}\n"));
    shared::print(&format!("{name}: {plan}{choice}"))
}

fn execute(builder: SessionBuilder, log: &Path, name: &str) -> Result<(), Error> {
    let preparing = progress::preparing(name);
    let session = builder.open_haply_with(palpate_haply::open).log(log).build().map_err(|error| error.at(name));
    preparing.finish_and_clear();
    let running = session?.start()?;
    let interrupt = shared::stops(&running)?;
    progress::wait(&running, name);
    let ended = running.elapsed();
    let until = running.until();
    let summary = running.stop();
    shared::print(&summary.to_string())?;
    if let Some(fault) = summary.runtime.fault {
        return Err(Error::new(ErrorKind::Fault, fault.to_string()).at(name));
    }
    if let Some(error) = summary.log_error {
        // The run itself went well; but what was promised, a log, is not there.
        return Err(Error::new(ErrorKind::Fault, format!("the log is incomplete: {error}")));
    }
    let first = summary.report.devices.first().map(|device| device.name.as_str()).filter(|name| !name.is_empty());
    let topic = first.map_or("/force".to_owned(), |name| format!("/{name}/force"));
    shared::print(&format!(
        "log: {0} (`palpate timing {0}`, `palpate export {0} --topic {topic}`)\n",
        shared::name_of(log)
    ))?;
    match until.filter(|_| interrupt.came()) {
        Some(until) if ended < until => {
            let (ended, until) = (ended.as_secs_f64(), until.as_secs_f64());
            let message = format!("interrupted after {ended:.2} of {until} s; the log is complete up to there");
            Err(Error::new(ErrorKind::Interrupted, message))
        }
        _ => Ok(()),
    }
}

/// A local model by its name, or which there are.
pub(super) fn model(name: &str) -> Result<LocalModelKind, String> {
    LocalModelKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
        let names: Vec<_> = LocalModelKind::ALL.iter().map(|kind| kind.name()).collect();
        format!("the local models are {}", names.join(", "))
    })
}
