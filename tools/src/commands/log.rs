//! `palpate log info|check|recover LOG`: what is in a log, whether it is sound, and a new one out of what is readable.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::PathBuf;

use palpate::{Error, ErrorKind};

use super::files::{begin_file, keep_inputs};
use super::log_info::{bytes, count, seconds, span, to_json, to_text};
use super::progress::ReadBar;
use super::shared::{name_of, print, print_report, warn_of_damage};
use crate::log_file::{CheckReport, LogInfo, Lost, Recovered, check, recover};

/// The arguments of `palpate log`.
#[derive(Debug, clap::Args)]
pub struct LogArgs {
    #[command(subcommand)]
    command: LogCommand,
}

#[derive(Debug, clap::Subcommand)]
enum LogCommand {
    /// Say what is in a log: from its index at once, or by reading all of it if it has none
    ///
    /// Exits with 0, also for a damaged log (one warning line); with 2 if the file is no MCAP or cannot be read.
    Info(InfoArgs),
    /// Read all of a log and say everything that is wrong with it
    ///
    /// Every checksum, the order of times, sequence numbers, every message, the books of the rate groups and the index.
    /// Prints a line for each finding and a verdict. Exits with 0 if the log is sound, with 1 if something was found, and with
    /// 2 if the file is no MCAP or cannot be read.
    Check(CheckArgs),
    /// Copy everything readable of a damaged log into a new, complete one
    ///
    /// Behind a damage it goes on with the next chunk whose checksum fits. Messages keep topic, times, sequence number and
    /// bytes; any MCAP can be recovered. Says what was saved and what was lost. Exits with 0 if the new log was written, and
    /// with 2 if the file is no MCAP, cannot be read, or the new one not be written.
    Recover(RecoverArgs),
}

/// The arguments of `palpate log info`.
#[derive(Debug, clap::Args)]
pub struct InfoArgs {
    /// The log
    pub log: PathBuf,
    /// Print one JSON document instead of text
    #[arg(long)]
    pub json: bool,
}

/// The arguments of `palpate log check`.
#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// The log
    pub log: PathBuf,
}

/// The arguments of `palpate log recover`.
#[derive(Debug, clap::Args)]
pub struct RecoverArgs {
    /// The damaged log
    pub log: PathBuf,
    /// The new log; an existing file is overwritten, but not the damaged log itself
    #[arg(long)]
    pub out: PathBuf,
}

/// Runs one of the three.
///
/// # Errors
/// [`ErrorKind::Io`] if a file cannot be read or written, [`ErrorKind::Log`] if the log is no MCAP, [`ErrorKind::Fault`] if
/// a check found something.
pub fn run(args: &LogArgs) -> Result<(), Error> {
    match &args.command {
        LogCommand::Info(args) => info(args),
        LogCommand::Check(args) => run_check(args),
        LogCommand::Recover(args) => run_recover(args),
    }
}

fn info(args: &InfoArgs) -> Result<(), Error> {
    let place = name_of(&args.log);
    let bar = ReadBar::new(&place);
    let info = LogInfo::open(&args.log, |read, length| bar.show(read, length));
    bar.clear();
    let info = info?;
    warn_of_damage(&place, info.damage.first().map(String::as_str));
    print_report(args.json, || to_json(&info), || to_text(&info, &place))
}

fn run_check(args: &CheckArgs) -> Result<(), Error> {
    let place = name_of(&args.log);
    let source = BufReader::with_capacity(1 << 18, File::open(&args.log).map_err(|e| Error::io(&args.log, e))?);
    let bar = ReadBar::new(&place);
    let report = check(source, &place, |read, length| bar.show(read, length));
    bar.clear();
    let report = report?;
    print(&findings(&report, &place))?;
    if report.is_sound() {
        return Ok(());
    }
    Err(Error::new(ErrorKind::Fault, count(report.count, "finding", "findings")).at(place))
}

/// A line for each finding, then the verdict.
fn findings(report: &CheckReport, place: &str) -> String {
    let mut text: String = report.findings.iter().map(|finding| format!("{place}: {finding}\n")).collect();
    let of_all =
        if report.is_checksummed { "one of all data that fits" } else { "none of all data that could be verified" };
    let checksums = format!("{} of {} chunks with a checksum, {of_all}", report.checksummed_chunks, report.chunks);
    let read = format!(
        "{} ({} of palpate's, decoded) {}; {checksums}",
        count(report.messages, "message", "messages"),
        report.decoded,
        span(report.span)
    );
    text += &match report.is_sound() {
        true => format!("SOUND: {place}: {read}\n"),
        false => format!("NOT SOUND: {place}: {}; {read}\n", count(report.count, "finding", "findings")),
    };
    text
}

fn run_recover(args: &RecoverArgs) -> Result<(), Error> {
    let (place, new_place) = (name_of(&args.log), name_of(&args.out));
    let source = File::open(&args.log).map_err(|e| Error::io(&args.log, e))?;
    keep_inputs(&[&args.log], &args.out)?;
    // Before a pipe is opened.
    palpate::log::LogReader::open(&args.log)?;
    let output = begin_file(&args.out, &[&args.log])?;
    let bar = ReadBar::new(&place);
    let (source, written) = (BufReader::with_capacity(1 << 18, source), BufWriter::with_capacity(1 << 18, &output));
    let recovered = recover(source, &place, written, &new_place, |read, length| bar.show(read, length));
    bar.clear();
    let (recovered, _) = recovered?;
    output.finish()?;
    print(&saved(&recovered, &place, &new_place))
}

/// What was saved and what was lost.
fn saved(recovered: &Recovered, place: &str, new_place: &str) -> String {
    let Recovered { messages, chunks, attachments, metadata, .. } = recovered;
    let mut text = format!(
        "saved: {} {} in {}, {}, {}: {new_place}\n",
        count(*messages, "message", "messages"),
        span(recovered.span),
        count(*chunks, "chunk", "chunks"),
        count(*attachments, "attachment", "attachments"),
        count(*metadata, "metadata record", "metadata records"),
    );
    recovered.lost.iter().for_each(|one| text += &format!("{}\n", lost(one)));
    if recovered.without_channel > 0 {
        let messages = count(recovered.without_channel, "message", "messages");
        text += &format!("lost: {messages} whose channel is not known any more\n");
    }
    if let Some(missing) = recovered.counted.and_then(|counted| counted.checked_sub(*messages)).filter(|&n| n > 0) {
        text += &format!("lost: {} by the count of the index\n", count(missing, "message", "messages"));
    }
    if recovered.lost.is_empty() && recovered.without_channel == 0 {
        text += &format!("lost: nothing, {place} was whole\n");
    } else {
        text += &format!("lost in all: {} of {}\n", bytes(recovered.lost_bytes()), bytes(recovered.bytes));
    }
    text
}

fn lost(lost: &Lost) -> String {
    let Lost { damage, after, before, saved } = lost;
    let time = match (after, before) {
        (Some(after), Some(before)) => format!("{} s of log time", seconds(before.saturating_sub(*after))),
        (Some(_), None) => "what came after the last message saved".to_owned(),
        (None, Some(_)) => "what came before the first message saved".to_owned(),
        (None, None) => "all messages".to_owned(),
    };
    let size = damage.to - damage.from;
    match saved {
        0 => format!("lost: {time}, {} from byte {} on: {}", bytes(size), damage.from, damage.what),
        _ => format!("lost: {time}: {}; {saved} messages of its last chunk were saved", damage.what),
    }
}
