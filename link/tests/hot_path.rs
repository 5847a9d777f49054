//! The promise of the hot path with the global model behind zenoh: the haptic tick has the ports that it always has, and does nothing for
//! the link. Guards and controls are those of the engine's own test.
#![cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]

#[path = "../../tests/hot_path_support/mod.rs"]
#[allow(dead_code)]
mod hot_path_support;

use hot_path_support::{Case, ELSEWHERE, Ended, Found, GUARDED, Guard, Offence, allocator, child};
use palpate::model::local::Kind;
use palpate::session::SessionBuilder;
use palpate_link::{Access, GlobalSide, serve};

#[global_allocator]
static ALLOCATOR: allocator::Guarded = allocator::Guarded;

/// The global side is in the same process, and everything between the two goes over loopback.
fn over_zenoh(session: SessionBuilder, case: Case) -> SessionBuilder {
    let socket = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp/{}", socket.local_addr().unwrap());
    drop(socket);
    let listens = address.clone();
    let make = move || case.body_and_models().build_global();
    std::thread::spawn(move || serve(make, &listens, &Access::default(), || false, |_| ()).unwrap());
    session.global_over(GlobalSide::at(&address, &Access::default()).unwrap())
}

#[track_caller]
fn assert_at_work(found: &Found) {
    assert_eq!(found.ticks, GUARDED, "{found:?}");
    assert!(found.logged >= found.ticks - 1 && found.in_contact > GUARDED / 10 && found.resyncs > 20, "{found:?}");
}

#[test]
fn a_tick_makes_no_system_call_and_never_allocates() {
    for model in [Kind::Hold, Kind::Patch, Kind::Predictive] {
        match Case::new(model, Guard::SystemCalls).run() {
            Some(Ended::Well(found)) => assert_at_work(&found),
            Some(Ended::Signal(signal, err)) => panic!("{model:?} was ended by signal {signal}: {err}"),
            None => {}
        }
    }
}

#[test]
fn a_tick_faults_no_page_and_waits_for_nothing_but_its_sleep() {
    let Some(Ended::Well(found)) = Case::new(Kind::Predictive, Guard::Counters).run() else { panic!("no counters") };
    assert_at_work(&found);
    assert_eq!(found.faults, [0, 0], "{found:?}");
    assert!(found.most_waits <= 1 && found.waits <= found.ticks as i64, "{found:?}");
}

/// The guard sees what it is there for.
#[test]
fn a_tick_that_calls_the_system_is_caught() {
    let case = Case::new(Kind::Predictive, Guard::SystemCalls).with(Offence::Call);
    assert!(matches!(case.run(), None | Some(Ended::Signal(..))));
}

#[test]
#[ignore = "a part of the other tests: it runs in a process that they start"]
fn the_guarded_session() {
    ELSEWHERE.set(over_zenoh).unwrap();
    child();
}
