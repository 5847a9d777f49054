//! What `cyclictest --json=FILE` of the Linux rt-tests writes: a histogram of wake-up latencies for each thread.

use std::path::Path;

use palpate::log::{Environment, GroupInfo, LogEntry, LoggedExecution, TextEvent, Window};
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use serde_json::Value;

use super::{Selection, TimingAnalysis, TimingReport};

/// Threads of a file, at most: no machine has as many cores.
const MOST_THREADS: usize = 1024;

/// The threads of `text`, which was read from `place`, as rate groups `thread0`, `thread1`, ... with their lateness.
///
/// Values that lie beyond the histogram count as the largest, which cyclictest knows apart from it; a warning says how many.
///
/// # Errors
/// [`ErrorKind::Log`] if it is no such file or holds no histogram; [`ErrorKind::Usage`] if a part of its time is asked for.
pub fn read_cyclictest(text: &str, place: &Path, selection: Selection) -> Result<TimingReport, Error> {
    let refuse = |why: &str| Error::new(ErrorKind::Log, why).at(place.display().to_string());
    let neither = "no log: neither MCAP nor what `cyclictest --json` writes";
    let file: Value = serde_json::from_str(text).map_err(|_| refuse(neither))?;
    let threads = file["thread"].as_object().ok_or_else(|| refuse(neither))?;
    if threads.len() > MOST_THREADS {
        return Err(refuse(&format!("has {} threads, must be at most {MOST_THREADS}", threads.len())));
    }
    let unit = if file["resolution_in_ns"].as_u64().unwrap_or(0) > 0 { 1 } else { 1000 };
    if selection.window != Window::default() {
        let message = "holds a histogram without times: leave --from and --to out";
        return Err(Error::new(ErrorKind::Usage, message).at(place.display().to_string()));
    }
    let mut analysis = TimingAnalysis::new(selection);
    let groups = threads.iter().map(|(number, thread)| GroupInfo {
        cpu: thread["cpu"].as_u64().and_then(|cpu| usize::try_from(cpu).ok()),
        ..GroupInfo::new(format!("thread{number}"), 0.0)
    });
    let system = &file["sysinfo"];
    let said = |key: &str| system[key].as_str().unwrap_or("-").to_owned();
    analysis.push_entry(&LogEntry::Environment(Environment {
        execution: LoggedExecution::Threaded { start_unix_ns: 0 },
        palpate_version: "-".to_owned(),
        model: "none, cyclictest".to_owned(),
        instruction_set: said("machine"),
        groups: groups.collect(),
        granted: [
            ("machine".to_owned(), format!("{} {}", said("sysname"), said("release"))),
            ("command".to_owned(), file["cmdline:"].as_str().or(file["cmdline"].as_str()).unwrap_or("-").to_owned()),
        ]
        .into(),
        ..Environment::default()
    }));
    for (group, (number, thread)) in (0..).zip(threads) {
        let bins = thread["histogram"].as_object().filter(|bins| !bins.is_empty());
        let bins = bins.ok_or_else(|| refuse("has no histogram: run cyclictest with -h 1000 (microseconds)"))?;
        let mut counted = 0_u64;
        for (value, count) in bins {
            let value: u64 = value.parse().map_err(|_| refuse("has a histogram with a value that is no number"))?;
            let count = count.as_u64().ok_or_else(|| refuse("has a histogram with a count that is no number"))?;
            analysis.push_lateness(group, value.saturating_mul(unit), count);
            counted = count.saturating_add(counted);
        }
        let beyond = thread["cycles"].as_u64().unwrap_or(counted).saturating_sub(counted);
        if beyond > 0 {
            let largest = thread["max"].as_u64().unwrap_or(0).saturating_mul(unit);
            analysis.push_lateness(group, largest, beyond);
            let message = format!(
                "thread{number}: {beyond} values lie beyond the histogram and count as the largest, {}; run with a larger -h",
                Nanos(largest)
            );
            analysis.push_entry(&LogEntry::Text(TextEvent {
                level: palpate::log::Level::Warning,
                message,
                ..TextEvent::default()
            }));
        }
    }
    Ok(analysis.report())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{ "file_version": 1, "cmdline:": "cyclictest -h 30", "sysinfo": {"sysname": "Linux", "release": "6"},
        "resolution_in_ns": 0, "thread": { "0": { "histogram": { "3": 900, "10": 98 }, "cycles": 1000, "max": 250, "cpu": 1 } } }"#;

    #[test]
    fn a_histogram_is_a_group_with_its_lateness() {
        let report = read_cyclictest(FILE, Path::new("c.json"), Selection::default()).unwrap();
        let group = &report.run.groups[0];
        assert_eq!((group.name.as_str(), group.rate_hz, group.released), ("thread0", None, 1000));
        let late = group.lateness;
        assert_eq!((late.count, late.p50, late.p99, late.p999, late.max), (1000, 3000, 10_000, 250_000, 250_000));
        assert_eq!(report.groups[0].lateness.percentiles, late);
        assert!(report.run.events[0].message.contains("2 values lie beyond"), "{:?}", report.run.events);
    }

    #[test]
    fn other_files_are_refused_in_words() {
        let error =
            |text: &str| read_cyclictest(text, Path::new("c.json"), Selection::default()).unwrap_err().to_string();
        assert!(error("hello").contains("neither MCAP nor"));
        assert!(error("{}").contains("neither MCAP nor"));
        assert!(error(&FILE.replace(r#""3": 900, "10": 98"#, "")).contains("-h 1000"));
    }
}
