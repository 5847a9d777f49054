//! What is reported about a log equals what was logged.

use crate::export::export_table;
use crate::timing::{Selection, TimingAnalysis, timing_to_json};
use palpate::ErrorKind;
use palpate::log::{Analysis, LogEntry, LogReader, LogRecord, RunReport, Window};

use super::log_sample::{entries, log_of, time_of};

fn analyse(bytes: &[u8]) -> RunReport {
    let mut reader = LogReader::new(bytes, "memory").unwrap();
    let mut analysis = Analysis::default();
    reader.readable().for_each(|entry| analysis.push_entry(&entry));
    RunReport { damage: reader.damage().map(str::to_owned), ..analysis.report() }
}

fn table(bytes: &[u8], topic: &str) -> String {
    let mut out = Vec::new();
    export_table(&mut LogReader::new(bytes, "run.mcap").unwrap(), topic, false, &Window::default(), &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

// Check every percentile of the haptic group against the sorted values themselves.
#[test]
fn percentiles_of_a_log_equal_those_of_the_sorted_records() {
    let sent = entries(1234);
    let mut lateness: Vec<u64> = sent
        .iter()
        .filter_map(|entry| match entry {
            LogEntry::Record(LogRecord::Tick(t)) if t.group == 0 => Some(t.woke.0 - t.scheduled.0),
            _ => None,
        })
        .collect();
    lateness.sort_unstable();
    let report = analyse(&log_of(&sent, 1000));
    let got = report.groups[0].lateness;
    let rank = |permille: usize| lateness[(lateness.len() * permille).div_ceil(1000) - 1];
    assert_eq!(got.count, 1234);
    assert_eq!([got.p50, got.p90, got.p99, got.p999, got.max], [500, 900, 990, 999, 1000].map(rank));
}

#[test]
fn json_is_one_document_that_says_what_the_log_says() {
    let bytes = log_of(&entries(500), 1000);
    let mut analysis = TimingAnalysis::new(Selection::default());
    LogReader::new(bytes.as_slice(), "memory").unwrap().for_each(|entry| analysis.push_entry(&entry.unwrap()));
    let value: serde_json::Value = serde_json::from_str(&timing_to_json(&analysis.report())).unwrap();
    assert_eq!(value["verdict"], "FAILED");
    assert_eq!(value["reason"], "global: an actor reported fault 18446744073709551615, in 0.500 s of real time");
    assert_eq!(value["groups"][0]["name"], "haptic");
    assert_eq!(value["groups"][0]["released"], 500);
    // Of the nine slips after a long tick, the policy gave up those at 100, 200, 300 and 400 by itself.
    assert_eq!(value["groups"][0]["skipped_by_cause"]["long_tick"], 5);
    assert_eq!(value["groups"][0]["skipped_by_cause"]["policy"], 4);
    assert_eq!(value["groups"][0]["in_degraded_mode"], 9);
    assert_eq!(value["groups"][0]["lost_records"], 4);
    assert_eq!(value["groups"][1]["released"], 15);
    assert_eq!(value["force"]["ticks"], 500);
    assert_eq!(value["contact"]["slip"], 125);
    assert_eq!(value["limits"]["stages"]["clamp"], 100 + 100);
    assert_eq!(value["resyncs"]["count"], 15);
    assert_eq!(value["environment"]["granted"]["mlock"], "refused");
    assert_eq!(value["events"]["count"], 2);
    let text = analyse(&bytes).to_string();
    assert!(text.starts_with("FAILED: global: an actor reported fault"), "{text}");
    assert!(text.lines().count() <= 40, "{text}");
}

#[test]
fn times_are_decimals_not_sums_of_periods_and_forces_keep_their_sign_and_the_last_bit() {
    for topic in ["/force", "/force_commanded"] {
        let table = table(&log_of(&entries(4), 10), topic);
        let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!([0, 1, 2, 3].map(|n| rows[n][0]), ["0", "0.001", "0.002", "0.003"]);
        for (n, row) in rows.iter().enumerate() {
            let force = [(n as f64 * 0.01).sin(), -0.0, f64::MIN_POSITIVE * n as f64];
            assert_eq!([1, 2, 3].map(|at| row[at].parse::<f64>().unwrap().to_bits()), force.map(f64::to_bits));
        }
    }
}

#[test]
fn every_topic_has_a_table_whose_rows_match_its_header() {
    let sent = entries(40);
    let bytes = log_of(&sent, 100);
    let mut reader = LogReader::new(bytes.as_slice(), "memory").unwrap();
    reader.readable().for_each(drop);
    let topics = reader.topics();
    assert_eq!(topics.len(), 14);
    for (&topic, &messages) in &topics {
        let table = table(&bytes, topic);
        let columns = table.lines().next().unwrap().split(',').count();
        assert!(topic == "/log" || table.lines().all(|line| line.split(',').count() == columns), "{topic}:\n{table}");
        assert_eq!(table.lines().count() as u64, 1 + messages, "{topic}");
    }
    assert!(sent.iter().map(time_of).is_sorted());
    assert!(table(&bytes, "/contact").contains("\n0,free,,"), "no triangle is an empty cell");
    assert!(table(&bytes, "/log").contains("0,warning,\"priority refused, running without\"\n"));
}

#[test]
fn a_topic_without_messages_is_a_header_and_an_unknown_one_an_error_that_lists_the_topics() {
    let bytes = log_of(&[], 1);
    assert_eq!(table(&bytes, "/resync"), "t_s,version,age_s,jump_before_n,jump_after_n,energy_j\n");
    for unknown in ["/forces", "force", "", "/timing/device"] {
        let mut out = Vec::new();
        let mut reader = LogReader::new(bytes.as_slice(), "run.mcap").unwrap();
        let error = export_table(&mut reader, unknown, false, &Window::default(), &mut out).unwrap_err();
        assert_eq!((error.kind(), out.len()), (ErrorKind::Log, 0));
        let text = error.to_string();
        assert!(
            text.starts_with(&format!("run.mcap: the log has no topic {unknown:?}; it has /contact, /force,")),
            "{text}"
        );
        assert!(text.contains("/timing/global, /timing/haptic, /tool"), "{text}");
    }
}
