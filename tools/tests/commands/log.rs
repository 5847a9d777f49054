//! `palpate log info|check|recover`: what they print, what they leave behind and how they exit.

use serde_json::Value;

use crate::support::{Called, Folder};

/// A folder with the log of a run of some seconds in virtual time, `run.mcap`.
fn folder(seconds: &str) -> (Folder, Vec<u8>) {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", seconds, "--out", "run.mcap"]);
    let bytes = std::fs::read(folder.path("run.mcap")).unwrap();
    (folder, bytes)
}

fn json(folder: &Folder, log: &str) -> Value {
    let called = folder.call(&["log", "info", log, "--json"]);
    assert_eq!(called.code, Some(0), "{called:?}");
    serde_json::from_str(&called.out).unwrap()
}

fn assert_sound(called: &Called) {
    assert_eq!((called.code, &*called.err), (Some(0), ""), "{called:?}");
    assert!(called.out.starts_with("SOUND: ") && called.out.lines().count() == 1, "{called:?}");
}

#[test]
fn info_says_what_is_in_a_log_by_its_index_and_by_a_scan() {
    let (folder, bytes) = folder("2");
    let info = json(&folder, "run.mcap");
    assert_eq!((&info["complete"], &info["has_index"]), (&true.into(), &true.into()));
    assert_eq!(info["bytes"], bytes.len());
    let topic = |info: &Value, name: &str| {
        info["topics"].as_array().unwrap().iter().find(|topic| topic["topic"] == name).unwrap().clone()
    };
    let force = topic(&info, "/force");
    assert_eq!((&force["messages"], &force["schema"]), (&2000.into(), &"palpate.Force".into()));
    assert!((force["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1.0, "{force}");
    assert_eq!(topic(&info, "/timing/local")["messages"], 2001);
    assert_eq!(
        (&info["environment"]["execution"], &info["environment"]["model"]),
        (&"virtual".into(), &"patch".into())
    );
    assert_eq!(info["attachments"][0]["name"], "scene.toml");
    assert_eq!(info["chunks"][0]["compression"], "lz4");
    let text = folder.succeed(&["log", "info", "run.mcap"]);
    for words in
        ["complete, by its index", "duration   2.000 s", "virtual, model patch", "/force_commanded", "scene.toml"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    // Check that a log without its index says the same, but for that
    folder.write("cut.mcap", &bytes[..bytes.len() - 9]);
    let called = folder.call(&["log", "info", "cut.mcap"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(0), 1), "{called:?}");
    let scanned = json(&folder, "cut.mcap");
    assert_eq!(scanned["has_index"], false);
    for same in ["messages", "topics", "environment", "attachments", "duration_s"] {
        assert_eq!(scanned[same], info[same], "{same}");
    }
}

#[test]
fn a_check_is_silent_on_a_sound_log_and_names_what_is_wrong() {
    let (folder, bytes) = folder("2");
    assert_sound(&folder.call(&["log", "check", "run.mcap"]));
    for (name, wrong, words) in [
        ("cut.mcap", bytes[..bytes.len() / 2].to_vec(), "cut off at byte"),
        ("flip.mcap", flipped(&bytes, bytes.len() / 2), "is damaged"),
        ("tail.mcap", flipped(&bytes, bytes.len() - 20), "index of the log is damaged"),
    ] {
        folder.write(name, wrong);
        let called = folder.call(&["log", "check", name]);
        assert_eq!((called.code, called.err.lines().count()), (Some(1), 1), "{called:?}");
        assert!(called.err.starts_with(&format!("error: {name}: ")) && called.err.contains("finding"), "{called:?}");
        assert!(called.out.lines().any(|line| line.contains(words)), "{called:?}");
        let verdict = called.out.lines().last().unwrap();
        assert!(verdict.starts_with(&format!("NOT SOUND: {name}: ")), "{called:?}");
    }
    assert!(folder.succeed(&["log", "check", "--help"]).contains("Exits with 0 if the log is sound"));
}

fn flipped(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at] ^= 0x20;
    bytes
}

// Every boundary of 4 KiB is tried in log_recover.
#[test]
fn recover_makes_a_sound_log_of_a_cut_one() {
    let (folder, bytes) = folder("3");
    folder.write("cut.mcap", &bytes[..bytes.len() * 9 / 10]);
    let out = folder.succeed(&["log", "recover", "cut.mcap", "--out", "new.mcap"]);
    assert!(out.starts_with("saved: ") && out.contains("cut off at byte"), "{out}");
    assert_sound(&folder.call(&["log", "check", "new.mcap"]));
    assert_eq!(json(&folder, "new.mcap")["has_index"], true);
    let force = |log| folder.call(&["export", log, "--topic", "/force"]).out;
    let (whole, new) = (force("run.mcap"), force("new.mcap"));
    assert!(new == force("cut.mcap") && whole.starts_with(&new) && new.len() > whole.len() * 8 / 10);
}

#[test]
fn recover_goes_on_behind_a_damage_and_says_what_was_lost() {
    let (folder, bytes) = folder("3");
    folder.write("wrong.mcap", flipped(&bytes, bytes.len() / 2));
    let out = folder.succeed(&["log", "recover", "wrong.mcap", "--out", "new.mcap"]);
    assert!(out.contains("s of log time, ") && out.contains("lost in all: "), "{out}");
    let new = folder.succeed(&["export", "new.mcap", "--topic", "/force"]);
    let whole = folder.succeed(&["export", "run.mcap", "--topic", "/force"]);
    let rows: std::collections::HashSet<&str> = whole.lines().collect();
    assert!(new.lines().all(|row| rows.contains(row)));
    let lost = whole.lines().count() - new.lines().count();
    assert!((400..600).contains(&lost), "{lost}");
    assert_eq!(new.lines().last(), whole.lines().last());
}

#[test]
fn what_is_no_log_or_would_be_overwritten_is_refused_with_2() {
    let (folder, bytes) = folder("0.2");
    folder.write("table.csv", "t_s\n0\n");
    for args in [&["info", "table.csv"][..], &["check", "table.csv"], &["recover", "table.csv", "--out", "new.mcap"]] {
        let called = folder.call(&[&["log"], args].concat());
        assert_eq!((called.code, &*called.out), (Some(2), ""), "{called:?}");
        assert!(called.err.contains("no MCAP file") && called.err.lines().count() == 1, "{called:?}");
    }
    for args in [&["info", "none.mcap"][..], &["check", "none.mcap"], &["recover", "none.mcap", "--out", "new.mcap"]] {
        assert_eq!(folder.call(&[&["log"], args].concat()).code, Some(2));
    }
    assert!(!folder.files().contains(&"new.mcap".to_owned()));
    // Its own name, another path to it, a link and a second name.
    std::fs::hard_link(folder.path("run.mcap"), folder.path("hard.mcap")).unwrap();
    let mut names = vec!["run.mcap", "./run.mcap", "hard.mcap"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("run.mcap", folder.path("soft.mcap")).unwrap();
        names.push("soft.mcap");
    }
    for name in names {
        let called = folder.call(&["log", "recover", "run.mcap", "--out", name]);
        assert_eq!(called.code, Some(2), "{called:?}");
        assert!(called.err.contains("is the input itself"), "{called:?}");
        assert!(std::fs::read(folder.path("run.mcap")).unwrap() == bytes);
    }
    #[cfg(target_os = "linux")]
    assert_eq!(folder.call(&["log", "recover", "run.mcap", "--out", "/dev/full"]).code, Some(2));
}
