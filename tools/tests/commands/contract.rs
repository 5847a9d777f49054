//! The contract of the command line: exit codes, one line per error, what is printed and which files are written.

use palpate::log::{LogEntry, LogReader, LogRecord};
use palpate::model::local::Kind as LocalModelKind;

use crate::support::{Called, Folder, PATH, rows};

/// Check that it is a refusal: exit code 2, one line on standard error that has `words` in it, and nothing else.
#[track_caller]
fn assert_refused(called: &Called, words: &[&str]) {
    let Called { code, out, err } = called;
    assert_eq!((*code, &**out), (Some(2), ""), "{called:?}");
    let is_one_line = err.ends_with('\n') && err.trim_end().lines().count() == 1 && err.starts_with("error: ");
    assert!(is_one_line && words.iter().all(|word| err.contains(word)), "{words:?} in {err:?}");
}

#[test]
fn a_bad_scene_is_refused_in_one_line_and_creates_no_file() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("size_m = [0.1", "size_mm = [0.1", &["scene.toml:3: body.block.size_mm: unknown key", "size_m"]),
        ("nodes = [6, 6, 6]", "nodes = [6, 0, 6]", &["scene.toml:2: body.block.nodes: is [6, 0, 6]"]),
        ("stiffness_n_per_m = 30.0", "stiffness_n_per_m = -30.0", &["scene.toml:7:", "stiffness_n_per_m: is -30"]),
        ("stiffness_n_per_m = 30.0", "stiffness_n_per_m = 1e12", &["body: ", "less stiffness"]),
        ("node_mass_kg = 0.0005", "node_mass_kg = 1e-15", &["body: ", "more mass"]),
        ("damping_ratio = 0.3", "damping_ratio = 1e9", &["body: ", "less stiffness or damping"]),
        ("patch = [3, 3, 2]", "patch = [7, 3, 2]", &["scene.toml:17: local.patch: is [7, 3, 2]"]),
        (
            "path_csv =",
            "attach_node = [6, 0, 5]\npath_csv =",
            &["scene.toml:20: device.attach_node: [6, 0, 5] is outside"],
        ),
        ("compute_latency_ms = 0", "compute_latency_ms = -1", &["scene.toml:13: global.compute_latency_ms: is -1"]),
        ("rate_hz = 30\n", "rate_hz = 30\nsubsteps_per_ms = 1\n", &["global.substeps_per_ms: is 1", "unstable"]),
        ("duration_s = 0.2", "duration_s = -0.2", &["run.duration_s: is -0.2"]),
        ("[run]", "[run", &["TOML syntax"]),
        ("[run]", "[ruin]", &["ruin: unknown key"]),
        ("\"path.csv\"", "\"nowhere.csv\"", &["scene.toml:20: device.path_csv: nowhere.csv: "]),
        ("\"path.csv\"", "\".\"", &["scene.toml:20: device.path_csv: "]),
    ];
    let folder = Folder::new();
    for (good, bad, words) in cases {
        folder.spoil(good, bad);
        for time in [&["--virtual"][..], &[]] {
            let called = folder.call(&[&["run", "scene.toml"], time].concat());
            assert_refused(&called, words);
            assert_eq!(folder.files(), ["path.csv", "scene.toml"], "{bad}");
        }
    }
}

#[test]
fn a_bad_path_is_refused_with_its_own_line_and_creates_no_file() {
    let folder = Folder::new();
    let header = "t_s,x_m,y_m,z_m\n";
    for (text, word) in [
        (format!("{header}0,0,0,0.2\n0.1,0,nan,0.2\n"), "path.csv:3: y_m is NaN"),
        (format!("{header}0,0,0,inf\n"), "path.csv:2: z_m is inf"),
        (format!("{header}0,0,0,0.2\n0.1,0,0,0.2\n0.1,0,0,0.2\n"), "path.csv:4: t_s is 0.1 after 0.1"),
        (format!("{header}0.2,0,0,0.2\n0.1,0,0,0.2\n"), "path.csv:3: t_s is 0.1 after 0.2"),
        (format!("{header}0,0,0\n"), "path.csv:2: found 3 columns"),
        (format!("{header}0,0,0,high\n"), "path.csv:2: z_m is \"high\""),
        (header.to_owned(), "path.csv:1: "),
        (String::new(), "path.csv:1: found no header"),
        (PATH.replace("x_m", "x_mm"), "path.csv:1: found the header"),
    ] {
        folder.write("path.csv", &text);
        assert_refused(&folder.call(&["run", "scene.toml", "--virtual"]), &[word]);
        assert_eq!(folder.files(), ["path.csv", "scene.toml"]);
    }
}

#[test]
fn a_bad_command_line_is_refused_in_one_line() {
    let folder = Folder::new();
    folder.write("empty.mcap", "");
    folder.write("text.mcap", "t_s,fx_n,fy_n,fz_n\n");
    std::fs::create_dir(folder.path("folder")).unwrap();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "0.04", "--out", "good.mcap"]);
    let before = folder.files();
    let run = |args: &[&'static str]| [&["run", "scene.toml", "--virtual"], args].concat();
    let cases: Vec<(Vec<&str>, &[&str])> = vec![
        (vec!["frobnicate"], &["frobnicate", "palpate --help"]),
        (vec!["--json"], &["--json"]),
        (vec!["run"], &["SCENE", "palpate run --help"]),
        (vec!["run", "scene.toml", "extra"], &["extra"]),
        (vec!["run", "nowhere.toml"], &["nowhere.toml", "No such file"]),
        (vec!["run", "folder"], &["folder", "directory"]),
        (vec!["run", "good.mcap"], &["good.mcap"]),
        (run(&["--duration", "nan"]), &["run.duration_s", "NaN"]),
        (run(&["--duration", "-1"]), &["run.duration_s", "-1"]),
        (run(&["--duration=-1"]), &["run.duration_s", "-1"]),
        (run(&["--duration", "0"]), &["run.duration_s", "is 0"]),
        (run(&["--duration", "1e-9"]), &["run.duration_s", "one haptic period"]),
        (run(&["--duration", "1e9"]), &["run.duration_s", "1000000 s"]),
        (run(&["--duration", "inf"]), &["run.duration_s"]),
        (run(&["--duration", "soon"]), &["soon", "--duration"]),
        (run(&["--duration"]), &["--duration"]),
        (run(&["--model", "marble"]), &["marble", "hold", "patch", "full"]),
        (run(&["--out", "nowhere/log.mcap"]), &["nowhere/log.mcap"]),
        (run(&["--out", "folder"]), &["folder", "directory"]),
        (run(&["--out", "scene.toml"]), &["scene.toml", "input"]),
        (run(&["--out", "./folder/../path.csv"]), &["path.csv", "input"]),
        (run(&["--insecure"]), &["--insecure", "--global"]),
        (run(&["--config", "link.toml"]), &["--config", "--global"]),
        (vec!["view", "scene.toml", "--insecure"], &["--insecure", "--global"]),
        (vec!["view", "--config", "link.toml"], &["--config", "--global"]),
        (vec!["mock", "haply", "--after", "10", "--duration", "0"], &["--fault"]),
        (vec!["timing"], &["LOG", "palpate timing --help"]),
        (vec!["timing", "nowhere.mcap"], &["nowhere.mcap", "No such file"]),
        (vec!["timing", "folder"], &["folder", "directory"]),
        (vec!["timing", "empty.mcap"], &["empty.mcap", "no MCAP"]),
        (vec!["timing", "text.mcap", "--json"], &["text.mcap", "no MCAP"]),
        (vec!["export"], &["LOG"]),
        (vec!["export", "good.mcap"], &["--topic"]),
        (vec!["export", "good.mcap", "--topic", "/farce"], &["good.mcap", "\"/farce\"", "/force_commanded"]),
        (vec!["export", "good.mcap", "--topic", "/force", "--format", "xml"], &["xml", "csv"]),
        (vec!["export", "good.mcap", "--topic", "/farce", "--out", "new.csv"], &["/farce"]),
        (vec!["export", "good.mcap", "--topic", "/force", "--out", "nowhere/f.csv"], &["nowhere/f.csv"]),
        (vec!["export", "good.mcap", "--topic", "/force", "--out", "folder"], &["folder", "directory"]),
        (vec!["export", "good.mcap", "--topic", "/force", "--out", "good.mcap"], &["good.mcap", "input"]),
        (vec!["export", "folder", "--topic", "/force"], &["folder", "directory"]),
        (vec!["export", "empty.mcap", "--topic", "/force"], &["empty.mcap", "no MCAP"]),
        (vec!["export", "text.mcap", "--topic", "/force"], &["text.mcap", "no MCAP"]),
    ];
    let whole = std::fs::read(folder.path("good.mcap")).unwrap();
    for (args, words) in cases {
        assert_refused(&folder.call(&args), words);
        assert_eq!(folder.files(), before, "{args:?}");
    }
    assert_eq!(std::fs::read(folder.path("good.mcap")).unwrap(), whole);
    assert_eq!(std::fs::read_to_string(folder.path("path.csv")).unwrap(), PATH);
}

#[cfg(unix)]
#[test]
fn a_command_that_is_no_text_is_refused_in_one_line() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::new();
    let called = folder.call_with(&[std::ffi::OsStr::from_bytes(b"r\xffn")]);
    assert_refused(&called, &["unrecognized subcommand", "palpate --help"]);
}

#[test]
fn help_and_version_are_answers_not_errors() {
    let folder = Folder::new();
    for args in [&["--help"][..], &["help"], &["run", "--help"], &["timing", "--help"], &["export", "--help"]] {
        assert!(folder.succeed(args).contains("Usage: palpate"), "{args:?}");
    }
    let version = folder.succeed(&["--version"]);
    assert!(version.starts_with(concat!("palpate ", env!("CARGO_PKG_VERSION"), "\nfeatures: ")), "{version}");
    assert!(version.contains("\ninstructions: "), "{version}");
}

#[test]
fn built_in_scenes_are_listed_and_run_by_their_names() {
    let folder = Folder::new();
    let list = folder.succeed(&["list"]);
    assert!(list.contains("\ndrag_friction\n           The tool presses 8 mm into the top"), "{list}");
    let run = ["run", "drag_friction", "--virtual", "--duration", "0.1"];
    assert!(folder.succeed(&run).contains("0.100 s of virtual time"));
    // A file of that name is what is meant.
    folder.write("drag_friction", "no scene");
    assert_refused(&folder.call(&run), &["drag_friction:1"]);
    // A folder of that name is not.
    std::fs::create_dir(folder.path("cantilever")).unwrap();
    let run = ["run", "cantilever", "--virtual", "--duration", "0.1"];
    assert!(folder.succeed(&run).contains("0.100 s of virtual time"));
    assert_refused(
        &folder.call(&["run", "drag_frictoin", "--virtual"]),
        &["drag_frictoin: no such file", "palpate list"],
    );
}

#[test]
fn a_doctor_and_completions_are_at_hand() {
    let folder = Folder::new();
    let text = folder.succeed(&["doctor"]);
    assert!(["READY: ", "USABLE: ", "LIMITED: "].iter().any(|word| text.starts_with(word)), "{text}");
    for shell in ["bash", "zsh", "fish"] {
        assert!(folder.succeed(&["completions", shell]).contains("replay"), "{shell}");
    }
}

#[test]
fn without_out_the_log_is_in_the_current_folder_and_out_overwrites() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    assert_eq!(folder.files(), ["palpate-virtual.mcap", "path.csv", "scene.toml"]);
    folder.write("other.mcap", vec![7; 1 << 20]);
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "other.mcap"]);
    let read = |name| std::fs::read(folder.path(name)).unwrap();
    assert!(read("other.mcap") == read("palpate-virtual.mcap"));
}

#[test]
fn json_is_one_document_and_nothing_else() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    let out = folder.succeed(&["timing", "palpate-virtual.mcap", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&out).expect("one JSON document");
    assert_eq!(report["groups"].as_array().unwrap().len(), 3);
    let local = &report["groups"][0];
    assert_eq!((local["name"].as_str(), local["released"].as_u64()), (Some("local"), Some(201)));
    for figure in ["lateness_ns", "execution_ns"] {
        for percentile in ["p50", "p90", "p99", "p999", "max"] {
            assert!(local[figure][percentile].is_u64(), "{figure} {percentile}");
        }
    }
    for key in ["skipped", "missed", "lost_records"] {
        assert_eq!(local[key].as_u64(), Some(0), "{key}");
    }
    assert_eq!(report["force"]["ticks"].as_u64(), Some(200));
    assert!(report["resyncs"]["count"].as_u64() >= Some(3));
    assert!(report["force"]["model_age_s"]["max"].is_f64());
    assert!(report["environment"]["granted"].is_object());
}

#[test]
fn timing_names_every_figure_it_promises() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    let text = folder.succeed(&["timing", "palpate-virtual.mcap"]);
    for word in [
        "released",
        "skipped",
        "missed",
        "every release at its time",
        "p50",
        "p99",
        "max",
        "resyncs",
        "jump",
        "before blending",
        "after blending",
        "age",
        "granted",
        "local",
        "global",
        "contact",
        "force",
    ] {
        assert!(text.contains(word), "no {word:?} in\n{text}");
    }
}

/// Check that the exported rows are the records of the log, bit for bit.
#[test]
fn exported_forces_have_one_row_per_tick_and_read_back_exactly() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    let csv = |topic| folder.succeed(&["export", "palpate-virtual.mcap", "--topic", topic, "--format", "csv"]);
    let records: Vec<LogRecord> = LogReader::open(folder.path("palpate-virtual.mcap"))
        .unwrap()
        .map(Result::unwrap)
        .filter_map(|entry| match entry {
            LogEntry::Record(record) => Some(record),
            _ => None,
        })
        .collect();
    let computed = |record: &LogRecord| match record {
        LogRecord::Force(r) => Some(r.force_n),
        _ => None,
    };
    let commanded = |record: &LogRecord| match record {
        LogRecord::Command(r) => Some(r.force_n),
        _ => None,
    };
    type Force = fn(&LogRecord) -> Option<[f64; 3]>;
    for (topic, force) in [("/force", computed as Force), ("/force_commanded", commanded as Force)] {
        let text = csv(topic);
        assert_eq!(text.lines().next(), Some("t_s,fx_n,fy_n,fz_n"), "{topic}");
        let logged: Vec<[f64; 3]> = records.iter().filter_map(force).collect();
        let rows = rows(&text);
        assert_eq!((rows.len(), logged.len()), (200, 200), "{topic}");
        for (n, (row, force)) in rows.iter().zip(&logged).enumerate() {
            assert_eq!(row[0], (n + 1) as f64 / 1000.0, "{topic}");
            for (cell, component) in row[1..].iter().zip(force) {
                assert_eq!(cell.to_bits(), component.to_bits(), "{topic} row {n}");
            }
        }
        assert!(rows.iter().any(|row| row[3] > 0.1), "the tool never felt anything");
    }
    assert!(csv("/force_commanded") == csv("/force"), "no limit acted, so both are the same");

    let out = folder.succeed(&["export", "palpate-virtual.mcap", "--topic", "/force", "--out", "force.csv"]);
    assert_eq!(out, "");
    assert_eq!(std::fs::read_to_string(folder.path("force.csv")).unwrap(), csv("/force"));
}

#[test]
fn the_safety_limits_act_on_the_commanded_force_alone() {
    let folder = Folder::new();
    let forces = |topic| rows(&folder.succeed(&["export", "palpate-virtual.mcap", "--topic", topic]));
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    let free = forces("/force");
    folder.spoil("max_force_n = 8.0\nmax_slew_n_per_ms = 0.5", "max_force_n = 0.3\nmax_slew_n_per_ms = 0.01");
    let report = folder.succeed(&["run", "scene.toml", "--virtual"]);
    assert!(report.contains("clamp") && report.contains("slew"), "{report}");
    assert_eq!(forces("/force"), free);
    let commanded = forces("/force_commanded");
    let norm = |f: [f64; 3]| f.iter().map(|c| c * c).sum::<f64>().sqrt();
    let mut last = [0.0; 3];
    for row in &commanded {
        let force = [row[1], row[2], row[3]];
        assert!(norm(force) <= 0.3 * (1.0 + 1e-12));
        assert!(norm(std::array::from_fn(|i| force[i] - last[i])) <= 0.01 * (1.0 + 1e-9));
        last = force;
    }
    assert!(norm(last) > 0.29, "the clamp was never reached: {last:?}");
}

#[test]
fn every_topic_of_a_log_can_be_exported() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    for (topic, header, count) in [
        ("/force", "t_s,fx_n", 200),
        ("/force_commanded", "t_s,fx_n", 200),
        ("/tool", "t_s,x_m", 201),
        ("/contact", "t_s,mode", 200),
        ("/resync", "t_s,version", 5),
        ("/global", "t_s,version", 6),
        ("/ports", "t_s,group,port", 19),
        ("/probe", "t_s,node", 200),
        ("/log", "t_s,level,message", 0),
        ("/timing/local", "tick,scheduled_ns", 201),
        ("/timing/global", "tick,scheduled_ns", 7),
    ] {
        let text = folder.succeed(&["export", "palpate-virtual.mcap", "--topic", topic]);
        assert!(text.starts_with(header), "{topic}: {text}");
        assert_eq!(text.lines().count() - 1, count, "{topic}");
    }
}

/// Check across chunks too: a viewer that reads from front to back never has to go back.
#[test]
fn a_virtual_log_is_in_time_order_from_front_to_back() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "2.1"]);
    let times: Vec<u64> = LogReader::open(folder.path("palpate-virtual.mcap"))
        .unwrap()
        .map(Result::unwrap)
        .filter_map(|entry| match entry {
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => None,
            LogEntry::Record(record) => Some(record.time().0),
            LogEntry::Stats(stats) => Some(stats.time.0),
            LogEntry::Text(event) => Some(event.time.0),
            LogEntry::Scene(frame) => Some(frame.time.0),
        })
        .collect();
    assert!(times.len() > 10_000 && times.is_sorted());
}

#[test]
#[cfg(target_os = "linux")]
fn a_log_on_a_full_disk_ends_the_command_with_1_and_one_line() {
    let folder = Folder::new();
    for time in [&["--virtual"][..], &[]] {
        let called = folder.call(&[&["run", "scene.toml", "--out", "/dev/full"], time].concat());
        assert_eq!(called.code, Some(1), "{called:?}");
        assert_eq!(called.err.lines().count(), 1, "{called:?}");
        assert!(called.err.starts_with("error: the log is incomplete: /dev/full: "), "{called:?}");
        assert!(called.out.contains("released"), "the run itself is reported: {called:?}");
    }
    folder.succeed(&["run", "scene.toml", "--virtual"]);
    let called = folder.call(&["export", "palpate-virtual.mcap", "--topic", "/force", "--out", "/dev/full"]);
    assert_refused(&called, &["/dev/full", "No space left"]);
}

#[test]
fn a_reader_that_goes_away_early_is_no_error() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "2"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["export", "palpate-virtual.mcap", "--topic", "/tool"])
        .current_dir(folder.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::with_capacity(64, child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), &*output.stderr), (Some(0), &b""[..]));
}

#[test]
fn a_scene_of_every_model_runs_and_names_it() {
    let folder = Folder::new();
    for model in LocalModelKind::ALL.map(LocalModelKind::name) {
        let report = folder.succeed(&["run", "scene.toml", "--virtual", "--model", model]);
        assert!(report.contains(&format!("model {model},")), "{report}");
    }
}

/// Ten seconds of real time, or five of a smaller scene on a machine that is too slow. Check what is written and said, never how late it was.
#[test]
fn the_command_alone_runs_the_flagship_in_real_time() {
    let folder = Folder::new();
    let started = std::time::Instant::now();
    // A host that stalls is said, and is no failure.
    let Called { code, out: report, err } = folder.call(&[]);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.lines().all(|line| line.starts_with(" WARN")), "{err}");
    let is_slow = err.contains("`demo` runs instead");
    let seconds = if is_slow { 5 } else { 10 };
    assert!(started.elapsed().as_secs_f64() >= seconds as f64 - 0.1);
    assert_eq!(folder.files(), ["palpate-run.mcap", "path.csv", "scene.toml"]);
    assert!(report.contains(&format!(" {seconds}.000 s of real time")), "{report}");
    for word in ["lateness", "execution", "skipped", "missed", "granted", "palpate-run.mcap"] {
        assert!(report.contains(word), "no {word:?} in\n{report}");
    }
    let json = folder.succeed(&["timing", "palpate-run.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    for (group, periods) in [("local", 1000 * seconds + 1), ("global", 30 * seconds + 1)] {
        let groups = json["groups"].as_array().unwrap();
        let group = groups.iter().find(|told| told["name"] == group).unwrap();
        let count = |key: &str| group[key].as_u64().unwrap();
        assert_eq!(count("released") + count("skipped"), periods, "{group}");
        assert_eq!(count("lost_records"), 0);
    }
    let forces = rows(&folder.succeed(&["export", "palpate-run.mcap", "--topic", "/force"]));
    assert_eq!(forces.len() as u64 + 1, json["groups"][0]["released"].as_u64().unwrap());
}

#[cfg(not(feature = "link"))]
#[test]
fn without_the_link_its_commands_say_in_one_line_how_to_get_it() {
    let folder = Folder::new();
    for args in [
        &["serve", "scene.toml", "--listen", "tcp/127.0.0.1:7447"][..],
        &["run", "scene.toml", "--global", "tcp/127.0.0.1:7447"],
        &["view", "scene.toml", "--global", "tcp/127.0.0.1:7447"],
        &["link", "keys", "keys"],
    ] {
        let called = folder.call(args);
        assert_eq!((called.code, called.err.lines().count()), (Some(2), 1), "{args:?}: {called:?}");
        assert!(called.err.contains("--features link"), "{args:?}: {called:?}");
    }
    assert!(!folder.path("keys").exists());
}
