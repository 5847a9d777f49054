//! One topic of a log as a table.

use std::io::{Read, Write};
use std::path::Path;

use super::csv;
use crate::error::{Error, ErrorKind};
use crate::log::topic::Kind;
use crate::log::{LogEntry, LogReader};

/// The formats of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Format {
    /// Comma-separated values with one header line; floats read back exactly.
    #[default]
    Csv,
}

/// Writes every message of `topic` to `out`, in the order of the log.
///
/// Nothing is written before the topic is known to exist. A topic that the log declares but never uses gives the header
/// alone. On a damaged log it writes what is readable; ask [`LogReader::damage`] afterwards.
///
/// # Errors
/// [`ErrorKind::Log`] if the log has no such topic, with the topics that it has; [`ErrorKind::Io`] if `out` cannot be
/// written.
pub fn export<R: Read, W: Write>(
    reader: &mut LogReader<R>,
    topic: &str,
    format: Format,
    out: &mut W,
) -> Result<(), Error> {
    let Format::Csv = format;
    let output = |e| Error::io(Path::new("output"), e);
    let mut header = None;
    while let Some(entry) = reader.next() {
        if reader.topic() != topic || matches!(entry, LogEntry::Environment(_) | LogEntry::Attachment { .. }) {
            continue;
        }
        if header.is_none() {
            header = reader.kind(topic);
            out.write_all(header.map_or("", csv::header).as_bytes()).map_err(output)?;
        }
        csv::row(&entry, out).map_err(output)?;
    }
    if header.is_none() {
        let kind = reader.kind(topic).or_else(|| lost_topic(reader, topic)).ok_or_else(|| unknown(reader, topic))?;
        if kind == Kind::Scene {
            let why = format!("{topic} is for viewers (3D), it makes no table");
            return Err(Error::new(ErrorKind::Log, why).at(reader.place()));
        }
        out.write_all(csv::header(kind).as_bytes()).map_err(output)?;
    }
    out.flush().map_err(output)
}

/// A log that is cut before its first message may have lost what declares its topics.
fn lost_topic<R: Read>(reader: &LogReader<R>, topic: &str) -> Option<Kind> {
    let is_empty = reader.topics().values().all(|&messages| messages == 0);
    (reader.damage().is_some() && is_empty).then(|| Kind::of_topic(topic)).flatten()
}

fn unknown<R: Read>(reader: &LogReader<R>, topic: &str) -> Error {
    let topics = reader.topics();
    let known = if topics.is_empty() {
        "it has none".to_owned()
    } else {
        format!("it has {}", topics.keys().copied().collect::<Vec<_>>().join(", "))
    };
    Error::new(ErrorKind::Log, format!("the log has no topic {topic:?}; {known}")).at(reader.place())
}
