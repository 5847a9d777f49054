//! Each local model against `full`, in virtual time: the error that is known for it, no more and no less.
//!
//! `cargo test --test local_models -- --nocapture` prints the table of the README.
#![cfg(feature = "scene")]

use std::path::Path;

use palpate::Session;
use palpate::log::LogRecord;
use palpate::model::Vec3;
use palpate::scene::{BlendKind, BlendSpec, Feedback, LocalModelKind, Scene, StepKind};

/// Percent of the peak of `full`: rms and largest difference, largest change from one tick to the next.
#[derive(Clone, Copy, Debug)]
struct Error {
    rms: f64,
    max: f64,
    jump: f64,
}

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(format!("{name}.toml"));
    Scene::load(&path).expect("a scene of the project")
}

fn forces(scene: Scene) -> Vec<Vec3> {
    let session = Session::from_scene(scene).virtual_time().keep_records().build().expect("a valid scene");
    let summary = session.run().expect("it runs");
    assert_eq!(summary.runtime.fault, None);
    let force = |record: &LogRecord| match record {
        LogRecord::Force(sample) => Some(Vec3::from(sample.force_n)),
        _ => None,
    };
    summary.records.iter().filter_map(force).collect()
}

fn error(forces: &[Vec3], full: &[Vec3]) -> Error {
    assert_eq!(forces.len(), full.len());
    let percent = 100.0 / full.iter().map(|f| f.norm()).fold(0.0, f64::max);
    let differences: Vec<f64> = forces.iter().zip(full).map(|(a, b)| (a - b).norm()).collect();
    Error {
        rms: percent * (differences.iter().map(|e| e * e).sum::<f64>() / differences.len() as f64).sqrt(),
        max: percent * differences.iter().copied().fold(0.0, f64::max),
        jump: percent * forces.windows(2).map(|f| (f[1] - f[0]).norm()).fold(0.0, f64::max),
    }
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

/// Every way that the README's table shows, by the name that it has there.
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

/// Check that each way has the error that was measured for it (rms, largest, largest change in one tick; % of the peak), to
/// a tenth or to 0.3.
fn assert_errors(name: &str, measured: [[f64; 3]; 14]) {
    let full = forces(scene(name).with_model(LocalModelKind::Full));
    let mut wrong = Vec::new();
    for ((label, way), expected) in ways().into_iter().zip(measured) {
        let found = error(&forces(way.scene(name)), &full);
        println!("{name}: {label}: rms {:.1} / max {:.1} / jump {:.1} %", found.rms, found.max, found.jump);
        let is_near = |found: f64, expected: f64| (found - expected).abs() < (0.1 * expected).max(0.3);
        if ![found.rms, found.max, found.jump].into_iter().zip(expected).all(|(found, expected)| is_near(found, expected)) {
            wrong.push(format!("{label}: {found:?}, was {expected:?}"));
        }
    }
    println!("{name}: full itself: jump {:.1} %", error(&full, &full).jump);
    assert!(wrong.is_empty(), "{name}: {wrong:#?}");
}

#[test]
fn a_hand_held_node_has_the_known_errors() {
    assert_errors("hand", [[0.0; 3]; 14]);
}

#[test]
fn a_wave_has_the_known_errors() {
    assert_errors("wave", [[0.0; 3]; 14]);
}

#[test]
fn a_drag_with_friction_has_the_known_errors() {
    assert_errors("drag_friction", [[0.0; 3]; 14]);
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
                let expected: [f64; 3] = full[resync.last_tick as usize - 1].into();
                assert_eq!(force, expected, "{name}, resync {}", resync.version);
                compared += 1;
            }
            assert!(matches!(resync.last_tick + 1 - resync.first_tick, 33 | 34), "{name}: {resync:?}");
        }
        assert!(compared > 500, "{name}: {compared} forces compared");
    }
}
