//! What `palpate export` finds in a log, and how options that do not belong together are refused.

use std::collections::BTreeMap;

use crate::support::Folder;

#[test]
fn a_group_of_another_program_is_found_by_the_name_that_the_report_gives_it() {
    let folder = Folder::new();
    let mut bytes = Vec::new();
    let mut writer = mcap::Writer::new(std::io::Cursor::new(&mut bytes)).unwrap();
    let schema = writer.add_schema("loop.TickTiming", "jsonschema", b"{}").unwrap();
    let channel_id = writer.add_channel(schema, "/servo", "json", &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 1, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, b"{\"scheduled_ns\": 0, \"woke_ns\": 7000}").unwrap();
    writer.finish().unwrap();
    drop(writer);
    folder.write("other.mcap", bytes);
    let export =
        |group| folder.call(&["export", "other.mcap", "--format", "hgrm", "--figure", "lateness", "--group", group]);
    assert!(folder.succeed(&["timing", "other.mcap"]).contains("servo"));
    let called = export("servo");
    assert!(called.code == Some(0) && called.out.contains("7.000"), "{called:?}");
    let called = export("none");
    assert!(called.code == Some(2) && called.err.contains("it has servo"), "{called:?}");
}

#[test]
fn options_that_do_not_belong_together_are_refused_in_one_line() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "0.04", "--out", "good.mcap"]);
    let before = folder.files();
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["--topic"]),
        (&["--format", "csv", "--topic", "/force", "--group", "local"], &["--group", "hgrm"]),
        (&["--format", "hgrm"], &["--group local --figure lateness"]),
        (&["--format", "hgrm", "--group", "local"], &["--figure"]),
        (&["--format", "hgrm", "--figure", "lateness"], &["--group"]),
        (&["--format", "hgrm", "--group", "local", "--figure", "force"], &["force", "lateness", "jitter"]),
        (&["--format", "hgrm", "--group", "loc", "--figure", "jitter"], &["good.mcap", "\"loc\"", "global", "local"]),
        (&["--format", "hgrm", "--topic", "/timing/local"], &["--topic", "csv"]),
        (&["--format", "chrome-trace", "--topic", "/force"], &["--topic", "chrome-trace"]),
        (&["--format", "chrome-trace", "--figure", "jitter"], &["--figure", "hgrm"]),
        (&["--topic", "/force", "--from", "2", "--to", "1"], &["--from 2 --to 1"]),
        (&["--topic", "/force", "--from", "-1"], &["--from", "-1"]),
        (&["--topic", "/force", "--to", "nan"], &["--to", "NaN"]),
        (&["--topic", "/force", "--to", "soon"], &["--to", "soon"]),
        (&["--topic", "/force", "--format", "parquet"], &["palpate-parquet", "export CSV"]),
    ];
    for (options, words) in cases {
        let called = folder.call(&[&["export", "good.mcap", "--out", "new.file"], *options].concat());
        assert_eq!((called.code, &*called.out), (Some(2), ""), "{called:?}");
        let is_one_line = called.err.trim_end().lines().count() == 1 && called.err.starts_with("error: ");
        assert!(is_one_line && words.iter().all(|word| called.err.contains(word)), "{words:?} in {:?}", called.err);
        assert_eq!(folder.files(), before, "{options:?}");
    }
}
