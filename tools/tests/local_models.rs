//! Each local model against `full`, in virtual time: the error that is known for it, no more and no less.
//!
//! `cargo test --test local_models -- --nocapture` prints the table of docs/local_models.md.

use std::path::Path;

use palpate::Session;
use palpate::log::LogRecord;
use palpate::model::local::BlendKind;
use palpate::model::local::{Feedback, Kind as LocalModelKind};
use palpate::scene::{BlendSpec, BodySpec, Scene, StepKind};
use palpate_cli::compare::{ForceDeviation, ForceTrace};

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(format!("{name}.toml"));
    Scene::load(&path).expect("a scene of the project")
}

fn forces(scene: Scene) -> ForceTrace {
    let session = Session::from_scene(scene).virtual_time().keep_records().build().expect("a valid scene");
    let summary = session.run().expect("it runs");
    assert_eq!(summary.runtime.fault, None);
    ForceTrace::of(&summary.records)
}

fn error(run: &ForceTrace, full: &ForceTrace) -> ForceDeviation {
    assert_eq!(run.forces_n.len(), full.forces_n.len());
    ForceDeviation::between(run, full)
}

use Feedback::{ContactNodes, Geometry, Trajectory};
use LocalModelKind::*;

/// A way of running a scene.
#[derive(Clone, Copy, Debug)]
struct Way {
    model: LocalModelKind,
    feedback: Feedback,
    blend: BlendKind,
    is_late: bool,
    step: StepKind,
}

fn way(model: LocalModelKind, feedback: Feedback) -> Way {
    Way { model, feedback, blend: BlendKind::None, is_late: false, step: StepKind::Auto }
}

impl Way {
    fn late(self) -> Self {
        Self { is_late: true, ..self }
    }

    fn blended(self, blend: BlendKind) -> Self {
        Self { blend, ..self }
    }

    fn scene(self, name: &str) -> Scene {
        let mut scene = scene(name).with_model(self.model);
        scene.local.feedback = Some(self.feedback);
        scene.local.step = self.step;
        scene.local.blend = BlendSpec { kind: self.blend, ms: 10.0 };
        if self.is_late {
            scene.global.compute_latency_ms = 33.34;
        }
        scene
    }
}

/// Every way that the table shows, by the name that it has there.
fn ways() -> [(&'static str, Way); 14] {
    let crossfade = BlendKind::Crossfade;
    [
        ("hold", way(Hold, Trajectory)),
        ("patch", way(Patch, Geometry)),
        ("patch, 10 ms crossfade", way(Patch, Geometry).blended(crossfade)),
        ("patch, 10 ms offset", way(Patch, Geometry).blended(BlendKind::Offset)),
        ("patch, trajectory", way(Patch, Trajectory)),
        ("patch, late", way(Patch, Geometry).late()),
        ("linear_boundary", way(LinearBoundary, Trajectory)),
        ("linear_boundary, geometry", way(LinearBoundary, Geometry)),
        ("linear_boundary, contact_nodes, 10 ms crossfade", way(LinearBoundary, ContactNodes).blended(crossfade)),
        ("linear_boundary, late", way(LinearBoundary, Trajectory).late()),
        ("scaled_boundary", way(ScaledBoundary, Trajectory)),
        ("scaled_boundary, late", way(ScaledBoundary, Trajectory).late()),
        ("condensed", way(Condensed, Trajectory)),
        ("condensed, late", way(Condensed, Trajectory).late()),
    ]
}

/// Check that each way has the error that was measured for it (rms, largest, largest change in one tick; % of the peak), to 3 %
/// or to 0.2.
fn assert_errors(name: &str, measured: [[f64; 3]; 14]) {
    let full = forces(scene(name).with_model(LocalModelKind::Full));
    let mut wrong = Vec::new();
    for ((label, way), expected) in ways().into_iter().zip(measured) {
        let found = error(&forces(way.scene(name)), &full);
        println!("{name}: {label}: rms {:.1} / max {:.1} / jump {:.1} %", found.rms, found.max, found.jump);
        let is_near = |found: f64, expected: f64| (found - expected).abs() < (0.03 * expected).max(0.2);
        if ![found.rms, found.max, found.jump]
            .into_iter()
            .zip(expected)
            .all(|(found, expected)| is_near(found, expected))
        {
            wrong.push(format!("{label}: {found:?}, was {expected:?}"));
        }
    }
    println!("{name}: full itself: jump {:.1} %", error(&full, &full).jump);
    assert!(wrong.is_empty(), "{name}: {wrong:#?}");
}

#[test]
fn a_hand_held_node_has_the_known_errors() {
    assert_errors(
        "hand",
        [
            [13.8, 52.6, 52.6],
            [11.8, 38.4, 25.1],
            [13.3, 33.9, 5.6],
            [12.6, 33.9, 12.9],
            [11.8, 44.1, 43.2],
            [32.5, 95.2, 56.5],
            [7.7, 36.7, 35.9],
            [7.8, 28.9, 18.9],
            [9.3, 36.7, 3.5],
            [24.6, 68.8, 60.9],
            [10.0, 37.6, 36.8],
            [23.2, 60.7, 44.7],
            [9.2, 37.8, 37.0],
            [21.2, 53.2, 42.1],
        ],
    );
}

#[test]
fn a_wave_has_the_known_errors() {
    assert_errors(
        "wave",
        [
            [10.9, 46.7, 46.7],
            [22.6, 72.7, 14.3],
            [24.1, 73.9, 4.8],
            [22.9, 73.9, 14.3],
            [18.5, 67.9, 65.9],
            [37.9, 110.3, 32.4],
            [6.3, 46.7, 48.3],
            [8.3, 46.7, 25.0],
            [7.8, 48.2, 8.0],
            [23.6, 96.6, 83.4],
            [37.3, 149.1, 147.2],
            [58.7, 178.0, 64.4],
            [17.6, 63.9, 61.9],
            [35.4, 106.3, 43.4],
        ],
    );
}

#[test]
fn a_drag_with_friction_has_the_known_errors() {
    assert_errors(
        "drag_friction",
        [
            [6.5, 44.7, 38.2],
            [11.5, 49.0, 20.0],
            [11.9, 44.5, 6.1],
            [11.8, 46.9, 18.3],
            [7.0, 41.1, 38.1],
            [17.2, 53.0, 22.4],
            [5.1, 35.0, 35.3],
            [11.5, 61.5, 39.4],
            [9.5, 51.9, 5.2],
            [12.5, 53.7, 41.1],
            [6.5, 41.8, 38.9],
            [12.3, 49.8, 51.0],
            [5.9, 40.8, 37.8],
            [11.4, 51.1, 50.8],
        ],
    );
}

/// A hundred times the stiffness asks for some 15 explicit steps per tick.
fn stiff(step: StepKind) -> ForceTrace {
    let mut scene = Way { step, ..way(LinearBoundary, Trajectory) }.scene("hand");
    let body = scene.body.as_mut().and_then(BodySpec::mass_spring_mut).expect("a block");
    body.material.stiffness_n_per_m *= 100.0;
    body.material.damping_ratio = 1.0;
    scene.global.substeps_per_ms = None;
    scene.safety.max_force_n = Some(1e4);
    scene.safety.max_slew_n_per_ms = 1e3;
    scene.run.duration_s = 0.3;
    forces(scene)
}

#[test]
fn a_stiff_patch_takes_implicit_steps_by_itself_and_stays_near_the_explicit_one() {
    let [auto, explicit, implicit] = [StepKind::Auto, StepKind::Explicit, StepKind::Implicit].map(stiff);
    assert_eq!(auto, implicit);
    let error = error(&implicit, &explicit);
    println!("k x 100, zeta 1: implicit against explicit: rms {:.2} / max {:.1} %", error.rms, error.max);
    assert!((0.01..2.0).contains(&error.rms), "{error:?}");
    // The demo's material asks for 2: nothing changes there.
    let short = |step| {
        let mut scene = Way { step, ..way(Patch, Geometry) }.scene("hand");
        scene.run.duration_s = 0.1;
        forces(scene)
    };
    assert_eq!(short(StepKind::Auto), short(StepKind::Explicit));
}

/// `hold` renders what the 30 Hz global model computed in blocks of 33 or 34 ticks; at every resync that must be the
/// force that `full` computed tick by tick, bit for bit.
#[test]
fn the_global_model_in_blocks_gives_the_same_bits_as_full_tick_by_tick() {
    for name in ["hand", "drag_friction", "wave"] {
        let full = forces(scene(name).with_model(LocalModelKind::Full));
        let hold = scene(name).with_model(LocalModelKind::Hold);
        let summary = Session::from_scene(hold).virtual_time().keep_records().build().unwrap().run().unwrap();
        let mut compared = 0;
        for record in &summary.records {
            let LogRecord::Global(resync) = record else { continue };
            let served = summary.records.iter().filter_map(|record| match record {
                LogRecord::Force(sample) if sample.model_version == resync.version => Some(sample.force_n),
                _ => None,
            });
            for force in served {
                let expected = full.forces_n[resync.last_tick as usize - 1];
                assert_eq!(force, expected, "{name}, resync {}", resync.version);
                compared += 1;
            }
            assert!(matches!(resync.last_tick + 1 - resync.first_tick, 33 | 34), "{name}: {resync:?}");
        }
        assert!(compared > 500, "{name}: {compared} forces compared");
    }
}
