//! What the parts of the command promise beyond one file.

#[path = "../../../src/model/tests/common/mod.rs"]
pub mod common;
mod cut_logs;
mod exports;
mod log_recover;
mod log_reports;
#[path = "../../../tests/log_sample/mod.rs"]
mod log_sample;
#[path = "../../tests/support/repository.rs"]
pub mod repository;
#[path = "../../tests/support/scene.rs"]
mod scene;
mod timing_faults;

use palpate::scene::Scene;
use palpate::session::Session;

/// The log of a run of the small scene in virtual time, whose global model takes `latency_ms`.
fn recorded(latency_ms: f64, duration_s: f64) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("path.csv"), scene::PATH).unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene::SCENE).unwrap();
    let mut scene = Scene::load(&folder.path().join("scene.toml")).unwrap();
    scene.global.compute_latency_ms = latency_ms;
    let log = folder.path().join("run.mcap");
    Session::from_scene(scene).virtual_time().duration_s(duration_s).log(&log).build().unwrap().run().unwrap();
    std::fs::read(log).unwrap()
}
