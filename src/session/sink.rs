//! Where a session's log entries go: a file, memory, or nowhere.

use std::sync::{Arc, Mutex, PoisonError};

use crate::actors::LogSink;
use crate::error::Error;
use crate::log::{Environment, GroupStats, LogRecord, SceneFrame, TextEvent};
use crate::time::Nanos;

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

#[cfg(feature = "log")]
type FileWriter = crate::log::McapWriter<std::io::BufWriter<std::fs::File>>;

/// All sinks that a session asked for, one after the other.
pub(super) struct Sinks {
    memory: Option<Memory>,
    #[cfg(feature = "log")]
    file: Option<FileWriter>,
}

impl Sinks {
    /// Keeps records in `memory`, if there is one.
    pub(super) fn new(memory: Option<Memory>) -> Self {
        Self {
            memory,
            #[cfg(feature = "log")]
            file: None,
        }
    }

    /// Also writes a file.
    #[cfg(feature = "log")]
    pub(super) fn with_file(mut self, path: &std::path::Path, environment: &Environment) -> Result<Self, Error> {
        self.file = Some(crate::log::McapWriter::create(path, environment)?);
        Ok(self)
    }

    /// Writes to the file, if there is one. A file that failed is given up with what it has; memory goes on.
    #[cfg(feature = "log")]
    fn on_file(&mut self, write: impl FnOnce(&mut FileWriter) -> Result<(), Error>) -> Result<(), Error> {
        let result = self.file.as_mut().map_or(Ok(()), write);
        if result.is_err() {
            self.file = None;
        }
        result
    }
}

impl LogSink for Sinks {
    fn record(&mut self, record: &LogRecord) -> Result<(), Error> {
        if let Some(memory) = &self.memory {
            memory.push(*record);
        }
        #[cfg(feature = "log")]
        self.on_file(|file| file.write(record))?;
        Ok(())
    }

    #[cfg_attr(not(feature = "log"), allow(unused_variables))]
    fn text(&mut self, event: &TextEvent) -> Result<(), Error> {
        #[cfg(feature = "log")]
        self.on_file(|file| file.write_text(event))?;
        Ok(())
    }

    #[cfg_attr(not(feature = "log"), allow(unused_variables))]
    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        #[cfg(feature = "log")]
        self.on_file(|file| file.write_stats(stats))?;
        Ok(())
    }

    #[cfg_attr(not(feature = "log"), allow(unused_variables))]
    fn scene(&mut self, frame: &SceneFrame) -> Result<(), Error> {
        #[cfg(feature = "log")]
        self.on_file(|file| file.write_scene(frame))?;
        Ok(())
    }

    #[cfg_attr(not(feature = "log"), allow(unused_variables))]
    fn environment(&mut self, environment: &Environment) {
        #[cfg(feature = "log")]
        if let Some(file) = &mut self.file {
            file.set_environment(environment);
        }
    }

    #[cfg_attr(not(feature = "log"), allow(unused_variables))]
    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error> {
        #[cfg(feature = "log")]
        self.on_file(|file| file.flush_if_due(log_time, now))?;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        #[cfg(feature = "log")]
        if let Some(file) = self.file.take() {
            file.finish()?;
        }
        Ok(())
    }
}
