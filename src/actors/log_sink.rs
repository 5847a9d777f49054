//! Where a logger puts what it takes.

use crate::error::Error;
use crate::log::{Environment, GroupStats, Level, LogRecord, SceneFrame, TextEvent};
use crate::runtime::Nanos;

/// The receiver of log entries, besides the statistics.
///
/// # Real-time
/// Called by the logger alone: may allocate, block and write files. Records wait in their rings meanwhile.
pub trait LogSink: Send {
    /// Takes one record.
    ///
    /// # Errors
    /// If it cannot be kept. The first error is reported when the run ends; what follows is still offered, because a
    /// sink may have other places to keep it.
    fn record(&mut self, record: &LogRecord) -> Result<(), Error>;

    /// Takes an event in words.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn text(&mut self, event: &TextEvent) -> Result<(), Error>;

    /// Takes the statistics of a group, once per second.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error>;

    /// Takes a picture of the run; without an own implementation, it is dropped.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn scene(&mut self, _: &SceneFrame) -> Result<(), Error> {
        Ok(())
    }

    /// Takes what became known of the run as a whole.
    fn environment(&mut self, environment: &Environment);

    /// Writes what is due at `log_time` and `now` (both since the start of the run).
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error>;

    /// Nothing more was recorded: what follows is told at any rate, and what was lost until now is a gap that is over.
    fn ending(&mut self) {}

    /// Ends the log.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn finish(&mut self) -> Result<(), Error>;

    /// What could not be kept since the last call: a gap that is over, or one that nothing follows any more.
    fn take_loss(&mut self) -> Option<Loss> {
        None
    }
}

/// Records that a sink could not keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    /// How many.
    pub records: u64,
    /// The time of the first, or of the last one before.
    pub from: Nanos,
    /// The time of the last.
    pub to: Nanos,
    /// Why, in words.
    pub why: &'static str,
}

impl Loss {
    /// Both as one.
    pub(super) fn and(self, later: Self) -> Self {
        let (from, to) = (self.from.min(later.from), self.to.max(later.to));
        Self { records: self.records + later.records, from, to, ..later }
    }

    /// As an event of the log.
    pub(super) fn in_words(&self) -> TextEvent {
        let Self { records, from, to, why } = *self;
        let s = |time: Nanos| format!("{:.3}", time.as_secs_f64());
        let message = format!("{records} records lost between {} s and {} s: {why}", s(from), s(to));
        TextEvent { time: to, level: Level::Warning, message }
    }
}
