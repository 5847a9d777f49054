//! `palpate timing LOG`: who was late, why, and what it did to the force.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use palpate::{Error, ErrorKind};

use super::files::{begin, write_page};
use super::progress::ReadBar;
use super::shared::{WindowArgs, name_of, print_report, warn_of_damage};
use crate::timing::{
    Against, Condition, Selection, TimingAnalysis, TimingReport, against_to_json, against_to_text, figure_to_text,
    read_cyclictest, timing_html, timing_to_json, timing_to_text,
};

/// The arguments of `palpate timing`.
#[derive(Debug, clap::Args)]
pub struct TimingArgs {
    /// The log to analyse: MCAP, of any program that writes tick timing, or what `cyclictest --json` wrote
    pub log: PathBuf,
    /// Print one JSON document instead of the report
    #[arg(long)]
    pub json: bool,
    /// Write a page with charts and a timeline around the worst ticks to this file
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Hold the log against this one: figures side by side, ratios and how sure they are
    #[arg(long, value_name = "OTHER")]
    pub against: Option<PathBuf>,
    /// With --against: hold the group THIS of the log against the group OTHER of the other one; may be given several times
    #[arg(long = "match", value_name = "THIS=OTHER", value_parser = pair, requires = "against")]
    pub matches: Vec<(String, String)>,
    /// Exit with 1 if the condition holds, such as 'local.lateness.p99 > 200us'; may be given several times
    #[arg(long, value_name = "CONDITION")]
    pub fail_if: Vec<Condition>,
    #[command(flatten)]
    pub window: WindowArgs,
    /// Look at this rate group alone; may be given several times
    #[arg(long, value_name = "NAME")]
    pub group: Vec<String>,
}

/// Analyses a log and prints the report. A damaged log is analysed up to the damage, with one warning.
///
/// # Errors
/// [`ErrorKind::Io`] if a log cannot be read, [`ErrorKind::Log`] if it is none, [`ErrorKind::Usage`] if it has no such group
/// or figure, [`ErrorKind::Condition`] if a condition holds.
pub fn run(args: &TimingArgs) -> Result<(), Error> {
    let inputs: Vec<&Path> =
        [Some(&args.log), args.against.as_ref()].into_iter().flatten().map(AsRef::as_ref).collect();
    let page = begin(args.html.as_deref(), &inputs)?;
    let report = read(&args.log, args, &args.group)?;
    let name = args.log.file_name().unwrap_or_default().to_string_lossy();
    write_page(page, || timing_html(&report, &name))?;
    match &args.against {
        Some(other_log) => {
            let other = matched(other_log, args)?;
            let against = Against::of(&report, &other);
            let [this_name, other_name] = [&args.log, other_log].map(|log| name_of(log));
            let json = || against_to_json(&against, &report, (&other_name, &other));
            print_report(args.json, json, || against_to_text(&against, [(&this_name, &report), (&other_name, &other)]))
        }
        None => print_report(args.json, || timing_to_json(&report), || timing_to_text(&report)),
    }?;
    check(args, &report)
}

/// Reads a log as far as it can be read.
fn read(log: &Path, args: &TimingArgs, groups: &[String]) -> Result<TimingReport, Error> {
    let selection = Selection { window: args.window.window()?, groups: groups.to_vec() };
    let wanted: Vec<&str> = groups.iter().map(String::as_str).collect();
    if let Some(text) = other_than_mcap(log)? {
        let report = read_cyclictest(&text, log, selection)?;
        check_groups(&report, log, &wanted)?;
        return Ok(report);
    }
    let mut analysis = TimingAnalysis::new(selection);
    let (bar, mut reader) = ReadBar::open("reading", log, false)?;
    reader.readable().for_each(|entry| analysis.push_entry(&entry));
    bar.clear();
    let mut report = analysis.report();
    report.run.damage = reader.damage().map(str::to_owned);
    report.run.messages = reader.topics().into_iter().map(|(topic, count)| (topic.to_owned(), count)).collect();
    warn_of_damage(reader.place(), reader.damage());
    check_groups(&report, log, &wanted)?;
    Ok(report)
}

/// Refuses a name that no group of the log has.
fn check_groups(report: &TimingReport, log: &Path, names: &[&str]) -> Result<(), Error> {
    let unknown = names.iter().find(|name| !report.groups.iter().any(|group| group.name == **name));
    match unknown {
        None => Ok(()),
        Some(unknown) => {
            let message = format!("has no rate group `{unknown}`; `palpate timing {}` lists its groups", log.display());
            Err(Error::new(ErrorKind::Usage, message).at(log.display().to_string()))
        }
    }
}

/// The other log with the names that its groups are to be compared by.
fn matched(log: &Path, args: &TimingArgs) -> Result<TimingReport, Error> {
    let own_name = |group: &String| {
        let found = args.matches.iter().find(|(this, _)| this == group);
        found.map_or_else(|| group.clone(), |(_, other)| other.clone())
    };
    let mut other = read(log, args, &args.group.iter().map(own_name).collect::<Vec<_>>())?;
    let names: Vec<&str> = args.matches.iter().map(|(_, name)| name.as_str()).collect();
    check_groups(&other, log, &names)?;
    let renamed: Vec<(String, String)> = args.matches.iter().map(|(this, name)| (name.clone(), this.clone())).collect();
    other.rename_groups(&renamed);
    Ok(other)
}

/// `THIS=OTHER` on the command line.
fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((this, other)) if !this.is_empty() && !other.is_empty() => Ok((this.to_owned(), other.to_owned())),
        _ => Err("write it as THIS=OTHER, such as local=thread0".to_owned()),
    }
}

/// The text of a file that is JSON and not MCAP.
fn other_than_mcap(log: &Path) -> Result<Option<String>, Error> {
    let failed = |error| Error::io(log, error);
    let mut first = [0; 1];
    let mut file = File::open(log).map_err(failed)?;
    let is_json = file.read(&mut first).map_err(failed)? == 1 && first == *b"{";
    Ok(if is_json { Some(std::fs::read_to_string(log).map_err(failed)?) } else { None })
}

/// Every condition that holds, in one line.
fn check(args: &TimingArgs, report: &TimingReport) -> Result<(), Error> {
    let figures = report.figures();
    let mut broken = Vec::new();
    for condition in &args.fail_if {
        if let Some(figure) = condition.broken_by(&figures)? {
            broken.push(format!("{} is {} (`{condition}`)", figure.name, figure_to_text(figure)));
        }
    }
    match broken.is_empty() {
        true => Ok(()),
        false => Err(Error::new(ErrorKind::Condition, broken.join("; ")).at(args.log.display().to_string())),
    }
}
