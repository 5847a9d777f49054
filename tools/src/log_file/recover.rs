//! A new, complete log of everything readable in a damaged one, of palpate's or of any other program.
//!
//! Messages are copied as they are: channel, times, sequence number and bytes. Channels that a damage took are taken from
//! the index at the end of the file, if that is there.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{Read, Seek, Write};
use std::path::Path;

use mcap::records::{AttachmentHeader, Channel, MessageHeader, Record, op};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, Summary, WriteOptions};

use super::Span;
use super::salvage::{Damage, Found, Salvage};
use super::summary::{read_summary, record_at};
use palpate::log::file::parse_record;
use palpate::{Error, ErrorKind};

/// The yield of [`recover`]: what was saved and what was lost.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recovered {
    /// The size of the damaged file (bytes).
    pub bytes: u64,
    /// The number of messages in the new log.
    pub messages: u64,
    /// The number of chunks in the new log.
    pub chunks: u64,
    /// The number of attachments in the new log.
    pub attachments: u64,
    /// The number of metadata records in the new log.
    pub metadata: u64,
    /// The log times of the first and the last message saved (ns).
    pub span: Option<(u64, u64)>,
    /// The damaged stretches, in the order of the file.
    pub lost: Vec<Lost>,
    /// The number of messages whose channel is not known any more.
    pub without_channel: u64,
    /// The number of messages that the index counts, if it is there: what is missing is lost.
    pub counted: Option<u64>,
}

/// A stretch of a log that is lost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// The stretch of the file, and what is wrong with it.
    pub damage: Damage,
    /// The log time of the last message before it (ns).
    pub after: Option<u64>,
    /// The log time of the first message behind it (ns).
    pub before: Option<u64>,
    /// The number of messages saved from the damaged record itself: of the last chunk of a cut file.
    pub saved: u64,
}

impl Recovered {
    /// The number of bytes of the file that gave nothing.
    pub fn lost_bytes(&self) -> u64 {
        self.lost.iter().filter(|lost| lost.saved == 0).map(|lost| lost.damage.to - lost.damage.from).sum()
    }
}

/// Copies everything readable of `source` into a new log in `output`. `place` and `new_place` name the two in errors;
/// `progress` is told how many bytes of how many were read, once per chunk.
///
/// # Errors
/// [`ErrorKind::Log`] if `source` is no MCAP, [`ErrorKind::Io`] if one cannot be read or the other not be written.
pub fn recover<W: Write>(
    mut source: impl Read + Seek,
    place: &str,
    output: W,
    new_place: &str,
    mut progress: impl FnMut(u64, u64),
) -> Result<(Recovered, W), Error> {
    let index = read_summary(&mut source);
    let mut hidden = listed(index.as_ref());
    let mut records = Salvage::new(&mut source, place)?;
    let failed = |e| cannot_write(new_place, e);
    let mut copy = Copy::new(index.unwrap_or_default());
    copy.report.bytes = records.length();
    let (mut output, mut new) = (Some(output), None);
    while let Some(found) = records.next() {
        let (opcode, stream) = match found {
            Found::Record(opcode, stream) => (opcode, stream),
            Found::Damage(damage) => {
                copy.note(damage);
                continue;
            }
        };
        let start = stream.chunk().map(|(start, _)| start);
        let (record_start, _) = stream.record_start();
        if let Some(output) = output.take() {
            new = Some(begin(output, if opcode == op::HEADER { stream.body() } else { &[] }).map_err(failed)?);
        }
        let Some(writer) = new.as_mut().filter(|_| opcode != op::HEADER) else { continue };
        if start != copy.chunk {
            // The new log has the chunks of the old one.
            writer.flush().map_err(failed)?;
            copy.report.chunks += u64::from(start.is_some());
            copy.since_chunk = 0;
            copy.chunk = start;
            progress(stream.offset(), copy.report.bytes);
        }
        hidden.remove(&record_start);
        match parse_record(opcode, stream.body()) {
            Ok(record) => copy.record(writer, record).map_err(failed)?,
            Err(what) => {
                // Of a record in a chunk, no more than the chunk has.
                let to = (record_start + 9 + stream.body().len() as u64).min(stream.offset());
                copy.note_record(Damage { from: record_start, to, what: format!("a record does not decode: {what}") });
            }
        }
    }
    drop(records);
    let mut writer = match (output, new) {
        (Some(output), _) => begin(output, &[]).map_err(failed)?,
        (None, Some(new)) => new,
        (None, None) => unreachable!("the output is in one of the two"),
    };
    // What the index knows of and a damage hid. What it says of other places is wrong, and so are records within records.
    let mut end = 0;
    for (offset, opcode) in hidden {
        if offset >= end
            && copy.is_lost(offset)
            && let Some(body) = record_at(&mut source, offset, opcode)
        {
            end = offset + 9 + body.len() as u64;
            if let Ok(record) = parse_record(opcode, &body) {
                copy.record(&mut writer, record).map_err(failed)?;
            }
        }
    }
    copy.declare_all(&mut writer).map_err(failed)?;
    writer.finish().map_err(failed)?;
    progress(copy.report.bytes, copy.report.bytes);
    let mut inner = writer.into_inner().into_inner();
    inner.flush().map_err(|e| Error::io(Path::new(new_place), e))?;
    Ok((copy.report, inner))
}

fn cannot_write(place: &str, error: McapError) -> Error {
    match error {
        McapError::Io(e) => Error::io(Path::new(place), e),
        other => Error::new(ErrorKind::Io, format!("the new log cannot be written: {other}")).at(place),
    }
}

/// The new log, in which all that is copied goes.
type NewLog<W> = mcap::Writer<NoSeek<W>>;

/// Begins the new log, with what the header of the old one says.
fn begin<W: Write>(output: W, header: &[u8]) -> mcap::McapResult<NewLog<W>> {
    let (profile, library) = match parse_record(op::HEADER, header) {
        Ok(Record::Header(header)) => (header.profile, header.library),
        _ => (String::new(), String::new()),
    };
    let options = WriteOptions::new()
        .profile(profile)
        .library(library)
        .compression(Some(Compression::Lz4))
        .calculate_data_section_crc(true)
        .calculate_summary_section_crc(true)
        .disable_seeking(true);
    options.create(NoSeek::new(output))
}

/// The places of the attachments and metadata that the index lists, and their opcodes.
fn listed(index: Option<&Summary>) -> BTreeMap<u64, u8> {
    let Some(index) = index else { return BTreeMap::new() };
    let attachments = index.attachment_indexes.iter().map(|entry| (entry.offset, op::ATTACHMENT));
    let metadata = index.metadata_indexes.iter().map(|entry| (entry.offset, op::METADATA));
    attachments.chain(metadata).collect()
}

/// What has been copied so far.
struct Copy {
    report: Recovered,
    index: Summary,
    /// As the file has them; the writer knows those that it was given.
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    declared: HashSet<u16>,
    span: Span,
    newest: Option<u64>,
    /// Where the chunk begins that the last record was in.
    chunk: Option<u64>,
    /// Messages since the chunk began.
    since_chunk: u64,
}

impl Copy {
    fn new(index: Summary) -> Self {
        let report =
            Recovered { counted: index.stats.as_ref().map(|stats| stats.message_count), ..Recovered::default() };
        Self {
            report,
            index,
            schemas: HashMap::new(),
            declared: HashSet::new(),
            span: Span::default(),
            newest: None,
            chunk: None,
            since_chunk: 0,
        }
    }

    fn note(&mut self, damage: Damage) {
        let saved = if self.chunk == Some(damage.from) { self.since_chunk } else { 0 };
        self.report.lost.push(Lost { damage, after: self.newest, before: None, saved });
        self.since_chunk = 0;
    }

    /// Notes a record that is whole but does not decode, together with what is wrong alike just before it.
    fn note_record(&mut self, damage: Damage) {
        match self.report.lost.last_mut() {
            Some(Lost { damage: last, before: None, saved: 0, .. })
                if last.what == damage.what && damage.from <= last.to =>
            {
                last.to = last.to.max(damage.to);
            }
            _ => self.report.lost.push(Lost { damage, after: self.newest, before: None, saved: 0 }),
        }
    }

    /// True for a place in what was lost.
    fn is_lost(&self, place: u64) -> bool {
        let begun = self.report.lost.partition_point(|lost| lost.damage.from <= place);
        self.report.lost[..begun].last().is_some_and(|lost| place < lost.damage.to)
    }

    fn record<W: Write>(&mut self, writer: &mut NewLog<W>, record: Record<'_>) -> mcap::McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Message { header, data } => self.message(writer, &header, &data)?,
            Record::Channel(channel) => self.declare(writer, &channel)?,
            Record::Metadata(metadata) => {
                writer.write_metadata(&metadata)?;
                self.report.metadata += 1;
            }
            Record::Attachment { header, data, .. } => {
                let AttachmentHeader { log_time, create_time, name, media_type } = header;
                writer.attach(&Attachment { log_time, create_time, name, media_type, data })?;
                self.report.attachments += 1;
            }
            _ => {}
        }
        Ok(())
    }

    fn message<W: Write>(
        &mut self,
        writer: &mut NewLog<W>,
        header: &MessageHeader,
        data: &[u8],
    ) -> mcap::McapResult<()> {
        if !self.declared.contains(&header.channel_id) {
            self.declare_from_index(writer, header.channel_id)?;
        }
        if !self.declared.contains(&header.channel_id) {
            self.report.without_channel += 1;
            return Ok(());
        }
        writer.write_to_known_channel(header, data)?;
        self.report.messages += 1;
        self.since_chunk += 1;
        self.span.push(header.log_time);
        self.report.span = self.span.0;
        self.newest = Some(header.log_time);
        let open = self.report.lost.iter_mut().rev().take_while(|lost| lost.before.is_none());
        open.for_each(|lost| lost.before = Some(header.log_time));
        Ok(())
    }

    /// Declares a channel under its own number; a second one of that number that differs is left out.
    fn declare<W: Write>(&mut self, writer: &mut NewLog<W>, channel: &Channel) -> mcap::McapResult<()> {
        let id = channel.schema_id;
        if !self.schemas.contains_key(&id)
            && let Some(schema) = self.index.schemas.get(&id)
        {
            self.schemas.insert(id, (schema.name.clone(), schema.encoding.clone(), schema.data.to_vec()));
        }
        let schema = match self.schemas.get(&id) {
            Some((name, encoding, data)) => writer.add_schema_with_id(id, name, encoding, data),
            None => Ok(0),
        };
        let Channel { topic, message_encoding, metadata, .. } = channel;
        let added = schema.and_then(|_| writer.add_channel_with_id(channel.id, id, topic, message_encoding, metadata));
        match added {
            Ok(id) => {
                self.declared.insert(id);
                Ok(())
            }
            Err(error @ McapError::Io(_)) => Err(error),
            Err(_) => Ok(()),
        }
    }

    fn declare_from_index<W: Write>(&mut self, writer: &mut NewLog<W>, id: u16) -> mcap::McapResult<()> {
        let Some(channel) = self.index.channels.get(&id) else { return Ok(()) };
        let channel = Channel {
            id,
            schema_id: channel.schema.as_ref().map_or(0, |schema| schema.id),
            topic: channel.topic.clone(),
            message_encoding: channel.message_encoding.clone(),
            metadata: channel.metadata.clone(),
        };
        self.declare(writer, &channel)
    }

    /// Topics without a message are part of a log too.
    fn declare_all<W: Write>(&mut self, writer: &mut NewLog<W>) -> mcap::McapResult<()> {
        let mut ids: Vec<u16> = self.index.channels.keys().copied().filter(|id| !self.declared.contains(id)).collect();
        ids.sort_unstable();
        ids.into_iter().try_for_each(|id| self.declare_from_index(writer, id))
    }
}
