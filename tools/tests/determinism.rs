//! Virtual runs are the same to the last bit every time, in every topic, for every scene and compute latency.

#[path = "support/repository.rs"]
mod repository;
mod support;

use std::path::PathBuf;

use support::{Folder, rows};

/// Nine global periods: long enough for eight resyncs, short enough for a test.
const SECONDS: &str = "0.3";
const TICKS: usize = 300;

const TOPICS: [&str; 15] = [
    "/force",
    "/force_commanded",
    "/tool",
    "/contact",
    "/resync",
    "/global",
    "/ports",
    "/probe",
    "/log",
    "/timing/local",
    "/timing/global",
    "/timing/logger",
    "/stats/local",
    "/stats/global",
    "/stats/logger",
];

fn scenes() -> Vec<PathBuf> {
    let folder = repository::in_repository("scenes");
    let entries = std::fs::read_dir(folder).expect("scenes/").map(|entry| entry.expect("readable").path());
    let mut scenes: Vec<_> = entries.filter(|path| path.extension().is_some_and(|ending| ending == "toml")).collect();
    // A device that is really there has no virtual time.
    scenes.retain(|path| !path.ends_with("haply.toml"));
    scenes.sort();
    assert!(scenes.len() >= 8, "{scenes:?}");
    scenes
}

/// What the topics of the first device begin with.
fn device(scene: &str) -> &'static str {
    if scene.ends_with("two_hands.toml") || scene.ends_with("forceps.toml") { "/left" } else { "" }
}

/// Two runs of a scene, byte for byte the same file; gives the exported forces.
fn run_twice(folder: &Folder, scene: &str, more: &[&str]) -> String {
    let run = |log| folder.succeed(&[&["run", scene, "--virtual", "--out", log], more].concat());
    // Side by side: what runs beside it does not change a run.
    let reports = std::thread::scope(|scope| {
        let [a, b] = ["a.mcap", "b.mcap"].map(|log| scope.spawn(move || run(log)));
        [a, b].map(|run| run.join().unwrap().lines().filter(|l| !l.starts_with("log:")).count())
    });
    assert_eq!(reports[0], reports[1]);
    let export = |log: &str, topic: &str| folder.succeed(&["export", log, "--topic", topic]);
    let topic = format!("{}/force", device(scene));
    let force = export("a.mcap", &topic);
    assert!(force == export("b.mcap", &topic), "{scene}: {topic}");
    let read = |log| std::fs::read(folder.path(log)).unwrap();
    // One comparison for every topic; which of them differs is asked only if one does.
    if read("a.mcap") != read("b.mcap") {
        let differ = |topic: &&&str| {
            folder.call(&["export", "a.mcap", "--topic", topic]).out
                != folder.call(&["export", "b.mcap", "--topic", topic]).out
        };
        panic!("{scene}: the logs differ in {:?}", TOPICS.iter().filter(differ).collect::<Vec<_>>());
    }
    force
}

#[test]
fn two_virtual_runs_of_every_scene_are_byte_identical() {
    let folder = Folder::new();
    for scene in scenes() {
        let scene = scene.to_str().expect("UTF-8");
        let force = rows(&run_twice(&folder, scene, &["--duration", SECONDS]));
        assert_eq!(force.len(), TICKS, "{scene}");
        for (n, row) in force.iter().enumerate() {
            assert_eq!(row[0], (n + 1) as f64 / 1000.0, "{scene}");
            assert!(row.iter().all(|cell| cell.is_finite()), "{scene}: {row:?}");
        }
        let topic = format!("{}/resync", device(scene));
        let resyncs = folder.succeed(&["export", "a.mcap", "--topic", &topic]);
        assert!(rows(&resyncs).len() >= 8, "{scene}: {resyncs}");
    }
}

#[test]
fn every_model_is_deterministic() {
    let folder = Folder::new();
    let mut seen: Vec<String> = Vec::new();
    for model in ["full", "hold", "patch"] {
        let force = run_twice(&folder, "scene.toml", &["--model", model]);
        assert!(rows(&force).iter().any(|row| row[3] != 0.0), "{model} never felt anything");
        assert!(!seen.contains(&force), "{model} gives the forces of another model");
        seen.push(force);
    }
}

/// The age of the serving model at each tick, from the log's resyncs: state and swap of each.
fn mean_age_s(folder: &Folder) -> f64 {
    let json = folder.succeed(&["timing", "a.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    json["force"]["model_age_s"]["p50"].as_f64().unwrap()
}

#[test]
fn a_compute_latency_ages_the_model_and_nothing_else_breaks() {
    let folder = Folder::new();
    let mut last = (-1.0, String::new());
    for latency_ms in ["0", "33.34", "50", "66.7"] {
        folder.spoil("compute_latency_ms = 0", &format!("compute_latency_ms = {latency_ms}"));
        let force = run_twice(&folder, "scene.toml", &["--duration", "0.6"]);
        let forces = rows(&force);
        assert_eq!(forces.len(), 600, "{latency_ms} ms");
        assert!(forces.iter().flatten().all(|cell| cell.is_finite()), "{latency_ms} ms");
        let age = mean_age_s(&folder);
        assert!(age > last.0 + 0.010, "{latency_ms} ms: age {age} after {}", last.0);
        assert!(force != last.1, "{latency_ms} ms changes nothing");
        // The global model is released every period whatever its latency is.
        assert_eq!(rows(&folder.succeed(&["export", "a.mcap", "--topic", "/global"])).len(), 18, "{latency_ms} ms");
        last = (age, force);
    }
}

#[test]
fn rates_other_than_the_usual_give_the_right_number_of_rows() {
    let folder = Folder::new();
    for (haptic, global, ticks) in [
        ("500", "30", 100),
        ("2000", "30", 400),
        ("4000", "60", 800),
        ("1000", "10", 200),
        ("1000", "29.97", 200),
        ("100", "100", 20),
        ("2.5", "0.5", 1),
    ] {
        let scene = support::SCENE
            .replace("rate_hz = 30", &format!("rate_hz = {global}"))
            .replace("rate_hz = 1000", &format!("rate_hz = {haptic}"))
            .replace("duration_s = 0.2", if ticks > 1 { "duration_s = 0.2" } else { "duration_s = 0.4" });
        folder.write("scene.toml", scene);
        let forces = rows(&run_twice(&folder, "scene.toml", &[]));
        assert_eq!(forces.len(), ticks, "{haptic} Hz over {global} Hz");
        assert!(forces.iter().flatten().all(|cell| cell.is_finite()));
        let period_s = 1.0 / haptic.parse::<f64>().unwrap();
        assert!((forces[0][0] - period_s).abs() < 1e-9, "the first row ends with the first tick");
    }
}
