//! The log as a file: written by a thread of its own, within bounds of memory and of waiting.
//!
//! In real time nobody waits for the disk: while more than [`LogFile::MOST_WAITING`] bytes wait for it, records are dropped and
//! counted. In simulated time the run waits. In both a disk that takes nothing any more is given up.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::log_sink::{LogSink, Loss};
use crate::error::Error;
use crate::log::{
    Backlog, BacklogProgress, Environment, GroupStats, LogRecord, LoggedExecution, McapWriter, SceneFrame, TextEvent,
};
use crate::runtime::Nanos;

/// In simulated time: how long a disk may take nothing.
const STALLED: Duration = Duration::from_secs(10);

/// A log file as a sink.
///
/// # Real-time
/// For the logger alone. In real time no call blocks but [`finish`](LogSink::finish), for at most [`LogFile::LAST_WAIT`].
#[derive(Debug)]
pub struct LogFile {
    /// Gone after an error.
    writer: Option<McapWriter<Backlog>>,
    disk: BacklogProgress,
    place: String,
    /// The file itself, which nobody else may write meanwhile; `None` for an output without a name.
    held: Option<Held>,
    waits: bool,
    /// What each block that waits for the disk ends with.
    marks: VecDeque<Mark>,
    safe: Mark,
    newest: Mark,
    /// Records are dropped until the disk has caught up.
    is_full: bool,
    /// Nothing is dropped for want of room any more: what is still told is little.
    is_ending: bool,
    finished: bool,
    gap: Option<Loss>,
    closed_gap: Option<Loss>,
}

/// A file that this run alone writes.
#[derive(Debug)]
struct Held {
    path: PathBuf,
    /// Its lock is gone with it.
    file: File,
}

impl Held {
    /// Creates or empties the file at `path`, unless another run holds it; a second handle is for whoever writes it.
    fn open(path: &Path) -> io::Result<(File, Self)> {
        // Emptied once it is known that nobody else is writing it.
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
        // Devices and pipes take what anybody gives.
        if file.metadata()?.is_file() {
            // A file system without locks protects no file.
            if let Err(TryLockError::WouldBlock) = file.try_lock() {
                return Err(io::Error::other("another run is writing it, name another file for this log"));
            }
            file.set_len(0)?;
        }
        Ok((file.try_clone()?, Self { path: path.to_owned(), file }))
    }

    /// True if the path still leads to the file.
    #[cfg(unix)]
    fn is_there(&self) -> bool {
        use std::os::unix::fs::MetadataExt;
        let number = |file: std::fs::Metadata| (file.dev(), file.ino());
        let there = std::fs::metadata(&self.path).map(number).ok();
        there.is_some() && there == self.file.metadata().map(number).ok()
    }

    #[cfg(not(unix))]
    fn is_there(&self) -> bool {
        self.path.exists()
    }
}

/// The end of a block: bytes and records up to there, and the time of the last one.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    bytes: u64,
    records: u64,
    time: Nanos,
}

impl LogFile {
    /// The amount that may wait for a slow disk before records are dropped (bytes): some six seconds of a usual log, two of one with pictures.
    pub const MOST_WAITING: u64 = 2 << 20;

    /// How long the end of a run in real time waits for the disk. Less than the runtime waits for the logger.
    pub const LAST_WAIT: Duration = Duration::from_secs(3);

    /// Creates or overwrites the log at `path`, which no other run can write until this one is over.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](crate::ErrorKind::Io) if the file cannot be created, or if another run is writing it.
    ///
    /// # Real-time
    /// Not real-time safe: opens a file, starts a thread, allocates. Before a run.
    pub fn create(path: &Path, environment: &Environment) -> Result<Self, Error> {
        let failed = |error| Error::io(path, error);
        let (file, held) = Held::open(path).map_err(failed)?;
        Ok(Self { held: Some(held), ..Self::new(file, &path.display().to_string(), environment)? })
    }

    /// Begins a log in `output`, which a thread of its own writes; `place` names it in errors.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](crate::ErrorKind::Io) if there is no thread for it.
    ///
    /// # Real-time
    /// Not real-time safe: starts a thread, allocates. Before a run.
    pub fn new(output: impl Write + Send + 'static, place: &str, environment: &Environment) -> Result<Self, Error> {
        let backlog = Backlog::new(output).map_err(|e| Error::io(Path::new(place), e))?;
        let disk = backlog.progress();
        Ok(Self {
            writer: Some(McapWriter::new(backlog, place, environment)?),
            disk,
            place: place.to_owned(),
            held: None,
            waits: environment.execution == LoggedExecution::Virtual,
            marks: VecDeque::new(),
            safe: Mark::default(),
            newest: Mark::default(),
            is_full: false,
            is_ending: false,
            finished: false,
            gap: None,
            closed_gap: None,
        })
    }

    /// Gives one message to the writer, or drops it.
    fn give(
        &mut self,
        time: Nanos,
        write: impl FnOnce(&mut McapWriter<Backlog>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let room = if self.writer.is_some() { self.has_room() } else { Ok(false) };
        let Some(writer) = self.writer.as_mut().filter(|_| matches!(room, Ok(true))) else {
            self.lose(1, time, time);
            return room.map(drop);
        };
        let result = write(writer);
        self.newest = Mark { records: self.newest.records + 1, time: self.newest.time.max(time), ..self.newest };
        match result {
            Ok(()) => self.mark(),
            Err(error) => return Err(self.give_up(error)),
        }
        Ok(())
    }

    /// True unless records are to be dropped.
    fn has_room(&mut self) -> Result<bool, Error> {
        let waiting = self.disk.waiting();
        if self.is_ending {
            return Ok(true);
        }
        if self.waits {
            // One block at a time: nothing is lost here, however slow the disk is.
            if waiting > LogFile::MOST_WAITING && !self.disk.wait_for(LogFile::MOST_WAITING / 2, STALLED, Duration::MAX)
            {
                return Err(self.stalled(STALLED));
            }
            return Ok(true);
        }
        self.is_full = waiting > if self.is_full { LogFile::MOST_WAITING / 2 } else { LogFile::MOST_WAITING };
        if !self.is_full {
            self.close_gap();
        }
        Ok(!self.is_full)
    }

    /// One that nobody has taken yet becomes one with it.
    fn close_gap(&mut self) {
        if let Some(gap) = self.gap.take() {
            self.closed_gap = Some(self.closed_gap.map_or(gap, |before| before.and(gap)));
        }
    }

    /// Notes which records the bytes given so far hold, and which of them are safe.
    fn mark(&mut self) {
        let given = self.disk.given();
        if given != self.newest.bytes {
            self.newest.bytes = given;
            self.marks.push_back(self.newest);
        }
        let written = self.disk.written();
        while let Some(mark) = self.marks.pop_front_if(|mark| mark.bytes <= written) {
            self.safe = mark;
        }
    }

    /// Counts `records` as lost.
    fn lose(&mut self, records: u64, from: Nanos, to: Nanos) {
        if records > 0 && !self.finished {
            let why = match self.writer {
                Some(_) => "the disk does not keep up",
                None => "the log was given up",
            };
            let loss = Loss { records, from, to, why };
            self.gap = Some(self.gap.map_or(loss, |gap| gap.and(loss)));
        }
    }

    /// What the disk has not taken is lost, and so is all that follows.
    fn give_up(&mut self, error: Error) -> Error {
        self.writer = None;
        self.mark();
        let lost = self.newest.records - self.safe.records;
        self.lose(lost, self.safe.time, self.newest.time);
        self.safe = self.newest;
        self.marks.clear();
        error
    }

    fn stalled(&mut self, waited: Duration) -> Error {
        let kib = self.disk.waiting() >> 10;
        let message = format!("the disk did not take the last {kib} KiB of the log within {waited:?}");
        self.give_up(Error::io(Path::new(&self.place), io::Error::other(message)))
    }

    fn close(&mut self, writer: McapWriter<Backlog>) -> Result<(), Error> {
        // Dropped here: the thread ends when all is written.
        writer.finish().map(drop)?;
        let (stalled, total) =
            if self.waits { (STALLED, Duration::MAX) } else { (LogFile::LAST_WAIT, LogFile::LAST_WAIT) };
        if !self.disk.wait_for_end(stalled, total) {
            return Err(self.stalled(stalled));
        }
        let failed = |error| Error::io(Path::new(&self.place), error);
        self.disk.take_error().map_or(Ok(()), |error| Err(failed(error)))?;
        match &self.held {
            Some(held) if !held.is_there() => {
                Err(failed(io::Error::other("it is gone: the file was deleted, moved or replaced during the run")))
            }
            _ => Ok(()),
        }
    }
}

impl LogSink for LogFile {
    fn record(&mut self, record: &LogRecord) -> Result<(), Error> {
        self.give(record.time(), |writer| writer.write(record))
    }

    fn text(&mut self, event: &TextEvent) -> Result<(), Error> {
        self.give(event.time, |writer| writer.write_text(event))
    }

    fn scene(&mut self, frame: &SceneFrame) -> Result<(), Error> {
        self.give(frame.time, |writer| writer.write_scene(frame))
    }

    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        self.give(stats.time, |writer| writer.write_stats(stats))
    }

    fn environment(&mut self, environment: &Environment) {
        if let Some(writer) = &mut self.writer {
            writer.set_environment(environment);
        }
    }

    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let result = writer.flush_if_due(log_time, now);
        let late = self.disk.take_error().map(|error| Error::io(Path::new(&self.place), error));
        match result.err().or(late) {
            None => self.mark(),
            Some(error) => return Err(self.give_up(error)),
        }
        Ok(())
    }

    fn ending(&mut self) {
        self.is_ending = true;
        self.close_gap();
    }

    fn finish(&mut self) -> Result<(), Error> {
        let result = match self.writer.take() {
            Some(writer) => self.close(writer).map_err(|error| self.give_up(error)),
            None => Ok(()),
        };
        self.finished = true;
        result
    }

    fn take_loss(&mut self) -> Option<Loss> {
        // A gap is told when it is over, or when nothing more will come.
        self.closed_gap.take().or_else(|| self.gap.take_if(|_| self.finished))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_gaps_that_end_before_one_is_taken_become_one() {
        let mut file = LogFile::new(io::sink(), "memory", &Environment::default()).unwrap();
        for (records, from, to) in [(3, 10, 20), (4, 30, 50)] {
            file.lose(records, Nanos(from), Nanos(to));
            file.close_gap();
        }
        let loss = file.take_loss().map(|Loss { records, from, to, .. }| (records, from, to));
        assert_eq!((loss, file.take_loss()), (Some((7, Nanos(10), Nanos(50))), None));
    }
}
