//! What is in a log, from its index where there is one.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::Summary;
use mcap::records::{Record, op};
use serde::Serialize;

use super::Span;
use super::salvage::{Found, Salvage};
use super::summary::{read_summary, record_at};
use palpate::Error;
use palpate::log::Environment;
use palpate::log::file::parse_record;

/// The contents of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogInfo {
    /// The size of the file (bytes).
    pub bytes: u64,
    /// True if there is an index; otherwise all of it was read.
    pub has_index: bool,
    /// The damage, as far as it was noticed: only [`check`](super::check) reads everything.
    pub damage: Vec<String>,
    /// The program that the file names.
    pub library: String,
    /// The profile that the file names, often empty.
    pub profile: String,
    /// The log times of the first and the last message (ns).
    pub span: Option<(u64, u64)>,
    /// The number of messages.
    pub messages: u64,
    /// The chunks by their compression; `none` for chunks that are not packed.
    pub chunks: BTreeMap<String, ChunkInfo>,
    /// The topics by name.
    pub topics: BTreeMap<String, TopicInfo>,
    /// The last environment of a run of palpate's.
    pub environment: Option<Environment>,
    /// The attachments in their order.
    pub attachments: Vec<AttachmentInfo>,
    /// The names of the metadata records in their order.
    pub metadata: Vec<String>,
}

/// The chunks of one compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChunkInfo {
    /// The number of them.
    pub count: u64,
    /// Their size in the file (bytes).
    #[serde(rename = "packed_bytes")]
    pub packed: u64,
    /// Their size once unpacked (bytes).
    #[serde(rename = "unpacked_bytes")]
    pub unpacked: u64,
}

/// A topic of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TopicInfo {
    /// The name of the message type; empty without one.
    pub schema: String,
    /// The encoding of the messages, such as `protobuf`.
    pub encoding: String,
    /// The number of them.
    pub messages: u64,
}

/// An attachment of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// The name of the attachment.
    pub name: String,
    /// The media type of the attachment.
    pub media_type: String,
    /// The size of the attachment (bytes).
    pub bytes: u64,
}

impl LogInfo {
    /// Looks into the log at `path`: its index if it has one, otherwise all of it. `progress` is told how many bytes of how
    /// many were read.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](palpate::ErrorKind::Io) if it cannot be read, [`ErrorKind::Log`](palpate::ErrorKind::Log) if it is no
    /// MCAP file.
    pub fn open(path: &Path, progress: impl FnMut(u64, u64)) -> Result<Self, Error> {
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        Self::of(BufReader::new(file), &path.display().to_string(), progress)
    }

    /// Looks into the log in `source`; `place` names it in errors, `progress` is told how many bytes of how many were read.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](palpate::ErrorKind::Io) if it cannot be read, [`ErrorKind::Log`](palpate::ErrorKind::Log) if it is no
    /// MCAP file.
    pub fn of(mut source: impl Read + Seek, place: &str, progress: impl FnMut(u64, u64)) -> Result<Self, Error> {
        if let Some(summary) = read_summary(&mut source)
            && let Some(info) = Self::of_index(&mut source, &summary)
        {
            return Ok(info);
        }
        let records = Salvage::new(source, place)?;
        Ok(Self::scanned(records, progress))
    }

    /// The time from the first to the last message (s).
    pub fn duration_s(&self) -> f64 {
        self.span.map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9)
    }

    /// Messages of a topic per second: as many intervals as there are messages less one.
    pub fn rate_hz(&self, topic: &TopicInfo) -> Option<f64> {
        let duration_s = self.duration_s();
        (topic.messages > 1 && duration_s > 0.0).then(|| (topic.messages - 1) as f64 / duration_s)
    }

    /// From the index, if it says enough.
    fn of_index(source: &mut (impl Read + Seek), index: &Summary) -> Option<Self> {
        let stats = index.stats.as_ref()?;
        let bytes = source.seek(SeekFrom::End(0)).ok()?;
        let mut info = Self {
            bytes,
            has_index: true,
            messages: stats.message_count,
            span: (stats.message_count > 0).then_some((stats.message_start_time, stats.message_end_time)),
            ..Self::default()
        };
        info.header(&record_at(source, mcap::MAGIC.len() as u64, op::HEADER)?);
        for channel in index.channels.values() {
            let topic = info.topics.entry(channel.topic.clone()).or_default();
            topic.schema = channel.schema.as_ref().map_or(String::new(), |schema| schema.name.clone());
            topic.encoding.clone_from(&channel.message_encoding);
            let counted = stats.channel_message_counts.get(&channel.id).copied().unwrap_or(0);
            topic.messages = topic.messages.saturating_add(counted);
        }
        for chunk in &index.chunk_indexes {
            info.chunk(&chunk.compression, chunk.compressed_size, chunk.uncompressed_size);
        }
        let mut attachments: Vec<_> = index.attachment_indexes.iter().collect();
        attachments.sort_by_key(|entry| entry.offset);
        info.attachments = attachments
            .into_iter()
            .map(|entry| AttachmentInfo {
                name: entry.name.clone(),
                media_type: entry.media_type.clone(),
                bytes: entry.data_size,
            })
            .collect();
        let mut metadata: Vec<_> = index.metadata_indexes.iter().collect();
        metadata.sort_by_key(|entry| entry.offset);
        let mut end = 0;
        for entry in metadata {
            // Records within records would have the file read for each of them.
            if entry.offset < end {
                return None;
            }
            let body = record_at(source, entry.offset, op::METADATA)?;
            end = entry.offset.saturating_add(body.len() as u64);
            info.metadata(op::METADATA, &body);
        }
        Some(info)
    }

    fn scanned<R: Read + Seek>(mut records: Salvage<R>, mut progress: impl FnMut(u64, u64)) -> Self {
        let mut info = Self { bytes: records.length(), ..Self::default() };
        let (mut schemas, mut channels) = (HashMap::new(), HashMap::<u16, (String, TopicInfo)>::new());
        let (mut span, mut chunk) = (Span::default(), None);
        while let Some(found) = records.next() {
            let (opcode, stream) = match found {
                Found::Record(opcode, stream) => (opcode, stream),
                Found::Damage(damage) => {
                    info.damage.push(damage.what);
                    continue;
                }
            };
            if let Some((start, head)) = stream.chunk().filter(|(start, _)| chunk != Some(*start)) {
                chunk = Some(start);
                info.chunk(&head.compression, head.length, head.unpacked);
                progress(stream.offset(), info.bytes);
            }
            let body = stream.body();
            match opcode {
                op::HEADER => info.header(body),
                op::METADATA | op::ATTACHMENT => info.metadata(opcode, body),
                _ => match parse_record(opcode, body) {
                    Ok(Record::Message { header, .. }) => {
                        info.messages += 1;
                        span.push(header.log_time);
                        channels.entry(header.channel_id).or_default().1.messages += 1;
                    }
                    Ok(Record::Schema { header, .. }) => {
                        schemas.insert(header.id, header.name);
                    }
                    Ok(Record::Channel(channel)) => {
                        let (name, topic) = channels.entry(channel.id).or_default();
                        *name = channel.topic;
                        topic.schema = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                        topic.encoding = channel.message_encoding;
                    }
                    _ => {}
                },
            }
        }
        info.span = span.0;
        for (id, (name, topic)) in channels {
            let name = if name.is_empty() { format!("channel {id}, not declared") } else { name };
            let known = info.topics.entry(name).or_default();
            *known = TopicInfo { messages: known.messages + topic.messages, ..topic };
        }
        info
    }

    fn header(&mut self, body: &[u8]) {
        if let Ok(Record::Header(header)) = parse_record(op::HEADER, body) {
            (self.library, self.profile) = (header.library, header.profile);
        }
    }

    fn chunk(&mut self, compression: &str, packed: u64, unpacked: u64) {
        let name = if compression.is_empty() { "none" } else { compression };
        let of = self.chunks.entry(name.to_owned()).or_default();
        // What an index says may be anything.
        let (packed, unpacked) = (of.packed.saturating_add(packed), of.unpacked.saturating_add(unpacked));
        *of = ChunkInfo { count: of.count + 1, packed, unpacked };
    }

    /// A metadata record or an attachment.
    fn metadata(&mut self, opcode: u8, body: &[u8]) {
        match parse_record(opcode, body) {
            Ok(Record::Metadata(metadata)) => {
                if metadata.name == "environment" {
                    self.environment = Some(Environment::from_map(&metadata.metadata));
                }
                self.metadata.push(metadata.name);
            }
            Ok(Record::Attachment { header, data, .. }) => self.attachments.push(AttachmentInfo {
                name: header.name,
                media_type: header.media_type,
                bytes: data.len() as u64,
            }),
            Ok(_) => {}
            Err(error) => self.damage.push(error),
        }
    }
}
