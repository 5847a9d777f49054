//! Logs come back as they were written, whole or damaged.
#![cfg(feature = "log")]

mod log_sample;

use std::io::{self, Write};

use log_sample::{entries, environment, log_of, time_of};
use palpate::ErrorKind;
use palpate::log::{Environment, LogEntry, LogReader, LogRecord, McapWriter};
use palpate::runtime::record::Record;
use palpate::time::Nanos;
use proptest::prelude::*;

fn read(bytes: &[u8]) -> (Vec<LogEntry>, Option<String>) {
    let mut reader = LogReader::new(bytes, "memory").unwrap();
    let entries = reader.by_ref().collect();
    (entries, reader.damage().map(str::to_owned))
}

/// Entries as bits, so that -0.0 differs from 0.0.
fn bits(entries: &[LogEntry]) -> Vec<(String, Option<Record>)> {
    let of = |entry: &LogEntry| match entry {
        LogEntry::Record(record) => (String::new(), Some(Record::from(*record))),
        other => (format!("{other:?}"), None),
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
    let (got, damage) = read(&bytes[..bytes.len() / 2]);
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
    assert!(matches!(reader.next(), Some(LogEntry::Environment(_))));
    assert_eq!(reader.next(), Some(LogEntry::Record(record)));
    assert!(matches!(record, LogRecord::Tick(_)));
    assert_eq!(reader.topic(), "/timing/haptic");
    assert_eq!(reader.next(), None);
    assert_eq!(reader.damage(), None);
    assert_eq!(reader.topics().len(), 13);
}

// What the frame holds besides chunk contents has no checksum: opcodes, lengths, the headers of chunks.
#[test]
fn one_wrong_bit_in_the_frame_of_the_file_never_forges_a_message() {
    const CHUNK: u8 = 6;
    let sent = entries(60);
    let clean = log_of(&sent, 120);
    let known = bits(&sent);
    let mut bytes = clean.clone();
    let mut at = 8;
    let mut tried = 0;
    while at + 9 < clean.len() - 8 {
        let length = usize::try_from(u64::from_le_bytes(clean[at + 1..at + 9].try_into().unwrap())).unwrap();
        let head = 9 + if clean[at] == CHUNK { 44 } else { 0 };
        for place in at..at + head {
            for bit in 0..8 {
                bytes[place] ^= 1 << bit;
                let (got, damage) = read(&bytes);
                let records: Vec<_> = got.into_iter().filter(|entry| matches!(entry, LogEntry::Record(_))).collect();
                let forged = bits(&records).into_iter().find(|record| !known.contains(record));
                assert_eq!(forged, None, "bit {bit} of byte {place}, record {} at byte {at}: {damage:?}", clean[at]);
                bytes[place] = clean[place];
                tried += 1;
            }
        }
        at += 9 + length;
    }
    assert!(tried > 5000, "{tried}");
}
