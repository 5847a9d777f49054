//! What a reader finds in a log, in the order it was written, and the part of it that is asked for.

use super::records::{Environment, LogRecord, SceneFrame, TextEvent};
use super::stats::GroupStats;
use crate::runtime::Nanos;

/// One entry of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEntry {
    /// About the run as a whole; a later one replaces an earlier one.
    Environment(Environment),
    /// A file inside the log: [`Environment::SCENE`] or [`Environment::SESSION`].
    Attachment {
        /// The name of the file.
        name: String,
        /// The bytes of the file.
        data: Vec<u8>,
    },
    /// A record of a tick, or an event.
    Record(LogRecord),
    /// The state of a rate group, once a second.
    Stats(GroupStats),
    /// An event in words.
    Text(TextEvent),
    /// A picture of the topic `/scene`, if [asked for](super::LogReader::with_scene): its surface. Tools and forces are in the
    /// records.
    Scene(SceneFrame),
}

/// A span of log time, counted from the start of the run. Two windows that meet share no record.
///
/// ```
/// use palpate::log::Window;
/// use palpate::runtime::Nanos;
///
/// let window = Window { from: Nanos(10), to: Nanos(20) };
/// assert!(window.contains(Nanos(10)) && !window.contains(Nanos(20)));
/// assert!(Window::default().contains(Nanos(u64::MAX)), "the default is all of a log");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The beginning; this moment belongs to the window.
    pub from: Nanos,
    /// The end; this moment does not belong to the window, except that `Nanos(u64::MAX)` is no end at all.
    pub to: Nanos,
}

impl Default for Window {
    /// All of a log.
    fn default() -> Self {
        Self { from: Nanos::ZERO, to: Nanos(u64::MAX) }
    }
}

impl Window {
    /// True if what has this time belongs to it.
    pub fn contains(&self, time: Nanos) -> bool {
        self.from <= time && (time < self.to || self.to.0 == u64::MAX)
    }

    /// True if an entry of a log belongs to it; what has no time is about all of the run and never belongs to a part.
    pub fn contains_entry(&self, entry: &LogEntry) -> bool {
        match entry {
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => false,
            LogEntry::Record(record) => self.contains(record.time()),
            LogEntry::Stats(stats) => self.contains(stats.time),
            LogEntry::Text(event) => self.contains(event.time),
            LogEntry::Scene(frame) => self.contains(frame.time),
        }
    }
}
