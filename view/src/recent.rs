//! What was just felt: the newest minute of records and pictures, to be downloaded as a log.

use std::collections::VecDeque;

use palpate::Error;
use palpate::log::{Environment, LogRecord, McapWriter, SceneFrame};
use palpate::runtime::Nanos;

/// How far back it goes.
const SPAN: Nanos = Nanos(60_000_000_000);
/// Pictures of a large body take more room than the span allows: so many bytes of points at most.
const MOST_BYTES: usize = 64 << 20;

/// The newest minute of a session.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recent {
    environment: Option<Environment>,
    records: VecDeque<LogRecord>,
    frames: VecDeque<SceneFrame>,
    /// Of the points of all frames.
    bytes: usize,
}

impl Recent {
    /// Forgets the session before.
    pub(crate) fn begin(&mut self) {
        *self = Self::default();
    }

    pub(crate) fn set_environment(&mut self, environment: Environment) {
        self.environment = Some(environment);
    }

    pub(crate) fn push(&mut self, record: LogRecord) {
        let from = record.time().saturating_sub(SPAN);
        self.records.push_back(record);
        while self.records.front().is_some_and(|first| first.time() < from) {
            self.records.pop_front();
        }
    }

    pub(crate) fn push_frame(&mut self, frame: SceneFrame) {
        let from = frame.time.saturating_sub(SPAN);
        self.bytes += size(&frame);
        self.frames.push_back(frame);
        while let Some(old) = self.frames.pop_front_if(|first| first.time < from || self.bytes > MOST_BYTES) {
            self.bytes -= size(&old);
        }
    }

    /// A log of it, as `palpate run --log-scene` writes one; `None` before there is anything.
    ///
    /// # Errors
    /// If what is known of the run cannot be written.
    pub(crate) fn log(self) -> Result<Option<Vec<u8>>, Error> {
        let Some(environment) = &self.environment else { return Ok(None) };
        let mut log = McapWriter::new(Vec::new(), "the log of the page", environment)?;
        let mut frames = self.frames.into_iter().peekable();
        for record in &self.records {
            while let Some(frame) = frames.next_if(|frame| frame.time <= record.time()) {
                log.write_scene(&frame)?;
            }
            log.write(record)?;
        }
        frames.try_for_each(|frame| log.write_scene(&frame))?;
        log.finish().map(Some)
    }
}

fn size(frame: &SceneFrame) -> usize {
    size_of_val(frame.points.as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::log::{ForceSample, LogEntry, LogReader};

    fn force(ms: u64) -> LogRecord {
        LogRecord::Force(ForceSample { time: Nanos(ms * 1_000_000), ..ForceSample::default() })
    }

    #[test]
    fn a_minute_is_kept_and_reads_back_as_a_log() {
        let mut recent = Recent::default();
        assert_eq!(recent.clone().log().unwrap(), None);
        recent.set_environment(Environment { haptic_hz: 1000.0, ..Environment::default() });
        (0..90_000).step_by(10).for_each(|ms| recent.push(force(ms)));
        let log = recent.log().unwrap().unwrap();
        let mut reader = LogReader::new(log.as_slice(), "log").unwrap();
        let is_force = |entry: &LogEntry| matches!(entry, LogEntry::Record(LogRecord::Force(_)));
        assert_eq!(reader.readable().filter(is_force).count(), 6001);
        assert_eq!(reader.damage(), None);
    }

    #[test]
    fn pictures_of_a_large_body_take_bounded_room() {
        let mut recent = Recent::default();
        for ms in 0..1000 {
            let points = vec![[0.0; 3]; 10_000];
            recent.push_frame(SceneFrame { time: Nanos(ms * 1_000_000), points, ..SceneFrame::default() });
        }
        assert!(recent.bytes <= MOST_BYTES && recent.frames.len() == MOST_BYTES / 240_000);
        assert_eq!(recent.frames.back().unwrap().time, Nanos(999_000_000), "the newest stays");
    }
}
