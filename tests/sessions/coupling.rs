//! The virtual coupling in whole sessions: it must not swing, whatever the body, the model and the rate.

use std::path::Path;

use crate::session_support::force_vectors;
use palpate::log::LogRecord;
use palpate::model::Vec3;
use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::Scene;
use palpate::session::{Session, Summary};

const MODELS: [LocalModelKind; 3] = [LocalModelKind::Full, LocalModelKind::Patch, LocalModelKind::Predictive];
/// Smaller than the scenes' 12: as stiff at the contact, and much faster.
const NODES: [usize; 3] = [6; 3];

fn load(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    let mut scene = Scene::load(&path).unwrap();
    scene.body.as_mut().unwrap().mass_spring_mut().unwrap().block.nodes = NODES;
    scene.global.substeps_per_ms = None;
    scene
}

fn run(scene: &Scene, coupling: bool) -> Summary {
    let mut scene = scene.clone();
    scene.local.coupling = coupling;
    let summary = Session::from_scene(scene).virtual_time().keep_records().build().unwrap().run().unwrap();
    assert_eq!(summary.runtime.fault, None);
    summary
}

/// What alternates from tick to tick: the root mean square of the fourth differences over the 16 that they make of it (N).
fn roughness(forces: &[Vec3]) -> f64 {
    let fourth = |w: &[Vec3]| (w[4] - 4.0 * w[3] + 6.0 * w[2] - 4.0 * w[1] + w[0]).norm_squared();
    (forces.windows(5).map(fourth).sum::<f64>() / forces.len() as f64).sqrt() / 16.0
}

fn peak(forces: &[Vec3]) -> f64 {
    forces.iter().map(Vec3::norm).fold(0.0, f64::max)
}

/// A coupling that swings by itself does so from tick to tick, by a share of what it feels. One that is soft beside its body
/// sticks and slips as any soft spring does, in swings of many ticks: this share of the peak is left of those.
const SMOOTH: f64 = 0.001;

#[test]
fn a_coupled_tool_is_smoother_than_a_direct_one_on_soft_and_stiff_bodies_at_every_rate() {
    let mut scene = load("drag_friction");
    scene.run.duration_s = 1.2;
    for rate_hz in [500.0, 1000.0, 4000.0] {
        for stiffness in [5.0, 30.0, 300.0] {
            for model in MODELS {
                let mut scene = scene.clone().with_model(model);
                scene.local.rate_hz = rate_hz;
                scene.body.as_mut().unwrap().mass_spring_mut().unwrap().material.stiffness_n_per_m = stiffness;
                let [direct, coupled] = [false, true].map(|coupling| force_vectors(&run(&scene, coupling)));
                let (rough, bound) = (roughness(&coupled), roughness(&direct).max(SMOOTH * peak(&coupled)));
                let told =
                    format!("{rate_hz} Hz, {stiffness} N/m, {}: {rough:.1e} N, at most {bound:.1e} N", model.name());
                println!("{told}; peak {:.2} N, direct {:.2} N", peak(&coupled), peak(&direct));
                assert!(rough <= bound && peak(&coupled) > 0.05, "{told}");
            }
        }
    }
}

#[test]
fn a_coupled_device_that_is_let_go_calms_down_and_its_environment_stays_passive() {
    for rate_hz in [500.0, 1000.0, 4000.0] {
        for model in MODELS {
            let mut scene = load("hand_release").with_model(model);
            scene.local.rate_hz = rate_hz;
            let [direct, coupled] = [false, true].map(|coupling| run(&scene, coupling));
            let swing = |from_s: f64, to_s: f64| {
                let heights = coupled.records.iter().filter_map(|record| match record {
                    LogRecord::Tool(tool) if (from_s..to_s).contains(&tool.time.as_secs_f64()) => {
                        Some(tool.position_m[2])
                    }
                    _ => None,
                });
                let ends = |(low, high): (f64, f64), z: f64| (low.min(z), high.max(z));
                let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
                high - low
            };
            let (released, end, least_j) =
                (swing(1.0, 1.5), swing(1.9, 2.4), coupled.report.devices[0].limits.energy.least_j);
            let rough = [&direct, &coupled].map(|summary| roughness(&force_vectors(summary)));
            let told = format!("{rate_hz} Hz, {}: {released:.1e} m, then {end:.1e} m, {least_j:.1e} J", model.name());
            println!("{told}, direct and coupled {:.1e} and {:.1e} N", rough[0], rough[1]);
            assert!(end < 0.8 * released && least_j >= -10e-6 && rough[1] <= rough[0], "{told}");
        }
    }
}
