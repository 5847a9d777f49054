//! One topic of a log as a table: its rows for any writer, and CSV.

use std::io::{self, Read, Write};

use palpate::log::TopicKind;
use palpate::log::{LogEntry, LogReader, Window};
use palpate::{Error, ErrorKind};

use super::columns::{self, Cell, Column};
use super::{output_error, unknown};

/// Writes every message of `topic` within `window` to `out` as comma-separated values with one header line, in the order of the
/// log.
///
/// Nothing is written before the topic is known to exist. A topic that the log declares but never uses gives a table
/// without rows. On a damaged log it writes what is readable; ask [`LogReader::damage`] afterwards. Floats are printed in the
/// shortest form that reads back exactly; durations and times inside `/timing` stay integer nanoseconds. Memory is bounded by
/// one chunk of the log.
///
/// # Errors
/// [`ErrorKind::Log`] if the log has no such topic, with the topics that it has; [`ErrorKind::Io`] if `out` cannot be written.
pub fn export_table<R: Read, W: Write>(
    reader: &mut LogReader<R>,
    topic: &str,
    window: &Window,
    out: &mut W,
) -> Result<(), Error> {
    export_rows(reader, topic, window, |columns| {
        header(columns, out).map_err(output_error)?;
        Ok(CsvTable(&mut *out))
    })?;
    out.flush().map_err(output_error)
}

/// A table in the making, in any format.
pub trait TableWriter {
    /// Adds a row, one cell for each column, and empties `cells`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be written.
    fn row(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error>;

    /// Writes what is left.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be written.
    fn finish(self) -> Result<(), Error>;
}

/// Gives every message of `topic` within `window` to the table that `begin` makes for its columns, in the order of the log.
///
/// `begin` is not called before the topic is known to exist.
///
/// # Errors
/// [`ErrorKind::Log`] if the log has no such topic, with the topics that it has, or if the topic is for viewers only; what
/// `begin` and the table say.
pub(crate) fn export_rows<R: Read, T: TableWriter>(
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

impl<W: Write> TableWriter for CsvTable<W> {
    fn row(&mut self, cells: &mut Vec<Cell>) -> Result<(), Error> {
        write_row(cells, &mut self.0).map_err(output_error)
    }

    fn finish(self) -> Result<(), Error> {
        Ok(())
    }
}

/// Writes the header line.
fn header(columns: &[Column], out: &mut impl Write) -> io::Result<()> {
    for (place, (name, _)) in columns.iter().enumerate() {
        write!(out, "{}{name}", if place == 0 { "" } else { "," })?;
    }
    writeln!(out)
}

/// Writes one row.
fn write_row(cells: &[Cell], out: &mut impl Write) -> io::Result<()> {
    for (place, cell) in cells.iter().enumerate() {
        if place > 0 {
            out.write_all(b",")?;
        }
        match cell {
            Cell::U64(value) => write!(out, "{value}")?,
            Cell::U32(value) => write!(out, "{value}")?,
            Cell::F64(value) => write!(out, "{value}")?,
            Cell::F32(value) => write!(out, "{value}")?,
            Cell::Word(word) => out.write_all(word.as_bytes())?,
            Cell::Text(text) => write!(out, "\"{}\"", text.replace('"', "\"\""))?,
            Cell::Missing => {}
        }
    }
    out.write_all(b"\n")
}
