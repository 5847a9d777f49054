//! What threads do with one session at the same time, and what they are told of it.

use palpate_ffi::exports::{run, setup, show};
use palpate_ffi::{PalpateCode, PalpateContact, PalpateSession, PalpateSetup};
use std::ptr::null_mut;
use std::time::{Duration, Instant};

/// A wait that nobody would see the end of (s).
const FOREVER_S: f64 = 3600.0;
/// Far above what a stop takes, far below a wait.
const SOON: Duration = Duration::from_secs(20);

#[track_caller]
fn ok(code: PalpateCode) {
    assert_eq!(code, PalpateCode::Ok);
}

/// The built-in scene without an end; the tool presses the upper face and stays there.
fn demo(is_virtual: bool) -> PalpateSession {
    let (mut made, mut session) = (PalpateSetup::default(), PalpateSession::default());
    let (times_s, places_m) = ([0.0, 0.3], [0.05, 0.05, 0.102, 0.05, 0.05, 0.09]);
    // SAFETY: every pointer is to a value of our own.
    unsafe {
        ok(setup::palpate_setup_demo(&mut made));
        ok(setup::palpate_setup_path(made, times_s.as_ptr(), places_m.as_ptr(), times_s.len()));
        ok(setup::palpate_setup_duration(made, 1e6));
        ok(setup::palpate_setup_share_contacts(made));
        if is_virtual {
            ok(setup::palpate_setup_virtual_time(made));
        }
        ok(run::palpate_start(made, &mut session));
    }
    session
}

fn progress(session: PalpateSession) -> (f64, bool) {
    let (mut time_s, mut ended) = (0.0, 0);
    // SAFETY: both pointers are to values of our own.
    ok(unsafe { run::palpate_progress(session, &mut time_s, &mut ended) });
    (time_s, ended != 0)
}

fn stop(session: PalpateSession) -> PalpateCode {
    // SAFETY: no summary is asked for.
    unsafe { run::palpate_stop(session, null_mut()) }
}

/// One thread waits; another looks how far it is, and stops it.
#[track_caller]
fn assert_stoppable_while_another_waits(is_virtual: bool) {
    let session = demo(is_virtual);
    let waits = std::thread::spawn(move || run::palpate_wait(session, FOREVER_S));
    // The wait has begun, or soon does: both are asked for again and again.
    std::thread::sleep(Duration::from_millis(200));
    let asked = Instant::now();
    let looks: Vec<_> = (0..20).map(|_| progress(session)).collect();
    assert!(looks.iter().all(|&(time_s, ended)| time_s < FOREVER_S && !ended), "{looks:?}");
    assert!(looks.is_sorted(), "{looks:?}");
    ok(stop(session));
    ok(waits.join().unwrap());
    assert!(asked.elapsed() < SOON, "it took {:?}", asked.elapsed());
    assert_eq!(run::palpate_wait(session, FOREVER_S), PalpateCode::BadHandle);
}

// Check that a wait keeps nobody from the session.
#[test]
fn a_session_is_looked_at_and_stopped_while_another_thread_waits() {
    assert_stoppable_while_another_waits(false);
}

// Check the same where the waiting thread is the one that runs the session.
#[test]
fn a_session_in_virtual_time_is_looked_at_and_stopped_while_another_thread_runs_it() {
    assert_stoppable_while_another_waits(true);
}

// Check that slices of virtual time add up.
#[test]
fn a_wait_in_virtual_time_runs_exactly_as_much_as_it_was_told() {
    let session = demo(true);
    for (seconds, total_s) in [(0.25, 0.25), (0.0, 0.25), (0.1234, 0.3734)] {
        ok(run::palpate_wait(session, seconds));
        assert!((progress(session).0 - total_s).abs() < 1e-8, "{} s", progress(session).0);
    }
    ok(stop(session));
}

fn contacts(session: PalpateSession) -> Vec<PalpateContact> {
    const ROOM: usize = 16;
    let mut contacts = Vec::with_capacity(ROOM);
    let mut count = 0;
    // SAFETY: there is room for that many, and those that were counted are written if that is fewer.
    unsafe {
        ok(show::palpate_contacts(session, contacts.as_mut_ptr(), ROOM, &mut count));
        contacts.set_len(count);
    }
    contacts
}

// Check that they are those of now, however long nobody has asked.
#[test]
fn contacts_are_the_newest_also_if_nobody_asked_for_long() {
    let session = demo(true);
    for seconds in [1.0, 9.0] {
        ok(run::palpate_wait(session, seconds));
        let (now_s, places) = (progress(session).0, contacts(session));
        assert!(!places.is_empty(), "no contact at {now_s} s");
        assert!(places.iter().all(|place| (0.09..0.16).contains(&(now_s - place.time_s))), "{now_s} s: {places:?}");
    }
    ok(stop(session));
}
