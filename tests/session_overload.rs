//! A global model that is too late: its work per release is bounded, what it cannot make up is dropped and said, and the
//! force comes back.

mod session_support;

use palpate::log::GlobalTick;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::{Disturbance, Nanos, RateGroup};
use palpate::scene::SafetyStage;
use palpate::session::{Session, Summary};
use session_support::*;
use std::sync::{Arc, Mutex};

const MS: u64 = 1_000_000;
const SUBSTEPS: u64 = 2;

/// Two seconds of pressing in virtual time, the global group disturbed; with the number of times that forces were
/// evaluated.
fn run(disturb: impl FnMut(u64) -> Disturbance + Send + 'static) -> (Summary, u64) {
    let evaluated = Arc::new(Mutex::new(0));
    let counter = Arc::clone(&evaluated);
    let body = AlteredBlock::new(block(), move |block, state, forces| {
        *counter.lock().unwrap() += 1;
        palpate::model::body::Body::forces(block, state, forces);
    });
    let session = Session::builder(body).path(pressing()).model(LocalModelKind::Patch).virtual_time().keep_records();
    let session = session.substeps_per_ms(SUBSTEPS as u32).safety_off([SafetyStage::StartUp]);
    let summary = session.disturb("global", disturb).duration_s(2.0).build().unwrap().run().unwrap();
    assert_eq!(summary.runtime.fault, None);
    let evaluated = *evaluated.lock().unwrap();
    (summary, evaluated)
}

fn said(summary: &Summary) -> bool {
    summary.report.events.iter().any(|event| event.message.contains("too late to follow the tool"))
}

fn at(ticks: &[GlobalTick], release: usize) -> u64 {
    ticks[release].last_tick
}

#[test]
fn a_stall_of_a_period_is_followed_sample_by_sample() {
    let stall =
        |release| Disturbance { late_wake: Nanos(if release == 30 { 33 * MS } else { 0 }), ..Disturbance::default() };
    let ((stalled, work), (calm, all)) = (run(stall), run(|_| Disturbance::default()));
    assert_eq!((work, said(&stalled)), (all, false));
    // Check that the force ends as that of a run without it, but for what patches fed back at other times.
    let last = |summary: &Summary| norm(forces(summary).last().unwrap().force_n);
    assert!((last(&stalled) - last(&calm)).abs() < 1e-6, "{} N, {} N", last(&stalled), last(&calm));
}

#[test]
fn a_longer_one_is_not_and_costs_a_period_of_work() {
    let stall =
        |release| Disturbance { late_wake: Nanos(if release == 15 { 1000 * MS } else { 0 }), ..Disturbance::default() };
    let ((stalled, work), (_, all)) = (run(stall), run(|_| Disturbance::default()));
    assert!(said(&stalled), "{}", stalled.report);
    // Of the second, half a period is the straight way and half a period the samples at its end.
    let left = all - work;
    assert!(left >= SUBSTEPS * (1000 - 2 * 34), "{left} evaluations of {all} were dropped");
    let ticks = global_ticks(&stalled);
    let release = ticks.iter().position(|tick| tick.last_tick - tick.first_tick > 900).expect("the case is no case");
    assert!(at(&ticks, release) + 1 >= ticks[release].time.0 / MS, "its state is that of the newest tool");
    // Check that the force is back at the end and near the one of a run without the stall.
    let last = forces(&stalled).last().map_or(0.0, |force| norm(force.force_n));
    let commanded = commands(&stalled).last().map_or(0.0, |command| norm(command.force_n));
    assert!(commanded > 0.1 && (commanded - last).abs() < 1e-9, "{commanded} N of {last} N");
}

#[test]
fn a_load_that_lasts_leaves_no_growing_backlog_and_the_force_is_back_after_it() {
    // Each release takes 170 ms of the clock until 1.2 s: five periods, which is more than it can make up.
    let load =
        |release: u64| Disturbance { work: Nanos(if release < 36 { 170 * MS } else { 0 }), ..Disturbance::default() };
    let ((loaded, work), (_, all)) = (run(load), run(|_| Disturbance::default()));
    assert!(said(&loaded) && work < all, "{}", loaded.report);
    let ticks = global_ticks(&loaded);
    // Check that each state is as new as its release.
    for tick in &ticks {
        assert!(tick.last_tick + 1 >= tick.time.0 / MS, "{tick:?}");
    }
    let commanded = commands(&loaded);
    assert!(commanded.last().is_some_and(|command| norm(command.force_n) > 0.1), "{:?}", commanded.last());
}

#[test]
fn a_stall_in_the_first_ticks_of_a_slow_haptic_loop_is_no_fault() {
    let stall =
        |release| Disturbance { late_wake: Nanos(if release == 1 { 110 * MS } else { 0 }), ..Disturbance::default() };
    let session = Session::builder(block()).path(pressing()).model(LocalModelKind::Patch).virtual_time().keep_records();
    let session = session.local(RateGroup::hz(50)).disturb("global", stall).duration_s(1.0);
    let summary = session.build().unwrap().run().unwrap();
    assert_eq!((summary.runtime.fault, summary.runtime.restarts), (None, vec![]));
}
