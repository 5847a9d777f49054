//! Logs come back as they were written, whole or damaged.

mod log_sample;

use std::io::{self, Write};

use log_sample::{entries, environment, log_of, time_of};
use palpate::ErrorKind;
use palpate::log::{
    ContactPointSample, ContactSample, Environment, LogEntry, LogReader, LogRecord, McapWriter, SceneFrame,
};
use palpate::runtime::Nanos;
use palpate::runtime::Record;
use proptest::prelude::*;

fn read(bytes: &[u8]) -> (Vec<LogEntry>, Option<String>) {
    let mut reader = LogReader::new(bytes, "memory").unwrap();
    let entries = reader.readable().collect();
    (entries, reader.damage().map(str::to_owned))
}

/// Entries as bits, so that -0.0 differs from 0.0.
fn bits(entries: &[LogEntry]) -> Vec<(String, [Option<Record>; 2])> {
    let of = |entry: &LogEntry| match entry {
        LogEntry::Record(record) => (String::new(), record.to_records()),
        other => (format!("{other:?}"), [None; 2]),
    };
    entries.iter().map(of).collect()
}

#[test]
fn every_kind_of_entry_comes_back_bit_for_bit() {
    let sent = entries(120);
    let (got, damage) = read(&log_of(&sent, 100));
    assert_eq!(damage, None);
    assert_eq!(got[0], LogEntry::Environment(environment()));
    assert!(bits(&got[1..]) == bits(&sent));
}

// Check that what a full ring left of a tick is never read as that of another tick or device.
#[test]
fn places_of_a_contact_that_was_lost_are_no_other_contacts() {
    let point = |ms: u64, device, triangle| {
        let time = Nanos(ms * 1_000_000);
        LogRecord::ContactPoint(ContactPointSample { time, device, triangle, ..ContactPointSample::default() })
    };
    let contact = |ms: u64, device, count| {
        let time = Nanos(ms * 1_000_000);
        LogRecord::Contact(ContactSample { time, device, count, area_m2: 1e-6, ..ContactSample::default() })
    };
    let sent = [
        point(1, 0, 10),
        point(1, 1, 11),
        // The contact of device 0 is missing in tick 1, one of two places in tick 2, both in tick 3.
        contact(1, 1, 1),
        point(2, 0, 20),
        contact(2, 0, 2),
        contact(3, 0, 2),
        point(4, 0, 40),
    ];
    let (got, damage) = read(&log_of(&sent.map(LogEntry::Record), 100));
    let expected = [point(1, 1, 11), contact(1, 1, 1), point(2, 0, 20), contact(2, 0, 2), contact(3, 0, 2)];
    assert_eq!((&got[1..], damage), (&expected.map(LogEntry::Record)[..], None));
}

#[test]
fn a_log_without_any_record_is_a_whole_log() {
    let (got, damage) = read(&log_of(&[], 1));
    assert_eq!((got, damage), (vec![LogEntry::Environment(environment())], None));
}

// Check that what is read from the first n bytes begins what is read from the first n + 1, and never shrinks.
fn assert_every_cut_reads_a_prefix(bytes: &[u8], step: usize) {
    let (whole, _) = read(bytes);
    let mut longest = 0;
    for cut in (8..bytes.len()).step_by(step) {
        let (got, damage) = read(&bytes[..cut]);
        assert!(damage.is_some(), "cut at {cut}");
        assert!(got.len() >= longest, "cut at {cut}: {} after {longest}", got.len());
        assert!(bits(&got) == bits(&whole[..got.len()]), "cut at {cut}");
        longest = got.len();
    }
    assert!(longest > whole.len() / 2, "the last cuts keep nearly everything");
}

#[test]
fn a_log_cut_at_any_byte_reads_up_to_the_cut() {
    assert_every_cut_reads_a_prefix(&log_of(&entries(20), 40), 1);
}

#[test]
fn a_longer_log_cut_anywhere_reads_up_to_the_cut() {
    assert_every_cut_reads_a_prefix(&log_of(&entries(400), 900), 97);
}

#[test]
fn the_messages_before_the_cut_inside_a_large_chunk_are_read() {
    let sent = entries(3000);
    let bytes = log_of(&sent, usize::MAX);
    // Opcode 6 is a chunk.
    let (start, _, length) = frame(&bytes).into_iter().find(|&(_, opcode, _)| opcode == 6).unwrap();
    let (got, damage) = read(&bytes[..start + length / 2]);
    let damage = damage.unwrap();
    assert!(damage.contains("cut off at byte") && damage.contains("in the chunk"), "{damage}");
    assert!(got.len() > sent.len() / 10, "{} of {}", got.len(), sent.len());
}

#[test]
fn a_log_without_its_index_says_that_the_run_was_cut_off() {
    let flushed = log_of(&[], 1);
    // The index begins with the data-end record, whose opcode is 15 and whose length is 4.
    let data_end = flushed.windows(9).position(|w| w == [15, 4, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    let (_, damage) = read(&flushed[..data_end]);
    assert_eq!(damage, Some(format!("the log ends without its index at byte {data_end}: the run was cut off")));
}

#[test]
fn what_is_no_mcap_is_refused_as_input() {
    for bytes in [&b""[..], b"\x89MCA", b"t_s,fx_n,fy_n,fz_n\n"] {
        let error = LogReader::new(bytes, "path.csv").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Log);
        assert_eq!(error.to_string(), "path.csv: no MCAP file: it does not begin with the MCAP magic");
    }
}

#[test]
fn messages_inside_a_chunk_are_put_in_time_order() {
    let mut sent = entries(30);
    sent.reverse();
    let (got, damage) = read(&log_of(&sent, usize::MAX));
    assert_eq!(damage, None);
    assert!(got.iter().map(time_of).is_sorted());
}

/// Check that what comes when younger messages have been written goes back in no reader's time, and keeps its own.
#[test]
fn a_message_that_comes_too_late_has_the_log_time_of_the_newest_before_it() {
    let sent = entries(30);
    // The second half first, each entry in a chunk of its own.
    let (early, late) = sent.split_at(sent.len() / 2);
    let bytes = log_of(&[late, early].concat(), 1);
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let times: Vec<[u64; 2]> = messages.map(|message| [message.log_time, message.publish_time]).collect();
    assert!(times.is_sorted_by_key(|[logged, _]| *logged));
    assert!(times.iter().any(|[logged, published]| logged > published));
    let mut newest = 0;
    for [logged, published] in times {
        newest = published.max(newest);
        assert_eq!(logged, newest);
    }
    let (got, damage) = read(&bytes);
    assert_eq!(damage, None);
    let sorted = |entries: &[LogEntry]| {
        let mut bits: Vec<String> = bits(entries).iter().map(|bits| format!("{bits:?}")).collect();
        bits.sort();
        bits
    };
    assert_eq!(got[0], LogEntry::Environment(environment()));
    assert!(sorted(&got[1..]) == sorted(&sent), "each with the time at which it was");
}

#[test]
fn grants_known_after_the_start_replace_the_first_environment() {
    let late = Environment { granted: [("mlock".to_owned(), "granted".to_owned())].into(), ..environment() };
    // Before the first chunk: one record. After it: a second one, which comes later and counts.
    let (early, _) = read(&log_of(&[LogEntry::Environment(late.clone())], 2));
    assert_eq!(early, [LogEntry::Environment(late.clone())]);
    let (both, _) = read(&log_of(&[entries(1).remove(0), LogEntry::Environment(late.clone())], 1));
    assert_eq!((both.len(), &both[2]), (3, &LogEntry::Environment(late)));
}

#[test]
fn chunks_are_flushed_by_log_time_or_by_wall_time() {
    let shared = Shared::default();
    let mut sizes = Vec::new();
    let mut writer = McapWriter::new(shared.clone(), "memory", &environment()).unwrap();
    for (log_ms, wall_ms) in [(10, 10), (499, 499), (500, 499), (501, 998), (502, 999)] {
        let LogEntry::Record(record) = entries(1).remove(1) else { panic!("the second entry is a record") };
        writer.write(&record).unwrap();
        writer.flush_if_due(Nanos(log_ms * 1_000_000), Nanos(wall_ms * 1_000_000)).unwrap();
        sizes.push(shared.len());
    }
    let grew: Vec<bool> = sizes.windows(2).map(|pair| pair[1] > pair[0]).collect();
    assert_eq!(grew, [false, true, false, true]);
}

#[test]
fn a_full_disk_is_an_error_and_leaves_a_readable_log() {
    let disk = Shared { limit: Some(40_000), ..Shared::default() };
    let mut writer = McapWriter::new(disk.clone(), "memory", &environment()).unwrap();
    let mut failures = 0;
    for entry in entries(2000) {
        if let LogEntry::Record(record) = entry {
            failures += u32::from(writer.write(&record).is_err());
            failures += u32::from(writer.flush_if_due(record.time(), Nanos::ZERO).is_err());
        }
    }
    assert!(failures > 0);
    assert_eq!(writer.finish().unwrap_err().kind(), ErrorKind::Io);
    let (got, damage) = read(&disk.bytes.lock().unwrap());
    assert!(got.len() > 100 && damage.is_some(), "{} {damage:?}", got.len());
}

/// A file in memory that can be looked at while it is written, and that may be full.
#[derive(Clone, Debug, Default)]
struct Shared {
    bytes: std::sync::Arc<std::sync::Mutex<Vec<u8>>>,
    limit: Option<usize>,
}

impl Shared {
    fn len(&self) -> usize {
        self.bytes.lock().unwrap().len()
    }
}

impl Write for Shared {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let mut bytes = self.bytes.lock().unwrap();
        let room = self.limit.map_or(buffer.len(), |limit| limit - bytes.len()).min(buffer.len());
        if room == 0 && !buffer.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        bytes.extend_from_slice(&buffer[..room]);
        Ok(room)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    // Check that wrong bytes anywhere neither panic nor let a wrong record through: what is read before the damage was
    // written.
    #[test]
    fn flipped_bits_never_panic_and_never_forge_a_message(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let sent = entries(60);
        let mut bytes = log_of(&sent, 120);
        for (at, bit) in &flips {
            let at = 8 + at.index(bytes.len() - 8);
            bytes[at] ^= 1 << bit;
        }
        let whole = cut.is_none();
        bytes.truncate(cut.map_or(bytes.len(), |cut| 8 + cut.index(bytes.len() - 8)));
        let (got, _) = read(&bytes);
        if whole {
            let sent = bits(&sent);
            let records = got.iter().filter(|entry| matches!(entry, LogEntry::Record(_))).cloned().collect::<Vec<_>>();
            prop_assert!(bits(&records).iter().all(|record| sent.contains(record)));
        }
    }
}

#[test]
fn a_log_on_disk_is_read_through_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut writer = McapWriter::create(&path, &environment()).unwrap();
    let LogEntry::Record(record) = entries(1).remove(1) else { panic!("the second entry is a record") };
    writer.write(&record).unwrap();
    writer.finish().unwrap();
    let mut reader = LogReader::open(&path).unwrap();
    assert!(matches!(reader.next(), Some(Ok(LogEntry::Environment(_)))));
    assert_eq!(reader.next().unwrap().unwrap(), LogEntry::Record(record));
    assert!(matches!(record, LogRecord::Tick(_)));
    assert_eq!(reader.topic(), "/timing/haptic");
    assert!(reader.next().is_none());
    assert_eq!(reader.damage(), None);
    assert_eq!(reader.topics().len(), 14);
}

#[test]
fn a_picture_is_counted_and_gives_no_entry() {
    let mut writer = McapWriter::new(Vec::new(), "memory", &environment()).unwrap();
    writer.write_scene(&SceneFrame { time: Nanos(5), ..SceneFrame::default() }).unwrap();
    let bytes = writer.finish().unwrap();
    let mut reader = LogReader::new(bytes.as_slice(), "memory").unwrap();
    assert_eq!((reader.readable().count(), reader.damage()), (1, None));
    assert_eq!(reader.topics().get("/scene"), Some(&1));
}

// Check that another program's message of a well-known name is left alone: it has none of palpate's own fields.
#[test]
fn a_foreign_message_of_a_well_known_name_is_no_entry() {
    let mut file = mcap::Writer::new(io::Cursor::new(Vec::new())).unwrap();
    let schema = file.add_schema("foxglove.Log", "protobuf", b"without its fields").unwrap();
    let channel = file.add_channel(schema, "/rosout", "protobuf", &std::collections::BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 7, publish_time: 7 };
    // Field 3, the message.
    file.write_to_known_channel(&header, b"\x1a\x05hello").unwrap();
    file.finish().unwrap();
    let bytes = file.into_inner().into_inner();
    let mut reader = LogReader::new(bytes.as_slice(), "memory").unwrap();
    assert_eq!((reader.readable().count(), reader.damage()), (0, None));
    assert_eq!(reader.topics().get("/rosout"), Some(&1));
}

// Check that a log from before the well-known messages is refused in words: its tool samples would silently be missing.
#[test]
fn a_log_of_an_older_schema_is_refused_in_words() {
    let mut file = mcap::Writer::new(io::Cursor::new(Vec::new())).unwrap();
    let metadata = environment().to_map(1);
    file.write_metadata(&mcap::records::Metadata { name: "environment".into(), metadata }).unwrap();
    file.finish().unwrap();
    let (got, damage) = read(&file.into_inner().into_inner());
    assert_eq!(got, []);
    assert_eq!(damage.as_deref(), Some("the log has schema 1, which this build does not read"));
}

/// A small log with every type of record that a file can hold: attachments, two environments, two chunks.
fn one_of_everything() -> Vec<u8> {
    let environment =
        Environment { scene: Some("# a scene".into()), session: Some("# a session".into()), ..environment() };
    let mut writer = McapWriter::new(Vec::new(), "memory", &environment).unwrap();
    for entry in entries(2) {
        match &entry {
            LogEntry::Record(record) => writer.write(record).unwrap(),
            LogEntry::Text(event) => writer.write_text(event).unwrap(),
            LogEntry::Scene(frame) => writer.write_scene(frame).unwrap(),
            LogEntry::Stats(stats) => writer.write_stats(stats).unwrap(),
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => {}
        }
        if is_end_of_first_half(&entry) {
            writer.flush().unwrap();
            writer.set_environment(&environment);
        }
    }
    writer.finish().unwrap()
}

fn is_end_of_first_half(entry: &LogEntry) -> bool {
    matches!(entry, LogEntry::Record(LogRecord::Probe(probe)) if probe.time == Nanos::ZERO)
}

/// Start, opcode and length of the body of every record of the file.
fn frame(bytes: &[u8]) -> Vec<(usize, u8, usize)> {
    let mut records = Vec::new();
    let mut at = 8;
    while at + 8 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        records.push((at, bytes[at], length));
        at += 9 + length;
    }
    records
}

// Check that no wrong bit goes unnoticed and none forges a record: in the frame of every type of record, in metadata,
// attachments and chunks, in the index with its copies of schemas.
#[test]
fn one_wrong_bit_anywhere_is_damage_and_never_forges_a_message() {
    let clean = one_of_everything();
    let frame = frame(&clean);
    let opcodes: std::collections::BTreeSet<u8> = frame.iter().map(|(_, opcode, _)| *opcode).collect();
    // Messages are in chunks.
    let all = [1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
    assert_eq!(opcodes.into_iter().collect::<Vec<u8>>(), all, "header, footer, schema, ... data end");
    let (whole, damage) = read(&clean);
    assert_eq!(damage, None);
    let known = bits(&whole);
    let mut bytes = clean.clone();
    let data_end = frame.iter().find(|(_, opcode, _)| *opcode == 15).unwrap().0;
    let mut try_bit = |place: usize, bit: usize| {
        bytes[place] ^= 1 << bit;
        let (got, damage) = read(&bytes);
        bytes[place] = clean[place];
        assert!(damage.is_some(), "bit {bit} of byte {place} of {}, data ends at {data_end}", clean.len());
        let records: Vec<_> = got.into_iter().filter(|entry| matches!(entry, LogEntry::Record(_))).collect();
        let forged = bits(&records).into_iter().find(|record| !known.contains(record));
        assert_eq!(forged, None, "bit {bit} of byte {place}: {damage:?}");
    };
    for (start, opcode, length) in frame {
        // The sizes in the header of a chunk are part of the frame.
        let head = 9 + if opcode == 6 { 44 } else { 0 };
        for place in start..start + 9 + length {
            // Of packed messages and of the index one bit of a byte is as good as another, and of the copies of long
            // schemas one byte.
            let (one_bit, is_bulk) = (place % 8..place % 8 + 1, place >= start + head);
            let tried = match opcode {
                3 if is_bulk && !place.is_multiple_of(19) => 0..0,
                _ if is_bulk && (opcode == 6 || start > data_end) => one_bit,
                _ => 0..8,
            };
            tried.for_each(|bit| try_bit(place, bit));
        }
    }
}

// The name of the environment stands outside all chunks: without it the log looks like another program's.
#[test]
fn records_are_as_written_where_the_environment_is_lost() {
    let sent = entries(60);
    let mut bytes = log_of(&sent, 120);
    let name = bytes.windows(11).position(|window| window == b"environment").unwrap();
    bytes[name] ^= 1;
    let (got, damage) = read(&bytes);
    assert!(damage.is_some_and(|damage| damage.contains("checksum")));
    let records = |entries: &[LogEntry]| {
        bits(&entries.iter().filter(|entry| matches!(entry, LogEntry::Record(_))).cloned().collect::<Vec<_>>())
    };
    let (got, sent) = (records(&got), records(&sent));
    assert!(got.len() > 400 && got.iter().all(|record| sent.contains(record)));
}

// Check that nobody who reads a log with `?` can take part of it for all of it.
#[test]
fn damage_is_one_error_after_what_can_be_read_and_then_the_end() {
    let whole = one_of_everything();
    let cut = &whole[..whole.len() / 2];
    let (entries, damage) = read(cut);
    let mut reader = LogReader::new(cut, "memory").unwrap();
    let got: Vec<_> = reader.by_ref().take_while(Result::is_ok).map(Result::unwrap).collect();
    assert_eq!(got, entries);
    assert!(reader.next().is_none(), "the error was taken, and comes once");
    let error = LogReader::new(cut, "memory").unwrap().collect::<Result<Vec<_>, _>>().unwrap_err();
    assert_eq!((error.kind(), error.to_string()), (ErrorKind::Log, format!("memory: {}", damage.unwrap())));
    assert_eq!(
        LogReader::new(whole.as_slice(), "memory").unwrap().map(Result::unwrap).collect::<Vec<_>>(),
        read(&whole).0
    );
}

#[test]
fn a_log_says_whether_it_has_a_checksum() {
    let checked = |bytes: &[u8]| {
        let mut reader = LogReader::new(bytes, "memory").unwrap();
        reader.readable().for_each(drop);
        (reader.is_checksummed(), reader.damage().is_none())
    };
    let bytes = one_of_everything();
    assert_eq!(checked(&bytes), (true, true));
    let data_end = frame(&bytes).iter().find(|(_, opcode, _)| *opcode == 15).unwrap().0;
    assert_eq!(checked(&bytes[..data_end]), (false, false));
    // Other programs may leave it out, which by the format is a zero.
    let options = mcap::WriteOptions::new().calculate_data_section_crc(false).calculate_summary_section_crc(false);
    let mut foreign = options.create(io::Cursor::new(Vec::new())).unwrap();
    foreign.finish().unwrap();
    assert_eq!(checked(&foreign.into_inner().into_inner()), (false, true));
}
