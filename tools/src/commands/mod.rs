//! The subcommands of `palpate`, one file each, and the contract that they share.
//!
//! Exit code 0 on success, 2 on a usage or input error (one line on standard error), 1 on a failed run, 130 on a run that
//! the user interrupted.

pub mod compare;
pub mod doctor;
pub mod export;
pub mod link;
pub mod list;
pub mod log;
pub mod mesh;
pub mod mock;
pub mod reduce;
pub mod replay;
pub mod run;
pub mod timing;
pub mod view;

mod files;
mod log_info;
mod progress;
mod shared;

use std::process::ExitCode;
use std::sync::LazyLock;

pub use files::OutputFile;
pub use shared::WindowArgs;

use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use palpate::model::body::InstructionSet;
use palpate::session::LOG_FAILURE;
use palpate::{Error, ErrorKind};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Feel deformable objects: a detailed simulation at 30 Hz, a local model at 1 kHz, and a log of every tick.
///
/// Without a subcommand, runs the built-in scene `torso`, a body of 97,336 nodes, in real time for 10 seconds and reports how it went.
#[derive(Debug, Parser)]
#[command(name = "palpate", version = VERSION.as_str(), args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the scenes that are built in
    List,
    /// Say whether this machine is ready for real time, and what to do
    Doctor,
    /// Run a scene, in real time or in virtual time
    Run(run::RunArgs),
    /// Say how well a recorded run kept its time, and what that did to the force
    Timing(timing::TimingArgs),
    /// Run every local model on a scene in virtual time: how far each is from `full`, and what it costs
    Compare(compare::CompareArgs),
    /// Reduce a body's model: the paper's tables and figures, and when a scene's local model may be trusted
    Reduce(reduce::ReduceArgs),
    /// Fill a closed surface with tetrahedra, or report on a volume mesh
    Mesh(mesh::MeshArgs),
    /// Execute a log again in simulated time and compare every force with the logged one, bit for bit
    Replay(replay::ReplayArgs),
    /// Write one topic of a log as a table
    Export(export::ExportArgs),
    /// Look into a log, check it, or save what is readable of a damaged one
    Log(log::LogArgs),
    /// Show a scene in the browser and push it with the mouse, or play a log
    View(view::ViewArgs),
    /// Be the global model of a haptic machine elsewhere, which runs the same scene with --global
    Serve(link::ServeArgs),
    /// Make what two computers need to know each other
    Link(link::LinkArgs),
    /// Be a device's service without the device, to try a scene against it
    Mock(mock::MockArgs),
    /// Print what completes this command in a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Version, features, and the instructions that the numerics use on this machine.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let features = match (cfg!(feature = "parallel"), cfg!(feature = "link")) {
        (true, true) => "parallel, link",
        (true, false) => "parallel",
        (false, true) => "link",
        (false, false) => "none",
    };
    format!("{}\nfeatures: {features}\ninstructions: {}", env!("CARGO_PKG_VERSION"), InstructionSet::detect().name())
});

/// Parses the command line, runs it and says how it ended.
pub fn main() -> ExitCode {
    // Warnings of actors go to standard error; nothing real-time ever writes there itself.
    // What the report or the command's own error says, once is enough: what the runtime's books hold, and a log that cannot
    // be written.
    let shown = Targets::new()
        .with_default(LevelFilter::WARN)
        .with_targets([("palpate_runtime", LevelFilter::OFF), (LOG_FAILURE, LevelFilter::OFF)])
        // What zenoh says of connections, the link says in its own words.
        .with_target("zenoh", LevelFilter::OFF);
    tracing_subscriber::fmt()
        .with_target(false)
        .without_time()
        .with_ansi(false)
        .with_writer(|| shared::Complaints)
        .finish()
        .with(shown)
        .init();
    let result = match Cli::try_parse() {
        Ok(Cli { command }) => match command {
            None => run::flagship(),
            Some(Command::List) => list::run(),
            Some(Command::Doctor) => doctor::run(),
            Some(Command::Run(args)) => run::run(&args),
            Some(Command::Compare(args)) => compare::run(&args),
            Some(Command::Reduce(args)) => reduce::run(&args),
            Some(Command::Mesh(args)) => mesh::run(&args),
            Some(Command::Timing(args)) => timing::run(&args),
            Some(Command::Export(args)) => export::run(&args),
            Some(Command::Log(args)) => log::run(&args),
            Some(Command::Replay(args)) => replay::run(&args),
            Some(Command::View(args)) => view::run(&args),
            Some(Command::Serve(args)) => link::serve(&args),
            Some(Command::Link(link::LinkArgs { command: link::LinkCommand::Keys(args) })) => link::keys(&args),
            Some(Command::Mock(args)) => mock::run(&args),
            Some(Command::Completions { shell }) => completions(shell),
        },
        Err(error) if error.use_stderr() => Err(usage_error(&error)),
        Err(help) => return print_help(&help),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.kind() == ErrorKind::Interrupted => {
            shared::complain(&error);
            ExitCode::from(shared::EXIT_CODE)
        }
        Err(error) => {
            shared::complain(format_args!("error: {error}"));
            if error.kind().is_input() { ExitCode::from(2) } else { ExitCode::from(1) }
        }
    }
}

fn completions(shell: Shell) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "palpate", &mut script);
    shared::print(&String::from_utf8_lossy(&script))
}

fn print_help(help: &clap::Error) -> ExitCode {
    match shared::print(&help.to_string()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::from(2),
    }
}

/// One line out of clap's several: what was wrong, then where to look.
fn usage_error(error: &clap::Error) -> Error {
    let text = error.to_string();
    let complaint = text.split("\n\nUsage:").next().unwrap_or(&text);
    let complaint = complaint.split("\n\nFor more information").next().unwrap_or(complaint);
    let complaint = complaint.trim_start_matches("error: ");
    let subcommands: Vec<String> = Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let first = std::env::args_os().nth(1).and_then(|word| word.into_string().ok());
    let asked = first.filter(|word| subcommands.contains(word));
    let help = asked.map_or("palpate --help".to_owned(), |word| format!("palpate {word} --help"));
    Error::new(ErrorKind::Usage, format!("{complaint}; see `{help}`"))
}
