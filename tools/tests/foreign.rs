//! Logs of other programs, and of nobody's good will: names that command a terminal, counts that wrap, sizes that explode.

mod support;

use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use mcap::records::{MessageHeader, op};
use palpate::log::{Environment, GroupInfo, GroupStats, LogRecord, McapWriter, Resync};
use palpate::runtime::TickTiming;

use support::{Folder, SCENE};

/// What takes minutes if it takes the square of its input, and a second or two if not.
const LONG: Duration = Duration::from_secs(60);

/// A log with tick timing of these groups, a message each.
fn log_of(groups: impl IntoIterator<Item = String>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = mcap::Writer::new(std::io::Cursor::new(&mut bytes)).unwrap();
    for group in groups {
        let channel_id = writer.add_channel(0, &format!("/timing/{group}"), "json", &BTreeMap::new()).unwrap();
        for tick in 0..3_u64 {
            let header = MessageHeader { channel_id, sequence: 1, log_time: tick, publish_time: tick };
            let due = tick * 1_000_000;
            let text = format!("{{\"scheduled_ns\": {due}, \"woke_ns\": {}}}", due + 7);
            writer.write_to_known_channel(&header, text.as_bytes()).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    bytes
}

#[test]
fn no_name_commands_a_terminal_or_breaks_a_line() {
    let folder = Folder::new();
    let (plain, hostile) = ("plain", "a\nb\u{1b}[31m\u{9b}2J\r");
    let call = |name: &str, args: &[&str]| {
        let log = format!("{name}.mcap");
        folder.write(&log, log_of([name.to_owned()]));
        folder.write(&format!("cut {log}"), &log_of([name.to_owned()])[..300]);
        let topic = format!("/timing/{name}");
        let cut = format!("cut {log}");
        let args: Vec<&str> = args
            .iter()
            .map(|arg| match *arg {
                "LOG" => &log,
                "CUT" => &cut,
                "TOPIC" => &topic,
                "GROUP" => name,
                other => other,
            })
            .collect();
        folder.call(&args)
    };
    for args in [
        &["log", "info", "LOG"][..],
        &["log", "info", "LOG", "--json"],
        &["log", "info", "CUT"],
        &["log", "check", "LOG"],
        &["log", "check", "CUT"],
        &["log", "recover", "LOG", "--out", "GROUP"],
        &["timing", "LOG"],
        &["timing", "LOG", "--json"],
        &["timing", "CUT"],
        &["timing", "LOG", "--group", "none"],
        &["timing", "LOG", "--against", "LOG"],
        &["export", "LOG", "--topic", "none"],
        &["export", "LOG", "--topic", "TOPIC"],
        &["export", "LOG", "--format", "hgrm", "--group", "GROUP", "--figure", "lateness"],
        &["replay", "LOG"],
        &["run", "LOG"],
        &["run", "GROUP"],
        &["GROUP"],
    ] {
        let (expected, called) = (call(plain, args), call(hostile, args));
        assert_eq!(called.code, expected.code, "{args:?}: {called:?}");
        for (text, like) in [(&called.out, &expected.out), (&called.err, &expected.err)] {
            assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{args:?}: {called:?}");
            // Wrapped lines may be more where names are longer.
            let is_wrapped = args[0] == "timing" && std::ptr::eq(text, &called.out);
            assert!(is_wrapped || text.lines().count() == like.lines().count(), "{args:?}: {called:?} {expected:?}");
        }
    }
    // Check that programs get the name as it is
    let called = call(hostile, &["log", "info", "LOG", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&called.out).unwrap();
    assert_eq!(info["topics"][0]["topic"], format!("/timing/{hostile}"));
}

#[test]
fn names_without_an_end_are_shortened() {
    let folder = Folder::new();
    folder.write("long.mcap", log_of(["x".repeat(70_000)]));
    for args in [&["log", "info", "long.mcap"][..], &["timing", "long.mcap"]] {
        let out = folder.succeed(args);
        assert!(out.lines().all(|line| line.chars().count() < 500), "{args:?}");
    }
    folder.write("long.toml", format!("{SCENE}\n[{}]\n", "x".repeat(5_000_000)));
    folder
        .write("key.toml", SCENE.replacen("[body.block]", &format!("[body.block]\n{} = 1", "y".repeat(5_000_000)), 1));
    for scene in ["long.toml", "key.toml"] {
        let called = folder.call(&["run", scene]);
        assert_eq!((called.code, called.err.lines().count()), (Some(2), 1));
        assert!(called.err.len() < 5000, "{} bytes", called.err.len());
    }
}

/// Runs the command, which has [`LONG`], and gives its exit code and what it printed.
fn in_time(folder: &Folder, args: &[&str]) -> (Option<i32>, String) {
    let out = std::fs::File::create(folder.path("printed")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    let both = out.try_clone().unwrap();
    let mut child =
        command.args(args).current_dir(folder.path("")).stdin(Stdio::null()).stdout(out).stderr(both).spawn().unwrap();
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return (status.code(), std::fs::read_to_string(folder.path("printed")).unwrap());
        }
        if begun.elapsed() > LONG {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{args:?} takes longer than {LONG:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn cyclictest(threads: &str) -> String {
    format!("{{\"resolution_in_ns\": 1, \"thread\": {{{threads}}}}}")
}

#[test]
fn counts_of_other_programs_end_at_the_largest_number_and_do_not_wrap() {
    let folder = Folder::new();
    let most = u64::MAX;
    let thread = format!("\"0\": {{\"histogram\": {{\"3\": {most}, \"5\": 7, \"03\": {most}}}, \"cycles\": 1}}");
    folder.write("cyclic.json", cyclictest(&thread));
    let report: serde_json::Value =
        serde_json::from_str(&folder.succeed(&["timing", "cyclic.json", "--json"])).unwrap();
    assert_eq!(report["groups"][0]["released"], most);
    folder.succeed(&["timing", "cyclic.json", "--html", "page.html"]);
    // Check that counts of several groups do not wrap either
    let groups = ["one", "two"].map(|name| GroupInfo::new(name, 1000.0)).into();
    let environment = Environment { groups, ..Environment::default() };
    let mut writer = McapWriter::create(&folder.path("lost.mcap"), &environment).unwrap();
    for group in [0, 1] {
        writer.write_stats(&GroupStats { group, lost_records: most, ..GroupStats::default() }).unwrap();
    }
    writer.finish().unwrap();
    let report: serde_json::Value = serde_json::from_str(&folder.succeed(&["timing", "lost.mcap", "--json"])).unwrap();
    assert_eq!(report["lost_records"], most, "{report}");
    folder.succeed(&["timing", "lost.mcap"]);
}

#[test]
fn a_histogram_with_many_bins_takes_as_long_as_it_is() {
    let folder = Folder::new();
    let bins: Vec<String> = (0..500_000).map(|bin| format!("\"{bin}\": 1")).collect();
    let thread = format!("\"0\": {{\"histogram\": {{{}}}, \"cycles\": 500000}}", bins.join(","));
    folder.write("cyclic.json", cyclictest(&thread));
    let (code, out) = in_time(&folder, &["timing", "cyclic.json", "--json"]);
    assert_eq!(code, Some(0), "{out}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["groups"][0]["released"], 500_000);
}

#[test]
fn more_groups_than_any_run_has_are_refused_by_their_number() {
    let folder = Folder::new();
    let thread = |number| format!("\"{number}\": {{\"histogram\": {{\"3\": 1}}}}");
    folder.write("cyclic.json", cyclictest(&(0..70_000).map(thread).collect::<Vec<_>>().join(",")));
    let called = folder.call(&["timing", "cyclic.json"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(2), 1), "{called:?}");
    assert!(called.err.contains("has 70000 threads, must be at most 1024"), "{called:?}");
    folder.write("groups.mcap", log_of((0..5000).map(|group| group.to_string())));
    let called = folder.call(&["timing", "groups.mcap"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(0), 1), "{}", called.err);
    assert!(called.err.contains("more than 1024 rate groups"), "{}", called.err);
    // Check that a log with as many as there may be is held against itself
    folder.write("groups.mcap", log_of((0..1024).map(|group| group.to_string())));
    let (code, out) = in_time(&folder, &["timing", "groups.mcap", "--against", "groups.mcap"]);
    assert_eq!(code, Some(0), "{out}");
}

/// A record of an MCAP file.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat()
}

/// A chunk whose records are `packed` and come to `unpacked` bytes.
fn chunk(compression: &str, packed: &[u8], unpacked: u64, checksum: u32) -> Vec<u8> {
    let name = compression.as_bytes();
    let body = [
        &[0; 16],
        &unpacked.to_le_bytes()[..],
        &checksum.to_le_bytes(),
        &(name.len() as u32).to_le_bytes(),
        name,
        &(packed.len() as u64).to_le_bytes(),
        packed,
    ];
    record(op::CHUNK, &body.concat())
}

fn log(chunks: &[u8]) -> Vec<u8> {
    [mcap::MAGIC, &record(op::HEADER, &[0; 8]), chunks].concat()
}

#[test]
fn heads_of_chunks_within_chunks_take_as_long_as_the_file() {
    let folder = Folder::new();
    let head = chunk("", &[], 0, 1).len() as u64;
    let mut nested = Vec::new();
    let length = 4 << 20;
    // Every head claims all of the rest.
    while nested.len() < length {
        let rest = (length - nested.len()) as u64;
        let mut head_of_rest = chunk("", &[], rest, 1);
        head_of_rest[1..9].copy_from_slice(&(head - 9 + rest).to_le_bytes());
        let at = head_of_rest.len() - 8;
        head_of_rest[at..].copy_from_slice(&rest.to_le_bytes());
        nested.extend(head_of_rest);
    }
    nested.resize(length + head as usize, 0);
    folder.write("nested.mcap", log(&nested));
    for args in [&["log", "check", "nested.mcap"][..], &["log", "recover", "nested.mcap", "--out", "new.mcap"]] {
        let (code, out) = in_time(&folder, args);
        assert!(matches!(code, Some(0 | 1)), "{args:?}: {out}");
        assert!(out.contains("false beginnings of chunks"), "{args:?}: {out}");
    }
}

#[test]
fn a_log_that_unpacks_to_more_than_a_log_can_is_refused_early() {
    let folder = Folder::new();
    // Blocks that repeat one byte 2^17 times: as many as a chunk of 64 MiB has, of empty records of 9 bytes.
    let (block, blocks) = (1_u32 << 17, 504_u32);
    let mut packed = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3];
    for number in 1..=blocks {
        let head = u32::from(number == blocks) | 1 << 1 | block << 3;
        packed.extend(&head.to_le_bytes()[..3]);
        packed.push(0);
    }
    let unpacked = u64::from(block * blocks);
    let zeros = crc32fast::hash(&vec![0; unpacked as usize]);
    let bomb = chunk("zstd", &packed, unpacked, zeros);
    folder.write("bomb.mcap", log(&bomb.repeat(400)));
    for args in [&["timing", "bomb.mcap"][..], &["log", "info", "bomb.mcap"], &["log", "check", "bomb.mcap"]] {
        let (code, out) = in_time(&folder, args);
        assert!(matches!(code, Some(0 | 1)) && out.contains("would unpack to"), "{args:?}: {code:?} {out}");
    }
}

#[test]
fn an_attachment_without_room_for_its_checksum_is_damage() {
    let folder = Folder::new();
    let short = |length: usize| record(op::ATTACHMENT, &vec![0; length]);
    let in_chunk = chunk("", &short(32), 41, 0);
    // In the index itself, and where the index says that one is.
    let indexed = |index: &[u8]| {
        let data = [log(&short(35)), record(op::DATA_END, &[0; 4])].concat();
        let start = (data.len() as u64).to_le_bytes();
        let statistics = record(op::STATISTICS, &[0; 46]);
        let footer = record(op::FOOTER, &[&start[..], &[0; 12]].concat());
        [&data, index, &statistics, &footer, mcap::MAGIC].concat()
    };
    let at = (mcap::MAGIC.len() + 9 + 8) as u64;
    let listed = record(op::ATTACHMENT_INDEX, &[&at.to_le_bytes()[..], &[0; 40]].concat());
    for bytes in [log(&short(32)), log(&short(35)), log(&in_chunk), indexed(&short(32)), indexed(&listed)] {
        folder.write("short.mcap", bytes);
        for args in [
            &["timing", "short.mcap"][..],
            &["log", "info", "short.mcap"],
            &["log", "check", "short.mcap"],
            &["log", "recover", "short.mcap", "--out", "new.mcap"],
            &["export", "short.mcap"],
            &["replay", "short.mcap"],
        ] {
            let called = folder.call(args);
            assert!(matches!(called.code, Some(0..=2)), "{args:?}: {called:?}");
        }
        let called = folder.call(&["log", "check", "short.mcap"]);
        assert!(called.out.contains("an attachment ends before its checksum"), "{called:?}");
    }
}

#[test]
fn numbers_that_no_group_and_no_device_has_are_damage() {
    let folder = Folder::new();
    let of_group = TickTiming { group: u16::MAX, ..TickTiming::default() };
    let of_device = Resync { device: u16::MAX, ..Resync::default() };
    for (record, words) in [
        (LogRecord::Tick(of_group), "it is of rate group 65535, of at most 1024"),
        (LogRecord::Resync(of_device), "it is of device 65535, of at most 8"),
    ] {
        let mut writer = McapWriter::create(&folder.path("wrong.mcap"), &Environment::default()).unwrap();
        writer.write(&record).unwrap();
        writer.finish().unwrap();
        let called = folder.call(&["timing", "wrong.mcap"]);
        assert!(called.err.contains(words), "{called:?}");
        let called = folder.call(&["log", "check", "wrong.mcap"]);
        assert!(called.code == Some(1) && called.out.contains(words), "{called:?}");
    }
}

#[test]
fn a_topic_with_a_long_name_and_many_messages_is_read_as_fast_as_it_is_long() {
    let folder = Folder::new();
    let mut bytes = Vec::new();
    let mut writer = mcap::Writer::new(std::io::Cursor::new(&mut bytes)).unwrap();
    let channel_id = writer.add_channel(0, &"x".repeat(20_000_000), "json", &BTreeMap::new()).unwrap();
    for sequence in 0..100_000 {
        let header = MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, b"{}").unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    folder.write("long.mcap", bytes);
    let (code, out) = in_time(&folder, &["timing", "long.mcap"]);
    assert_eq!(code, Some(0), "{out}");
}

#[test]
fn a_schema_of_many_channels_is_looked_at_once() {
    let folder = Folder::new();
    let mut bytes = Vec::new();
    let mut writer = mcap::Writer::new(std::io::Cursor::new(&mut bytes)).unwrap();
    // A name with a field of palpate's own is looked for in all of it.
    let schema = writer.add_schema("foxglove.Log", "protobuf", &vec![0; 10_000_000]).unwrap();
    for channel in 0..20_000 {
        writer.add_channel(schema, &format!("/{channel}"), "protobuf", &BTreeMap::new()).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    folder.write("many.mcap", bytes);
    let (code, out) = in_time(&folder, &["timing", "many.mcap"]);
    assert_eq!(code, Some(0), "{out}");
}
