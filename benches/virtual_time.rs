//! How much faster than real time a whole session is in virtual time: the demo's scene with the local model `patch`.
//!
//! `cargo bench --bench virtual_time`
//!
//! Time simulated over time taken, the median of five runs. What the runtime alone does is in its own bench.

use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::Scene;
use palpate::session::Session;
use std::time::{Duration, Instant};

fn demo_scene() -> Duration {
    let scene = Scene::demo().with_model(LocalModelKind::Patch);
    let session = Session::from_scene(scene).virtual_time().build().expect("a valid scene");
    let start = Instant::now();
    let summary = session.run().expect("it runs");
    let took = start.elapsed();
    assert_eq!(summary.runtime.fault, None);
    took
}

fn main() {
    let simulated_s = Scene::demo().run.duration_s;
    let mut multiples: Vec<f64> = (0..5).map(|_| simulated_s / demo_scene().as_secs_f64()).collect();
    multiples.sort_by(f64::total_cmp);
    let verdict = if multiples[2] >= 3.0 { "met" } else { "missed" };
    println!("| virtual time | times real time | target |");
    println!("| --- | ---: | --- |");
    println!("| the demo scene with `patch` | {:.1} | >= 3: {verdict} |", multiples[2]);
}
