//! Each local model against `full`, in virtual time: the error that is known for it, no more and no less.
//!
//! `cargo test --test local_models -- --nocapture` prints the table of the README.
#![cfg(feature = "scene")]

use std::path::Path;

use palpate::Session;
use palpate::log::LogRecord;
use palpate::model::Vec3;
use palpate::scene::{BlendKind, BlendSpec, LocalModelKind, Scene};

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

/// Errors of hold, patch, patch with a crossfade of 10 ms, and patch with results that arrive one period late.
fn errors(name: &str) -> [Error; 4] {
    let full = forces(scene(name).with_model(LocalModelKind::Full));
    let hold = forces(scene(name).with_model(LocalModelKind::Hold));
    let patch = forces(scene(name).with_model(LocalModelKind::Patch));
    let mut blended = scene(name).with_model(LocalModelKind::Patch);
    blended.local.blend = BlendSpec { kind: BlendKind::Crossfade, ms: 10.0 };
    let blended = forces(blended);
    let mut late = scene(name).with_model(LocalModelKind::Patch);
    late.global.compute_latency_ms = 33.34;
    let late = forces(late);
    let errors = [hold, patch, blended, late].map(|f| error(&f, &full));
    for (model, e) in ["hold", "patch", "patch, 10 ms crossfade", "patch, one period late"].iter().zip(&errors) {
        println!("{name}: {model}: rms {:.1} / max {:.1} / jump {:.1} %", e.rms, e.max, e.jump);
    }
    println!("{name}: full itself: jump {:.1} %", error(&full, &full).jump);
    errors
}

#[test]
fn a_hand_held_node_has_the_known_errors() {
    let [hold, patch, blended, late] = errors("hand");
    assert!((12.0..16.0).contains(&hold.rms) && (45.0..60.0).contains(&hold.max), "{hold:?}");
    assert!((10.0..14.0).contains(&patch.rms) && (33.0..45.0).contains(&patch.max), "{patch:?}");
    assert!((20.0..30.0).contains(&patch.jump), "{patch:?}");
    assert!((11.0..15.0).contains(&blended.rms) && blended.jump < 7.0, "{blended:?}");
    assert!(late.rms > patch.rms && late.rms < 60.0, "lateness costs, but nothing diverges: {late:?}");
}

#[test]
fn a_wave_has_the_known_errors() {
    let [hold, patch, blended, late] = errors("wave");
    assert!((8.0..13.0).contains(&hold.rms) && (40.0..52.0).contains(&hold.max), "{hold:?}");
    assert!((19.0..25.0).contains(&patch.rms) && (62.0..78.0).contains(&patch.max), "{patch:?}");
    assert!((20.0..26.0).contains(&blended.rms) && blended.jump < 7.0, "{blended:?}");
    assert!(late.rms > patch.rms && late.rms < 60.0, "lateness costs, but nothing diverges: {late:?}");
}

#[test]
fn a_drag_with_friction_has_the_known_errors() {
    let [hold, patch, blended, late] = errors("drag_friction");
    assert!((5.0..8.0).contains(&hold.rms) && (38.0..50.0).contains(&hold.max), "{hold:?}");
    assert!((10.0..14.0).contains(&patch.rms) && (42.0..56.0).contains(&patch.max), "{patch:?}");
    assert!(blended.jump < 8.0, "{blended:?}");
    assert!(late.rms > patch.rms && late.rms < 60.0, "lateness costs, but nothing diverges: {late:?}");
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
