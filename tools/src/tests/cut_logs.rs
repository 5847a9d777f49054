//! A real run's log cut at any byte: exports and analyses work up to the damage, and say so.

use palpate::log::{LogReader, Window};

use super::recorded;
use crate::export::export_table;
use crate::timing::{Selection, TimingAnalysis, timing_to_json};

const MAGIC: usize = 8;
/// A prime, so that cuts fall on every kind of boundary in turn.
const STEP: usize = 199;

/// The log of a short run in virtual time: several chunks, every topic in use.
fn log() -> Vec<u8> {
    recorded(0.0, 1.2)
}

fn exported(bytes: &[u8], topic: &str) -> (String, Option<String>) {
    let mut reader = LogReader::new(bytes, "cut.mcap").expect("it begins with the magic");
    let mut out = Vec::new();
    export_table(&mut reader, topic, false, &Window::default(), &mut out)
        .unwrap_or_else(|error| panic!("{topic}: {error}"));
    (String::from_utf8(out).unwrap(), reader.damage().map(str::to_owned))
}

fn analysed(bytes: &[u8]) -> (TimingAnalysis, Option<String>) {
    let mut reader = LogReader::new(bytes, "cut.mcap").expect("it begins with the magic");
    let mut analysis = TimingAnalysis::new(Selection::default());
    reader.readable().for_each(|entry| analysis.push_entry(&entry));
    (analysis, reader.damage().map(str::to_owned))
}

#[test]
fn every_cut_exports_a_prefix_and_is_called_damaged() {
    let bytes = log();
    for topic in ["/force", "/timing/local", "/resync"] {
        let (whole, damage) = exported(&bytes, topic);
        assert_eq!(damage, None);
        let (mut longest, mut lengths) = (0, std::collections::BTreeSet::new());
        // The last bytes one by one: the index and the closing magic.
        for cut in (MAGIC..bytes.len()).step_by(STEP).chain(bytes.len() - 64..bytes.len()) {
            let (text, damage) = exported(&bytes[..cut], topic);
            assert!(damage.is_some_and(|line| line.lines().count() == 1), "{topic} cut at {cut}");
            assert!(whole.starts_with(&text) && text.ends_with('\n'), "{topic} cut at {cut}");
            assert!(text.len() >= longest, "{topic} cut at {cut}: less than from a shorter log");
            longest = text.len();
            lengths.insert(longest);
        }
        assert_eq!(longest, whole.len(), "{topic}: cut off its index alone, a log still has every row");
        assert!(lengths.len() > 2, "{topic}: {lengths:?}");
    }
}

#[test]
fn every_cut_can_be_analysed() {
    let bytes = log();
    let mut last = 0;
    for cut in (MAGIC..bytes.len()).step_by(STEP) {
        let (analysis, damage) = analysed(&bytes[..cut]);
        assert!(damage.is_some(), "cut at {cut}");
        let report = analysis.report();
        assert!(report.run.devices[0].force.ticks >= last, "cut at {cut}");
        last = report.run.devices[0].force.ticks;
        assert_eq!(exported(&bytes[..cut], "/force").0.lines().count() as u64, 1 + last, "cut at {cut}");
        let json: serde_json::Value = serde_json::from_str(&timing_to_json(&report)).expect("one JSON document");
        assert!(!report.run.to_string().is_empty() && json.is_object(), "cut at {cut}");
    }
    assert_eq!(last, 1200);
}

/// Check that what follows a log is neither trusted nor a reason to lose what is in it.
#[test]
fn bytes_that_follow_a_log_do_not_hide_it() {
    let mut bytes = log();
    let whole = exported(&bytes, "/force").0;
    bytes.extend_from_slice(&[0xa5; 1000]);
    assert!(exported(&bytes, "/force").0 == whole);
}
