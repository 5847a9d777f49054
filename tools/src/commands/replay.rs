//! `palpate replay LOG`: is a recorded run what its inputs make of it, bit for bit?

use std::collections::BTreeMap;
use std::path::PathBuf;

use palpate::session::{Compared, Difference, ReplayReport, Session};
use palpate::{Error, ErrorKind};
use serde_json::{Value, json};

use super::{progress, shared};

/// The arguments of `palpate replay`.
#[derive(Debug, clap::Args)]
pub struct ReplayArgs {
    /// The log to replay.
    pub log: PathBuf,
    /// Print one JSON document instead of the report.
    #[arg(long)]
    pub json: bool,
}

/// Replays a log and prints how many of its samples are bit-identical.
///
/// # Errors
/// [`ErrorKind::Io`] if the log cannot be read, [`ErrorKind::Log`] if it does not hold all that a replay needs or nothing
/// could be compared, [`ErrorKind::Fault`] if a sample is not identical.
pub fn run(args: &ReplayArgs) -> Result<(), Error> {
    let name = shared::name_of(&args.log);
    let preparing = progress::preparing(&name);
    let replay = Session::replay(&args.log);
    preparing.finish_and_clear();
    let replay = replay?;
    let bar = progress::RunBar::new(&name, replay.end());
    let report = replay.run_with(|elapsed| bar.show(elapsed));
    bar.clear();
    let report = report?;
    shared::print_report(args.json, || to_json(&report), || report.to_string())?;
    if report.is_identical() {
        return Ok(());
    }
    if report.topics().all(|topic| topic.logged == 0 && topic.computed == 0) && report.fault.is_none() {
        let t = report.compared_up_to().as_secs_f64();
        let message = format!("there is nothing to compare before the fault at t = {t} s");
        return Err(Error::new(ErrorKind::Log, message).at(name));
    }
    let message = "the replay is not identical to the log, see the report";
    Err(Error::new(ErrorKind::Fault, message).at(name))
}

fn to_json(report: &ReplayReport) -> Value {
    json!({
        "identical": report.is_identical(),
        "force": compared(&report.force),
        "force_commanded": compared(&report.commanded),
        "others": report.others.iter().map(|other| (other.topic.trim_start_matches('/'), compared(other)))
            .collect::<BTreeMap<_, _>>(),
        "compared_up_to_s": report.compared_up_to().as_secs_f64(),
        "end_s": report.end.as_secs_f64(),
        "first_difference": report.first_difference.as_ref().map(difference),
        "logged_fault": report.logged_fault.as_ref().map(|fault| json!({
            "t_s": fault.time.as_secs_f64(),
            "what": fault.what,
            "restarted": fault.restarted,
        })),
        "not_repeated": report.unrepeated.iter().flat_map(|left| &left.releases).map(|left| json!({
            "group": left.group,
            "tick": left.tick,
            "t_s": left.time.as_secs_f64(),
        })).collect::<Vec<_>>(),
        "fault": report.fault.as_ref().map(ToString::to_string),
    })
}

fn compared(compared: &Compared) -> Value {
    json!({
        "logged": compared.logged,
        "computed": compared.computed,
        "identical": compared.identical,
        "left_out": compared.left_out,
    })
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
