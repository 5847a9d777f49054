//! The part of a log that is asked for.

use super::entry::LogEntry;
use crate::runtime::Nanos;

/// A span of log time, counted from the start of the run. Two windows that meet share no record.
///
/// ```
/// use palpate::log::Window;
/// use palpate::time::Nanos;
///
/// let window = Window { from: Nanos(10), to: Nanos(20) };
/// assert!(window.contains(Nanos(10)) && !window.contains(Nanos(20)));
/// assert!(Window::default().contains(Nanos(u64::MAX)), "the default is all of a log");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Where it begins; this moment belongs to it.
    pub from: Nanos,
    /// Where it ends; this moment does not belong to it, except that `Nanos(u64::MAX)` is no end at all.
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

    /// The same for an entry of a log; what has no time is about all of the run and never belongs to a part.
    pub fn contains_entry(&self, entry: &LogEntry) -> bool {
        match entry {
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => false,
            LogEntry::Record(record) => self.contains(record.time()),
            LogEntry::Stats(stats) => self.contains(stats.time),
            LogEntry::Text(event) => self.contains(event.time),
        }
    }
}
