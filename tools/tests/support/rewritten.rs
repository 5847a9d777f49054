//! A log as somebody could have changed it.

use std::path::Path;

use palpate::log::{Environment, LogEntry, LogReader, LogRecord, McapWriter};

/// Writes the log anew with another text of what was run and other records.
pub fn rewrite_log(log: &Path, session: impl Fn(String) -> String, record: impl Fn(LogRecord) -> LogRecord) {
    let entries: Vec<_> = LogReader::open(log).unwrap().map(Result::unwrap).collect();
    let mut environment = Environment::default();
    for entry in &entries {
        match entry {
            LogEntry::Environment(found) => {
                environment = Environment { session: environment.session, ..found.clone() };
            }
            LogEntry::Attachment { name, data } if name == Environment::SESSION => {
                environment.session = Some(session(String::from_utf8(data.clone()).unwrap()));
            }
            _ => {}
        }
    }
    let mut writer = McapWriter::create(log, &environment).unwrap();
    for entry in entries {
        match entry {
            LogEntry::Record(found) => writer.write(&record(found)).unwrap(),
            LogEntry::Text(event) => writer.write_text(&event).unwrap(),
            LogEntry::Scene(frame) => writer.write_scene(&frame).unwrap(),
            LogEntry::Stats(stats) => writer.write_stats(&stats).unwrap(),
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => {}
        }
    }
    writer.finish().unwrap();
}
