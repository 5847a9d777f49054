//! What the system does to a run of the command: signals, a stopped process, a full disk, a log that nobody takes.
#![cfg(target_os = "linux")]

mod support;

use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use support::{Folder, rows};

/// The scene's default ramp (s).
const RAMP_S: f64 = 0.1;

/// Starts `palpate run` for at most `seconds` and waits until it has run for a while.
fn start(folder: &Folder, seconds: &str, out: &str) -> Child {
    let child = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["run", "scene.toml", "--duration", seconds, "--out", out])
        .current_dir(folder.path("."))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    child
}

fn signal(child: &Child, signal: &str) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

fn finish(child: Child) -> (Option<i32>, String, String) {
    taken_apart(child.wait_with_output().unwrap())
}

/// Status, standard output and standard error.
fn taken_apart(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Time and magnitude of every commanded force.
fn commanded(folder: &Folder, log: &str) -> Vec<(f64, f64)> {
    let csv = folder.succeed(&["export", log, "--topic", "/force_commanded"]);
    rows(&csv).iter().map(|row| (row[0], row[1..4].iter().map(|c| c * c).sum::<f64>().sqrt())).collect()
}

#[test]
fn an_interrupt_ramps_the_force_out_closes_the_log_and_says_so() {
    for name in ["-INT", "-TERM"] {
        let folder = Folder::new();
        let child = start(&folder, "60", "run.mcap");
        signal(&child, name);
        let (code, out, err) = finish(child);
        assert_eq!(code, Some(130), "{err}");
        assert!(err.contains("interrupted after") && err.contains("of 60 s"), "{err}");
        assert!(out.contains("released"), "{out}");
        let commanded = commanded(&folder, "run.mcap");
        let rest = commanded.iter().position(|sample| sample.0 > 0.5 && sample.1 == 0.0).expect("it comes to rest");
        assert!(commanded[rest..].iter().all(|sample| sample.1 == 0.0));
        // Check that it faded within the declared time, and did not drop
        let full = commanded[..rest].iter().rposition(|sample| sample.1 > 0.999 * commanded[rest - 150].1).unwrap();
        let fading = commanded[rest].0 - commanded[full].0;
        assert!(fading > 0.5 * RAMP_S && fading < RAMP_S + 0.01, "{fading} s");
    }
}

#[test]
fn after_a_stopped_process_goes_on_the_first_command_is_zero_and_then_ramps_in() {
    let folder = Folder::new();
    // The model that served before the pause is old when it is over, and would fade.
    folder.spoil("off = [\"start_up\"]", "off = [\"start_up\", \"model_age\"]");
    let child = start(&folder, "6", "run.mcap");
    signal(&child, "-STOP");
    // Longer than what a thread is given to return: nobody hung while everything stood still.
    std::thread::sleep(Duration::from_millis(2600));
    signal(&child, "-CONT");
    let (code, out, err) = finish(child);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(!out.contains("left behind") && !out.contains("restarted"), "{out}");
    // What each command's release had skipped; the first release commands nothing.
    let table = folder.succeed(&["export", "run.mcap", "--topic", "/timing/local"]);
    let slips = |row: &str| row.split(',').nth(6).unwrap().parse::<f64>().unwrap();
    let slips: Vec<f64> = table.lines().skip(2).map(slips).collect();
    let commanded: Vec<f64> = commanded(&folder, "run.mcap").iter().map(|sample| sample.1).collect();
    assert_eq!(commanded.len(), slips.len());
    let zero = slips.iter().position(|&slips| slips >= 2000.0).expect("the pause");
    let before = commanded[zero - 1];
    assert!(before > 0.1, "the tool must feel something before: {before} N");
    assert_eq!(commanded[zero], 0.0);
    // Check that the force comes back in small steps and is all there after the ramp, however many periods the host takes; a
    // stall as long as the ramp is another pause
    let mut since_s = 0.0;
    let mut release = zero;
    while since_s < 1.5 * RAMP_S {
        release += 1;
        let dt = 1e-3 * (slips[release] + 1.0);
        if dt >= RAMP_S {
            assert_eq!(commanded[release], 0.0, "after {dt} s without a command");
            since_s = 0.0;
            continue;
        }
        let step = (commanded[release] - commanded[release - 1]).abs();
        assert!(step < (0.04 + dt / RAMP_S) * before, "{step} N in {dt} s of {before} N");
        since_s += dt;
    }
    let back = commanded[release];
    assert!((back - before).abs() < 0.1 * before, "{back} N of {before} N");
    // Check that the periods of the pause are accounted for
    let timing = folder.succeed(&["timing", "run.mcap", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&timing).unwrap();
    let local = &report["groups"][0];
    // It was stopped asleep or, now and then, within a tick, which then is a long one.
    let skipped = |cause: &str| local["skipped_by_cause"][cause].as_u64().unwrap();
    assert!(skipped("late_wake") + skipped("long_tick") >= 2500, "{local}");
    assert_eq!(report["groups"][1]["skipped_by_cause"]["fault"], 0, "{report}");
    let count = |name: &str| local[name].as_u64().unwrap();
    assert_eq!(count("released") + count("skipped"), count("elapsed_periods"));
}

#[test]
fn a_full_disk_costs_the_log_and_not_the_run() {
    let folder = Folder::new();
    let called = folder.call(&["run", "scene.toml", "--out", "/dev/full"]);
    assert_eq!(called.code, Some(1), "{called:?}");
    assert!(called.err.starts_with("error: the log is incomplete: ") && called.err.lines().count() == 1, "{called:?}");
    assert!(called.out.contains("released"), "{called:?}");
}

/// The figures of the haptic group in a report: released, skipped, missed, lost records.
fn local(out: &str) -> [u64; 4] {
    let local = out.lines().find(|line| line.starts_with("local  ")).unwrap_or_else(|| panic!("no local group: {out}"));
    let figures: Vec<u64> = local.split_whitespace().skip(3).map(|figure| figure.parse().unwrap()).collect();
    figures.try_into().unwrap_or_else(|_| panic!("{local}"))
}

// A file system of 1 MiB in a mount space of its own: it is gone with the shell.
#[test]
fn a_disk_that_becomes_full_keeps_what_fitted_and_the_run_goes_on() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("disk")).unwrap();
    let script = "mount -t tmpfs -o size=1m none disk || exit 99
        \"$0\" run scene.toml --duration 8 --out disk/run.mcap; code=$?; cp disk/run.mcap saved.mcap; exit $code";
    let output = Command::new("unshare")
        .args(["-rm", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(folder.path("."))
        .output()
        .unwrap();
    let (code, out, err) = taken_apart(output);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(err.starts_with("error: the log is incomplete: disk/run.mcap: No space left on device"), "{err}");
    let [released, skipped, _, lost] = local(&out);
    assert_eq!(released + skipped, 8001, "{out}");
    assert!(lost > 1000 && out.contains("records lost between"), "{out}");
    assert_eq!(std::fs::metadata(folder.path("saved.mcap")).unwrap().len(), 1 << 20);
    // Check that it is good up to there
    let saved = folder.call(&["export", "saved.mcap", "--topic", "/force"]);
    assert_eq!((saved.code, saved.err.lines().count()), (Some(0), 1), "{saved:?}");
    assert!(rows(&saved.out).len() > 1000);
    folder.succeed(&["log", "recover", "saved.mcap", "--out", "new.mcap"]);
    folder.succeed(&["log", "check", "new.mcap"]);
}

/// A run of `seconds` into a pipe that the shell command `reader` has at its other end: standard output
/// and standard error.
fn run_into_pipe(folder: &Folder, seconds: u64, reader: &str) -> (String, String) {
    assert!(Command::new("mkfifo").arg(folder.path("log.mcap")).status().unwrap().success());
    let mut reader = Command::new("sh").args(["-c", reader]).current_dir(folder.path(".")).spawn().unwrap();
    let begun = Instant::now();
    let child = start(folder, &seconds.to_string(), "log.mcap");
    let (code, out, err) = finish(child);
    let took = begun.elapsed();
    reader.kill().unwrap();
    reader.wait().unwrap();
    assert_eq!(code, Some(1), "{out}{err}");
    // Check that the haptic group ran on to its end, and that the report has all its figures
    let [released, skipped, _, lost] = local(&out);
    assert_eq!(released + skipped, 1000 * seconds + 1, "{out}");
    // Check that it is told what was lost, and when
    assert!(lost > 10_000 && out.contains("records lost between"), "{out}");
    // The run, the wait for the disk, and what a busy machine takes.
    assert!(took < Duration::from_secs(40), "{took:?}");
    (out, err)
}

#[test]
fn a_slow_disk_costs_records_and_not_the_run() {
    let folder = Folder::new();
    // Takes 20 kB/s.
    let slow = "while dd bs=2000 count=1 status=none; do sleep 0.1; done < log.mcap > taken.mcap";
    let (out, err) = run_into_pipe(&folder, 12, slow);
    assert!(err.contains("the disk did not take the last "), "{out}{err}");
    let taken = folder.call(&["export", "taken.mcap", "--topic", "/force"]);
    assert_eq!(taken.code, Some(0), "{taken:?}");
    assert!(rows(&taken.out).len() > 100);
}

#[test]
fn a_log_that_nobody_takes_costs_records_and_not_the_run() {
    let folder = Folder::new();
    // Opens it, which lets the run start, and reads nothing: nearly everything is lost, but for what fits into the pipe.
    let (out, err) = run_into_pipe(&folder, 3, "exec sleep 60 < log.mcap");
    assert!(err.starts_with("error: the log is incomplete: log.mcap: the disk did not take the last "), "{out}{err}");
}
