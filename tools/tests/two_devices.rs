//! Two devices on one body: each with its own contact and its own local model, its own topics, its own limits.

#[path = "../../src/model/tests/common/mod.rs"]
mod common;

use std::path::Path;

use common::{STD, block, drag_path, minjerk, simulation};
use palpate::Session;
use palpate::devices::{Scripted, ToolPath};
use palpate::log::{LogEntry, LogReader, ToolSample};
use palpate::model::Vec3;
use palpate::model::contact::{Contact, ToolMotion};
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::scene::{DeviceKind, DeviceSpec, Scene};
use palpate::session::{SessionBuilder, Summary};
use palpate_cli::compare::{ForceDeviation, ForceTrace};

const TICKS: u32 = 2500;

/// Presses 8 mm deep beside the drag's way, holds and lifts; nearer than a patch is wide at the end of the drag.
fn press_path(t: f64) -> Vec3 {
    let z = 0.101 - 0.009 * minjerk((t - 0.4) / 0.4) + 0.011 * minjerk((t - 2.0) / 0.4);
    Vec3::new(0.0712, 0.0471, z)
}

/// Far above everything.
fn away(_: f64) -> Vec3 {
    Vec3::new(0.05, 0.05, 0.3)
}

fn path(at: fn(f64) -> Vec3) -> ToolPath {
    let times: Vec<f64> = (0..=TICKS).map(|n| f64::from(n) * 1e-3).collect();
    let places = times.iter().map(|&t| at(t).into()).collect();
    ToolPath::new(times, places).unwrap()
}

/// The whole body at 1 kHz with both tools: forces on each.
fn reference(paths: [fn(f64) -> Vec3; 2]) -> [Vec<Vec3>; 2] {
    let mut both = simulation(block(STD), Contact::default(), 0.5).with_tool(Contact::default());
    let mut forces = [Vec::new(), Vec::new()];
    for n in 0..TICKS {
        let motion = |at: fn(f64) -> Vec3| ToolMotion::straight(at(f64::from(n) * 1e-3), at(f64::from(n + 1) * 1e-3));
        both.tick_all(&paths.map(motion));
        forces.iter_mut().enumerate().for_each(|(tool, forces)| forces.push(both.force(tool)));
    }
    forces
}

fn builder(model: LocalModelKind, late_ms: f64) -> SessionBuilder {
    let mut scene = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two_hands.toml")).unwrap();
    scene.devices.truncate(1);
    scene.devices[0] = DeviceSpec::default();
    scene.global.compute_latency_ms = late_ms;
    Session::from_scene(scene.with_model(model))
        .named_device("left", Scripted::new(path(drag_path)))
        .named_device("right", Scripted::new(path(press_path)))
        .virtual_time()
        .keep_records()
}

fn run(builder: SessionBuilder) -> Summary {
    let summary = builder.build().unwrap().run().unwrap();
    assert!(summary.runtime.fault.is_none() && summary.log_error.is_none(), "{summary}");
    summary
}

fn trace(forces: &[Vec3]) -> ForceTrace {
    let forces_n: Vec<[f64; 3]> = forces.iter().map(|&force| force.into()).collect();
    ForceTrace { energy_j: vec![0.0; forces_n.len()], forces_n, ..ForceTrace::default() }
}

#[test]
fn a_tool_that_touches_nothing_changes_nothing() {
    let mut alone = simulation(block(STD), Contact::default(), 0.5);
    let path: Vec<Vec3> = (0..=TICKS).map(|n| drag_path(f64::from(n) * 1e-3)).collect();
    assert_eq!(reference([drag_path, away])[0], common::forces(&mut alone, &path), "in every bit");
    assert!(reference([away, drag_path])[0].iter().all(|force| *force == Vec3::zeros()));
}

// Check that the order of the tools is of no account while they touch different nodes.
#[test]
fn tools_can_be_given_in_any_order() {
    let [left, right] = reference([drag_path, press_path]);
    let [right_first, left_second] = reference([press_path, drag_path]);
    assert_eq!((&left, &right), (&left_second, &right_first));
    let mut alone = simulation(block(STD), Contact::default(), 0.5);
    let path: Vec<Vec3> = (0..=TICKS).map(|n| drag_path(f64::from(n) * 1e-3)).collect();
    let alone = common::forces(&mut alone, &path);
    let felt = common::rms_percent(&left, &alone);
    assert!(felt > 1.0, "the tools are to feel each other through the body: {felt} %");
}

/// The errors of both tools, in % of each one's peak.
fn errors(model: LocalModelKind, late_ms: f64, references: &[ForceTrace; 2]) -> [ForceDeviation; 2] {
    let summary = run(builder(model, late_ms));
    [0, 1].map(|device: u16| {
        let forces = ForceTrace::of_device(&summary.records, device);
        assert_eq!(forces.forces_n.len(), TICKS as usize);
        let error = ForceDeviation::between(&forces, &references[usize::from(device)]);
        println!("{} {late_ms} ms late, device {device}: {error:.3?}", model.name());
        error
    })
}

#[test]
fn each_tool_has_a_local_model_that_knows_of_the_other() {
    let references = reference([drag_path, press_path]).map(|forces| trace(&forces));
    for (late_ms, rms, max) in [(0.0, 0.2, 2.0), (33.34, 0.8, 5.0)] {
        for error in errors(LocalModelKind::Predictive, late_ms, &references) {
            assert!(error.rms < rms && error.max < max, "{late_ms} ms late: {error:?}");
        }
    }
    for error in errors(LocalModelKind::Patch, 33.34, &references) {
        assert!(error.rms < 15.0, "{error:?}");
    }
}

#[test]
fn each_device_has_its_topics_and_its_part_of_the_report_and_replays() {
    let folder = std::env::temp_dir().join(format!("palpate-two-devices-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("two.mcap");
    let summary = run(builder(LocalModelKind::Predictive, 33.34).duration_s(0.9).log(&log));
    let devices = &summary.report.devices;
    assert_eq!(devices.iter().map(|device| device.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
    assert!(devices.iter().all(|device| device.force.ticks == 900 && device.limits.ticks == 900), "{summary}");
    assert!(devices[0].force.peak_n != devices[1].force.peak_n);
    let mut reader = LogReader::open(&log).unwrap();
    let tools: Vec<ToolSample> = reader
        .by_ref()
        .filter_map(|entry| match entry {
            LogEntry::Record(palpate::log::LogRecord::Tool(sample)) => Some(sample),
            _ => None,
        })
        .collect();
    for (device, at) in [(0, drag_path as fn(f64) -> Vec3), (1, press_path)] {
        let sample = tools.iter().find(|tool| tool.device == device && tool.time == Nanos(500_000_000)).unwrap();
        assert_eq!(Vec3::from(sample.position_m), at(0.5));
    }
    for topic in ["/left/force", "/right/force", "/left/tool", "/right/force_commanded", "/left/resync"] {
        assert!(reader.topics()[topic] > 20, "{topic}: {:?}", reader.topics());
    }
    assert!(!reader.topics().contains_key("/force"));
    let report = Session::replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.identical == 1800, "{report}");
    std::fs::remove_dir_all(&folder).unwrap();
}

fn two_hands() -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two_hands.toml")).unwrap()
}

/// Check devices that are not alike, where every number of the pipeline and of the coupling is each one's own.
#[test]
fn a_run_of_unlike_devices_replays_and_its_log_moves_the_tool_that_is_named() {
    let folder = std::env::temp_dir().join(format!("palpate-unlike-devices-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("unlike.mcap");
    let mut scene = two_hands();
    scene.local.coupling = true;
    let summary = run(Session::from_scene(scene).duration_s(0.8).virtual_time().log(&log));
    assert!(summary.report.devices.iter().all(|device| device.force.peak_n > 0.1), "{summary}");
    let report = Session::replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.commanded.is_identical(), "{report}");

    let moved_by = |name: &str| {
        let mut scene = two_hands();
        scene.devices = vec![DeviceSpec {
            name: Some(name.into()),
            kind: DeviceKind::Replay,
            log: Some(log.clone()),
            ..DeviceSpec::default()
        }];
        let builder = Session::from_scene(scene).duration_s(0.5).virtual_time().keep_records();
        let summary = builder.build().map_err(|error| error.to_string())?.run().unwrap();
        Ok(ForceTrace::of(&summary.records).forces_n.len())
    };
    assert_eq!(moved_by("right"), Ok(500));
    let refused: Result<usize, String> = moved_by("middle");
    assert!(
        refused.as_ref().is_err_and(|error| error.contains("no device \"middle\", but left and right")),
        "{refused:?}"
    );
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_cannot_be_is_refused_with_the_device_named() {
    let refused = |change: fn(&mut Scene)| {
        let mut scene = two_hands();
        change(&mut scene);
        Session::from_scene(scene).virtual_time().build().unwrap_err().to_string()
    };
    assert!(refused(|scene| scene.devices[1].name = None).starts_with("device[1].name: is missing"));
    assert!(refused(|scene| scene.devices[1].name = Some("left".into())).starts_with("device[1].name: is \"left\""));
    assert!(refused(|scene| scene.devices[1].name = Some("/x".into())).starts_with("device[1].name: is \"/x\""));
    assert!(refused(|scene| scene.local.model = LocalModelKind::Full.into()).starts_with("local.model: is `full`"));
    assert!(refused(|scene| scene.devices[1].plant.mass_kg = -1.0).starts_with("device[1].plant.mass_kg"));
    assert!(refused(|scene| scene.devices.clear()).starts_with("device: is given 0 times"));
}
