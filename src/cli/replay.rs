//! `palpate replay LOG`: is a recorded run what its inputs make of it, bit for bit?

use std::path::PathBuf;

use palpate::session::{Compared, Difference, ReplayReport, Session};
use palpate::{Error, ErrorKind};
use serde_json::{Value, json};

use super::{output, progress};

/// The arguments of `palpate replay`.
#[derive(Debug, clap::Args)]
pub struct ReplayArgs {
    /// The log to replay.
    pub log: PathBuf,
    /// Print one JSON document instead of the report.
    #[arg(long)]
    pub json: bool,
}

/// Replays a log and prints how many of its forces are bit-identical.
///
/// # Errors
/// [`ErrorKind::Io`] if the log cannot be read, [`ErrorKind::Log`] if it does not hold all that a replay needs,
/// [`ErrorKind::Fault`] if a force is not identical.
pub fn run(args: &ReplayArgs) -> Result<(), Error> {
    let name = args.log.display().to_string();
    let preparing = progress::preparing(&name);
    let replay = Session::replay(&args.log);
    preparing.finish_and_clear();
    let replay = replay?;
    let bar = progress::RunBar::new(&name, replay.end());
    let report = replay.run_with(|elapsed| bar.show(elapsed));
    bar.clear();
    let report = report?;
    let text = if args.json { format!("{}\n", to_json(&report)) } else { report.to_string() };
    output::print(&text)?;
    if report.is_identical() {
        return Ok(());
    }
    let message = "the replay is not identical to the log, see the report";
    Err(Error::new(ErrorKind::Fault, message).at(name))
}

fn to_json(report: &ReplayReport) -> Value {
    json!({
        "identical": report.is_identical(),
        "force": compared(&report.force),
        "force_commanded": compared(&report.commanded),
        "first_difference": report.first_difference.as_ref().map(difference),
        "logged_fault": report.logged_fault.as_ref().map(|(time, what)| json!({
            "t_s": time.as_secs_f64(),
            "what": what,
        })),
        "fault": report.fault.as_ref().map(ToString::to_string),
    })
}

fn compared(compared: &Compared) -> Value {
    json!({ "logged": compared.logged, "computed": compared.computed, "identical": compared.identical })
}

fn difference(difference: &Difference) -> Value {
    json!({
        "t_s": difference.time.as_secs_f64(),
        "topic": difference.topic,
        "what": difference.what,
        "logged": difference.logged,
        "computed": difference.computed,
    })
}
