//! One topic of a log as a table.

use std::io::{self, Read, Write};

use super::columns::{self, Cell, Column};
use super::{csv, output_error, unknown};
use palpate::{Error, ErrorKind};
use palpate::log::TopicKind;
use palpate::log::{LogEntry, LogReader, Window};

/// The formats of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Comma-separated values with one header line; floats read back exactly.
    #[default]
    Csv,
    /// Apache Parquet: typed columns with the names of the CSV.
    Parquet,
}

/// Writes every message of `topic` to `out`, in the order of the log.
///
/// # Errors
/// As [`export_table`].
pub fn export<R: Read, W: Write + Send>(
    reader: &mut LogReader<R>,
    topic: &str,
    format: Format,
    out: &mut W,
) -> Result<(), Error> {
    export_table(reader, topic, format, &Window::default(), out)
}

/// Writes every message of `topic` within `window` to `out`, in the order of the log.
///
/// Nothing is written before the topic is known to exist. A topic that the log declares but never uses gives a table
/// without rows. On a damaged log it writes what is readable; ask [`LogReader::damage`] afterwards. Memory is bounded: by
/// one chunk of the log, and for Parquet by one row group.
///
/// # Errors
/// [`ErrorKind::Log`](palpate::ErrorKind::Log) if the log has no such topic, with the topics that it has;
/// [`ErrorKind::Io`](palpate::ErrorKind::Io) if `out` cannot be written; [`ErrorKind::Usage`](palpate::ErrorKind::Usage) if
/// this build has not the format.
pub fn export_table<R: Read, W: Write + Send>(
    reader: &mut LogReader<R>,
    topic: &str,
    format: Format,
    window: &Window,
    out: &mut W,
) -> Result<(), Error> {
    match format {
        Format::Csv => write_table(reader, topic, window, |columns| CsvTable::new(columns, &mut *out))?,
        Format::Parquet => {
            write_table(reader, topic, window, |columns| super::parquet::ParquetTable::new(columns, &mut *out))?;
        }
    }
    out.flush().map_err(output_error)
}

/// A table in the making.
pub(super) trait Table {
    /// Adds a row, one cell for each column.
    fn row(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error>;

    /// Writes what is left.
    fn finish(self) -> Result<(), Error>;
}

fn write_table<R: Read, T: Table>(
    reader: &mut LogReader<R>,
    topic: &str,
    window: &Window,
    begin: impl FnOnce(&'static [Column]) -> Result<T, Error>,
) -> Result<(), Error> {
    let mut entry = next_of(reader, topic, window);
    let kind = reader.kind(topic).or_else(|| lost_topic(reader, topic)).ok_or_else(|| {
        let topics: Vec<&str> = reader.topics().into_keys().collect();
        unknown(reader, "topic", topic, &topics)
    })?;
    if kind == TopicKind::Scene {
        let why = format!("{topic} is for viewers (3D), it makes no table");
        return Err(Error::new(ErrorKind::Log, why).at(reader.place()));
    }
    let columns = columns::columns(kind);
    let mut table = begin(columns)?;
    let (mut cells, mut row) = (Vec::new(), Vec::new());
    while let Some(found) = entry {
        columns::cells(&found, &mut cells);
        let mut left = cells.drain(..).peekable();
        while left.peek().is_some() {
            row.clear();
            row.extend(left.by_ref().take(columns.len()));
            table.row(&mut row)?;
        }
        entry = next_of(reader, topic, window);
    }
    table.finish()
}

/// The next entry of `topic` in `window`.
fn next_of<R: Read>(reader: &mut LogReader<R>, topic: &str, window: &Window) -> Option<LogEntry> {
    loop {
        let entry = reader.next()?;
        if reader.topic() == topic && window.contains_entry(&entry) {
            return Some(entry);
        }
    }
}

/// A log that is cut before its first message may have lost what declares its topics.
pub(super) fn lost_topic<R: Read>(reader: &LogReader<R>, topic: &str) -> Option<TopicKind> {
    let is_empty = reader.topics().values().all(|&messages| messages == 0);
    (reader.damage().is_some() && is_empty).then(|| TopicKind::of_topic(topic)).flatten()
}

struct CsvTable<W>(W);

impl<W: Write> CsvTable<W> {
    fn new(columns: &[Column], mut out: W) -> Result<Self, Error> {
        csv::header(columns, &mut out).map_err(output_error)?;
        Ok(Self(out))
    }
}

impl<W: Write> Table for CsvTable<W> {
    fn row(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error> {
        let written: io::Result<()> = csv::row(cells, &mut self.0);
        written.map_err(output_error)
    }

    fn finish(self) -> Result<(), Error> {
        Ok(())
    }
}
