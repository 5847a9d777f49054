//! `palpate timing LOG`: who was late, why, and what it did to the force.

use std::path::PathBuf;

use palpate::Error;
use palpate::log::LogReader;
use palpate::log::timing::{Selection, TimingAnalysis};
use palpate::report::{timing_to_json, timing_to_text};

use super::output::{print, warn_of_damage};

/// The arguments of `palpate timing`.
#[derive(Debug, clap::Args)]
pub struct TimingArgs {
    /// The log to analyse.
    pub log: PathBuf,
    /// Print one JSON document instead of the report.
    #[arg(long)]
    pub json: bool,
}

/// Analyses a log and prints the report. A damaged log is analysed up to the damage, with one warning.
///
/// # Errors
/// [`ErrorKind::Io`](palpate::ErrorKind::Io) if the log cannot be read, [`ErrorKind::Log`](palpate::ErrorKind::Log) if it
/// is no MCAP.
pub fn run(args: &TimingArgs) -> Result<(), Error> {
    let mut reader = LogReader::open(&args.log)?;
    let mut analysis = TimingAnalysis::new(Selection::default());
    reader.by_ref().for_each(|entry| analysis.push_entry(&entry));
    let mut report = analysis.report();
    report.run.damage = reader.damage().map(str::to_owned);
    report.run.messages = reader.topics().into_iter().map(|(topic, count)| (topic.to_owned(), count)).collect();
    warn_of_damage(reader.place(), reader.damage());
    if args.json { print(&format!("{}\n", timing_to_json(&report))) } else { print(&timing_to_text(&report)) }
}
