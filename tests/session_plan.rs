//! What a session plans, measures and refuses before it starts.

mod session_support;

use palpate::ErrorKind;
use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::runtime::{Execution, RateGroup};
use palpate::session::{Session, SessionBuilder};
use session_support::*;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

/// A block that takes its time for each evaluation of its forces, and the count of these.
fn slow(takes: Duration) -> (impl Body, Arc<Mutex<u64>>) {
    let evaluations: Arc<Mutex<u64>> = Arc::default();
    let count = Arc::clone(&evaluations);
    let body = AlteredBlock::new(block(), move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        let start = Instant::now();
        block.forces(state, forces);
        *count.lock().unwrap() += 1;
        while start.elapsed() < takes {
            std::hint::spin_loop();
        }
    });
    (body, evaluations)
}

fn session(body: impl Body + 'static) -> SessionBuilder {
    Session::builder(body).path(pressing()).model(LocalModelKind::Patch).substeps_per_ms(2)
}

fn budgets(session: &Session) -> Vec<(String, Option<Nanos>)> {
    session.plan().unwrap().groups.into_iter().map(|group| (group.name, group.budget)).collect()
}

#[test]
fn the_measured_cost_of_the_body_is_the_budget_of_the_group_that_runs_it() {
    // A step takes 50 us at least: 66.7 steps of a global period 3.3 ms, two steps of a haptic tick 0.1 ms.
    let takes = Duration::from_micros(50);
    let planned = |model| budgets(&session(slow(takes).0).model(model).build().unwrap());
    let patch = planned(LocalModelKind::Patch);
    assert_eq!(patch.iter().map(|(name, _)| &**name).collect::<Vec<_>>(), ["local", "global", "logger"]);
    let (local, global) = (patch[0].1, patch[1].1);
    assert!(local.is_none() && global.is_some_and(|budget| budget.0 > 3 * MS), "{patch:?}");
    let full = planned(LocalModelKind::Full);
    assert_eq!(full.len(), 2);
    assert!(full[0].1.is_some_and(|budget| budget.0 >= MS / 10), "{full:?}");
}

#[test]
fn a_body_that_cannot_keep_its_rate_is_refused_when_the_session_is_built() {
    let takes = Duration::from_micros(600);
    let refused = |model| session(slow(takes).0).model(model).build().unwrap_err();
    for (model, words) in [
        (LocalModelKind::Patch, ["body: ", "66.7 force evaluations", "33.3 ms", "of 216 fit"]),
        (LocalModelKind::Full, ["model(): ", "2.0 force evaluations", "1.00 ms", "another local model"]),
    ] {
        let error = refused(model);
        assert_eq!(error.kind(), ErrorKind::Scene);
        let error = error.to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?} in {error}");
        // Check that virtual time takes it
        assert!(session(slow(takes).0).model(model).virtual_time().build().is_ok());
    }
}

#[test]
fn nothing_is_measured_in_virtual_time_or_where_the_program_gave_a_budget() {
    let evaluations = |change: &dyn Fn(SessionBuilder) -> SessionBuilder| {
        let (body, evaluations) = slow(Duration::ZERO);
        change(session(body)).build().unwrap();
        *evaluations.lock().unwrap()
    };
    let virtual_time = evaluations(&SessionBuilder::virtual_time);
    assert!(evaluations(&|session| session) > virtual_time);
    let given = RateGroup::hz(30).budget(Nanos(7 * MS));
    assert_eq!(evaluations(&|session| session.global(given.clone())), virtual_time);
    let planned = budgets(&session(slow(Duration::from_millis(1)).0).global(given).build().unwrap());
    assert_eq!(planned[1].1, Some(Nanos(7 * MS)));
}

#[test]
fn budgets_above_a_core_are_refused_with_their_sum_before_a_log_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let groups = |session: SessionBuilder| {
        let session = session.local(RateGroup::hz(1000).pin(0).budget(Nanos(900_000)));
        session.global(RateGroup::hz(30).pin(0).budget(Nanos(10 * MS)))
    };
    let session = groups(session(block()));
    let session = session.log(&log);
    let error = session.build().unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Runtime);
    assert!(error.to_string().contains("core 0 need 120.0 %"), "{error}");
    assert!(!log.exists());
}

#[test]
fn a_local_group_that_only_names_its_rate_keeps_the_real_time_priority() {
    let asked = |group: RateGroup| session(block()).local(group).build().unwrap().plan().unwrap().groups[0].priority;
    assert_eq!(asked(RateGroup::hz(1000)), Some(80));
    assert_eq!(asked(RateGroup::hz(1000).realtime(60)), Some(60));
    assert_eq!(asked(RateGroup::hz(1000).best_effort()), None);
}

#[test]
fn a_plan_asks_no_device_and_can_be_followed_by_a_run() {
    let built = session(block()).duration_s(0.05).virtual_time().build().unwrap();
    let plan = built.plan().unwrap();
    assert_eq!((plan.execution, plan.missing.len(), plan.total_load), (Execution::Virtual, 0, 0.0));
    assert_eq!(plan.coincidences.len(), 3);
    assert_eq!(built.run().unwrap().runtime.groups.len(), 3);
}
