//! What a reader finds in a log, in the order it was written.

use super::environment::Environment;
use super::event::TextEvent;
use super::records::LogRecord;
use super::stats::GroupStats;

/// One entry of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEntry {
    /// About the run as a whole; a later one replaces an earlier one.
    Environment(Environment),
    /// A file inside the log: [`Environment::SCENE`] or [`Environment::SESSION`].
    Attachment {
        /// Its name.
        name: String,
        /// Its bytes.
        data: Vec<u8>,
    },
    /// A record of a tick, or an event.
    Record(LogRecord),
    /// The state of a rate group, once a second.
    Stats(GroupStats),
    /// An event in words.
    Text(TextEvent),
}
