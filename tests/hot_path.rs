//! The promise of the hot path, held by machine: after warm-up a haptic tick of a real session does not allocate, block,
//! fault a page or make a system call besides its sleep, with contact, resyncs and logging in it.
//!
//! Each session runs in a process of its own, on real threads; its device calls the guards from the real-time thread.
//! Every guard has a control that commits the offence and must be caught.
#![cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]

mod hot_path_support;

use hot_path_support::{Case, Ended, Found, GUARDED, Guard, Offence, allocator, child};
use palpate::model::local::Kind as LocalModelKind;

#[global_allocator]
static ALLOCATOR: allocator::Guarded = allocator::Guarded;

/// What a case without an offence found; `None` where the filter is refused.
#[track_caller]
fn end_well(case: Case) -> Option<Found> {
    match case.run()? {
        Ended::Well(found) => Some(found),
        Ended::Signal(signal, err) => panic!("{case:?} was ended by signal {signal}: {err}"),
    }
}

/// Check that the guarded ticks were the ticks of a session at work, and that their records reached the log.
#[track_caller]
fn assert_at_work(found: &Found, case: Case) {
    assert_eq!(found.ticks, GUARDED, "{found:?}");
    if case.privileged != found.is_realtime {
        assert!(case.privileged, "a real-time policy that nobody asked for");
        println!("no real-time policy here: the same is asked of an ordinary thread");
    }
    assert!(found.logged >= found.ticks - 1, "{found:?}");
    assert!(found.in_contact > GUARDED / 10, "{found:?}");
    if case.model != LocalModelKind::Full {
        assert!(found.resyncs > 20, "{found:?}");
    }
}

fn assert_silent(case: Case) {
    if let Some(found) = end_well(case) {
        assert_at_work(&found, case);
    }
}

fn assert_still(case: Case) {
    let found = end_well(case).expect("counters are always there");
    assert_at_work(&found, case);
    assert_eq!(found.faults, [0, 0], "{found:?}");
    // A wait that is no sleep, as for a lock, would be a second one in its tick. Ticks that wake late do not sleep.
    assert!(found.most_waits <= 1 && found.waits <= found.ticks as i64, "{found:?}");
    assert!(found.waits > 0, "nothing was counted: {found:?}");
}

#[test]
fn a_tick_with_a_patch_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Patch, Guard::SystemCalls));
}

#[test]
fn a_tick_with_moving_surroundings_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::LinearBoundary, Guard::SystemCalls));
}

#[test]
fn an_implicit_tick_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::ScaledBoundary, Guard::SystemCalls));
}

#[test]
fn a_tick_with_condensed_surroundings_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Condensed, Guard::SystemCalls));
}

#[test]
fn a_predictive_tick_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Predictive, Guard::SystemCalls));
}

#[test]
fn a_tick_with_hold_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Hold, Guard::SystemCalls));
}

#[test]
fn a_tick_with_the_whole_body_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Full, Guard::SystemCalls));
}

#[test]
fn a_tick_with_two_tools_makes_no_system_call_and_never_allocates() {
    for model in [LocalModelKind::Full, LocalModelKind::Patch, LocalModelKind::Predictive] {
        assert_silent(Case::new(model, Guard::SystemCalls).with_second());
    }
}

/// The bridges are off the real-time thread, and the ports are what they are without them.
#[test]
fn a_tick_with_the_global_model_behind_a_link_makes_no_system_call_and_never_allocates() {
    for model in [LocalModelKind::Hold, LocalModelKind::Patch, LocalModelKind::Predictive] {
        assert_silent(Case::new(model, Guard::SystemCalls).linked());
    }
    assert_still(Case::new(LocalModelKind::Predictive, Guard::Counters).linked());
}

/// Of a sphere that touches in several places; one of the models is stepped implicitly.
#[test]
fn a_tick_of_a_tool_with_a_shape_makes_no_system_call_and_never_allocates() {
    for model in
        [LocalModelKind::Patch, LocalModelKind::ScaledBoundary, LocalModelKind::Predictive, LocalModelKind::Full]
    {
        let case = Case::new(model, Guard::SystemCalls).with_shape();
        if let Some(found) = end_well(case) {
            assert_at_work(&found, case);
            assert!(found.places > 1, "{found:?}");
        }
    }
}

#[test]
fn a_tick_without_privileges_makes_no_system_call_and_never_allocates() {
    assert_silent(Case::new(LocalModelKind::Patch, Guard::SystemCalls).unprivileged());
}

#[test]
fn a_tick_with_a_patch_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::Patch, Guard::Counters));
}

#[test]
fn a_predictive_tick_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::Predictive, Guard::Counters));
}

#[test]
fn an_implicit_tick_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::ScaledBoundary, Guard::Counters));
}

#[test]
fn a_tick_with_hold_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::Hold, Guard::Counters));
}

#[test]
fn a_tick_with_the_whole_body_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::Full, Guard::Counters));
}

/// Memory is not locked here: every page was touched at set-up.
#[test]
fn a_tick_without_privileges_faults_no_page_and_waits_for_nothing_but_its_release() {
    assert_still(Case::new(LocalModelKind::Patch, Guard::Counters).unprivileged());
}

/// Check that the process was ended by `signal` and, for an abort, said why.
#[track_caller]
fn assert_caught(case: Case, signal: i32, words: &str) {
    match case.run() {
        None => {}
        Some(Ended::Signal(got, err)) => assert!(got == signal && err.contains(words), "signal {got}: {err}"),
        Some(Ended::Well(found)) => panic!("{case:?} was not caught: {found:?}"),
    }
}

#[test]
fn the_allocator_catches_a_tick_that_allocates_or_frees() {
    let case = Case::new(LocalModelKind::Hold, Guard::Counters);
    assert_caught(case.with(Offence::Allocate), libc::SIGABRT, "a real-time tick allocated");
    assert_caught(case.with(Offence::Free), libc::SIGABRT, "a real-time tick freed memory");
}

#[test]
fn the_filter_catches_a_system_call_and_a_lock_that_is_held() {
    let case = Case::new(LocalModelKind::Hold, Guard::SystemCalls);
    assert_caught(case.with(Offence::Call), libc::SIGSYS, "");
    assert_caught(case.with(Offence::Lock), libc::SIGSYS, "");
}

#[test]
fn the_counters_catch_a_fault_and_a_second_wait() {
    let case = Case::new(LocalModelKind::Hold, Guard::Counters);
    let found = end_well(case.with(Offence::Fault)).expect("counters are always there");
    assert!(found.faults[0] > 0, "{found:?}");
    let found = end_well(case.with(Offence::Wait)).expect("counters are always there");
    assert_eq!(found.most_waits, 2, "{found:?}");
}

#[test]
#[ignore = "the child process of the other tests"]
fn the_guarded_session() {
    child();
}
