//! Two devices on one body: each with its own contact and its own local model, its own topics, its own limits.

#[path = "../../src/model/tests/common/mod.rs"]
mod common;

use std::path::Path;
use std::time::Duration;

use common::{STD, block, drag_path, minjerk, simulation};
use palpate::Session;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, Scripted, ToolPath};
use palpate::log::{LogEntry, LogReader, LogRecord, ToolSample};
use palpate::model::Vec3;
use palpate::model::contact::{Contact, ToolMotion};
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::scene::{DeviceKind, DeviceSpec, ModelChoice, Scene};
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
    // At the ticks' own times, so that a tick sees the places of the reference.
    let times = (0..=TICKS).map(|n| Nanos(1_000_000 * u64::from(n)).as_secs_f64()).collect();
    let places = (0..=TICKS).map(|n| at(f64::from(n) * 1e-3).into()).collect();
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

/// A session without its devices.
fn without_devices(model: LocalModelKind, late_ms: f64) -> SessionBuilder {
    let mut scene = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two_hands.toml")).unwrap();
    scene.devices.truncate(1);
    scene.devices[0] = DeviceSpec::default();
    scene.global.compute_latency_ms = late_ms;
    Session::from_scene(scene.with_model(model)).virtual_time().keep_records()
}

fn builder(model: LocalModelKind, late_ms: f64) -> SessionBuilder {
    without_devices(model, late_ms)
        .named_device("left", Scripted::new(path(drag_path)))
        .named_device("right", Scripted::new(path(press_path)))
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

fn forces(summary: &Summary, device: u16) -> Vec<Vec3> {
    ForceTrace::of_device(&summary.records, device).forces_n.into_iter().map(Vec3::from).collect()
}

#[test]
fn full_is_the_whole_body_with_all_tools_in_every_bit_and_in_any_order() {
    let [left, right] = reference([drag_path, press_path]);
    let summary = run(builder(LocalModelKind::Full, 0.0));
    assert_eq!([0, 1].map(|device| forces(&summary, device)), [left.clone(), right.clone()]);
    let commanded = |device: u16| {
        let of_device = summary.records.iter().filter_map(move |record| match record {
            LogRecord::Command(sample) if sample.device == device => Some(Vec3::from(sample.force_n).norm()),
            _ => None,
        });
        of_device.fold(0.0, f64::max)
    };
    assert!([0, 1].iter().all(|&device| commanded(device) > 0.5), "each device is commanded its own");
    assert!(summary.report.devices.iter().all(|device| device.resyncs.jump_before_n.count == 0));

    let turned = without_devices(LocalModelKind::Full, 0.0)
        .named_device("right", Scripted::new(path(press_path)))
        .named_device("left", Scripted::new(path(drag_path)));
    let turned = run(turned);
    assert_eq!([0, 1].map(|device| forces(&turned, device)), [right, left]);
}

/// Reads along a path until it is pulled out.
#[derive(Debug)]
struct PulledOut {
    path: ToolPath,
    at: Nanos,
}

impl Device for PulledOut {
    fn name(&self) -> &str {
        "pulled out"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let position = self.path.pose_at(time.as_secs_f64()).position;
        let state = DeviceState { position, ..DeviceState::default() };
        if time < self.at { Ok(state) } else { Err(DeviceFault::Disconnected) }
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

// Check that the one that is left feels a body whose other tool stands still.
#[test]
fn a_device_that_fails_does_not_stop_the_other() {
    fn held(t: f64) -> Vec3 {
        drag_path(t.min(699.0 * 1e-3))
    }
    let summary = run(without_devices(LocalModelKind::Full, 0.0)
        .named_device("left", PulledOut { path: path(drag_path), at: Nanos(700_000_000) })
        .named_device("right", Scripted::new(path(press_path))));
    assert_eq!(forces(&summary, 1), reference([held, press_path])[1]);
    let degraded: u64 = summary.runtime.groups.iter().map(|group| group.degraded).sum();
    // The ramp at the end reads too.
    assert!(degraded > u64::from(TICKS) - 700, "every read that failed is counted: {degraded}");
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
    // The window of the tool that presses reaches to where the other one drags: 1.3 and 7.9 one period late.
    for (late_ms, rms, max) in [(0.0, 0.2, 2.0), (33.34, 1.5, 9.0)] {
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
        .readable()
        .filter_map(|entry| match entry {
            LogEntry::Record(LogRecord::Tool(sample)) => Some(sample),
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

/// Check `full` with a hand on one of the devices and a coupling on both: to the end of the scene, and again from its log.
#[test]
fn two_hands_on_the_whole_body_run_and_replay() {
    let folder = std::env::temp_dir().join(format!("palpate-two-hands-full-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("full.mcap");
    for coupling in [false, true] {
        let mut scene = two_hands().with_model(LocalModelKind::Full);
        scene.local.coupling = coupling;
        let summary = run(Session::from_scene(scene).virtual_time().log(&log));
        for device in &summary.report.devices {
            assert!(device.force.ticks == 2500 && device.force.peak_n > 0.1, "{summary}");
            assert!(device.force.peak_commanded_n > 0.1 && device.force.not_finite == 0, "{summary}");
        }
        let mut reader = LogReader::open(&log).unwrap();
        assert_eq!(
            reader.readable().filter(|entry| matches!(entry, LogEntry::Record(LogRecord::Resync(_)))).count(),
            0
        );
        for topic in ["/left/force", "/right/force_commanded", "/left/contact", "/right/tool"] {
            assert!(reader.topics()[topic] >= 2500, "{topic}: {:?}", reader.topics());
        }
        let report = Session::replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical() && report.commanded.is_identical(), "{report}");
        assert_eq!(report.force.identical, 5000, "{report}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn two_hands_on_the_whole_body_run_live_and_stop() {
    let scene = two_hands().with_model(LocalModelKind::Full);
    let running = Session::from_scene(scene).keep_records().build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(700));
    let summary = running.stop();
    assert!(summary.runtime.fault.is_none() && summary.log_error.is_none(), "{summary}");
    let ticks = |device| forces(&summary, device).len();
    assert!(ticks(0) > 20 && ticks(0) == ticks(1), "{summary}");
}

#[test]
fn auto_takes_the_whole_body_for_several_devices_where_it_fits() {
    let mut scene = two_hands();
    scene.local.model = ModelChoice::Auto;
    let session = Session::from_scene(scene).virtual_time().build().unwrap();
    let choice = session.choice().cloned().unwrap();
    assert_eq!(choice.model, LocalModelKind::Full, "{choice}");
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
    assert!(refused(|scene| scene.devices[1].plant.mass_kg = -1.0).starts_with("device[1].plant.mass_kg"));
    assert!(refused(|scene| scene.devices.clear()).starts_with("device: is given 0 times"));
}
