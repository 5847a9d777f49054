//! One topic of a log as a table: its rows for any writer, and CSV.

use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::path::Path;

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
/// one chunk of the log. `is_turned` is what [`is_turned`] says: columns of torque and orientation are there only then.
///
/// # Errors
/// [`ErrorKind::Log`] if the log has no such topic, with the topics that it has; [`ErrorKind::Io`] if `out` cannot be written.
pub fn export_table<R: Read, W: Write>(
    reader: &mut LogReader<R>,
    topic: &str,
    is_turned: bool,
    window: &Window,
    out: &mut W,
) -> Result<(), Error> {
    export_rows(reader, topic, is_turned, window, |columns| {
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

/// What is added to a topic with contacts to name the table of the places that touch: a message has several of them.
const POINTS: &str = "/points";

/// Gives every message of `topic` within `window` to the table that `begin` makes for its columns, in the order of the log.
/// The places of contacts are the table `/contact/points`, a row for each.
///
/// `begin` is not called before the topic is known to exist; `is_turned` is what [`is_turned`] says.
///
/// # Errors
/// [`ErrorKind::Log`] if the log has no such topic, with the topics that it has, or if the topic is for viewers only; what
/// `begin` and the table say.
pub fn export_rows<R: Read, T: TableWriter>(
    reader: &mut LogReader<R>,
    topic: &str,
    is_turned: bool,
    window: &Window,
    begin: impl FnOnce(&'static [Column]) -> Result<T, Error>,
) -> Result<(), Error> {
    let with_points = topic.strip_suffix(POINTS).filter(|of| TopicKind::of_topic(of) == Some(TopicKind::Contact));
    let named = topic;
    let topic = with_points.unwrap_or(topic);
    let mut entry = next_of(reader, topic, window);
    let kind = reader.kind(topic).or_else(|| lost_topic(reader, topic)).ok_or_else(|| {
        let topics: Vec<&str> = reader.topics().into_keys().collect();
        unknown(reader, "topic", named, &topics)
    })?;
    if kind == TopicKind::Scene {
        let why = format!("{topic} is for viewers (3D), it makes no table");
        return Err(Error::new(ErrorKind::Log, why).at(reader.place()));
    }
    let columns = if with_points.is_some() { columns::POINT_COLUMNS } else { columns::columns(kind, is_turned) };
    let mut table = begin(columns)?;
    let (mut cells, mut row) = (Vec::new(), Vec::new());
    while let Some(found) = entry {
        match with_points {
            Some(_) => columns::point_cells(&found, &mut cells),
            None => columns::cells(&found, is_turned, &mut cells),
        }
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

/// True if a sample of `topic` in the log at `log` has a torque other than zero, or a tool that is turned: its table has columns
/// for that then. Such a log is read up to that sample, any other one to its end.
///
/// # Errors
/// [`ErrorKind::Io`] if the log cannot be read, [`ErrorKind::Log`] if it is no MCAP file.
pub fn is_turned(log: &Path, topic: &str) -> Result<bool, Error> {
    let may_be =
        matches!(TopicKind::of_topic(topic), Some(TopicKind::Force | TopicKind::ForceCommanded | TopicKind::Tool));
    // A pipe can be read only once.
    if !may_be || !log.is_file() {
        return Ok(false);
    }
    let mut reader = LogReader::open(log)?;
    while let Some(entry) = next_of(&mut reader, topic, &Window::default()) {
        if columns::is_turned(&entry) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The next entry of `topic` in `window`, before the end of the log or its damage.
fn next_of<R: Read>(reader: &mut LogReader<R>, topic: &str, window: &Window) -> Option<LogEntry> {
    loop {
        let entry = reader.next()?.ok()?;
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

/// `text` with its control characters escaped: a row is a line, and a terminal obeys none of them.
fn one_line(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return text.into();
    }
    let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect::<String>().into()
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
            Cell::Text(text) => write!(out, "\"{}\"", one_line(text).replace('"', "\"\""))?,
            Cell::Missing => {}
        }
    }
    out.write_all(b"\n")
}
