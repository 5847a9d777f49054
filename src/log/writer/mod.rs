//! Writes records as an MCAP file that any viewer opens.
//!
//! Messages are collected for up to 500 ms, put in time order and written as one lz4 chunk with a single sequential
//! write: a killed process loses less than a second, and what is on disk is never patched afterwards.

mod backlog;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, WriteOptions};

pub use self::backlog::{Backlog, BacklogProgress};
use super::messages::foxglove::{Log, PoseInFrame, SceneUpdate};
use super::messages::topic::{Topic, TopicKind};
use super::messages::{ActorTimes, Contact, LogMessage, SCHEMA_VERSION, descriptor_set};
use super::records::{Environment, LogRecord, SceneFrame, TextEvent, WaitingPoints};
use super::stats::GroupStats;
use crate::error::{Error, ErrorKind};
use crate::runtime::Nanos;

/// Log time or wall time between two chunks.
const FLUSH_INTERVAL: Nanos = Nanos(500_000_000);
/// Collected messages that force a chunk earlier (bytes).
const CHUNK_BYTES: usize = 1 << 20;
/// The file buffer (bytes): a chunk goes to the file in few large writes.
const FILE_BUFFER_BYTES: usize = 1 << 18;

/// A message that waits for the next chunk.
#[derive(Debug)]
struct Pending {
    time: Nanos,
    topic: Topic,
    start: usize,
    end: usize,
}

/// Writes one log.
///
/// # Real-time
/// Every method allocates and may block: this is for the logger's thread.
///
/// ```
/// use palpate::log::{Environment, LogRecord, McapWriter, ToolSample};
/// use palpate::runtime::Nanos;
///
/// # fn main() -> Result<(), palpate::Error> {
/// let mut writer = McapWriter::new(Vec::new(), "memory", &Environment::default())?;
/// writer.write(&LogRecord::Tool(ToolSample { time: Nanos(1_000_000), ..ToolSample::default() }))?;
/// assert!(writer.finish()?.starts_with(b"\x89MCAP"));
/// # Ok(())
/// # }
/// ```
pub struct McapWriter<W: Write> {
    /// Gone after an error: what is on disk stays as it is.
    output: Option<mcap::Writer<NoSeek<W>>>,
    place: String,
    environment: Environment,
    environment_is_written: bool,
    attached: Vec<&'static str>,
    channels: BTreeMap<Topic, (u16, u32)>,
    points: WaitingPoints,
    pending: Vec<Pending>,
    bytes: Vec<u8>,
    flushed_at: (Nanos, Nanos),
    /// The largest log time that was written: no later message has a smaller one.
    newest: u64,
}

impl McapWriter<BufWriter<File>> {
    /// Creates or overwrites the log at `path`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the file cannot be created or written.
    pub fn create(path: &Path, environment: &Environment) -> Result<Self, Error> {
        let file = File::create(path).map_err(|e| Error::io(path, e))?;
        Self::new(BufWriter::with_capacity(FILE_BUFFER_BYTES, file), &path.display().to_string(), environment)
    }
}

impl<W: Write> McapWriter<W> {
    /// Begins a log in `output`; `place` names it in errors.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if `output` cannot be written.
    pub fn new(output: W, place: &str, environment: &Environment) -> Result<Self, Error> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .profile("palpate")
            .library(concat!("palpate/", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            // Metadata and the frame have no other checksum.
            .calculate_data_section_crc(true)
            .calculate_summary_section_crc(true)
            .disable_seeking(true);
        let output = options.create(NoSeek::new(output)).map_err(|e| write_error(place, e))?;
        Ok(Self {
            output: Some(output),
            place: place.to_owned(),
            environment: environment.clone(),
            environment_is_written: false,
            attached: Vec::new(),
            channels: BTreeMap::new(),
            points: WaitingPoints::default(),
            pending: Vec::new(),
            bytes: Vec::with_capacity(CHUNK_BYTES),
            flushed_at: (Nanos::ZERO, Nanos::ZERO),
            newest: 0,
        })
    }

    /// Replaces the environment, for what is known only after the start. It is written with the next chunk; after the
    /// first chunk, as a second metadata record that readers prefer. Group names are fixed by the first chunk.
    pub fn set_environment(&mut self, environment: &Environment) {
        self.environment = environment.clone();
        self.environment_is_written = false;
    }

    /// Adds a record. A [`LogRecord::ContactPoint`] is written with the [`LogRecord::Contact`] of its device and time that
    /// follows, and is lost without it.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk was full and could not be written. The log is then given up: further calls fail at
    /// once and what is on disk stays readable.
    pub fn write(&mut self, record: &LogRecord) -> Result<(), Error> {
        let topic = Topic::of(record);
        let time = record.time();
        match record {
            LogRecord::Tick(r) => self.push(topic, time, r),
            LogRecord::Actors(r) => self.push(topic, time, &ActorTimes::from(r)),
            LogRecord::Event(r) => {
                let group = self.environment.group_name(r.group);
                self.push(topic, time, &Log::coded(r, &group, self.environment.epoch_ns()))
            }
            LogRecord::Force(r) => self.push(topic, time, r),
            LogRecord::Command(r) => self.push(topic, time, r),
            LogRecord::Tool(r) => self.push(topic, time, &PoseInFrame::of(r, self.environment.epoch_ns())),
            LogRecord::ContactPoint(r) => {
                self.points.add(*r);
                Ok(())
            }
            LogRecord::Contact(r) => {
                let points = self.points.take(r);
                self.push(topic, time, &Contact::of(r, &points))
            }
            LogRecord::Resync(r) => self.push(topic, time, r),
            LogRecord::Global(r) => self.push(topic, time, r),
            LogRecord::Port(r) => self.push(topic, time, r),
            LogRecord::Input(r) => self.push(topic, time, r),
            LogRecord::Probe(r) => self.push(topic, time, r),
            LogRecord::Link(r) => self.push(topic, time, r),
        }
    }

    /// Adds an event in words.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn write_text(&mut self, event: &TextEvent) -> Result<(), Error> {
        self.push(Topic(TopicKind::Log, 0), event.time, &Log::text(event, self.environment.epoch_ns()))
    }

    /// Adds a picture of the run.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn write_scene(&mut self, frame: &SceneFrame) -> Result<(), Error> {
        self.push(Topic(TopicKind::Scene, 0), frame.time, &SceneUpdate::of(frame, self.environment.epoch_ns()))
    }

    /// Adds the statistics of a group.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn write_stats(&mut self, stats: &GroupStats) -> Result<(), Error> {
        self.push(Topic(TopicKind::Stats, stats.group), stats.time, stats)
    }

    /// Writes a chunk if 500 ms of log time or of wall time have passed since the last one. `wall` counts from any
    /// fixed moment.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn flush_if_due(&mut self, log_time: Nanos, wall: Nanos) -> Result<(), Error> {
        let (last_log_time, last_wall) = self.flushed_at;
        let due = |now: Nanos, last: Nanos| now.saturating_sub(last) >= FLUSH_INTERVAL;
        if due(log_time, last_log_time) || due(wall, last_wall) {
            self.flushed_at = (log_time, wall);
            self.flush()?;
        }
        Ok(())
    }

    /// Writes what has been collected as one chunk and hands it to the operating system.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn flush(&mut self) -> Result<(), Error> {
        let Some(mut output) = self.output.take() else {
            return Err(Error::new(ErrorKind::Io, "the log was given up after an earlier write error").at(&self.place));
        };
        match self.write_chunk(&mut output) {
            Ok(()) => {
                self.output = Some(output);
                Ok(())
            }
            Err(e) => {
                // Dropping the writer would append an index to a half-written record.
                drop(output.into_inner());
                Err(write_error(&self.place, e))
            }
        }
    }

    /// Writes the last chunk and the index, and gives the output back.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a chunk could not be written, see [`write`](Self::write).
    pub fn finish(mut self) -> Result<W, Error> {
        self.flush()?;
        let place = std::mem::take(&mut self.place);
        let mut output = self.output.take().expect("flush succeeded and put the output back");
        output.finish().map_err(|e| write_error(&place, e))?;
        let mut inner = output.into_inner().into_inner();
        inner.flush().map_err(|e| write_error(&place, e.into()))?;
        Ok(inner)
    }

    fn push(&mut self, topic: Topic, time: Nanos, message: &impl LogMessage) -> Result<(), Error> {
        let start = self.bytes.len();
        message.encode(&mut self.bytes);
        self.pending.push(Pending { time, topic, start, end: self.bytes.len() });
        if self.bytes.len() >= CHUNK_BYTES { self.flush() } else { Ok(()) }
    }

    fn write_chunk(&mut self, output: &mut mcap::Writer<NoSeek<W>>) -> mcap::McapResult<()> {
        if !self.environment_is_written {
            let metadata = self.environment.to_map(SCHEMA_VERSION);
            output.write_metadata(&Metadata { name: "environment".into(), metadata })?;
            self.environment_is_written = true;
        }
        self.attach(output, Environment::SCENE, "application/toml")?;
        self.attach(output, Environment::SESSION, "application/toml")?;
        self.attach(output, Environment::MESH, "application/octet-stream")?;
        if self.channels.is_empty() {
            let declared: Vec<Topic> = Topic::declared(&self.environment).collect();
            for topic in declared {
                self.channel(output, topic)?;
            }
        }
        let mut pending = std::mem::take(&mut self.pending);
        // Stable: what happened at one time keeps the order in which it was written.
        pending.sort_by_key(|message| message.time);
        for message in pending.drain(..) {
            let (channel_id, sequence) = self.channel(output, message.topic)?;
            let publish_time = self.environment.epoch_ns().saturating_add(message.time.0);
            // A release that took very long comes when younger ones have been written: readers expect the order of time.
            self.newest = self.newest.max(publish_time);
            let header = MessageHeader { channel_id, sequence, log_time: self.newest, publish_time };
            output.write_to_known_channel(&header, &self.bytes[message.start..message.end])?;
        }
        self.pending = pending;
        self.bytes.clear();
        output.flush()
    }

    /// Attaches what has this name once it is known.
    fn attach(
        &mut self,
        output: &mut mcap::Writer<NoSeek<W>>,
        name: &'static str,
        media_type: &str,
    ) -> mcap::McapResult<()> {
        let Some(data) = self.environment.attachment(name).filter(|_| !self.attached.contains(&name)) else {
            return Ok(());
        };
        let time = self.environment.epoch_ns();
        output.attach(&Attachment {
            log_time: time,
            create_time: time,
            name: name.into(),
            media_type: media_type.into(),
            data: data.into(),
        })?;
        self.attached.push(name);
        Ok(())
    }

    /// The id of the topic's channel and the number of its next message.
    fn channel(&mut self, output: &mut mcap::Writer<NoSeek<W>>, topic: Topic) -> mcap::McapResult<(u16, u32)> {
        if let Some((id, sequence)) = self.channels.get_mut(&topic) {
            *sequence = sequence.wrapping_add(1);
            return Ok((*id, *sequence));
        }
        let name = topic.0.schema();
        let schema = output.add_schema(name, "protobuf", &descriptor_set(name))?;
        let id = output.add_channel(schema, &topic.name(&self.environment), "protobuf", &BTreeMap::new())?;
        self.channels.insert(topic, (id, 0));
        Ok((id, 0))
    }
}

impl<W: Write> std::fmt::Debug for McapWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapWriter")
            .field("place", &self.place)
            .field("pending", &self.pending.len())
            .finish_non_exhaustive()
    }
}

fn write_error(place: &str, error: mcap::McapError) -> Error {
    match error {
        mcap::McapError::Io(e) => Error::io(Path::new(place), e),
        other => Error::new(ErrorKind::Io, format!("the log cannot be written: {other}")).at(place),
    }
}
