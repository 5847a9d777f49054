//! Friction, stiffness and local model change while a session runs: the force follows, nothing jumps that no blend allows, and the log
//! repeats it to the last bit.

use std::time::Duration;

use palpate::devices::Scripted;
use palpate::log::{ForceSample, LogRecord, ServedBy};
use palpate::model::local::{Feedback, Kind};
use palpate::prelude::*;
use palpate::scene::LinkSpec;

/// What is done at a time (ms).
type Act<'a> = (u64, &'a dyn Fn(&Controls));

const EVERY: [Kind; 8] = Kind::ALL;

/// A block of 6^3 nodes that is pressed 4 mm deep from 0.2 s on, and dragged from 0.6 s to 1.6 s if it is to be.
fn pressed(model: Kind, drags: bool) -> SessionBuilder {
    Session::builder(block()).path(path(0.023, drags)).friction(0.4).crossfade_ms(10.0).model(model)
}

/// The same with a second tool 10 mm beside.
fn pressed_twice(model: Kind, drags: bool) -> SessionBuilder {
    let [left, right] = [0.023, 0.033].map(|y| Scripted::new(path(y, drags)));
    let session = Session::builder(block()).named_device("left", left).named_device("right", right);
    session.friction(0.4).crossfade_ms(10.0).model(model)
}

fn block() -> Block {
    let body = Block::builder([6; 3], [0.05; 3]).stiffness(30.0).damping_ratio(0.3).node_mass(0.5e-3).fix(Face::ZMin);
    body.build().unwrap()
}

fn path(y: f64, drags: bool) -> ToolPath {
    let end = if drags { 0.032 } else { 0.022 };
    let places = [[0.022, y, 0.052], [0.022, y, 0.046], [0.022, y, 0.046], [end, y, 0.046], [end, y, 0.046]];
    ToolPath::new(vec![0.0, 0.2, 0.6, 1.6, 10.0], places.to_vec()).unwrap()
}

/// Runs for so many seconds, and does what is wanted at its times (ms); the forces on the first device.
fn run(session: SessionBuilder, ms: u64, wanted: &[Act<'_>]) -> Vec<ForceSample> {
    run_all(session, ms, wanted).into_iter().filter(|force| force.device == 0).collect()
}

/// Likewise, of all devices.
fn run_all(session: SessionBuilder, ms: u64, wanted: &[Act<'_>]) -> Vec<ForceSample> {
    let session = session.virtual_time().keep_records().duration_s(1e-3 * ms as f64);
    let mut running = session.build().unwrap().start().unwrap();
    let controls = running.take_controls().unwrap();
    let mut now = 0;
    for (at, act) in wanted {
        running.wait_for(Duration::from_millis(at - now));
        now = *at;
        act(&controls);
    }
    running.wait();
    let summary = running.stop();
    assert_eq!(summary.runtime.fault, None);
    let forces = summary.records.iter().filter_map(|record| match record {
        LogRecord::Force(force) => Some(*force),
        _ => None,
    });
    forces.collect()
}

fn size(force: &ForceSample) -> f64 {
    force.force_n.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Of the last 50 ms (N).
fn settled(forces: &[ForceSample]) -> f64 {
    let last = &forces[forces.len() - 50..];
    last.iter().map(size).sum::<f64>() / 50.0
}

#[test]
fn full_beside_a_global_model_is_full_to_the_last_bit() {
    for pressed in [pressed, pressed_twice] {
        let sorted = |session| {
            let mut forces = run_all(session, 900, &[]);
            forces.sort_by_key(|force| (force.time, force.device));
            forces
        };
        let [alone, beside] = [pressed(Kind::Full, true), pressed(Kind::Full, true).switchable()].map(sorted);
        assert!(alone.iter().map(size).fold(0.0, f64::max) > 0.1);
        assert_eq!(alone.len(), beside.len());
        for (a, b) in alone.iter().zip(&beside) {
            assert_eq!((a.time, a.device), (b.time, b.device));
            assert_eq!(a.force_n.map(f64::to_bits), b.force_n.map(f64::to_bits));
            assert_eq!((b.served_by, b.model_age_s), (ServedBy::Full, 0.0));
        }
    }
}

#[test]
fn every_model_takes_over_from_every_other_while_the_tool_touches() {
    let one =
        [Kind::Hold, Kind::Full, Kind::Predictive].map(|from| (from, pressed as fn(Kind, bool) -> SessionBuilder));
    for (from, pressed) in one.into_iter().chain([(Kind::Full, pressed_twice as fn(Kind, bool) -> SessionBuilder)]) {
        let acts: Vec<_> =
            EVERY.iter().map(|&kind| move |controls: &Controls| controls.set_model(kind).unwrap()).collect();
        let wanted: Vec<Act<'_>> =
            (0..).zip(&acts).map(|(n, act)| (400 + 150 * n, act as &dyn Fn(&Controls))).collect();
        let forces = run(pressed(from, false).switchable(), 400 + 150 * EVERY.len() as u64, &wanted);
        for (n, kind) in (0..).zip(EVERY) {
            // A period until it is built, one until it serves, and the blend.
            let served = &forces[(400 + 150 * n + 100) as usize];
            let expected = match kind {
                Kind::Full => ServedBy::Full,
                Kind::Hold => ServedBy::Hold,
                Kind::Patch => ServedBy::Patch,
                Kind::LinearBoundary => ServedBy::LinearBoundary,
                Kind::ScaledBoundary => ServedBy::ScaledBoundary,
                Kind::Condensed => ServedBy::Condensed,
                Kind::Predicted => ServedBy::Predicted,
                Kind::Predictive => ServedBy::Predictive,
            };
            assert_eq!(served.served_by, expected, "from {from:?}");
        }
        // The tool rests: what changes is what the models make of it, led over by the blend of 10 ms.
        let resting = &forces[400..];
        let most = resting.windows(2).map(|pair| (size(&pair[1]) - size(&pair[0])).abs()).fold(0.0, f64::max);
        assert!(most < 0.12 * settled(&forces), "a step of {most} N beside {} N", settled(&forces));
    }
}

#[test]
fn a_body_that_is_twice_as_stiff_presses_back_twice_as_hard() {
    for model in [Kind::Full, Kind::Hold, Kind::Patch, Kind::Condensed, Kind::Predictive] {
        let as_made = run(pressed(model, false), 1500, &[]);
        let stiffer = run(pressed(model, false), 1500, &[(400, &|controls| controls.set_stiffness(2.0).unwrap())]);
        let (once, twice) = (settled(&as_made), settled(&stiffer));
        assert!((twice / once - 2.0).abs() < 0.03, "{model:?}: {once} N, {twice} N");
        // It goes there over tenths of a second: a step would push the hand.
        let step = |forces: &[ForceSample]| {
            forces[400..].windows(2).map(|pair| (size(&pair[1]) - size(&pair[0])).abs()).fold(0.0, f64::max)
        };
        assert!(step(&stiffer) < 0.15 * once, "{model:?}: a step of {} N", step(&stiffer));
    }
}

#[test]
fn a_body_made_stiffer_while_it_runs_moves_as_one_that_was_made_so() {
    // From before the contact on, so that both meet the tool as they are.
    let made = |factor: f64| {
        let body = Block::builder([6; 3], [0.05; 3]).stiffness(30.0 * factor).damping_ratio(0.3).node_mass(0.5e-3);
        let places = [[0.022, 0.023, 0.06], [0.022, 0.023, 0.06], [0.022, 0.023, 0.045]];
        let path = ToolPath::new(vec![0.0, 0.5, 0.9], places.to_vec()).unwrap();
        Session::builder(body.fix(Face::ZMin).build().unwrap())
            .path(path)
            .friction(0.4)
            .model(Kind::Full)
            .substeps_per_ms(2)
    };
    let live = run(made(1.0), 1000, &[(5, &|controls| controls.set_stiffness(1.7).unwrap())]);
    let fixed = run(made(1.7), 1000, &[]);
    let peak = fixed.iter().map(size).fold(0.0, f64::max);
    assert!(peak > 0.1);
    for (a, b) in live.iter().zip(&fixed) {
        assert!((size(a) - size(b)).abs() < 1e-6 * peak, "{} {} at {}", size(a), size(b), a.time);
    }
}

#[test]
fn friction_that_is_changed_is_what_holds_a_dragged_tool() {
    for model in [Kind::Full, Kind::Patch, Kind::Predictive] {
        let ratio = |wanted: &[Act<'_>]| {
            let forces = run(pressed(model, true), 1500, wanted);
            let last = &forces[1400..];
            let tangential: f64 = last.iter().map(|force| force.force_n[0].hypot(force.force_n[1])).sum();
            tangential / last.iter().map(|force| force.force_n[2].abs()).sum::<f64>()
        };
        let (before, after) = (ratio(&[]), ratio(&[(700, &|controls| controls.set_friction(0.1.into()).unwrap())]));
        // The surface leans under the tool, so that the ratio is not the coefficient itself.
        assert!(after < before - 0.15, "{model:?}: {before} {after}");
    }
}

/// Check that what is changed crosses a link that loses some of what it is given, and takes its time there: the force is as ever for
/// one way and the time that a model takes on the other.
#[test]
fn over_a_link_friction_and_stiffness_change_when_they_have_crossed_it() {
    let link = || LinkSpec { delay_ms: 20.0, loss: 0.05, seed: 3, ..LinkSpec::default() };
    for model in [Kind::Hold, Kind::Patch, Kind::Predictive] {
        let over = |wanted: &[Act<'_>]| run(pressed(model, true).link(link()), 1500, wanted);
        let as_made = over(&[]);
        let change: Act<'_> = (1200, &|controls| {
            controls.set_stiffness(1.5).unwrap();
            controls.set_friction(0.1.into()).unwrap();
        });
        let changed = over(&[change]);
        let first = as_made.iter().zip(&changed).position(|(a, b)| a.force_n != b.force_n).unwrap();
        assert!((1240..1400).contains(&first), "{model:?}: {first} ms");
        let last = |forces: &[ForceSample]| forces.last().unwrap().force_n;
        let [before, after] = [last(&as_made), last(&changed)];
        let ratio = after[2] / before[2];
        assert!((1.2..1.6).contains(&ratio), "{model:?}: {ratio} times as hard");
        let [before, after] = [before, after].map(|force| force[0].hypot(force[1]) / force[2].abs());
        assert!(after < before - 0.15, "{model:?}: {before} and {after} of the normal force drags");
    }
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut running = pressed(Kind::Patch, false).virtual_time().build().unwrap().start().unwrap();
    let controls = running.take_controls().unwrap();
    let most = *controls.stiffness_limits().end();
    assert!(most > 1.0 && most < 10.0, "{most}");
    for factor in [0.0, -1.0, f64::NAN, f64::INFINITY, 1.001 * most] {
        let error = controls.set_stiffness(factor).unwrap_err().to_string();
        assert!(error.contains(&format!("{most:.3}")), "{error}");
    }
    assert!(controls.set_friction((-0.1).into()).is_err() && controls.set_friction(f64::NAN.into()).is_err());
    let error = controls.set_model(Kind::Full).unwrap_err().to_string();
    assert!(error.contains("full cannot be set while this session runs, patch can"), "{error}");
    assert_eq!((controls.stiffness(), controls.friction().kinetic, controls.model()), (1.0, 0.4, Kind::Patch));
    controls.set_stiffness(most).unwrap();
    running.wait_for(Duration::from_millis(1500));
    assert_eq!(running.stop().runtime.fault, None, "the stiffest body that its steps bear is stable");
}

#[test]
fn a_log_with_changes_is_repeated_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (name, in_real_time) in [("virtual.mcap", false), ("real.mcap", true)] {
        let log = folder.path().join(name);
        let session = pressed(Kind::Full, true).switchable();
        let recorded = session.log(&log).duration_s(1.4);
        let recorded = if in_real_time { recorded } else { recorded.virtual_time() };
        let mut running = recorded.build().unwrap().start().unwrap();
        let controls = running.take_controls().unwrap();
        let acts: [&dyn Fn(); 6] = [
            &|| controls.set_model(Kind::Patch).unwrap(),
            &|| controls.set_friction(0.2.into()).unwrap(),
            &|| controls.set_model(Kind::Predictive).unwrap(),
            &|| controls.set_stiffness(1.8).unwrap(),
            &|| controls.set_model(Kind::Full).unwrap(),
            &|| controls.set_stiffness(0.6).unwrap(),
        ];
        for act in acts {
            running.wait_for(Duration::from_millis(170));
            act();
        }
        running.wait();
        let summary = running.stop();
        assert!(summary.runtime.fault.is_none() && summary.log_error.is_none());
        let report = pressed(Kind::Full, true).switchable().duration_s(1.4).replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical(), "{name}: {report:?}");
    }
}

// Check that patch and feedback count for a model that is switched to as for one of the start, and that a log says them.
#[test]
fn what_was_asked_of_patch_and_feedback_counts_for_models_that_are_switched_to() {
    let folder = tempfile::tempdir().unwrap();
    let switched = |change: fn(SessionBuilder) -> SessionBuilder| {
        let log = folder.path().join("run.mcap");
        let session = || change(pressed(Kind::Hold, true)).switchable();
        let wanted: [Act<'_>; 1] = [(300, &|controls| controls.set_model(Kind::Patch).unwrap())];
        let forces = run(session().log(&log), 800, &wanted);
        let report = session().duration_s(0.8).replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical(), "{report:?}");
        forces.iter().map(|force| force.force_n.map(f64::to_bits)).collect::<Vec<_>>()
    };
    let usual = switched(|session| session);
    assert_eq!(usual, switched(|session| session.patch([4, 4, 2])), "what is usual");
    assert_ne!(usual, switched(|session| session.patch([3, 3, 2])));
    assert_ne!(usual, switched(|session| session.feedback(Feedback::Trajectory)));
}
