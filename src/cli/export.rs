//! `palpate export LOG --topic TOPIC`: one topic of a log as a table.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use palpate::log::LogReader;
use palpate::report::{Format, export};
use palpate::{Error, ErrorKind};

use super::output::{forgive_closed_pipe, refuse_to_overwrite, warn_of_damage};

/// The arguments of `palpate export`.
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    /// The log to read.
    pub log: PathBuf,
    /// The topic to write, such as /force or /timing/local.
    #[arg(long)]
    pub topic: String,
    /// The format of the table.
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    pub format: Format,
    /// The file to write; standard output if left out.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Writes one topic of a log. A damaged log is written up to the damage, with one warning.
///
/// # Errors
/// [`ErrorKind::Io`] if a file cannot be read or written,
/// [`ErrorKind::Log`] if the log is no MCAP or has no such topic.
pub fn run(args: &ExportArgs) -> Result<(), Error> {
    let mut reader = LogReader::open(&args.log)?;
    match &args.out {
        Some(path) => {
            refuse_to_overwrite(&args.log, path)?;
            let mut out = BufWriter::new(LazyFile { path: path.clone(), file: None });
            export(&mut reader, &args.topic, args.format, &mut out).map_err(|e| match e.kind() {
                ErrorKind::Io => e.at(path.display().to_string()),
                _ => e,
            })?;
        }
        None => {
            let mut out = BufWriter::new(io::stdout().lock());
            forgive_closed_pipe(export(&mut reader, &args.topic, args.format, &mut out))?;
            // What is left in the buffer has no reader any more, and dropping it would try once again.
            drop(out.into_parts());
        }
    }
    warn_of_damage(reader.place(), reader.damage());
    Ok(())
}

/// A file that is created by its first byte, so that a bad topic leaves none behind.
struct LazyFile {
    path: PathBuf,
    file: Option<File>,
}

impl Write for LazyFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(File::create(&self.path)?),
        };
        file.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), File::flush)
    }
}
