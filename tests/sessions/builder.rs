//! What a program gives a builder counts as what a scene says, and is refused as that.

use crate::session_support::*;
use palpate::ErrorKind;
use palpate::devices::{Scripted, ToolPath};
use palpate::model::Vec3;
use palpate::model::body::Body;
use palpate::model::local::Kind;
use palpate::runtime::{Nanos, RateGroup};
use palpate::scene::{BuiltIn, Scene};
use palpate::session::Session;

#[test]
fn a_latency_that_a_group_declares_is_that_of_the_scene() {
    let felt = |latency_ms: u64, of_scene_ms: f64| {
        let mut scene = Scene::demo();
        scene.global.compute_latency_ms = of_scene_ms;
        let group = RateGroup::hz(30).latency(Nanos(latency_ms * 1_000_000));
        let session = Session::from_scene(scene).model(Kind::Hold).global(group).duration_s(1.0);
        commands(&session.virtual_time().keep_records().build().unwrap().run().unwrap())
    };
    let declared = felt(200, 0.0);
    assert!(largest_command(&declared, 0, [0.0, 1.0]) > 0.1, "such a model is not too old");
    assert_eq!(declared, felt(0, 200.0));
}

#[test]
fn a_body_of_the_program_takes_the_place_of_the_scenes_and_is_not_logged_as_that() {
    let pulled = Scene { devices: Scene::demo().devices, ..BuiltIn::named("wave").unwrap().load() };
    let error = Session::from_scene(pulled).body(block()).build().unwrap_err();
    assert!(error.place() == "initial" && error.to_string().contains("the program's own"), "{error}");

    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let mut scene = Scene::demo();
    scene.probes.clear();
    let session = || Session::from_scene(scene.clone()).body(block()).model(Kind::Hold).duration_s(0.6);
    let summary = session().virtual_time().log(&log).build().unwrap().run().unwrap();
    assert_eq!(summary.runtime.fault, None);
    let error = Session::replay(&log).unwrap_err();
    assert!(error.kind() == ErrorKind::Log && error.to_string().contains("program's own"), "{error}");
    assert!(session().replay(&log).unwrap().run().unwrap().is_identical());
}

#[test]
fn a_device_that_begins_away_from_its_node_is_refused_at_the_start() {
    let glued = |above_m: f64| {
        let place = block().rest()[top() as usize] + Vec3::z() * above_m;
        let device = Scripted::new(ToolPath::constant(place.into()).unwrap());
        let session = Session::builder(block()).device(device).attach_node(top()).model(Kind::Hold);
        session.duration_s(0.05).virtual_time().build().unwrap().run()
    };
    assert!(glued(5e-4).is_ok());
    let error = glued(0.02).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Device);
    assert!(error.to_string().contains("0.02") && error.to_string().contains("glued"), "{error}");
}

#[test]
fn a_session_without_an_end_is_started_and_not_run() {
    let session = Session::builder(block()).path(pressing()).model(Kind::Hold).virtual_time();
    let error = session.build().unwrap().run().unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Runtime);
    assert!(error.to_string().contains("duration_s()") && error.to_string().contains("start()"), "{error}");
}
