//! Whole sessions whose tools have a shape: every local model, torque, several tools, replays.

use crate::session_support::{commands, forces, norm};
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use palpate::log::{CommandSample, ContactSample, ForceSample, LogRecord};
use palpate::model::Vec3;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder, Summary};

const RADIUS_M: f64 = 0.02;
const SPHERE: &str = "{ shape = \"sphere\", radius_m = 0.02 }";
/// Along x, 4 cm from end to end of its axis.
const CAPSULE: &str = "{ shape = \"capsule\", radius_m = 0.01, length_m = 0.04, axis = [1, 0, 0] }";

fn device(name: &str, tool: &str) -> String {
    format!("[[device]]\nname = \"{name}\"\ntool = {tool}\nattach_node = [2, 2, 5]\n")
}

/// A block of 6^3 nodes, 2 cm apart.
fn scene(friction: f64, devices: &[String]) -> Scene {
    let text = format!(
        "[body.block]\nnodes = [6, 6, 6]\nsize_m = [0.1, 0.1, 0.1]\n[body.material]\nnode_mass_kg = 0.0005\n\
         stiffness_n_per_m = 30.0\ndamping_ratio = 0.3\n[contact]\nfriction = {friction}\n{}",
        devices.concat()
    );
    let mut scene = Scene::from_toml(&text, "tools.toml", None).unwrap();
    // The program moves the tools itself: no node holds them.
    scene.devices.iter_mut().for_each(|device| device.attach_node = None);
    scene
}

/// From 2 mm above the top to 8 mm below it within 60 ms, for a tool of `radius`, then along x by `drag`.
fn pressed(x: f64, radius: f64, drag: f64) -> ToolPath {
    let times: Vec<f64> = (0..=400).map(|n| f64::from(n) * 1e-3).collect();
    let at = |t: f64| [x + drag * (t - 0.06).max(0.0), 0.052, 0.102 + radius - 0.010 * (t / 0.06).min(1.0)];
    let places = times.iter().map(|&t| at(t)).collect();
    ToolPath::new(times, places).unwrap()
}

fn builder(scene: Scene) -> SessionBuilder {
    Session::from_scene(scene).duration_s(0.3).virtual_time().keep_records()
}

fn run(builder: SessionBuilder) -> Summary {
    let summary = builder.build().unwrap().run().unwrap();
    assert!(summary.runtime.fault.is_none() && summary.log_error.is_none(), "{summary}");
    let is_finite = |of: [f64; 3]| of.iter().all(|value| value.is_finite());
    assert!(forces(&summary).iter().all(|row| is_finite(row.force_n) && is_finite(row.torque_n_m)), "{summary}");
    summary
}

fn contacts(summary: &Summary) -> Vec<ContactSample> {
    let found = summary.records.iter().filter_map(|record| match record {
        LogRecord::Contact(contact) => Some(*contact),
        _ => None,
    });
    found.collect()
}

/// The largest of something in the last 150 ms.
fn largest(rows: &[ForceSample], of: impl Fn(&ForceSample) -> [f64; 3]) -> f64 {
    rows.iter().filter(|row| row.time >= Nanos(150_000_000)).map(|row| norm(of(row))).fold(0.0, f64::max)
}

#[test]
fn a_sphere_is_felt_in_every_local_model_and_turns_nothing_without_friction() {
    for model in LocalModelKind::ALL {
        let summary =
            run(builder(scene(0.0, &[device("only", SPHERE)])).path(pressed(0.05, RADIUS_M, 0.1)).model(model));
        let felt = forces(&summary);
        let (peak, torque) = (largest(&felt, |row| row.force_n), largest(&felt, |row| row.torque_n_m));
        println!("{}: {peak:.3} N, {torque:.1e} N m", model.name());
        assert!((0.3..10.0).contains(&peak), "{model:?}: {peak} N");
        assert!(torque <= 1e-9, "{model:?}: {torque} N m");
        let touching: Vec<_> = contacts(&summary).into_iter().filter(|contact| contact.count > 0).collect();
        assert!(touching.len() > 150, "{model:?}: {} ticks", touching.len());
        assert!(touching.iter().all(|contact| contact.area_m2 >= 0.0 && contact.normal_force_n >= 0.0), "{model:?}");
        let words: String = summary.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("tool sphere of 20.0 mm; elements of") && words.contains("corners smoothed"), "{words}");
    }
}

#[test]
fn friction_turns_a_sphere() {
    let summary = run(builder(scene(0.5, &[device("only", SPHERE)]))
        .path(pressed(0.04, RADIUS_M, 0.1))
        .model(LocalModelKind::Full));
    let torque = largest(&forces(&summary), |row| row.torque_n_m);
    let force = largest(&forces(&summary), |row| row.force_n);
    assert!(torque > 1e-3 && torque <= RADIUS_M * force, "{torque} N m of {force} N");
}

#[test]
fn a_capsule_over_the_rim_is_turned_by_its_one_end_that_touches() {
    for model in LocalModelKind::ALL {
        let summary = run(builder(scene(0.0, &[device("only", CAPSULE)])).path(pressed(0.095, 0.01, 0.0)).model(model));
        let last = *forces(&summary).last().unwrap();
        println!("{}: {:?} N, {:?} N m", model.name(), last.force_n, last.torque_n_m);
        // Up at x < 0: about +y it is z F_x - x F_z.
        assert!(last.force_n[2] > 0.1 && last.torque_n_m[1] > 1e-4, "{model:?}: {last:?}");
    }
}

/// A device that turns along a path, and exerts a torque or not.
#[derive(Debug)]
struct Turning {
    path: ToolPath,
    max_torque_n_m: Option<f64>,
}

impl Device for Turning {
    fn name(&self) -> &str {
        "turning"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_torque_n_m: self.max_torque_n_m, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let pose = self.path.pose_at(time.as_secs_f64());
        Ok(DeviceState { position: pose.position, orientation: pose.orientation, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        let is_none = command.torque == Vec3::zeros();
        if self.max_torque_n_m.is_none() && !is_none { Err(DeviceFault::Refused) } else { Ok(()) }
    }
}

#[test]
fn the_torque_of_a_turning_capsule_is_logged_and_commanded_where_the_device_can() {
    let path = pressed(0.05, 0.01, 0.0);
    // Turned about y, by 0.3 rad at the end: one end goes in deeper.
    let turned = path.times_s().iter().map(|t| [(0.375 * t).cos(), 0.0, (0.375 * t).sin(), 0.0]).collect::<Vec<_>>();
    let path = path.turned(&turned).unwrap();
    for max_torque_n_m in [None, Some(0.05)] {
        let device = Turning { path: path.clone(), max_torque_n_m };
        let only = scene(0.3, &[self::device("only", CAPSULE)]);
        let summary = run(builder(only).device(device).model(LocalModelKind::Patch));
        assert!(largest(&forces(&summary), |row| row.torque_n_m) > 1e-4);
        let commanded: Vec<CommandSample> = commands(&summary);
        let most = commanded.iter().map(|row| norm(row.torque_n_m)).fold(0.0, f64::max);
        match max_torque_n_m {
            None => assert_eq!(most, 0.0),
            Some(limit) => assert!(most > 0.0 && most <= limit, "{most} N m"),
        }
    }
}

#[test]
fn two_spheres_press_the_same_nodes() {
    for model in [LocalModelKind::Patch, LocalModelKind::Predictive] {
        let mut both = scene(0.5, &[device("left", SPHERE), device("right", SPHERE)]);
        for (spec, x) in both.devices.iter_mut().zip([0.035, 0.061]) {
            spec.path = Some(pressed(x, RADIUS_M, 0.0));
        }
        let summary = run(builder(both).model(model));
        for device in [0, 1] {
            let felt: Vec<_> = forces(&summary).into_iter().filter(|row| row.device == device).collect();
            let peak = largest(&felt, |row| row.force_n);
            println!("{} of {device}: {peak:.3} N", model.name());
            assert!((0.2..10.0).contains(&peak), "{model:?}: {peak} N on {device}");
        }
        // They mirror one another about x = 0.048 m and the nodes do nearly.
        let last = |device| forces(&summary).into_iter().rfind(|row| row.device == device).unwrap().force_n[2];
        assert!((last(0) / last(1) - 1.0).abs() < 0.3, "{} and {} N", last(0), last(1));
    }
}

#[test]
fn a_run_with_a_sphere_is_replayed_bit_for_bit() {
    for model in [LocalModelKind::Patch, LocalModelKind::Predictive, LocalModelKind::Full] {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("run.mcap");
        let recorded = builder(scene(0.5, &[device("only", SPHERE)])).path(pressed(0.04, RADIUS_M, 0.1)).model(model);
        assert!(largest(&forces(&run(recorded.log(&log))), |row| row.torque_n_m) > 0.0);
        let report = Session::replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical() && report.force.logged == 300, "{report}");
    }
}
