//! The predictive model against `full`, in virtual time: what it is held to on the reference scenes, with results that
//! arrive in time, one, one and a half and two periods late.

use std::path::Path;

use palpate::Session;
use palpate::devices::ToolPath;
use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::{BodySpec, Scene, ToolSpec};
use palpate_cli::compare::{ForceDeviation, ForceTrace};

const IN_TIME: f64 = 0.0;
/// A period of 30 Hz is 33.33 ms.
const ONE_PERIOD_MS: f64 = 33.34;
/// Of the spheres (m).
const RADIUS: f64 = 8e-3;

struct Case {
    scene: Scene,
    full: ForceTrace,
}

impl Case {
    fn new(name: &str) -> Self {
        Self::of(scene(&format!("scenes/{name}.toml")))
    }

    /// The first `duration_s` seconds of a scene with a sphere in place of its point: as deep, so with its centre higher.
    fn with_sphere(path: &str, duration_s: f64) -> Self {
        let mut scene = scene(path);
        scene.run.duration_s = duration_s;
        let device = &mut scene.devices[0];
        let path = device.path.take().expect("a scripted tool");
        let raised = path.positions_m().iter().map(|&[x, y, z]| [x, y, z + RADIUS]).collect();
        device.path = Some(ToolPath::new(path.times_s().to_vec(), raised).expect("a path"));
        device.tool = ToolSpec::Sphere { radius_m: RADIUS };
        Self::of(scene)
    }

    fn of(scene: Scene) -> Self {
        let full = forces(scene.clone().with_model(LocalModelKind::Full)).0;
        Self { scene, full }
    }

    /// The error of `predictive`, and what `full` itself jumps.
    fn error(&self, latency_ms: f64, change: impl Fn(&mut Scene)) -> (ForceDeviation, f64) {
        let mut scene = self.scene.clone().with_model(LocalModelKind::Predictive);
        scene.global.compute_latency_ms = latency_ms;
        change(&mut scene);
        let (forces, served) = forces(scene);
        assert_eq!(forces.forces_n.len(), self.full.forces_n.len());
        let error = ForceDeviation::between(&forces, &self.full);
        let own_jump = ForceDeviation::between(&self.full, &self.full).jump;
        println!("{latency_ms} ms late: {error:.3?}, full jumps {own_jump:.2}; {served}");
        (error, own_jump)
    }
}

/// A scene file of the repository.
fn scene(path: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    Scene::load(&path).expect("a scene of the project")
}

fn forces(scene: Scene) -> (ForceTrace, String) {
    let session = Session::from_scene(scene).virtual_time().keep_records().build().expect("a valid scene");
    let summary = session.run().expect("it runs");
    assert_eq!(summary.runtime.fault, None);
    let shares = summary.report.devices[0].force.shares().map(|(model, share)| format!("{} {share:.4}", model.name()));
    let shares = shares.collect::<Vec<_>>().join(", ");
    (ForceTrace::of(&summary.records), shares)
}

/// One period late: at most `rms` and `max`, and no jump more than 1 % above the reference's own.
fn assert_late(case: &Case, [rms, max]: [f64; 2]) {
    let (error, own_jump) = case.error(ONE_PERIOD_MS, |_| ());
    assert!(error.rms <= rms && error.max <= max && error.jump <= own_jump + 1.0, "{error:?}");
}

#[test]
fn a_hand_held_node() {
    let case = Case::new("hand");
    assert_late(&case, [0.45, 2.0]);
    let (in_time, _) = case.error(IN_TIME, |_| ());
    assert!(in_time.rms <= 0.2 && in_time.max <= 1.0, "{in_time:?}");
    for periods in [1.5, 2.0] {
        let (late, _) = case.error(periods * ONE_PERIOD_MS, |_| ());
        assert!(late.rms <= 1.5, "{periods} periods: {late:?}");
    }
}

#[test]
fn a_wave() {
    assert_late(&Case::new("wave"), [0.3, 1.0]);
}

#[test]
fn a_drag_that_sticks_and_slips() {
    let case = Case::new("drag_friction");
    assert_late(&case, [0.5, 6.0]);
    for periods in [1.5, 2.0] {
        let (late, _) = case.error(periods * ONE_PERIOD_MS, |_| ());
        assert!(late.rms <= 1.5, "{periods} periods: {late:?}");
    }
}

#[test]
fn a_frictionless_drag() {
    assert_late(&Case::new("drag_slip"), [0.4, 3.0]);
}

/// The scene that an independent implementation computed with plain tetrahedra; the whole body runs ahead, with 100 states. A
/// prototype of that implementation is 0.33 % off with as many.
#[test]
fn a_drag_over_tissue() {
    let case = Case::of(scene("tests/reference/tissue/t1_drag.toml"));
    let (late, own_jump) = case.error(ONE_PERIOD_MS, |_| ());
    // Larger windows with the 100 states that the scene names: 0.41 and 3.4; 0.39 when a window served at its edge too, and 0.28 and 2.1
    // when it did not hold the way back.
    assert!(late.rms <= 0.42 && late.max <= 3.5 && late.jump <= own_jump + 1.0, "{late:?}");
    let (in_time, _) = case.error(IN_TIME, |_| ());
    assert!(in_time.rms <= 0.1 && in_time.max <= 1.3, "{in_time:?}");
}

/// Nearly incompressible and with nodal pressure the ring has two layers of nodes, and takes 300 states. The first half second
/// of 1.4: `palpate compare` on the scene file runs all of it, 0.36 % one period late.
#[test]
fn a_circle_over_nearly_incompressible_tissue() {
    let mut scene = scene("tests/reference/tissue/t2_circle_incompressible.toml");
    scene.run.duration_s = 0.5;
    let case = Case::of(scene);
    let (late, own_jump) = case.error(ONE_PERIOD_MS, |_| ());
    assert!(late.rms <= 0.4 && late.max <= 2.0 && late.jump <= own_jump + 1.0, "{late:?}");
}

/// Surroundings that give way once left the patch without what holds it: `scaled_boundary` and `condensed` diverged here.
#[test]
fn every_other_model_stays_bounded_on_nearly_incompressible_tissue() {
    let mut scene = scene("tests/reference/tissue/t2_circle_incompressible.toml");
    scene.run.duration_s = 0.5;
    let case = Case::of(scene);
    for model in LocalModelKind::ALL {
        if matches!(model, LocalModelKind::Full | LocalModelKind::Predictive) {
            continue;
        }
        let (late, _) = case.error(ONE_PERIOD_MS, |scene| scene.local.model = model.into());
        assert!(late.rms <= 30.0 && late.max <= 100.0, "{}: {late:?}", model.name());
    }
}

/// Without its basis the ring moves as predicted for a tool that stays where it is: worse, and not wrong.
#[test]
fn without_a_basis_the_prediction_alone_serves() {
    let case = Case::new("hand");
    let (with, _) = case.error(ONE_PERIOD_MS, |_| ());
    let (without, _) = case.error(ONE_PERIOD_MS, |scene| scene.local.basis = Some(0));
    println!("{with:?} with, {without:?} without");
    assert!(with.rms < 0.5 * without.rms && without.rms < 20.0, "{with:?} against {without:?}");
}

/// A window that holds all of a small body has nothing around it to foretell or to reduce: it is as good as `full`, however late.
#[test]
fn a_body_that_fits_in_a_window_is_exact() {
    let mut scene = scene("scenes/drag_friction.toml");
    let Some(BodySpec::MassSpring(body)) = &mut scene.body else { panic!("a lattice") };
    body.block.nodes = [6; 3];
    scene.run.duration_s = 1.0;
    let case = Case::of(scene);
    for periods in [1.0, 2.0] {
        let (late, _) = case.error(periods * ONE_PERIOD_MS, |_| ());
        assert!(late.max <= 0.01, "{periods} periods: {late:?}");
    }
}

/// Bases that come late are a normal event: the first windows serve as long as they hold where the tool goes.
#[test]
fn late_bases_leave_the_first_windows_to_serve() {
    let mut scene = Case::new("drag_slip").scene.with_model(LocalModelKind::Predictive);
    scene.global.basis_latency_ms = Some(900.0);
    scene.local.patch = Some([3, 3, 2]);
    scene.run.duration_s = 1.8;
    let (late, shares) = forces(scene);
    assert!(late.forces_n.iter().flatten().all(|c| c.is_finite()));
    assert!(shares.contains("predictive 1.0000"), "{shares}");
}

/// A sphere is dragged over the lattice, sticks and slips: its footprint changes with every triangle, and the window holds it.
#[test]
fn a_sphere_that_is_dragged() {
    let case = Case::with_sphere("scenes/drag_friction.toml", 1.0);
    let (late, own_jump) = case.error(ONE_PERIOD_MS, |_| ());
    assert!(late.rms <= 1.0 && late.jump <= own_jump + 1.5, "{late:?}");
}

/// The same over tissue: the many nodes under a sphere take 250 states, with 150 it is 1 % off.
#[test]
fn a_sphere_over_tissue() {
    let case = Case::with_sphere("tests/reference/tissue/t1_drag.toml", 0.6);
    let (late, own_jump) =
        case.error(ONE_PERIOD_MS, |scene| (scene.local.patch, scene.local.basis) = (None, Some(250)));
    assert!(late.rms <= 0.8 && late.max <= 3.5 && late.jump <= own_jump + 1.0, "{late:?}");
}
