//! A log in other formats: what each holds, and what belongs together.

use std::collections::{BTreeMap, BTreeSet};

use crate::export::{TickDuration, export_percentiles, export_table, export_trace, is_turned};
use palpate::ErrorKind;
use palpate::log::{LogEntry, LogReader, LogRecord, Window};
use palpate::runtime::Nanos;
use palpate::runtime::TickTiming;
use serde_json::Value;

use super::log_sample::{entries, log_of};
use super::recorded;

const ALL: Window = Window { from: Nanos::ZERO, to: Nanos(u64::MAX) };

fn table(bytes: &[u8], topic: &str, window: &Window) -> String {
    let mut out = Vec::new();
    export_table(&mut reader(bytes), topic, false, window, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn percentiles(bytes: &[u8], group: &str, figure: TickDuration, window: &Window) -> String {
    let mut out = Vec::new();
    export_percentiles(&mut reader(bytes), group, figure, window, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn trace(bytes: &[u8], window: &Window) -> Vec<Value> {
    let mut out = Vec::new();
    export_trace(&mut reader(bytes), window, &mut out).unwrap();
    let Value::Array(events) = serde_json::from_slice::<Value>(&out).unwrap()["traceEvents"].take() else {
        panic!("no array of events")
    };
    events
}

fn reader(bytes: &[u8]) -> LogReader<&[u8]> {
    LogReader::new(bytes, "run.mcap").unwrap()
}

fn timings(entries: &[LogEntry], of: u16) -> Vec<TickTiming> {
    let timing = |entry: &LogEntry| match entry {
        LogEntry::Record(LogRecord::Tick(timing)) if timing.group == of => Some(*timing),
        _ => None,
    };
    entries.iter().filter_map(timing).collect()
}

/// A time of a trace in nanoseconds.
fn ns(value: &Value) -> u64 {
    (value.as_f64().unwrap() * 1e3).round() as u64
}

// Check that columns of torque and orientation are there where a log has some, and that a log without keeps its table.
#[test]
fn a_turned_tool_has_columns_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let header = |entries: &[LogEntry], topic: &str| {
        let path = folder.path().join("run.mcap");
        std::fs::write(&path, log_of(entries, 1000)).unwrap();
        let mut out = Vec::new();
        let is_turned = is_turned(&path, topic).unwrap();
        export_table(&mut LogReader::open(&path).unwrap(), topic, is_turned, &ALL, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let columns = text.lines().next().unwrap().split(',').count();
        assert!(text.lines().all(|line| line.split(',').count() == columns), "{topic}");
        (text.lines().next().unwrap().to_owned(), text.lines().nth(2).unwrap().to_owned())
    };
    let turned = entries(20);
    let straight: Vec<LogEntry> = turned.iter().cloned().map(without_turning).collect();
    let (columns, row) = header(&turned, "/force");
    assert_eq!(columns, "t_s,fx_n,fy_n,fz_n,tx_n_m,ty_n_m,tz_n_m");
    assert!(row.ends_with(",0,-0,0.001"), "{row}");
    assert_eq!(header(&straight, "/force").0, "t_s,fx_n,fy_n,fz_n");
    assert_eq!(header(&straight, "/force_commanded").0, "t_s,fx_n,fy_n,fz_n");
    assert!(header(&turned, "/tool").0.ends_with(",sample_id,buttons,qw,qx,qy,qz"));
    assert!(header(&straight, "/tool").0.ends_with(",sample_id,buttons"));
}

fn without_turning(mut entry: LogEntry) -> LogEntry {
    match &mut entry {
        LogEntry::Record(LogRecord::Force(row)) => row.torque_n_m = [0.0; 3],
        LogEntry::Record(LogRecord::Command(row)) => row.torque_n_m = [0.0; 3],
        LogEntry::Record(LogRecord::Tool(row)) => row.orientation = palpate::model::Turn::identity(),
        _ => {}
    }
    entry
}

#[test]
fn windows_that_meet_hold_every_row_once() {
    let bytes = log_of(&entries(300), 1000);
    for topic in ["/force", "/timing/haptic", "/timing/global", "/resync", "/log", "/stats/haptic"] {
        let whole = table(&bytes, topic, &ALL);
        let header = whole.lines().next().unwrap();
        let cuts = [0, 40_000_000, 123_000_000, u64::MAX];
        let mut joined = format!("{header}\n");
        for cut in cuts.windows(2) {
            let part = table(&bytes, topic, &Window { from: Nanos(cut[0]), to: Nanos(cut[1]) });
            joined += part.strip_prefix(&format!("{header}\n")).unwrap();
        }
        assert_eq!(joined, whole, "{topic}");
    }
    let part = table(&bytes, "/force", &Window { from: Nanos(40_000_000), to: Nanos(43_000_000) });
    let times: Vec<&str> = part.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(times, ["0.04", "0.041", "0.042"]);
}

#[test]
fn the_places_of_contacts_are_a_table_of_their_own() {
    let sent = entries(30);
    let bytes = log_of(&sent, 1000);
    let (mut contacts, mut points) = (Vec::new(), Vec::new());
    for entry in &sent {
        match entry {
            LogEntry::Record(LogRecord::Contact(r)) => contacts.push(*r),
            LogEntry::Record(LogRecord::ContactPoint(r)) => points.push(*r),
            _ => {}
        }
    }
    let text = table(&bytes, "/contact", &ALL);
    let mut lines = text.lines();
    let header = "t_s,mode,triangle,weight_a,weight_b,weight_c,nx,ny,nz,normal_force_n,tangential_force_n,count,area_m2,mean_pressure_pa";
    assert_eq!(lines.next(), Some(header));
    assert_eq!(lines.clone().count(), contacts.len());
    for (line, contact) in lines.zip(&contacts) {
        let expected = format!(",{},{},{}", contact.count, contact.area_m2, contact.mean_pressure_pa());
        assert!(line.ends_with(&expected), "{line}: {expected}");
    }
    let text = table(&bytes, "/contact/points", &ALL);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t_s,x_m,y_m,z_m,nx,ny,nz,normal_n,tangential_n,triangle,mode"));
    assert_eq!(lines.clone().count(), points.len());
    for (line, point) in lines.zip(&points) {
        let [x, y, z] = point.place_m;
        let begin = format!("{},{x},{y},{z},", point.time.as_secs_f64());
        assert!(line.starts_with(&begin) && line.ends_with(&format!(",{},slip", point.triangle)), "{line}");
    }
    for topic in ["/points", "/force/points", "/left/contact/points"] {
        let error = export_table(&mut reader(&bytes), topic, false, &ALL, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains(&format!("the log has no topic {topic:?}")), "{error}");
    }
}

// Check every line of each figure against the sorted values themselves.
#[test]
fn each_line_of_a_percentile_file_is_a_nearest_rank_of_the_sorted_values() {
    let sent = entries(700);
    let bytes = log_of(&sent, 1000);
    let timings = timings(&sent, 0);
    let periods: Vec<u64> = timings.windows(2).map(|pair| pair[1].woke.0 - pair[0].woke.0).collect();
    let scheduled = timings.windows(2).map(|pair| pair[1].scheduled.0 - pair[0].scheduled.0);
    let expected: [(TickDuration, Vec<u64>); 4] = [
        (TickDuration::Lateness, timings.iter().map(|t| t.woke.0 - t.scheduled.0).collect()),
        (TickDuration::Execution, timings.iter().map(|t| t.end.0 - t.start.0).collect()),
        (TickDuration::PeriodError, periods.iter().zip(scheduled).map(|(period, due)| period.abs_diff(due)).collect()),
        (TickDuration::Jitter, periods.windows(2).map(|pair| pair[1].abs_diff(pair[0])).collect()),
    ];
    for (figure, mut values) in expected {
        values.sort_unstable();
        let text = percentiles(&bytes, "haptic", figure, &ALL);
        let lines: Vec<Vec<&str>> = text
            .lines()
            .skip(2)
            .take_while(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().collect())
            .collect();
        assert!(lines.len() > 10, "{figure:?}: {} lines", lines.len());
        for line in &lines {
            // In whole numbers: 0.55 is no double, and 0.55 * 700 rounds up to the next rank.
            let level: usize = line[1].replace('.', "").parse().unwrap();
            let rank = (level * values.len()).div_ceil(1_000_000_000_000).max(1);
            let value = values[rank - 1];
            let count = values.iter().filter(|other| **other <= value).count();
            let expected = (format!("{}.{:03}", value / 1000, value % 1000), count.to_string());
            assert_eq!((line[0], line[2]), (&*expected.0, &*expected.1), "{figure:?} at {}", line[1]);
        }
        assert_eq!(lines.last().unwrap()[1], "1.000000000000");
        assert!(text.contains(&format!("Total count    = {:>12}]", values.len())), "{text}");
    }
}

#[test]
fn a_percentile_file_of_a_part_has_the_samples_of_that_part() {
    let bytes = log_of(&entries(300), 1000);
    let part = Window { from: Nanos(100_000_000), to: Nanos(150_000_000) };
    for (figure, samples) in [(TickDuration::Lateness, 50), (TickDuration::PeriodError, 49), (TickDuration::Jitter, 48)]
    {
        let text = percentiles(&bytes, "haptic", figure, &part);
        assert!(text.contains(&format!("Total count    = {samples:>12}]")), "{text}");
    }
}

#[test]
fn an_unknown_group_is_an_error_that_lists_the_groups() {
    let bytes = log_of(&entries(3), 1000);
    let mut out = Vec::new();
    let error = export_percentiles(&mut reader(&bytes), "locale", TickDuration::Lateness, &ALL, &mut out).unwrap_err();
    assert_eq!((error.kind(), out.len()), (ErrorKind::Log, 0));
    assert_eq!(error.to_string(), "run.mcap: the log has no rate group \"locale\"; it has global, haptic");
}

#[test]
fn a_trace_has_a_slice_for_each_release_and_an_instant_for_each_slip_and_miss() {
    let sent = entries(400);
    let events = trace(&log_of(&sent, 1000), &ALL);
    let of_phase = |phase: &str| events.iter().filter(move |event| event["ph"] == phase).collect::<Vec<_>>();
    let track = |name: &str| {
        let named = |event: &&&Value| event["name"] == "thread_name" && event["args"]["name"] == name;
        of_phase("M").iter().find(named).unwrap()["tid"].as_u64().unwrap()
    };
    assert!(track("haptic") < track("global"), "the fastest group is on top");
    for (group, name) in [(0, "haptic"), (1, "global")] {
        let timings = timings(&sent, group);
        let slices: Vec<&Value> = of_phase("X")
            .into_iter()
            .filter(|event| event["tid"].as_u64().unwrap() / 1000 == track(name) / 1000)
            .collect();
        assert_eq!(slices.len(), timings.len());
        for (slice, timing) in slices.iter().zip(&timings) {
            assert_eq!((ns(&slice["ts"]), ns(&slice["dur"])), (timing.start.0, timing.end.0 - timing.start.0));
            assert_eq!(slice["args"]["tick"], timing.tick);
            assert_eq!(ns(&slice["args"]["lateness_us"]), timing.woke.0 - timing.scheduled.0);
            assert_eq!(slice["args"]["cause"], timing.cause.name());
        }
    }
    let both: Vec<TickTiming> = [0, 1].iter().flat_map(|group| timings(&sent, *group)).collect();
    let mut slips: BTreeMap<String, u64> = BTreeMap::new();
    for (cause, count) in both.iter().flat_map(TickTiming::slips_by_cause).filter(|(_, count)| *count > 0) {
        *slips.entry(format!("slip: {}", cause.name())).or_default() += u64::from(count);
    }
    let mut drawn: BTreeMap<String, u64> = BTreeMap::new();
    for event in of_phase("i").iter().filter(|event| event["cat"] == "slip") {
        *drawn.entry(event["name"].as_str().unwrap().to_owned()).or_default() +=
            event["args"]["slips"].as_u64().unwrap();
    }
    assert!(drawn.len() > 1 && drawn == slips, "{drawn:?}, not {slips:?}");
    let misses = of_phase("i").iter().filter(|event| event["cat"] == "miss").count();
    let missed = both.iter().filter(|timing| timing.missed()).count();
    assert!(missed > 0 && misses == missed, "{misses} instants for {missed} missed deadlines");
    assert!(of_phase("i").iter().any(|event| event["name"] == "priority refused, running without"));
}

// A run in virtual time with a latency: each resync is one flow, from the haptic release whose sample the global release
// took last, over that release, to the first haptic release after its end.
#[test]
fn each_resync_is_one_flow_from_the_last_sample_to_the_first_force() {
    let bytes = recorded(5.0, 0.5);
    let built: Vec<Vec<u64>> = table(&bytes, "/global", &ALL)
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            vec![(cells[0] * 1e9).round() as u64, cells[3] as u64]
        })
        .collect();
    let events = trace(&bytes, &ALL);
    let mut flows: BTreeMap<u64, BTreeMap<&str, u64>> = BTreeMap::new();
    for event in events.iter().filter(|event| event["cat"] == "flow") {
        let stations = flows.entry(event["id"].as_u64().unwrap()).or_default();
        assert_eq!(stations.insert(event["ph"].as_str().unwrap(), ns(&event["ts"])), None, "twice: {event}");
    }
    // The last release ends too late for any force to know of it.
    assert!(
        built.len() > 10 && (built.len() - 1..=built.len()).contains(&flows.len()),
        "{} of {}",
        flows.len(),
        built.len()
    );
    for (flow, built) in flows.values().zip(&built) {
        let [time, last_tick] = built[..] else { panic!("two numbers") };
        let served = (time + 5_000_000).next_multiple_of(1_000_000);
        assert_eq!(*flow, BTreeMap::from([("s", last_tick * 1_000_000), ("t", time), ("f", served)]));
    }
    // A part of the log has the flows that lie in it.
    let part = Window { from: Nanos(100_000_000), to: Nanos(300_000_000) };
    let ids: BTreeSet<u64> = trace(&bytes, &part).iter().filter_map(|event| event["id"].as_u64()).collect();
    assert!((4..=6).contains(&ids.len()), "{} flows in 0.2 s at 30 Hz", ids.len());
}

#[test]
fn releases_that_overlap_are_drawn_on_tracks_of_their_own() {
    let bytes = recorded(50.0, 0.5);
    let events = trace(&bytes, &ALL);
    let mut free_from: BTreeMap<u64, u64> = BTreeMap::new();
    for slice in events.iter().filter(|event| event["ph"] == "X") {
        let free = free_from.entry(slice["tid"].as_u64().unwrap()).or_default();
        assert!(ns(&slice["ts"]) >= *free, "{slice} begins before {free}");
        *free = ns(&slice["ts"]) + ns(&slice["dur"]);
    }
    let names: BTreeSet<&str> = events
        .iter()
        .filter(|event| event["name"] == "thread_name")
        .map(|event| event["args"]["name"].as_str().unwrap())
        .collect();
    assert!(names.contains("global (overlapping 1)") && names.contains("local"), "{names:?}");
}
