//! Whole sessions in situations in which simulations usually fail: each local model against `full`, in virtual time.

#[path = "../examples/hard_cases/arguments.rs"]
mod arguments;
#[path = "../examples/hard_cases/cases/mod.rs"]
#[allow(dead_code, reason = "what is hard about a case is for the table")]
mod cases;
#[path = "../examples/hard_cases/measure.rs"]
#[allow(dead_code, reason = "the example prints what is only compared here")]
mod measure;

use arguments::Asked;
use cases::{Bound, Case, Upset};
use measure::{MAX_FORCE_N, Measured, Traced};
use palpate::log::LogRecord;
use palpate::model::body::{Block, Body, State};
use palpate::model::contact::{Contact, Law, ToolMotion};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Face;
use palpate::model::simulation::{Simulation, Stepping};
use palpate::prelude::*;
use palpate::scene::Scene;

fn scene(name: &str) -> Scene {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/hard");
    Scene::load(&folder.join(name).with_extension("toml")).unwrap()
}

#[test]
fn the_example_takes_no_case_or_option_that_there_is_not_and_keeps_the_table_of_the_docs() {
    let read = |arguments: &[&str]| {
        Asked::read(arguments.iter().map(|argument| (*argument).to_owned()), &["impact", "impact_hard", "teleport"])
    };
    let all = Asked { all: true, ..Asked::default() };
    assert_eq!((read(&[]), read(&["--all"])), (Ok(Asked::default()), Ok(all)));
    let names = vec!["tele".to_owned(), "impact".to_owned()];
    assert_eq!(read(&["tele", "--bounds", "impact"]), Ok(Asked { names, bounds: true, ..Asked::default() }));
    for refused in [&["impcat"][..], &["--dcos"], &["--bounds", "--docs"], &["--docs", "--bounds", "--all"]] {
        assert!(read(refused).is_err(), "{refused:?}");
    }
}

/// What holds of every run, whatever is done to it.
fn check_safe(what: &str, case: &Case, run: &Traced) {
    assert_eq!(run.fault, None, "{what}");
    assert!(run.is_finite, "{what}: a force is not finite");
    assert!(run.commanded_n <= MAX_FORCE_N * (1.0 + 1e-12), "{what}: {} N reach the device", run.commanded_n);
    if case.ends_free {
        let forces = &run.trace.forces_n;
        assert!(forces[forces.len() - 10..].iter().all(|force| *force == [0.0; 3]), "{what}: the tool has left");
    }
}

fn check_error(what: &str, measured: &Measured, at_most: &Bound) {
    let error = measured.error;
    let figures = [
        ("rms", error.rms, at_most.rms),
        ("max", error.max, at_most.max),
        ("jump", error.jump, at_most.jump),
        ("energy", error.energy, at_most.energy),
    ];
    for (name, figure, bound) in figures {
        assert!(figure <= bound, "{what}: {name} is {figure}, at most {bound} is expected");
    }
}

/// What `predictive` promises of drags, of lost resyncs and of stalls, whatever was measured.
fn check_promise(what: &str, case: &Case, measured: &Measured, full: &Traced) {
    let (error, peak) = (measured.error, measured.peaks_n[0] / measured.peaks_n[1]);
    if case.name.starts_with("drag") {
        assert!(peak <= 1.3, "{what}: {peak} times as strong");
        assert!(error.rms <= 3.0, "{what}: {}", error.rms);
    }
    match case.upset {
        Upset::Nothing => {}
        Upset::EverySecondLost => assert!(error.rms <= 1.5, "{what}: {}", error.rms),
        Upset::Stall(_) => {
            let own = Measured::between(full, full).error.jump;
            assert!(error.jump <= own + 7.0, "{what}: jumps by {}, the reference by {own}", error.jump);
            assert!(peak <= 1.3, "{what}: {peak} times as strong");
        }
    }
}

fn check(cases: &[Case]) {
    let bases = tempfile::tempdir().unwrap();
    for case in cases {
        let full = measure::full(case).unwrap();
        check_safe(&format!("{}, full", case.name), case, &full);
        for run in case.runs {
            let what = format!("{}, {} {} periods late", case.name, run.model.name(), run.late);
            let traced = measure::run(case, run, bases.path()).unwrap();
            check_safe(&what, case, &traced);
            let measured = Measured::between(&traced, &full);
            if run.model == LocalModelKind::Predictive {
                check_promise(&what, case, &measured, &full);
            }
            check_error(&what, &measured, &run.at_most);
        }
    }
}

#[test]
fn extreme_materials_and_shapes_stay_within_their_bounds() {
    check(cases::materials::CASES);
}

#[test]
fn fast_and_deep_motions_stay_within_their_bounds() {
    check(cases::motions::CASES);
}

#[test]
fn degenerate_places_and_rest_stay_within_their_bounds() {
    check(cases::places::CASES);
}

#[test]
fn late_lost_and_stalled_resyncs_stay_within_their_bounds() {
    check(cases::late::CASES);
}

#[test]
fn a_tool_at_1_m_s_is_felt_as_soon_as_it_is_inside() {
    for model in [LocalModelKind::Full, LocalModelKind::Patch, LocalModelKind::Predictive] {
        let session = Session::from_scene(scene("impact")).model(model).virtual_time().keep_records().build().unwrap();
        let summary = session.run().unwrap();
        let forces = palpate_cli::compare::ForceTrace::of(&summary.records).forces_n;
        // From 30 mm above, 1 mm per tick; then it stays inside.
        assert!(forces[..29].iter().all(|force| *force == [0.0; 3]), "{model:?}");
        // It is felt in the first tick that ends inside; then the surface may run ahead of it for a while.
        assert!(forces[29..31].iter().any(|force| force[2] > 0.1), "{model:?}: {:?}", &forces[28..32]);
        assert!(forces[forces.len() - 20..].iter().all(|force| force[2] > 0.1), "{model:?}");
    }
}

/// The force of 34 N for one tick, and what reaches the device of it.
#[test]
fn a_tool_that_teleports_is_clamped_and_slewed() {
    let scene = scene("teleport");
    let (limit, slew) = (scene.safety.max_force_n.unwrap(), scene.safety.max_slew_n_per_ms);
    let summary = Session::from_scene(scene).virtual_time().keep_records().build().unwrap().run().unwrap();
    let commands: Vec<Vec3> = summary
        .records
        .iter()
        .filter_map(|record| match record {
            LogRecord::Command(sample) => Some(sample.force_n.into()),
            _ => None,
        })
        .collect();
    let computed = palpate_cli::compare::ForceTrace::of(&summary.records).peak_n();
    assert!(computed > 3.0 * limit, "the case is no case: {computed} N");
    assert!(commands.iter().all(|force| force.norm() <= limit * (1.0 + 1e-12)));
    assert!(commands.windows(2).all(|pair| (pair[1] - pair[0]).norm() <= slew * (1.0 + 1e-9)));
}

#[test]
fn what_no_explicit_step_can_hold_is_refused_with_the_number_that_can() {
    let error = Session::from_scene(scene("stiff_100")).substeps_per_ms(2).virtual_time().build().unwrap_err();
    let text = error.to_string();
    assert!(text.contains("substeps_per_ms") && text.contains("stab"), "{text}");
}

#[test]
fn a_disturbance_of_a_group_that_is_not_there_is_refused() {
    let session = Session::from_scene(scene("vertex")).virtual_time().disturb("globe", |_| Default::default());
    let error = session.build().unwrap().start().map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("`globe`"), "{error}");
}

/// A pressed block comes to rest and stays: after two minutes no state is subnormal, which would make each product slow, and
/// none changes any more.
#[test]
fn a_body_at_rest_for_minutes_has_no_subnormal_state() {
    let body = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.3.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
    let at = |z| Vec3::new(0.0225, 0.0238, z);
    sim.tick(ToolMotion::straight(at(0.051), at(0.050_5)));
    for tick in 0..10 {
        let z = |tick: i32| 0.0505 - 5e-4 * f64::from(tick);
        sim.tick(ToolMotion::straight(at(z(tick)), at(z(tick + 1))));
    }
    let rest = ToolMotion::straight(at(0.0455), at(0.0455));
    let mut before = State::default();
    for second in 0..120 {
        for _ in 0..1000 {
            sim.tick(rest);
        }
        let state = sim.state();
        let subnormal = state.positions.iter().chain(&state.velocities).flatten().filter(|c| c.is_subnormal()).count();
        assert_eq!(subnormal, 0, "after {second} s");
        if second == 118 {
            before = state.clone();
        }
    }
    // Check that what is left is rounding: no position drifts
    let moved = sim.state().positions.iter().zip(&before.positions).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-15, "{moved} m within a second");
}
