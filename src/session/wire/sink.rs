//! Where a session's log entries go: a file, memory, or nowhere.

use std::path::Path;

use crate::actors::{LogFile, LogSink, Loss};
use crate::error::Error;
use crate::log::{Environment, GroupStats, LogRecord, SceneFrame, TextEvent};
use crate::runtime::Nanos;
use crate::session::records::RecordSender;
use crate::session::running::Memory;

/// All sinks that a session asked for, one after the other.
pub(super) struct Sinks {
    memory: Option<Memory>,
    sender: Option<RecordSender>,
    file: Option<LogFile>,
}

impl Sinks {
    /// Keeps records in `memory`, hands them to the program by `sender` and writes them to a file at `path`, if there are any.
    pub(super) fn new(
        memory: Option<Memory>,
        sender: Option<RecordSender>,
        path: Option<&Path>,
        environment: &Environment,
    ) -> Result<Self, Error> {
        if let Some(sender) = &sender {
            sender.environment(environment);
        }
        Ok(Self { memory, sender, file: path.map(|path| LogFile::create(path, environment)).transpose()? })
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
        if let Some(sender) = &self.sender {
            sender.record(record);
        }
        self.on_file(|file| file.record(record))
    }

    fn text(&mut self, event: &TextEvent) -> Result<(), Error> {
        self.on_file(|file| file.text(event))
    }

    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        self.on_file(|file| file.stats(stats))
    }

    fn scene(&mut self, frame: &SceneFrame) -> Result<(), Error> {
        self.on_file(|file| file.scene(frame))
    }

    fn environment(&mut self, environment: &Environment) {
        if let Some(sender) = &self.sender {
            sender.environment(environment);
        }
        if let Some(file) = &mut self.file {
            file.environment(environment);
        }
    }

    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error> {
        self.on_file(|file| file.flush(log_time, now))
    }

    fn ending(&mut self) {
        self.file.iter_mut().for_each(LogFile::ending);
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.on_file(LogFile::finish)
    }

    fn take_loss(&mut self) -> Option<Loss> {
        self.file.as_mut().and_then(LogFile::take_loss)
    }
}
