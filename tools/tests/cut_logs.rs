//! A real run's log cut at any byte or with a wrong bit: `export` and `timing` work up to the damage, and say so.

mod support;

use palpate::log::{LogEntry, LogReader, LogRecord};

use support::Folder;

const MAGIC: usize = 8;
const SPAWNED: usize = 40;

/// The log of a short run in virtual time: several chunks, every topic in use.
fn log(folder: &Folder) -> Vec<u8> {
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "1.2", "--out", "whole.mcap"]);
    std::fs::read(folder.path("whole.mcap")).unwrap()
}

/// Check that the command writes every force that is readable and nothing else, at cuts spread over the whole file and with a
/// wrong bit in three places.
#[test]
fn the_command_exits_with_0_and_one_warning() {
    let folder = Folder::new();
    let bytes = log(&folder);
    let whole = folder.succeed(&["export", "whole.mcap", "--topic", "/force"]);
    let cuts = (0..SPAWNED).map(|i| bytes[..MAGIC + i * (bytes.len() - MAGIC) / SPAWNED].to_vec());
    let flips = [1, 2, 3].map(|quarter| {
        let (mut bytes, at) = (bytes.clone(), quarter * bytes.len() / 4);
        bytes[at] ^= 0x40;
        bytes
    });
    for (i, bytes) in cuts.chain(flips).enumerate() {
        folder.write("bad.mcap", &bytes);
        let args: [&[&str]; 3] =
            [&["export", "bad.mcap", "--topic", "/force"], &["timing", "bad.mcap"], &["timing", "bad.mcap", "--json"]];
        let called = folder.call(args[i % 3]);
        assert_eq!((called.code, called.err.lines().count()), (Some(0), 1), "{i}: {called:?}");
        assert!(called.err.starts_with("warning: bad.mcap: "), "{i}: {called:?}");
        match i % 3 {
            0 => {
                let mut reader = LogReader::new(&*bytes, "bad.mcap").unwrap();
                let is_force = |entry: &LogEntry| matches!(entry, LogEntry::Record(LogRecord::Force(_)));
                assert!(whole.starts_with(&called.out), "{i}");
                assert_eq!(called.out.lines().count(), 1 + reader.readable().filter(is_force).count(), "{i}");
            }
            1 => assert!(called.out.contains("DAMAGED") || called.out.contains("damage"), "{i}: {called:?}"),
            _ => {
                let report: serde_json::Value = serde_json::from_str(&called.out).expect("one JSON document");
                assert!(report["damage"].is_string(), "{i}: {called:?}");
            }
        }
    }
}

/// Nanoseconds since 1970.
fn unix_ns() -> u64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as u64
}

// Check what a process leaves behind that has no chance to close anything: everything up to the last second, by the clock
// that both the log and this test read.
#[test]
fn a_killed_run_leaves_a_readable_log_that_lacks_at_most_a_second() {
    use std::process::{Command, Stdio};
    for extra_ms in [0, 137, 421] {
        let folder = Folder::new();
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["run", "scene.toml", "--duration", "1000", "--out", "killed.mcap"])
            .current_dir(folder.path(""))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Until the first chunk is there, then some while: how long that takes is the machine's affair.
        let size = || std::fs::metadata(folder.path("killed.mcap")).map_or(0, |file| file.len());
        while size() < 10_000 {
            assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        // Some moment that nothing in the run is in step with.
        let random_ms = unix_ns() / 1000 % 500;
        std::thread::sleep(std::time::Duration::from_millis(2000 + extra_ms + random_ms));
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        let killed_at = unix_ns();
        child.kill().unwrap();
        child.wait().unwrap();
        let called = folder.call(&["export", "killed.mcap", "--topic", "/force"]);
        assert_eq!((called.code, called.err.lines().count()), (Some(0), 1), "{called:?}");
        // Between two records or in one: a kill waits for neither.
        assert!(called.err.contains("cut off"), "{called:?}");
        // The start of the run by the environment, and the last record of the haptic group, since then.
        let mut reader = LogReader::open(folder.path("killed.mcap")).unwrap();
        let (mut start, mut last) = (0, palpate::runtime::Nanos::ZERO);
        for entry in reader.readable() {
            match entry {
                LogEntry::Environment(environment) => start = environment.epoch_ns(),
                LogEntry::Record(record @ LogRecord::Force(_)) => last = record.time(),
                _ => {}
            }
        }
        let missing_s = killed_at.saturating_sub(start + last.0) as f64 * 1e-9;
        assert!(last.as_secs_f64() > 2.0 && start > 0);
        assert!(missing_s <= 1.0, "{missing_s} s are missing");
        println!("killed after {:.3} s: {missing_s:.3} s are missing", (killed_at - start) as f64 * 1e-9);
        // Check that nothing is missing in between either, and that a sound log can be made of it
        let rows = support::rows(&called.out);
        assert!(rows.len() as u64 <= last.0 / 1_000_000);
        folder.succeed(&["log", "recover", "killed.mcap", "--out", "new.mcap"]);
        folder.succeed(&["log", "check", "new.mcap"]);
    }
}

#[test]
fn a_cut_below_the_magic_is_no_log() {
    let folder = Folder::new();
    let bytes = log(&folder);
    for cut in 0..MAGIC {
        folder.write("cut.mcap", &bytes[..cut]);
        for args in [&["export", "cut.mcap", "--topic", "/force"][..], &["timing", "cut.mcap"]] {
            let called = folder.call(args);
            assert_eq!((called.code, &*called.out), (Some(2), ""), "cut at {cut}: {called:?}");
            assert_eq!(called.err, "error: cut.mcap: no MCAP file: it does not begin with the MCAP magic\n");
        }
    }
}
