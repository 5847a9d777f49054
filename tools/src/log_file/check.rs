//! Reads all of a log and says everything that is wrong with it.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{Read, Seek};

use mcap::records::{ChunkIndex, MessageHeader, Record, Statistics, op};

use super::Span;
use super::salvage::{Found, Salvage};
use palpate::log::file::parse_record;
use palpate::log::{Analysis, Environment, LogEntry, LogRecord, TopicKind};
use palpate::{Error, printable};

/// Findings that are kept in words; the others are only counted.
const FINDINGS_KEPT: usize = 1000;
/// Findings of one topic that are kept in words: a topic that is wrong throughout says so once and a few times more.
const PER_TOPIC: u64 = 5;

/// The findings of [`check`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckReport {
    /// The faults, a line each: first in the order of the file, then of the log as a whole.
    pub findings: Vec<String>,
    /// The number of all findings.
    pub count: u64,
    /// The number of messages read.
    pub messages: u64,
    /// The number of messages that were palpate's and were decoded.
    pub decoded: u64,
    /// The number of chunks read.
    pub chunks: u64,
    /// The number of chunks whose checksum was verified.
    pub checksummed_chunks: u64,
    /// True if the data as a whole has a checksum and fits it.
    pub is_checksummed: bool,
    /// The log times of the first and the last message (ns).
    pub span: Option<(u64, u64)>,
}

impl CheckReport {
    /// True if nothing is wrong.
    pub fn is_sound(&self) -> bool {
        self.count == 0
    }

    fn find(&mut self, what: String) {
        self.count += 1;
        if self.findings.len() < FINDINGS_KEPT {
            // Topics and groups are called as another program likes.
            self.findings.push(printable(&what).into_owned());
        }
    }
}

/// Reads all of a log; `place` names it in errors. `progress` is told how many bytes of how many were read, once per chunk.
///
/// # Errors
/// [`ErrorKind::Io`](palpate::ErrorKind::Io) if it cannot be read, [`ErrorKind::Log`](palpate::ErrorKind::Log) if it is no MCAP
/// file.
pub fn check(source: impl Read + Seek, place: &str, progress: impl FnMut(u64, u64)) -> Result<CheckReport, Error> {
    let records = Salvage::new(source, place)?;
    Ok(Checker::default().run(records, progress))
}

/// A channel and its messages so far.
#[derive(Default)]
struct Channel {
    topic: String,
    kind: Option<TopicKind>,
    messages: u64,
    next_sequence: u32,
    newest: u64,
    findings: u64,
}

/// Start and length of a chunk, its first and last log time, its size once unpacked and its compression.
type Chunk = (u64, u64, (u64, u64), u64, String);

#[derive(Default)]
struct Checker {
    report: CheckReport,
    schemas: HashMap<u16, Option<TopicKind>>,
    channels: BTreeMap<u16, Channel>,
    analysis: Analysis,
    environment: Environment,
    /// Releases by the last statistics of each group: fewer than there are if the log was cut off later.
    released: BTreeMap<u16, u64>,
    ticks: BTreeMap<u16, u64>,
    lost_records: u64,
    span: Span,
    chunks: HashSet<Chunk>,
    indexed: Vec<ChunkIndex>,
    counts: [(u64, u64); 2],
    statistics: Option<Statistics>,
}

impl Checker {
    fn run<R: Read + Seek>(mut self, mut records: Salvage<R>, mut progress: impl FnMut(u64, u64)) -> CheckReport {
        let mut chunk = None;
        let mut damaged = false;
        let length = records.length();
        while let Some(found) = records.next() {
            let (opcode, stream) = match found {
                Found::Record(opcode, stream) => (opcode, stream),
                Found::Damage(damage) => {
                    damaged = true;
                    self.report.find(damage.what);
                    continue;
                }
            };
            if let Some((start, head)) = stream.chunk().filter(|(start, _)| chunk != Some(*start)) {
                chunk = Some(start);
                self.report.chunks += 1;
                self.report.checksummed_chunks += u64::from(head.checksum != 0 && !head.is_cut);
                let times = (head.first_time, head.last_time);
                self.chunks.insert((start, head.length, times, head.unpacked, head.compression.clone()));
                progress(stream.offset(), length);
            }
            let in_chunk = stream.chunk().map(|(_, head)| (head.first_time, head.last_time));
            self.record(opcode, stream.body(), in_chunk);
        }
        self.report.is_checksummed = records.is_checksummed();
        self.report.span = self.span.0;
        self.groups();
        if !damaged {
            self.index();
        }
        self.report
    }

    fn record(&mut self, opcode: u8, body: &[u8], in_chunk: Option<(u64, u64)>) {
        match parse_record(opcode, body) {
            Ok(Record::Message { header, data }) => self.message(&header, &data, in_chunk),
            Ok(Record::Schema { header, data }) => {
                self.schemas.insert(header.id, TopicKind::of_schema(&header.name, &data));
            }
            Ok(Record::Channel(channel)) => {
                let kind = self.schemas.get(&channel.schema_id).copied().flatten();
                let known = self.channels.entry(channel.id).or_default();
                if known.topic.is_empty() {
                    (known.topic, known.kind) = (channel.topic, kind);
                } else if known.topic != channel.topic {
                    let (id, first) = (channel.id, &known.topic);
                    self.report.find(format!("channel {id} is {first} first and {} later", channel.topic));
                }
            }
            Ok(Record::Metadata(metadata)) => {
                self.counts[0].0 += 1;
                if metadata.name == "environment" {
                    self.environment = Environment::from_map(&metadata.metadata);
                    self.analysis.set_environment(&self.environment);
                }
            }
            Ok(Record::Attachment { .. }) => self.counts[1].0 += 1,
            Ok(Record::Statistics(statistics)) => self.statistics = Some(statistics),
            Ok(Record::ChunkIndex(index)) => self.indexed.push(index),
            Ok(Record::MetadataIndex(_)) => self.counts[0].1 += 1,
            Ok(Record::AttachmentIndex(_)) => self.counts[1].1 += 1,
            Ok(_) => {}
            Err(_) if opcode == op::MESSAGE => self.report.find("a message without its header".into()),
            Err(error) => self.report.find(format!("a record does not decode: {error}")),
        }
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8], in_chunk: Option<(u64, u64)>) {
        self.report.messages += 1;
        self.span.push(header.log_time);
        let id = header.channel_id;
        let channel = self.channels.entry(id).or_default();
        let mut found = Vec::new();
        if channel.topic.is_empty() && channel.messages == 0 {
            found.push(format!("messages on channel {id}, which is not declared"));
        }
        if in_chunk.is_some_and(|(first, last)| !(first..=last).contains(&header.log_time)) {
            found.push("is outside of the times that its chunk names".to_owned());
        }
        if let Some(kind) = channel.kind {
            // palpate counts from 0 or from 1.
            let due = if channel.messages == 0 { header.sequence.min(1) } else { channel.next_sequence };
            if header.sequence != due {
                found.push(format!("has sequence number {} where {due} is due", header.sequence));
            }
            if header.log_time < channel.newest
                && !matches!(kind, TopicKind::Log | TopicKind::Ports | TopicKind::Inputs)
            {
                found.push(format!("goes back in time by {} ns", channel.newest - header.log_time));
            }
            match LogEntry::decode(kind, data) {
                Ok(entry) => {
                    self.report.decoded += 1;
                    match &entry {
                        Some(LogEntry::Record(LogRecord::Tick(timing))) => {
                            *self.ticks.entry(timing.group).or_default() += 1;
                            entry.iter().for_each(|entry| self.analysis.push_entry(entry));
                        }
                        Some(LogEntry::Stats(stats)) => {
                            self.released.insert(stats.group, stats.released);
                            self.lost_records = self.lost_records.max(stats.lost_records);
                        }
                        _ => {}
                    }
                }
                Err(error) => found.push(format!("does not decode: {error}")),
            }
        }
        channel.next_sequence = header.sequence.wrapping_add(1);
        channel.newest = channel.newest.max(header.log_time);
        channel.messages += 1;
        for what in found {
            channel.findings += 1;
            self.report.count += 1;
            if channel.findings <= PER_TOPIC && self.report.findings.len() < FINDINGS_KEPT {
                let (topic, number) = (&channel.topic, channel.messages);
                let more =
                    if channel.findings == PER_TOPIC { " (further ones of this topic are only counted)" } else { "" };
                let (topic, what) = (printable(topic), printable(&what));
                self.report.findings.push(format!("{topic}: message {number} {what}{more}"));
            }
        }
    }

    /// The books of the rate groups.
    fn groups(&mut self) {
        for (&group, &ticks) in &self.ticks {
            let name = self.environment.group_name(group);
            if let Some(&released) = self.released.get(&group)
                && released > ticks
            {
                self.report
                    .find(format!("/timing/{name} holds {ticks} releases, but {released} were counted in the run"));
            }
        }
        for group in self.analysis.report().groups {
            let (released, skipped, elapsed) = (group.released, group.skipped.total(), group.elapsed_periods);
            if released + skipped != elapsed {
                let name = group.name;
                self.report.find(format!(
                    "{name}: {released} released + {skipped} skipped are not the {elapsed} elapsed periods"
                ));
            }
        }
        if self.lost_records > 0 {
            self.report.find(format!("{} records were lost while it was written", self.lost_records));
        }
    }

    /// The index against what was read.
    fn index(&mut self) {
        let Some(statistics) = self.statistics.take() else { return };
        let read: BTreeMap<u16, u64> = self.channels.iter().map(|(&id, channel)| (id, channel.messages)).collect();
        let [(metadata, metadata_indexed), (attachments, attachments_indexed)] = self.counts;
        let totals = [
            ("messages", statistics.message_count, self.report.messages),
            ("chunks", statistics.chunk_count.into(), self.report.chunks),
            ("metadata records", statistics.metadata_count.into(), metadata),
            ("attachments", statistics.attachment_count.into(), attachments),
        ];
        for (what, counted, found) in totals {
            if counted != found {
                self.report.find(format!("the index counts {counted} {what}, but there are {found}"));
            }
        }
        for (id, &found) in &read {
            let counted = statistics.channel_message_counts.get(id).copied().unwrap_or(0);
            if counted != found {
                let topic = &self.channels[id].topic;
                self.report.find(format!("the index counts {counted} messages on {topic}, but there are {found}"));
            }
        }
        if let Some((first, last)) = self.span.0
            && (statistics.message_start_time, statistics.message_end_time) != (first, last)
        {
            self.report.find("the times of the first and last message in the index are wrong".into());
        }
        // What a program leaves out of its index is its choice; what is in it must be right.
        for (what, listed, there) in
            [("metadata records", metadata_indexed, metadata), ("attachments", attachments_indexed, attachments)]
        {
            if listed > 0 && listed != there {
                self.report.find(format!("the index lists {listed} of {there} {what}"));
            }
        }
        let key = |index: &ChunkIndex| {
            let times = (index.message_start_time, index.message_end_time);
            (index.chunk_start_offset, index.chunk_length, times, index.uncompressed_size, index.compression.clone())
        };
        if !self.indexed.is_empty() {
            let wrong = self.indexed.iter().filter(|index| !self.chunks.contains(&key(index))).count();
            let (listed, there) = (self.indexed.len(), self.chunks.len());
            if wrong > 0 || listed != there {
                self.report.find(format!("the index lists {listed} chunks of {there}, {wrong} of them wrongly"));
            }
        }
    }
}
