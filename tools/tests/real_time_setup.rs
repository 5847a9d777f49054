//! What the command asks of the system and does not get: reported, logged, and never a reason to fail.
//!
//! The real binary runs in a child process whose privileges are taken away by `setpriv` and `prlimit`, or which
//! `taskset` keeps on one core (all three: util-linux). Nothing is skipped: where the tests themselves have no privileges
//! there is less to take away, and the child has as few.
#![cfg(target_os = "linux")]

mod support;

use std::process::Command;

use support::Folder;

/// No right to real-time priorities and 64 kB of lockable memory.
const NO_RIGHTS: &str = "prlimit --rtprio=0:0 --memlock=65536:65536";
/// Root without the two capabilities that would stand above these limits.
const NO_CAPABILITIES: &str = "setpriv --bounding-set -sys_nice,-ipc_lock --inh-caps -sys_nice,-ipc_lock";
const ONE_CORE: &str = "taskset -c";

/// What a run told: its report, and what its log says that the system granted.
struct Told {
    report: String,
    granted: String,
    periods: u64,
}

/// Runs the demo of the folder in real time, below these commands, and reads its log back.
fn run_below(commands: &[&str]) -> Told {
    let folder = Folder::new();
    let words: Vec<&str> = commands.iter().flat_map(|command| command.split(' ')).collect();
    let mut command = match words.split_first() {
        Some((first, others)) => {
            let mut command = Command::new(first);
            command.args(others).arg(env!("CARGO_BIN_EXE_palpate"));
            command
        }
        None => Command::new(env!("CARGO_BIN_EXE_palpate")),
    };
    let output = command.args(["run", "scene.toml", "--out", "run.mcap"]).current_dir(folder.path("")).output();
    let output = output.unwrap_or_else(|error| panic!("{commands:?}: {error}"));
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    let (report, complaints) = (text(output.stdout), text(output.stderr));
    assert_eq!((output.status.code(), &*complaints), (Some(0), ""), "{commands:?}: {report}");

    let json = folder.succeed(&["timing", "run.mcap", "--json"]);
    let document: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let granted = document["environment"]["granted"].as_object().expect("what was granted").iter();
    let granted = granted.map(|(key, value)| format!("{key}: {}\n", value.as_str().expect("text"))).collect();
    let counts = &document["groups"][0];
    let periods = counts["released"].as_u64().expect("released") + counts["skipped"].as_u64().expect("skipped");
    Told { report, granted, periods }
}

fn without_rights() -> Vec<&'static str> {
    let own = std::fs::read_to_string("/proc/self/status").expect("its own status");
    let root = own.lines().any(|line| line.starts_with("Uid:") && line.split_whitespace().nth(2) == Some("0"));
    if root { vec![NO_CAPABILITIES, NO_RIGHTS] } else { vec![NO_RIGHTS] }
}

/// The first core that this process may use, as `taskset` takes it.
fn a_core() -> String {
    let own = std::fs::read_to_string("/proc/self/status").expect("its own status");
    let list = own.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("the cores it may use");
    list.trim().split([',', '-']).next().expect("at least one core").to_owned()
}

/// The line of one thing in what was granted.
fn line<'a>(told: &'a Told, key: &str) -> &'a str {
    let line = told.granted.lines().find(|line| line.starts_with(&format!("{key}: ")));
    line.unwrap_or_else(|| panic!("nothing about {key}: {}", told.granted))
}

/// Whether the report, which breaks long lines, has these words in this order.
fn has_words(report: &str, words: &str) -> bool {
    report.split_whitespace().collect::<Vec<_>>().join(" ").contains(words)
}

/// The scene lasts 0.2 s: every period is accounted for, whatever the system refused.
const PERIODS: u64 = 201;

#[test]
fn without_privileges_the_run_goes_on_and_names_what_was_refused() {
    let told = run_below(&without_rights());
    assert_eq!(told.periods, PERIODS);
    let local = line(&told, "local");
    assert!(local.contains("SCHED_OTHER") && local.contains("SCHED_FIFO 80 refused: "), "{local}");
    // Check that no thread spins that has no real-time policy
    assert!(local.contains(", sleep;"), "{local}");
    let memory = line(&told, "memory");
    assert!(memory.contains("not locked: the limit is 65536 bytes"), "{memory}");
    assert!(has_words(&told.report, "SCHED_FIFO 80 refused: "), "{}", told.report);
    assert!(has_words(&told.report, "not locked: the limit is 65536 bytes"), "{}", told.report);
}

#[test]
fn on_one_core_the_run_goes_on() {
    let core = format!("{ONE_CORE} {}", a_core());
    let told = run_below(&[&core]);
    assert_eq!(told.periods, PERIODS);
    assert!(line(&told, "machine").ends_with(" 1 cores"), "{}", told.granted);
    // Nothing to pin to, so nothing is asked for and nothing is refused.
    assert!(line(&told, "local").contains("on any cpu"), "{}", told.granted);
    assert!(!line(&told, "local").contains("core"), "{}", told.granted);
}

#[test]
fn on_one_core_and_without_privileges_the_run_goes_on() {
    let core = format!("{ONE_CORE} {}", a_core());
    let mut commands = without_rights();
    commands.push(&core);
    let told = run_below(&commands);
    assert_eq!(told.periods, PERIODS);
    assert!(line(&told, "local").contains("SCHED_FIFO 80 refused: "), "{}", told.granted);
    assert!(line(&told, "machine").ends_with(" 1 cores"), "{}", told.granted);
}

#[test]
fn the_policy_decides_whether_a_thread_spins() {
    let told = run_below(&[]);
    assert_eq!(told.periods, PERIODS);
    let local = line(&told, "local");
    if local.contains("SCHED_FIFO 80 on") {
        assert!(local.ends_with("sleep, then spin, margin adapts (at most 135 us)"), "{local}");
    } else {
        assert!(local.contains(", sleep;") && local.contains("refused"), "{local}");
    }
    // The global group asks for no policy: it sleeps whatever the rights are.
    assert!(line(&told, "global").ends_with("SCHED_OTHER on any cpu, sleep"), "{}", told.granted);
    // Timer slack needs no privilege, and what was asked for was given.
    assert_eq!(line(&told, "timer slack"), "timer slack: 1 ns");
}
