//! Reads a log from front to back, a chunk at a time, to its end or to the first damage.

mod chunk;
mod foreign;
mod framing;
mod parsed;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use mcap::records::{Record, op};

pub use self::chunk::{ChunkHead, ChunkRecords};
use self::foreign::{ForeignChannel, ForeignSchema};
pub use self::framing::{RecordStream, Section};
pub use self::parsed::parse_record;
use super::entry::LogEntry;
pub use super::messages::topic::{Topic, TopicKind};
use super::messages::{self, LogMessage, foxglove};
use super::records::{
    Environment, GroupInfo, Level, LogRecord, LoggedExecution, MAX_DEVICES, MAX_GROUPS, SCHEMA_VERSION_KEY, TextEvent,
};
use crate::error::{Error, ErrorKind};
use crate::runtime::Nanos;

/// Logs before it have other messages on `/tool` and `/log`.
const OLDEST_SCHEMA: u32 = 2;
const READ_BUFFER_BYTES: usize = 1 << 18;

/// The entries of a log, as an iterator of results.
///
/// A damaged or truncated log gives everything before the damage, then one error that says what is damaged and where, and then
/// ends: `?` on each entry reads a whole log or none. [`readable`](Self::readable) is for programs that use what there is.
/// Memory is bounded by one chunk.
///
/// ```
/// use palpate::log::{Environment, ForceSample, LogEntry, LogReader, LogRecord, McapWriter};
///
/// # fn main() -> Result<(), palpate::Error> {
/// let mut writer = McapWriter::new(Vec::new(), "memory", &Environment::default())?;
/// writer.write(&LogRecord::Force(ForceSample { force_n: [0.0, 0.0, -1.5], ..ForceSample::default() }))?;
/// let log = writer.finish()?;
///
/// let mut forces = Vec::new();
/// for entry in LogReader::new(log.as_slice(), "memory")? {
///     if let LogEntry::Record(LogRecord::Force(sample)) = entry? {
///         forces.push(sample.force_n[2]);
///     }
/// }
/// assert_eq!(forces, [-1.5]);
///
/// // Without its last byte it is still read, and said to be damaged.
/// let mut cut = LogReader::new(&log[..log.len() - 1], "memory")?;
/// assert_eq!(cut.readable().count(), 2);
/// assert!(cut.damage().is_some());
/// # Ok(())
/// # }
/// ```
pub struct LogReader<R> {
    records: RecordStream<R>,
    place: String,
    schemas: HashMap<u16, Schema>,
    channels: HashMap<u16, Channel>,
    /// That of the entry before.
    channel: Option<u16>,
    messages: u64,
    /// What is left of the message just read.
    left: VecDeque<LogEntry>,
    /// What other programs' channels together say of the run; `None` in a log of palpate's.
    foreign: Option<Environment>,
    foreign_base: Option<u64>,
    /// Pictures are read too.
    has_scene: bool,
    /// The damage was given as an error.
    is_told: bool,
}

/// What a schema says of the messages of its channels, of which there may be many.
struct Schema {
    /// `None` for messages that are not palpate's.
    kind: Option<TopicKind>,
    timing: ForeignSchema,
}

impl Schema {
    fn of(name: String, descriptors: &[u8]) -> Self {
        Self { kind: TopicKind::of_schema(&name, descriptors), timing: ForeignSchema::of(&name, descriptors) }
    }
}

struct Channel {
    topic: String,
    /// `None` for messages that are not palpate's.
    kind: Option<TopicKind>,
    foreign: Option<ForeignChannel>,
    messages: u64,
}

impl LogReader<BufReader<File>> {
    /// Opens the log at `path`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read, [`ErrorKind::Log`] if it is no MCAP file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        Self::new(BufReader::with_capacity(READ_BUFFER_BYTES, file), &path.display().to_string())
    }
}

impl<R: Read> LogReader<R> {
    /// Reads a log from `source`; `place` names it in errors. `source` should be buffered.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read, [`ErrorKind::Log`] if it is no MCAP file.
    pub fn new(source: R, place: &str) -> Result<Self, Error> {
        let records = RecordStream::new(source, place)?;
        Ok(Self {
            records,
            place: place.to_owned(),
            schemas: HashMap::new(),
            channels: HashMap::new(),
            channel: None,
            messages: 0,
            left: VecDeque::new(),
            foreign: Some(foreign_environment()),
            foreign_base: None,
            has_scene: false,
            is_told: false,
        })
    }

    /// Also reads the pictures of the topic `/scene`, as [`LogEntry::Scene`]: they are most of a log that has them, and only who
    /// draws needs them.
    #[must_use]
    pub fn with_scene(mut self) -> Self {
        self.has_scene = true;
        self
    }

    /// The entries up to the end of the log or to its damage, of which [`damage`](Self::damage) tells afterwards.
    pub fn readable(&mut self) -> impl Iterator<Item = LogEntry> {
        self.map_while(Result::ok)
    }

    /// The damage of the log and its place, in one line; known only once the iterator has ended.
    pub fn damage(&self) -> Option<&str> {
        self.records.damage()
    }

    /// True if the log has a checksum over all of its data and it fits; known only once the iterator has ended. palpate
    /// always writes one, other programs may not.
    pub fn is_checksummed(&self) -> bool {
        self.records.is_checksummed()
    }

    /// The name that errors use.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The topic of the entry before; empty for an environment, an attachment or what the reader itself says.
    pub fn topic(&self) -> &str {
        self.channel.and_then(|id| self.channels.get(&id)).map_or("", |channel| &channel.topic)
    }

    /// The topics that the log has declared so far, with the number of messages read from each.
    pub fn topics(&self) -> BTreeMap<&str, u64> {
        let mut topics = BTreeMap::new();
        for channel in self.channels.values() {
            *topics.entry(channel.topic.as_str()).or_insert(0) += channel.messages;
        }
        topics
    }

    /// The kind of `topic`, if the log has declared it and its messages are palpate's.
    pub fn kind(&self, topic: &str) -> Option<TopicKind> {
        let channel = self.channels.values().find(|channel| channel.topic == topic)?;
        channel.kind.or(channel.foreign.as_ref().map(|_| TopicKind::Timing))
    }

    /// The entry in the record just read: `Ok(None)` if it holds none.
    fn decode(&mut self, opcode: u8) -> Result<Option<LogEntry>, String> {
        let body = self.records.body();
        if opcode == op::MESSAGE {
            return self.decode_message();
        }
        match parse_record(opcode, body)? {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, Schema::of(header.name, &data));
            }
            // The index repeats every channel.
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => return Ok(self.declare(channel)),
            Record::Metadata(metadata) if metadata.name == "environment" => {
                self.channel = None;
                self.foreign = None;
                let version = metadata.metadata.get(SCHEMA_VERSION_KEY).and_then(|version| version.parse::<u32>().ok());
                if let Some(version) = version.filter(|&version| version < OLDEST_SCHEMA) {
                    self.records.stop(format!("the log has schema {version}, which this build does not read"));
                    return Ok(None);
                }
                return Ok(Some(LogEntry::Environment(Environment::from_map(&metadata.metadata))));
            }
            Record::Attachment { header, data, .. } => {
                self.channel = None;
                return Ok(Some(LogEntry::Attachment { name: header.name, data: data.into_owned() }));
            }
            Record::Statistics(statistics) if statistics.message_count != self.messages => {
                return Err(format!(
                    "its index counts {} messages but {} could be read",
                    statistics.message_count, self.messages
                ));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Takes in a channel; if it is one of another program's with tick timing, says which groups there are now.
    fn declare(&mut self, channel: mcap::records::Channel) -> Option<LogEntry> {
        let schema = self.schemas.get(&channel.schema_id);
        let kind = schema.and_then(|schema| schema.kind);
        let mut foreign = None;
        let mut known = None;
        if let Some(environment) = self.foreign.as_mut() {
            let schema = schema.map(|schema| &schema.timing);
            foreign = ForeignChannel::of(&channel.topic, &channel.message_encoding, schema, &channel.metadata);
            if let Some(foreign) = &mut foreign {
                // A log that was merged or split may have several channels of one group.
                let place = environment.groups.iter().position(|group| group.name == foreign.name());
                foreign.set_group(u16::try_from(place.unwrap_or(environment.groups.len())).unwrap_or(u16::MAX));
                if place.is_none() && environment.groups.len() >= MAX_GROUPS {
                    self.records
                        .stop(format!("the log has more than {MAX_GROUPS} rate groups, which is all that is read"));
                    return None;
                }
                if place.is_none() {
                    environment.groups.push(GroupInfo::new(foreign.name(), foreign.rate_hz().unwrap_or(0.0)));
                    known = Some(LogEntry::Environment(environment.clone()));
                }
            }
        }
        self.channels.insert(channel.id, Channel { topic: channel.topic, kind, foreign, messages: 0 });
        known
    }

    fn decode_message(&mut self) -> Result<Option<LogEntry>, String> {
        let body = self.records.body();
        let Ok(Record::Message { header, data }) = parse_record(op::MESSAGE, body) else {
            return Err("a message without its header".into());
        };
        let id = header.channel_id;
        let Some(channel) = self.channels.get_mut(&id) else {
            return Err(format!("a message on channel {id}, which was never declared"));
        };
        self.messages += 1;
        channel.messages += 1;
        self.channel = Some(id);
        let kind = match (channel.kind, &mut channel.foreign) {
            // What palpate wrote says all of itself, whether or not the environment came through beside it.
            (Some(kind), _) => kind,
            (None, Some(foreign)) => {
                let tick = foreign.tick(&data, &mut self.foreign_base);
                let tick = tick.map_err(|e| format!("a message on {} is no tick timing: {e}", channel.topic))?;
                let Some(tick) = tick else {
                    self.channel = None;
                    return Ok(Some(left_out(foreign.name())));
                };
                return Ok(Some(LogEntry::Record(LogRecord::Tick(tick))));
            }
            (None, None) => return Ok(None),
        };
        let place = &channel.topic;
        let damaged = |e: &dyn std::fmt::Display| format!("a message on {place} does not decode: {e}");
        if kind == TopicKind::Contact {
            // The places come first, as they were recorded.
            let contact = messages::Contact::decode(&data).map_err(|e| damaged(&e))?;
            let sample = LogEntry::Record(LogRecord::Contact(contact.sample()));
            sample.is_of_a_run().map_err(|e| damaged(&e))?;
            let points = contact.points().map(|point| LogEntry::Record(LogRecord::ContactPoint(point)));
            self.left.extend(points.chain([sample]));
            return Ok(self.left.pop_front());
        }
        if kind == TopicKind::Scene && self.has_scene {
            let update = foxglove::SceneUpdate::decode(&data).map_err(|e| damaged(&e))?;
            return Ok(update.surface().map(LogEntry::Scene));
        }
        LogEntry::decode(kind, &data).map_err(|e| damaged(&e))
    }
}

impl<R: Read> Iterator for LogReader<R> {
    type Item = Result<LogEntry, Error>;

    /// The next entry.
    ///
    /// # Errors
    /// [`ErrorKind::Log`] where the log is damaged, once.
    fn next(&mut self) -> Option<Self::Item> {
        if let Some(entry) = self.left.pop_front() {
            return Some(Ok(entry));
        }
        while let Some(opcode) = self.records.read_next() {
            match self.decode(opcode) {
                Ok(Some(entry)) => return Some(Ok(entry)),
                Ok(None) => {}
                Err(e) => self.records.stop(format!("the log is damaged: {e}")),
            }
        }
        if std::mem::replace(&mut self.is_told, true) {
            return None;
        }
        self.records.damage().map(|damage| Err(Error::new(ErrorKind::Log, damage).at(&self.place)))
    }
}

impl<R> std::fmt::Debug for LogReader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LogReader")
            .field("place", &self.place)
            .field("messages", &self.messages)
            .finish_non_exhaustive()
    }
}

/// Says that a release of `group` has no place in the time of the log.
fn left_out(group: &str) -> LogEntry {
    let message = format!("{group}: a release that was due before the first second of the log is left out");
    LogEntry::Text(TextEvent { time: Nanos::ZERO, level: Level::Warning, message })
}

/// What is known of a run of another program.
fn foreign_environment() -> Environment {
    let execution = LoggedExecution::Threaded { start_unix_ns: 0 };
    Environment {
        execution,
        model: "unknown".into(),
        palpate_version: "-".into(),
        instruction_set: "-".into(),
        ..Environment::default()
    }
}

impl LogEntry {
    /// Reads the entry in the data of a message of this kind, of a contact the last one; `None` for what is there to be seen
    /// only.
    ///
    /// # Errors
    /// What is damaged, in a line.
    pub fn decode(kind: TopicKind, data: &[u8]) -> Result<Option<Self>, String> {
        let entry = Self::of_message(kind, data).map_err(|error| error.to_string())?;
        entry.as_ref().map_or(Ok(()), Self::is_of_a_run)?;
        Ok(entry)
    }

    /// Refuses numbers that no group and no device of a run has: there are sums for each of them.
    fn is_of_a_run(&self) -> Result<(), String> {
        let (group, device) = match self {
            Self::Stats(stats) => (stats.group, 0),
            Self::Record(LogRecord::Tick(r)) => (r.group, 0),
            Self::Record(LogRecord::Actors(r)) => (r.group, 0),
            Self::Record(LogRecord::Port(r)) => (r.group, 0),
            Self::Record(LogRecord::Input(r)) => (r.group, 0),
            Self::Record(record) => (0, record.device()),
            _ => (0, 0),
        };
        if usize::from(group) >= MAX_GROUPS {
            return Err(format!("it is of rate group {group}, of at most {MAX_GROUPS}"));
        }
        if device >= MAX_DEVICES {
            return Err(format!("it is of device {device}, of at most {MAX_DEVICES}"));
        }
        Ok(())
    }

    fn of_message(kind: TopicKind, data: &[u8]) -> Result<Option<Self>, prost::DecodeError> {
        Ok(Some(Self::Record(match kind {
            TopicKind::Timing => LogRecord::Tick(LogMessage::decode(data)?),
            TopicKind::Actors => LogRecord::Actors(messages::ActorTimes::decode(data)?.into()),
            TopicKind::Force => LogRecord::Force(LogMessage::decode(data)?),
            TopicKind::ForceCommanded => LogRecord::Command(LogMessage::decode(data)?),
            TopicKind::Tool => LogRecord::Tool(foxglove::PoseInFrame::decode(data)?.into()),
            TopicKind::Contact => LogRecord::Contact(messages::Contact::decode(data)?.sample()),
            TopicKind::Resync => LogRecord::Resync(LogMessage::decode(data)?),
            TopicKind::Global => LogRecord::Global(LogMessage::decode(data)?),
            TopicKind::Ports => LogRecord::Port(LogMessage::decode(data)?),
            TopicKind::Inputs => LogRecord::Input(LogMessage::decode(data)?),
            TopicKind::Probe => LogRecord::Probe(LogMessage::decode(data)?),
            TopicKind::Link => LogRecord::Link(LogMessage::decode(data)?),
            TopicKind::Stats => return Ok(Some(Self::Stats(LogMessage::decode(data)?))),
            TopicKind::Scene => return Ok(None),
            TopicKind::Log => {
                let message = foxglove::Log::decode(data)?;
                match message.event() {
                    Some(event) => LogRecord::Event(event),
                    None => return Ok(Some(Self::Text(message.into()))),
                }
            }
        })))
    }
}
