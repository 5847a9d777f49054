//! Where a session's log entries go: a file, memory, or nowhere.

use std::sync::{Arc, Mutex, PoisonError};

use crate::actors::LogFile;
use crate::actors::{LogSink, Loss};
use crate::error::Error;
use crate::log::{Environment, GroupStats, LogRecord, SceneFrame, TextEvent};
use crate::runtime::Nanos;

/// Records kept in memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory(Arc<Mutex<Vec<LogRecord>>>);

impl Memory {
    pub(super) fn take(&self) -> Vec<LogRecord> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn push(&self, record: LogRecord) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(record);
    }
}

/// All sinks that a session asked for, one after the other.
pub(super) struct Sinks {
    memory: Option<Memory>,
    file: Option<LogFile>,
}

impl Sinks {
    /// Keeps records in `memory`, if there is one.
    pub(super) fn new(memory: Option<Memory>) -> Self {
        Self {
            memory,
            file: None,
        }
    }

    /// Also writes a file.
    pub(super) fn with_file(mut self, path: &std::path::Path, environment: &Environment) -> Result<Self, Error> {
        self.file = Some(LogFile::create(path, environment)?);
        Ok(self)
    }

    /// Writes to the file, if there is one. A file that failed counts what it loses; memory goes on.
    fn on_file(&mut self, write: impl FnOnce(&mut LogFile) -> Result<(), Error>) -> Result<(), Error> {
        self.file.as_mut().map_or(Ok(()), write)
    }
}

impl LogSink for Sinks {
    fn record(&mut self, record: &LogRecord) -> Result<(), Error> {
        if let Some(memory) = &self.memory {
            memory.push(*record);
        }
        self.on_file(|file| file.record(record))?;
        Ok(())
    }

    fn text(&mut self, event: &TextEvent) -> Result<(), Error> {
        self.on_file(|file| file.text(event))?;
        Ok(())
    }

    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        self.on_file(|file| file.stats(stats))?;
        Ok(())
    }

    fn scene(&mut self, frame: &SceneFrame) -> Result<(), Error> {
        self.on_file(|file| file.scene(frame))?;
        Ok(())
    }

    fn environment(&mut self, environment: &Environment) {
        if let Some(file) = &mut self.file {
            file.environment(environment);
        }
    }

    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error> {
        self.on_file(|file| file.flush(log_time, now))?;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.on_file(LogFile::finish)?;
        Ok(())
    }

    fn take_loss(&mut self) -> Option<Loss> {
        self.file.as_mut().and_then(LogFile::take_loss)
    }
}
