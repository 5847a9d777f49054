//! `palpate export LOG`: a log in the formats of other programs.

use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use palpate::log::{LogReader, Window};
use palpate::{Error, ErrorKind};

use super::files::begin_file;
use super::progress::ReadBar;
use super::shared::{WindowArgs, forgive_closed_pipe, warn_of_damage};
use crate::export::{TickDuration, export_percentiles, export_table, export_trace, is_turned};

/// The formats of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ExportFormat {
    /// One topic as comma-separated values
    Csv,
    /// One topic as an Apache Parquet table
    Parquet,
    /// One figure of a rate group as HdrHistogram's percentile text
    Hgrm,
    /// All rate groups on a timeline, for Perfetto
    ChromeTrace,
}

/// The arguments of `palpate export`.
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    /// The log to read.
    pub log: PathBuf,
    /// The topic to write as a table, such as /force or /timing/local; /contact/points are the places that touch.
    #[arg(long)]
    pub topic: Option<String>,
    /// The format.
    #[arg(long, value_enum, default_value_t = ExportFormat::Csv)]
    pub format: ExportFormat,
    /// For hgrm: the rate group, such as local.
    #[arg(long)]
    pub group: Option<String>,
    /// For hgrm: the figure.
    #[arg(long, value_enum)]
    pub figure: Option<TickDuration>,
    #[command(flatten)]
    pub window: WindowArgs,
    /// The file to write; standard output if left out.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// What is to be written, with everything that it needs.
enum What<'a> {
    /// A topic, and whether it has columns of torque or orientation.
    Table(&'a str, bool),
    Percentiles(&'a str, TickDuration),
    Trace,
}

/// Writes a log, or a part of it, in another format. A damaged log is written up to the damage, with one warning.
///
/// # Errors
/// [`ErrorKind::Usage`] if an option is missing or does not belong to the format, [`ErrorKind::Io`] if a file cannot be
/// read or written, [`ErrorKind::Log`] if the log is no MCAP or has not what was asked for.
pub fn run(args: &ExportArgs) -> Result<(), Error> {
    let (what, window) = (what(args)?, args.window.window()?);
    // On standard output the table itself shows how far it is.
    let (bar, mut reader) = ReadBar::open("exporting", &args.log, args.out.is_none())?;
    let result = match &args.out {
        Some(path) => write_file(&what, &mut reader, &window, &args.log, path),
        None => write_standard_output(&what, &mut reader, &window),
    };
    bar.clear();
    result?;
    warn_of_damage(reader.place(), reader.damage());
    Ok(())
}

fn write_file<R: Read>(
    what: &What<'_>,
    reader: &mut LogReader<R>,
    window: &Window,
    log: &Path,
    path: &Path,
) -> Result<(), Error> {
    let output = begin_file(path, &[log])?;
    write(what, reader, window, &mut BufWriter::new(&output)).map_err(|e| match e.kind() {
        ErrorKind::Io => e.at(path.display().to_string()),
        _ => e,
    })?;
    output.finish()
}

fn write_standard_output<R: Read>(what: &What<'_>, reader: &mut LogReader<R>, window: &Window) -> Result<(), Error> {
    let mut out = BufWriter::new(io::stdout());
    forgive_closed_pipe(write(what, reader, window, &mut out))?;
    // What is left in the buffer has no reader any more, and dropping it would try once again.
    drop(out.into_parts());
    Ok(())
}

fn write<R: Read, W: Write>(
    what: &What<'_>,
    reader: &mut LogReader<R>,
    window: &Window,
    out: &mut W,
) -> Result<(), Error> {
    match *what {
        What::Table(topic, is_turned) => export_table(reader, topic, is_turned, window, out),
        What::Percentiles(group, figure) => export_percentiles(reader, group, figure, window, out),
        What::Trace => export_trace(reader, window, out),
    }
}

/// What the options ask for together.
fn what(args: &ExportArgs) -> Result<What<'_>, Error> {
    let topic = || args.topic.as_deref().ok_or_else(|| usage("name the topic with --topic, such as --topic /force"));
    let (needs_topic, needs_figure, name) = match args.format {
        ExportFormat::Csv => (true, false, "csv"),
        ExportFormat::Parquet => (true, false, "parquet"),
        ExportFormat::Hgrm => (false, true, "hgrm"),
        ExportFormat::ChromeTrace => (false, false, "chrome-trace"),
    };
    let given = [
        ("--topic", args.topic.is_some(), needs_topic, "csv or parquet"),
        ("--group", args.group.is_some(), needs_figure, "hgrm"),
        ("--figure", args.figure.is_some(), needs_figure, "hgrm"),
    ];
    if let Some((option, _, _, fits)) = given.into_iter().find(|(_, given, needed, _)| *given && !needed) {
        return Err(usage(&format!("{option} belongs to --format {fits}, not to {name}: leave one of them out")));
    }
    match args.format {
        ExportFormat::Csv => {
            let topic = topic()?;
            Ok(What::Table(topic, is_turned(&args.log, topic)?))
        }
        ExportFormat::Parquet => {
            let topic = topic()?;
            let message = format!(
                "Parquet has a program of its own: `palpate-parquet LOG --topic {topic} --out FILE`, or export CSV"
            );
            Err(Error::new(ErrorKind::Usage, message))
        }
        ExportFormat::Hgrm => match (&args.group, args.figure) {
            (Some(group), Some(figure)) => Ok(What::Percentiles(group, figure)),
            _ => Err(usage("hgrm needs a rate group and a figure: add --group local --figure lateness")),
        },
        ExportFormat::ChromeTrace => Ok(What::Trace),
    }
}

fn usage(message: &str) -> Error {
    Error::new(ErrorKind::Usage, format!("{message}; see `palpate export --help`"))
}
