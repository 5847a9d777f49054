//! A damaged log is read up to the damage and recovered behind it: cut at every 4 KiB boundary, and with wrong bits anywhere.

use std::collections::{BTreeMap, HashMap};
use std::io::{Cursor, Read, Seek, SeekFrom};

use crate::log_file::{LogInfo, Recovered, check, recover};
use mcap::records::op;
use palpate::log::{GroupStats, LogEntry, LogReader, LogRecord};
use palpate::runtime::{Record, TickTiming};
use proptest::prelude::*;

use super::log_sample::log_of;

const BOUNDARY: usize = 4096;

/// The sample without its slips, which skip no tick, and its losses: the books of a sound log add up.
fn entries(ticks: u64) -> Vec<LogEntry> {
    let even = |entry| match entry {
        LogEntry::Record(LogRecord::Tick(timing)) => {
            LogEntry::Record(LogRecord::Tick(TickTiming { slips: 0, given_up: 0, ..timing }))
        }
        LogEntry::Stats(stats) => LogEntry::Stats(GroupStats { lost_records: 0, ..stats }),
        other => other,
    };
    super::log_sample::entries(ticks).into_iter().map(even).collect()
}

/// A log of 110 boundaries and more, in some thirty chunks.
fn long_log() -> Vec<u8> {
    let bytes = log_of(&entries(3600), 1000);
    assert!(bytes.len() > 110 * BOUNDARY, "{}", bytes.len());
    bytes
}

fn read(bytes: &[u8]) -> (Vec<LogEntry>, Option<String>) {
    let mut reader = LogReader::new(bytes, "memory").unwrap();
    let entries = reader.readable().collect();
    (entries, reader.damage().map(str::to_owned))
}

fn recovered(bytes: &[u8]) -> (Recovered, Vec<u8>) {
    recover(Cursor::new(bytes), "old", Vec::new(), "new", |_, _| ()).unwrap()
}

/// Entries as bits, so that -0.0 differs from 0.0.
fn bits(entries: &[LogEntry]) -> Vec<(String, [Option<Record>; 2])> {
    let of = |entry: &LogEntry| match entry {
        LogEntry::Record(record) => (String::new(), record.to_records()),
        other => (format!("{other:?}"), [None; 2]),
    };
    entries.iter().map(of).collect()
}

/// Every message as it is in the file: topic, sequence, both times, bytes.
fn raw(bytes: &[u8]) -> Vec<(String, u32, u64, u64, Vec<u8>)> {
    let message = |message: mcap::McapResult<mcap::Message<'_>>| {
        let message = message.unwrap();
        let topic = message.channel.topic.clone();
        (topic, message.sequence, message.log_time, message.publish_time, message.data.into_owned())
    };
    mcap::MessageStream::new(bytes).unwrap().map(message).collect()
}

// Check that what is read of each cut begins what is read of the whole and never shrinks, and that a sound log of exactly
// that is recovered.
#[test]
fn a_log_cut_at_every_4_kib_is_read_up_to_the_cut_and_recovered_as_a_sound_log() {
    let bytes = long_log();
    let whole = bits(&read(&bytes).0);
    let messages = raw(&bytes);
    let (mut longest, mut cuts) = (0, 0);
    for cut in (BOUNDARY..bytes.len()).step_by(BOUNDARY) {
        let (got, damage) = read(&bytes[..cut]);
        assert!(damage.is_some(), "cut at {cut}");
        assert!(got.len() >= longest && bits(&got) == whole[..got.len()], "cut at {cut}");
        longest = got.len();
        let (report, new) = recovered(&bytes[..cut]);
        assert_eq!(report.lost.len(), 1, "cut at {cut}: {report:?}");
        let sound = check(Cursor::new(&new), "new", |_, _| ()).unwrap();
        assert!(sound.is_sound() && sound.is_checksummed, "cut at {cut}: {sound:?}");
        let (again, damage) = read(&new);
        assert_eq!(damage, None, "cut at {cut}");
        assert!(bits(&again) == bits(&got), "cut at {cut}");
        let copied = raw(&new);
        assert!(copied == messages[..copied.len()] && copied.len() as u64 == report.messages, "cut at {cut}");
        cuts += 1;
    }
    assert!(cuts >= 110 && longest > whole.len() * 9 / 10, "{cuts} {longest} of {}", whole.len());
}

#[test]
fn a_whole_log_is_recovered_whole() {
    let bytes = long_log();
    let (report, new) = recovered(&bytes);
    assert_eq!((report.lost.len(), report.lost_bytes(), report.counted), (0, 0, Some(report.messages)));
    assert!(raw(&new) == raw(&bytes) && bits(&read(&new).0) == bits(&read(&bytes).0));
    let (old, new) = (info(&bytes), info(&new));
    assert_eq!((&old.topics, &old.metadata, old.span), (&new.topics, &new.metadata, new.span));
    assert_eq!((&old.attachments, &old.library, &old.profile), (&new.attachments, &new.library, &new.profile));
}

fn info(bytes: &[u8]) -> LogInfo {
    LogInfo::of(Cursor::new(bytes), "memory", |_, _| ()).unwrap()
}

/// Start and length of each chunk, opcode and length included.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut chunks, mut at) = (Vec::new(), 8);
    while at + 9 <= bytes.len() - 8 {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == 6 {
            chunks.push((at, 9 + length));
        }
        at += 9 + length;
    }
    chunks
}

// Check that a chunk with a wrong byte is left out and all others are there: in its data, in its header, in its length, also
// if it is the first one, which declares the channels.
#[test]
fn behind_a_damaged_chunk_the_next_one_is_read() {
    let bytes = long_log();
    let chunks = chunks(&bytes);
    assert!(chunks.len() > 10);
    let all = raw(&bytes);
    for (damaged, place) in [(0, 200), (5, 200), (5, 1), (5, 3), (5, 26), (5, 0), (chunks.len() - 1, 200)] {
        let mut wrong = bytes.clone();
        wrong[chunks[damaged].0 + place] ^= 0x10;
        let (report, new) = recovered(&wrong);
        let place = format!("byte {place} of chunk {damaged}: {:?}", report.lost);
        assert_eq!(report.lost.len(), 1, "{place}");
        assert_eq!(report.chunks as usize, chunks.len() - 1, "{place}");
        assert_eq!(read(&new).1, None, "{place}");
        let lost = all.len() - raw(&new).len();
        assert_eq!(report.counted, Some(report.messages + lost as u64), "{place}");
        // The last chunk ends with the run.
        assert!((lost > 500 || damaged + 1 == chunks.len()) && lost < 1100, "{place}: {lost}");
        assert!(is_subsequence(&raw(&new), &all), "{place}");
        let found = check(Cursor::new(&wrong), "wrong", |_, _| ()).unwrap();
        assert!(!found.is_sound() && found.messages == report.messages, "{place}: {found:?}");
        if place.starts_with("byte 0 ") {
            // A record of a kind that nobody knows is passed over, by the format; that something is wrong was noticed.
            continue;
        }
        let gap = &report.lost[0];
        let expected = (damaged != 0, damaged != chunks.len() - 1);
        assert_eq!((gap.after.is_some(), gap.before.is_some()), expected, "{place}");
        assert!(report.lost_bytes() >= chunks[damaged].1 as u64, "{place}");
    }
}

fn is_subsequence<T: PartialEq>(part: &[T], whole: &[T]) -> bool {
    let mut rest = whole.iter();
    part.iter().all(|one| rest.any(|other| other == one))
}

#[test]
fn the_index_and_a_scan_say_the_same() {
    let bytes = long_log();
    let by_index = info(&bytes);
    let data_end = bytes.windows(9).rposition(|w| w == [15, 4, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    let by_scan = info(&bytes[..data_end]);
    assert!(by_index.has_index && !by_scan.has_index);
    assert_eq!(by_scan.damage, [format!("the log ends without its index at byte {data_end}: the run was cut off")]);
    let packed = |info: &LogInfo| info.chunks["lz4"].count;
    assert_eq!(packed(&by_index), packed(&by_scan));
    let same = |info: &LogInfo| (info.messages, info.span, info.topics.clone(), info.environment.clone());
    assert_eq!(same(&by_index), same(&by_scan));
}

// Check that a log of another program, with messages outside of chunks and types that palpate does not know, comes back.
#[test]
fn logs_of_other_programs_are_recovered_too() {
    for use_chunks in [true, false] {
        let options = mcap::WriteOptions::new().compression(None).use_chunks(use_chunks).library("other");
        let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
        let schema = writer.add_schema_with_id(7, "Thing", "jsonschema", b"{}").unwrap();
        let metadata = BTreeMap::from([("unit".to_owned(), "m".to_owned())]);
        writer.add_channel_with_id(40, schema, "/thing", "json", &metadata).unwrap();
        for i in 0..1000_u32 {
            let (channel_id, time) = (40, u64::from(i) * 1000);
            let header =
                mcap::records::MessageHeader { channel_id, sequence: i, log_time: time, publish_time: time + 7 };
            writer.write_to_known_channel(&header, format!("{{\"x\": {i}}}").as_bytes()).unwrap();
        }
        writer.finish().unwrap();
        let bytes = writer.into_inner().into_inner();
        let sound = check(Cursor::new(&bytes), "other", |_, _| ()).unwrap();
        assert_eq!((sound.findings.len(), sound.messages, sound.decoded), (0, 1000, 0), "{sound:?}");
        let (report, new) = recovered(&bytes[..bytes.len() / 2]);
        assert!(report.messages > 200, "{report:?}");
        assert!(raw(&new) == raw(&bytes)[..report.messages as usize]);
        let summary = mcap::Summary::read(&new).unwrap().unwrap();
        let channel = &summary.channels[&40];
        assert_eq!((&channel.metadata, channel.schema.as_ref().unwrap().id), (&metadata, 7));
        assert_eq!(info(&new).library, "other");
    }
}

#[test]
fn a_check_names_what_a_sound_file_lacks() {
    // A log whose fifth chunk was taken out, index and all: each record of it is sound.
    let bytes = long_log();
    let mut wrong = bytes.clone();
    wrong[chunks(&bytes)[5].0 + 200] ^= 1;
    let (_, new) = recovered(&wrong);
    let report = check(Cursor::new(&new), "new", |_, _| ()).unwrap();
    let found = |words: &str| report.findings.iter().any(|finding| finding.contains(words));
    assert!(found("has sequence number"), "{:?}", report.findings);
    assert!(found("released +") && found("are not the"), "{:?}", report.findings);
    assert!(report.is_checksummed);
}

// An index that does not fit its checksum names no channels: a wrong topic in it would be given to good messages.
#[test]
fn what_a_damaged_index_says_is_not_believed() {
    let clean = log_of(&entries(60), 120);
    let mut bytes = clean.clone();
    bytes[chunks(&clean)[0].0 + 200] ^= 1;
    let in_index = clean.windows(6).rposition(|window| window == b"/probe").unwrap();
    assert!(in_index > chunks(&clean).last().unwrap().0, "the index repeats every channel");
    bytes[in_index] ^= 1;
    let (_, new) = recovered(&bytes);
    let known = raw(&clean);
    assert!(raw(&new).iter().all(|message| known.contains(message)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Check that wrong bits, with or without a cut, never panic, and that what is recovered was written: no message that
    // was not there, none twice, none out of order.
    #[test]
    fn what_is_recovered_of_wrong_bits_was_written(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let clean = log_of(&entries(60), 120);
        let mut bytes = clean.clone();
        for (at, bit) in &flips {
            let at = 8 + at.index(bytes.len() - 8);
            bytes[at] ^= 1 << bit;
        }
        let is_whole = cut.is_none();
        bytes.truncate(cut.map_or(bytes.len(), |cut| 8 + cut.index(bytes.len() - 8)));
        let _ = info(&bytes);
        let _ = check(Cursor::new(&bytes), "memory", |_, _| ()).unwrap();
        let (report, new) = recovered(&bytes);
        prop_assert_eq!(read(&new).1, None);
        let got = raw(&new);
        prop_assert_eq!(got.len() as u64, report.messages);
        // The last chunk of a cut file cannot be checked.
        if is_whole {
            let mut left: HashMap<_, usize> = HashMap::new();
            raw(&clean).into_iter().for_each(|message| *left.entry(message).or_default() += 1);
            for message in got {
                let known = left.get_mut(&message).filter(|left| **left > 0);
                prop_assert!(known.is_some(), "{:?}", message);
                *left.entry(message).or_default() -= 1;
            }
        }
    }
}

/// A record of an MCAP file.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat()
}

/// The header of a log.
fn head() -> Vec<u8> {
    [mcap::MAGIC, &record(op::HEADER, &[0; 8])].concat()
}

#[test]
fn an_attachment_with_a_wrong_checksum_is_named_as_lost() {
    // 68 bytes behind times and names, and a checksum that is not theirs.
    let body = [[0; 24].as_slice(), &68_u64.to_le_bytes(), &[0; 68], &[1, 0, 0, 0]].concat();
    let log = [head(), record(op::ATTACHMENT, &body), record(op::DATA_END, &[0; 4]), record(op::FOOTER, &[0; 20])];
    let bytes = [log.concat().as_slice(), mcap::MAGIC].concat();
    let (report, _) = recovered(&bytes);
    assert_eq!((report.attachments, report.lost.len(), report.lost_bytes()), (0, 1, 113), "{report:?}");
    assert!(report.lost[0].damage.what.contains("a record does not decode"), "{report:?}");
}

// Check that messages of a chunk before it are not taken for messages of the record that is cut.
#[test]
fn a_record_that_is_cut_behind_a_chunk_is_lost_with_all_of_its_bytes() {
    let bytes = long_log();
    let (at, length) = *chunks(&bytes).last().unwrap();
    let metadata = record(op::METADATA, &[0; 100]);
    let cut = [&bytes[..at + length], &metadata[..60]].concat();
    let (report, _) = recovered(&cut);
    assert_eq!((report.lost.len(), report.lost[0].saved, report.lost_bytes()), (1, 0, 60), "{report:?}");
}

/// Counts the bytes read of a file.
struct Counted<'a>(Cursor<&'a [u8]>, &'a mut u64);

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.0.read(buffer)?;
        *self.1 += count as u64;
        Ok(count)
    }
}

impl Seek for Counted<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

// Check that an index of a thousand records, each of which claims the rest of the file, does not have the file read for each.
#[test]
fn records_within_records_that_an_index_lists_are_read_once() {
    let (heads, start) = (1000_u64, head().len() as u64);
    let mut data = head();
    let length = 9 * heads;
    for number in 1..=heads {
        data.push(op::METADATA);
        data.extend((length - 9 * number).to_le_bytes());
    }
    data.extend(record(op::DATA_END, &[0; 4]));
    let index_at = data.len() as u64;
    for number in 0..heads {
        let place = [start + 9 * number, 0].map(u64::to_le_bytes).concat();
        data.extend(record(op::METADATA_INDEX, &[place.as_slice(), &[0; 4]].concat()));
    }
    data.extend(record(op::STATISTICS, &[0; 46]));
    data.extend(record(op::FOOTER, &[index_at.to_le_bytes().as_slice(), &[0; 12]].concat()));
    data.extend(mcap::MAGIC);
    let (size, mut read) = (data.len() as u64, 0);
    LogInfo::of(Counted(Cursor::new(&data), &mut read), "memory", |_, _| ()).unwrap();
    assert!(read < 5 * size, "{read} bytes of {size}");
    read = 0;
    recover(Counted(Cursor::new(&data), &mut read), "old", Vec::new(), "new", |_, _| ()).unwrap();
    assert!(read < 5 * size, "{read} bytes of {size}");
}
