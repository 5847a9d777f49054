//! `palpate replay`: what it prints and how it exits.

mod support;

use palpate::log::LogRecord;
use palpate::runtime::Nanos;

use support::{Folder, SCENE, rewrite_log};

/// Records a run and gives the number of its forces.
fn recorded(folder: &Folder, more: &[&str]) -> usize {
    folder.succeed(&[&["run", "scene.toml", "--out", "run.mcap"], more].concat());
    folder.succeed(&["export", "run.mcap", "--topic", "/force"]).lines().count() - 1
}

/// Changes the last bit of the force at 150 ms.
fn spoil(folder: &Folder) {
    let spoiled = |record| match record {
        LogRecord::Force(mut force) if force.time == Nanos(150_000_000) => {
            force.force_n[2] = f64::from_bits(force.force_n[2].to_bits() ^ 1);
            LogRecord::Force(force)
        }
        record => record,
    };
    rewrite_log(&folder.path("run.mcap"), |session| session, spoiled);
}

#[test]
fn a_run_in_real_time_is_identical_and_exits_with_0() {
    let folder = Folder::new();
    // The command line's own changes are part of what was run.
    for more in [&["--model", "hold", "--duration", "0.4"][..], &["--model", "full"], &[]] {
        let forces = recorded(&folder, more);
        let text = folder.succeed(&["replay", "run.mcap"]);
        let lines: Vec<&str> = text.lines().collect();
        let first = format!("{forces} of {forces} force samples bit-identical, {forces} of {forces} commanded");
        assert!(lines.len() == 2 && lines[0] == first, "{text}");
        assert!(lines[1].starts_with(&format!("and {forces} of {forces} contact, ")), "{text}");
    }
    let json = folder.succeed(&["replay", "run.mcap", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["identical"], true);
    assert_eq!(report["force"]["identical"], report["force_commanded"]["logged"]);
    assert!(report["first_difference"].is_null() && report["fault"].is_null());
}

#[test]
fn a_difference_is_printed_with_both_values_and_exits_with_1() {
    let folder = Folder::new();
    recorded(&folder, &["--virtual"]);
    spoil(&folder);
    let called = folder.call(&["replay", "run.mcap"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(1), 1), "{called:?}");
    assert!(called.out.starts_with("199 of 200 force samples bit-identical, 200 of 200 commanded\n"), "{called:?}");
    let difference = "first difference: /force at t = 0.15 s differs in force_n: logged [";
    assert!(called.out.contains(difference) && called.out.contains(", computed ["), "{called:?}");
    let called = folder.call(&["replay", "run.mcap", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&called.out).unwrap();
    assert_eq!((called.code, &report["first_difference"]["t_s"]), (Some(1), &0.15.into()));
}

#[test]
fn what_cannot_be_replayed_is_refused_in_one_line_with_2() {
    let folder = Folder::new();
    recorded(&folder, &["--virtual"]);
    let bytes = std::fs::read(folder.path("run.mcap")).unwrap();
    folder.write("cut.mcap", &bytes[..bytes.len() / 2]);
    folder.write("text.mcap", SCENE);
    for (log, says) in [("cut.mcap", "damaged"), ("text.mcap", "no MCAP"), ("none.mcap", "none.mcap")] {
        let called = folder.call(&["replay", log]);
        assert_eq!((called.code, called.err.lines().count(), &*called.out), (Some(2), 1, ""), "{called:?}");
        assert!(called.err.starts_with("error: ") && called.err.contains(says), "{called:?}");
    }
}
