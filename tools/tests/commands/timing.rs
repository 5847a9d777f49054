//! `palpate timing`: conditions, comparisons, parts of a log, logs of other programs.

use std::collections::BTreeMap;

use palpate::log::{Environment, GroupInfo, GroupStats, LogRecord, McapWriter};
use palpate::runtime::TickTiming;
use serde_json::Value;

use crate::support::Folder;

fn run(folder: &Folder, log: &str) {
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", log]);
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("one JSON document")
}

#[test]
fn a_condition_that_holds_exits_with_1_and_names_the_figure() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    let called =
        folder.call(&["timing", "a.mcap", "--fail-if", "local.released > 100", "--fail-if", "global.skipped > 0"]);
    assert_eq!(called.code, Some(1));
    assert!(called.out.starts_with("OK: "), "the report is printed all the same: {}", called.out);
    assert_eq!(called.err, "error: a.mcap: local.released is 201 (`local.released > 100`)\n");
    let passes =
        ["timing", "a.mcap", "--fail-if", "local.lateness.p99 > 200us", "--fail-if", "resync.jump_after.max > 1N"];
    folder.succeed(&passes);
}

#[test]
fn a_condition_or_a_part_that_cannot_be_is_refused_in_one_line() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    for (arguments, words) in [
        (["--fail-if", "local.lateness.p99 200us"], "has none of > >= < <="),
        (["--fail-if", "lokal.lateness.p99 > 200us"], "no figure lokal.lateness.p99"),
        (["--fail-if", "local.lateness.p99 > 200"], "needs one of the units"),
        (["--group", "lokal"], "no rate group `lokal`"),
        (["--from", "-1"], "--from is -1"),
        (["--from", "soon"], "invalid value"),
        (["--against", "none.mcap"], "none.mcap"),
    ] {
        let called = folder.call(&["timing", "a.mcap", arguments[0], arguments[1]]);
        assert_eq!(called.code, Some(2), "{arguments:?}");
        assert!(called.err.starts_with("error: ") && called.err.contains(words), "{arguments:?}: {}", called.err);
        assert_eq!(called.err.lines().count(), 1, "{}", called.err);
    }
}

#[test]
fn parts_add_up_to_the_whole_and_a_group_stands_alone() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    let figures = |arguments: &[&str]| {
        let arguments: Vec<&str> = ["timing", "a.mcap", "--json"].iter().chain(arguments).copied().collect();
        let document = json(&folder.succeed(&arguments));
        serde_json::from_value::<BTreeMap<String, Value>>(document["figures"].clone()).expect("an object")
    };
    let whole = figures(&[]);
    let parts = [figures(&["--to", "0.08"]), figures(&["--from", "0.08"])];
    for figure in ["local.released", "global.released", "force.ticks", "contact.slip", "resync.jump_before.count"] {
        let count = |figures: &BTreeMap<String, Value>| figures[figure].as_u64().expect("a count");
        assert_eq!(parts.iter().map(count).sum::<u64>(), count(&whole), "{figure}");
    }
    let alone = figures(&["--group", "global"]);
    assert_eq!(alone["global.execution.p99"], whole["global.execution.p99"]);
    assert!(!alone.keys().any(|name| name.starts_with("local.")));
}

#[test]
fn what_was_lost_is_told_of_whichever_group_is_looked_at() {
    let folder = Folder::new();
    let groups = ["local", "global"].map(|name| GroupInfo::new(name, 1000.0)).into();
    let environment = Environment { groups, ..Environment::default() };
    let mut writer = McapWriter::create(&folder.path("a.mcap"), &environment).unwrap();
    writer.write_stats(&GroupStats { group: 0, lost_records: 7, ..GroupStats::default() }).unwrap();
    for group in [0, 1] {
        writer.write(&LogRecord::Tick(TickTiming { group, ..TickTiming::default() })).unwrap();
    }
    writer.finish().unwrap();
    for group in ["local", "global"] {
        let report = json(&folder.succeed(&["timing", "a.mcap", "--json", "--group", group]));
        assert_eq!((&report["lost_records"], &report["verdict"]), (&7.into(), &"INCOMPLETE".into()), "{group}");
    }
}

#[test]
fn a_log_against_itself_differs_in_nothing() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    run(&folder, "b.mcap");
    let document = json(&folder.succeed(&["timing", "a.mcap", "--against", "b.mcap", "--json"]));
    let figures = document["against"]["figures"].as_object().expect("an object");
    assert!(figures.len() > 50 && figures.values().all(|figure| figure["this"] == figure["other"]));
    assert!(figures.values().all(|figure| figure["differs"] == false));
    assert_eq!(figures["local.released"]["ratio"], 1.0);
    let text = folder.succeed(&["timing", "a.mcap", "--against", "b.mcap"]);
    assert!(text.contains("this") && text.contains("b.mcap: OK"), "{text}");
}

#[test]
fn groups_are_matched_all_at_once() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    let matched =
        ["timing", "a.mcap", "--against", "a.mcap", "--match", "local=global", "--match", "global=local", "--json"];
    let swapped = json(&folder.succeed(&matched));
    let figure =
        |name: &str| (&swapped["against"]["figures"][name]["this"], &swapped["against"]["figures"][name]["other"]);
    assert_eq!(figure("local.released"), (&Value::from(201), &Value::from(7)));
    assert_eq!(figure("global.released"), (&Value::from(7), &Value::from(201)));
    // Check that a group whose name is taken is not compared in place of the one that was named
    let one = ["timing", "a.mcap", "--against", "a.mcap", "--match", "local=global", "--group", "local", "--json"];
    let one = json(&folder.succeed(&one));
    assert_eq!(one["against"]["figures"]["local.released"]["other"], 7);
}

#[test]
fn what_cyclictest_writes_stands_beside_a_log() {
    let folder = Folder::new();
    run(&folder, "a.mcap");
    let file = r#"{ "file_version": 1, "cmdline:": "cyclictest -h 100", "sysinfo": { "sysname": "Linux", "release": "6" },
        "resolution_in_ns": 0, "thread": { "0": { "histogram": { "3": 900, "10": 100 }, "cycles": 1000, "max": 10, "cpu": 1 } } }"#;
    folder.write("cyclic.json", file);
    let document = json(&folder.succeed(&["timing", "cyclic.json", "--json"]));
    assert_eq!(document["figures"]["thread0.lateness.p99"], 10_000);
    assert!(folder.succeed(&["timing", "cyclic.json"]).contains("thread0"));
    assert!(folder.succeed(&["timing", "a.mcap", "--against", "cyclic.json"]).contains("unmatched"));
    let matched = ["timing", "a.mcap", "--against", "cyclic.json", "--match", "local=thread0", "--json"];
    let beside = json(&folder.succeed(&matched));
    let p99 = &beside["against"]["figures"]["local.lateness.p99"];
    assert_eq!((&p99["this"], &p99["other"]), (&Value::from(0), &Value::from(10_000)));
    let called = folder.call(&["timing", "a.mcap", "--against", "cyclic.json", "--match", "local=thread7"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(2), 1), "{}", called.err);
    folder.write("other.json", "{}");
    let called = folder.call(&["timing", "other.json"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(2), 1), "{}", called.err);
}
