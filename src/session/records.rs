//! Records for a program that shows them while the session runs.
//!
//! They come from the logger, which drains them off the ticks: 20 times a second and a tenth of a second late, in the order of
//! time, as the log has them. A program that does not take them loses the oldest; the logger never waits for it.

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};

use crate::log::{Environment, LogRecord};

/// Records that wait for a program: some three seconds of one device at 1 kHz, and a few megabytes.
const WAITING: usize = 1 << 14;

/// What is known of the run as a whole comes twice: at the start, and when the system has granted its rights.
const ENVIRONMENTS: usize = 2;

/// The logger's end.
#[derive(Debug)]
pub(super) struct RecordSender {
    records: Sender<LogRecord>,
    /// The program's end, for what makes room.
    oldest: Receiver<LogRecord>,
    environments: Sender<Environment>,
}

impl RecordSender {
    /// Both ends.
    pub(super) fn new() -> (Self, SharedRecords) {
        let (records, newest) = bounded(WAITING);
        let (environments, known) = bounded(ENVIRONMENTS);
        let sender = Self { records, oldest: newest.clone(), environments };
        (sender, SharedRecords { records: newest, environments: known })
    }

    /// Hands over `record`, in place of the oldest if too many wait: a program that looks again wants to know how it is now.
    pub(super) fn record(&self, record: &LogRecord) {
        if let Err(TrySendError::Full(record)) = self.records.try_send(*record) {
            // Or the program has just made room; nobody else sends.
            let _ = self.oldest.try_recv();
            let _ = self.records.try_send(record);
        }
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
    /// three seconds of one device at 1 kHz, loses the oldest.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::ForceSample;
    use crate::runtime::Nanos;

    fn at(time: usize) -> LogRecord {
        LogRecord::Force(ForceSample { time: Nanos(time as u64), ..ForceSample::default() })
    }

    // Check that who looks late sees how it is now, without a gap, and that nothing is held back afterwards.
    #[test]
    fn who_does_not_look_loses_the_oldest() {
        const TOO_MANY: usize = 100;
        let (sender, mut shared) = RecordSender::new();
        (0..WAITING + TOO_MANY).for_each(|time| sender.record(&at(time)));
        let times =
            |shared: &mut SharedRecords| shared.newest().map(|record| record.time().0 as usize).collect::<Vec<_>>();
        assert_eq!(times(&mut shared), (TOO_MANY..WAITING + TOO_MANY).collect::<Vec<_>>());
        sender.record(&at(7));
        assert_eq!(times(&mut shared), [7]);
    }
}
