//! Reads a log from front to back, a chunk at a time, to its end or to the first damage.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use mcap::records::{Record, op};

use super::entry::LogEntry;
use super::environment::{Environment, Execution, GroupInfo, SCHEMA_VERSION_KEY};
use super::foreign::ForeignChannel;
use super::foxglove;
use super::framing::RecordStream;
use super::records::LogRecord;
use super::schema;
use super::topic::Kind;
use crate::error::{Error, ErrorKind};

/// Logs before it have other messages on `/tool` and `/log`.
const OLDEST_SCHEMA: u32 = 2;
const READ_BUFFER_BYTES: usize = 1 << 18;
/// Channel id, sequence number, log time and publish time in front of every message.
pub const MESSAGE_HEADER_BYTES: usize = 22;

/// The entries of a log, as an iterator.
///
/// A damaged or truncated log gives everything before the damage and then ends; [`damage`](Self::damage) says what
/// and where. Memory is bounded by one chunk.
pub struct LogReader<R> {
    records: RecordStream<R>,
    place: String,
    schemas: HashMap<u16, (String, Vec<u8>)>,
    channels: HashMap<u16, Channel>,
    topic: String,
    messages: u64,
    /// What other programs' channels together say of the run; `None` in a log of palpate's.
    foreign: Option<Environment>,
    foreign_base: Option<u64>,
}

struct Channel {
    topic: String,
    /// `None` for messages that are not palpate's.
    kind: Option<Kind>,
    foreign: Option<ForeignChannel>,
    messages: u64,
}

impl LogReader<BufReader<File>> {
    /// Opens the log at `path`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read, [`ErrorKind::Log`] if it is no MCAP file.
    pub fn open(path: &Path) -> Result<Self, Error> {
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
        let records = RecordStream::new(source).map_err(|e| cannot_open(place, e))?;
        Ok(Self {
            records,
            place: place.to_owned(),
            schemas: HashMap::new(),
            channels: HashMap::new(),
            topic: String::new(),
            messages: 0,
            foreign: Some(foreign_environment()),
            foreign_base: None,
        })
    }

    /// What is wrong with the log and where, in one line; known only once the iterator has ended.
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

    /// The topic of the entry before; empty for an environment or an attachment.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The topics that the log has declared so far, with the number of messages read from each.
    pub fn topics(&self) -> BTreeMap<&str, u64> {
        let mut topics = BTreeMap::new();
        for channel in self.channels.values() {
            *topics.entry(channel.topic.as_str()).or_insert(0) += channel.messages;
        }
        topics
    }

    /// What `topic` carries, if the log has declared it and its messages are palpate's.
    pub fn kind(&self, topic: &str) -> Option<Kind> {
        let channel = self.channels.values().find(|channel| channel.topic == topic)?;
        channel.kind.or(channel.foreign.as_ref().map(|_| Kind::Timing))
    }

    /// The entry in the record just read: `Ok(None)` if it holds none.
    fn decode(&mut self, opcode: u8) -> Result<Option<LogEntry>, String> {
        let body = self.records.body();
        if opcode == op::MESSAGE {
            return self.decode_message();
        }
        match mcap::parse_record(opcode, body).map_err(|e| e.to_string())? {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, data.into_owned()));
            }
            // The index repeats every channel.
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => return Ok(self.declare(channel)),
            Record::Metadata(metadata) if metadata.name == "environment" => {
                self.topic.clear();
                self.foreign = None;
                let version = metadata.metadata.get(SCHEMA_VERSION_KEY).and_then(|version| version.parse::<u32>().ok());
                if let Some(version) = version.filter(|&version| version < OLDEST_SCHEMA) {
                    self.records.stop(format!("the log has schema {version}, which this build does not read"));
                    return Ok(None);
                }
                return Ok(Some(LogEntry::Environment(Environment::from_map(&metadata.metadata))));
            }
            Record::Attachment { header, data, .. } => {
                self.topic.clear();
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
        let schema = self.schemas.get(&channel.schema_id).map(|(name, data)| (name.as_str(), data.as_slice()));
        let kind = schema.and_then(|(name, data)| kind_of(name, data));
        let mut foreign = None;
        let mut known = None;
        if let Some(environment) = self.foreign.as_mut() {
            foreign = ForeignChannel::of(&channel.topic, &channel.message_encoding, schema, &channel.metadata);
            if let Some(foreign) = &mut foreign {
                // A log that was merged or split may have several channels of one group.
                let place = environment.groups.iter().position(|group| group.name == foreign.name());
                foreign.set_group(u16::try_from(place.unwrap_or(environment.groups.len())).unwrap_or(u16::MAX));
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
        let Some((header, data)) = body.split_at_checked(MESSAGE_HEADER_BYTES) else {
            return Err("a message without its header".into());
        };
        let id = u16::from_le_bytes([header[0], header[1]]);
        let Some(channel) = self.channels.get_mut(&id) else {
            return Err(format!("a message on channel {id}, which was never declared"));
        };
        self.messages += 1;
        channel.messages += 1;
        self.topic.clone_from(&channel.topic);
        let kind = match (channel.kind, &mut channel.foreign) {
            // What palpate wrote says all of itself, whether or not the environment came through beside it.
            (Some(kind), _) => kind,
            (None, Some(foreign)) => {
                let tick = foreign.tick(data, &mut self.foreign_base);
                let tick = tick.map_err(|e| format!("a message on {} is no tick timing: {e}", channel.topic))?;
                return Ok(Some(LogEntry::Record(LogRecord::Tick(tick))));
            }
            (None, None) => return Ok(None),
        };
        match decode_data(kind, data) {
            Ok(entry) => Ok(entry),
            Err(e) => Err(format!("a message on {} does not decode: {e}", channel.topic)),
        }
    }
}

impl<R: Read> Iterator for LogReader<R> {
    type Item = LogEntry;

    fn next(&mut self) -> Option<LogEntry> {
        loop {
            let opcode = self.records.next()?;
            match self.decode(opcode) {
                Ok(Some(entry)) => return Some(entry),
                Ok(None) => {}
                Err(e) => self.records.stop(format!("the log is damaged: {e}")),
            }
        }
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

/// What is known of a run of another program.
fn foreign_environment() -> Environment {
    let execution = Execution::Threaded { start_unix_ns: 0 };
    Environment {
        execution,
        model: "unknown".into(),
        palpate_version: "-".into(),
        instruction_set: "-".into(),
        ..Environment::default()
    }
}

/// What messages with this schema carry, if palpate has written them. Those with well-known names may be another
/// program's: they lack palpate's own fields, and so does their descriptor.
pub fn kind_of(schema: &str, descriptor: &[u8]) -> Option<Kind> {
    const OWN_FIELD: &[u8] = b"time_ns";
    let is_ours =
        !schema.starts_with("foxglove.") || descriptor.windows(OWN_FIELD.len()).any(|window| window == OWN_FIELD);
    Kind::from_schema(schema).filter(|_| is_ours)
}

/// Why a file cannot be read as a log.
pub fn cannot_open(place: &str, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::InvalidData => {
            Error::new(ErrorKind::Log, "no MCAP file: it does not begin with the MCAP magic").at(place)
        }
        _ => Error::io(Path::new(place), error),
    }
}

/// The entry in a message of this kind; `None` for what is there to be seen only.
pub fn decode_data(kind: Kind, data: &[u8]) -> Result<Option<LogEntry>, prost::DecodeError> {
    fn parse<M: prost::Message + Default>(data: &[u8]) -> Result<M, prost::DecodeError> {
        M::decode(data)
    }
    Ok(Some(LogEntry::Record(match kind {
        Kind::Timing => LogRecord::Tick(parse::<schema::TickTiming>(data)?.into()),
        Kind::Actors => LogRecord::Actors(parse::<schema::ActorTimes>(data)?.into()),
        Kind::Force => LogRecord::Force(parse::<schema::Force>(data)?.into()),
        Kind::ForceCommanded => LogRecord::Command(parse::<schema::CommandedForce>(data)?.into()),
        Kind::Tool => LogRecord::Tool(parse::<foxglove::PoseInFrame>(data)?.into()),
        Kind::Contact => LogRecord::Contact(parse::<schema::Contact>(data)?.into()),
        Kind::Resync => LogRecord::Resync(parse::<schema::Resync>(data)?.into()),
        Kind::Global => LogRecord::Global(parse::<schema::GlobalTick>(data)?.into()),
        Kind::Ports => LogRecord::Port(parse::<schema::PortUse>(data)?.into()),
        Kind::Probe => LogRecord::Probe(parse::<schema::Probe>(data)?.into()),
        Kind::Stats => return Ok(Some(LogEntry::Stats(parse::<schema::Stats>(data)?.into()))),
        Kind::Scene => return Ok(None),
        Kind::Log => {
            let message = parse::<foxglove::Log>(data)?;
            match message.event() {
                Some(event) => LogRecord::Event(event),
                None => return Ok(Some(LogEntry::Text(message.into()))),
            }
        }
    })))
}
