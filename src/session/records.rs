//! Records for a program that shows them while the session runs.
//!
//! They come from the logger, which drains them off the ticks: 20 times a second and a tenth of a second late, in the order of
//! time, as the log has them. A program that does not take them loses the newest; the logger never waits for it.

use crossbeam_channel::{Receiver, Sender, bounded};

use crate::log::{Environment, LogRecord};

/// Records that wait for a program: some three seconds of one device at 1 kHz, and a few megabytes.
const WAITING: usize = 1 << 14;

/// What is known of the run as a whole comes twice: at the start, and when the system has granted its rights.
const ENVIRONMENTS: usize = 2;

/// The logger's end.
#[derive(Debug)]
pub(super) struct RecordSender {
    records: Sender<LogRecord>,
    environments: Sender<Environment>,
}

impl RecordSender {
    /// Both ends.
    pub(super) fn new() -> (Self, SharedRecords) {
        let (records, newest) = bounded(WAITING);
        let (environments, known) = bounded(ENVIRONMENTS);
        (Self { records, environments }, SharedRecords { records: newest, environments: known })
    }

    /// Hands over `record`, unless too many wait: a program that does not look needs none.
    pub(super) fn record(&self, record: &LogRecord) {
        let _ = self.records.try_send(*record);
    }

    /// Hands over what became known of the run as a whole.
    pub(super) fn environment(&self, environment: &Environment) {
        let _ = self.environments.try_send(environment.clone());
    }
}

/// The records of a session that runs, for a program that shows them.
///
/// ```
/// use palpate::log::LogRecord;
/// use palpate::prelude::*;
/// use std::time::Duration;
///
/// # fn main() -> Result<(), Error> {
/// let builder = Session::from_scene(Scene::demo()).virtual_time().share_records();
/// let mut running = builder.build()?.start()?;
/// let mut records = running.take_records().expect("they are shared");
/// running.wait_for(Duration::from_millis(300));
/// assert_eq!(records.environment().expect("known from the start").haptic_hz, 1000.0);
/// assert!(records.newest().filter(|record| matches!(record, LogRecord::Force(_))).count() >= 100);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct SharedRecords {
    records: Receiver<LogRecord>,
    environments: Receiver<Environment>,
}

impl SharedRecords {
    /// The records that have come since the last call, in the order of time. Whoever lets more wait than a channel holds, some
    /// three seconds of one device at 1 kHz, loses the newest.
    ///
    /// # Real-time
    /// Never disturbs a tick. Not real-time safe: for threads that show it.
    pub fn newest(&mut self) -> impl Iterator<Item = LogRecord> {
        self.records.try_iter()
    }

    /// What is known of the run as a whole, if anything has come since the last call: at the start, and again with the rights
    /// that the system has granted.
    ///
    /// # Real-time
    /// Never disturbs a tick. Not real-time safe: for threads that show it.
    pub fn environment(&mut self) -> Option<Environment> {
        self.environments.try_iter().last()
    }
}
