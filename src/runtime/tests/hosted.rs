//! Hosted groups: releases on a thread of the program's own, at whatever pace it keeps.

use palpate_runtime::{
    Actor, ActorTimes, Execution, GroupMode, HostRelease, HostedGroup, Nanos, Outcome, OverrunPolicy, RateGroup,
    Restart, RunningGraph, Runtime, RuntimeFaultKind, STOP_BOUND, TickContext, actor_fn,
};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

/// What the hosted actor was called with: tick, mode and thread.
type Calls = Arc<Mutex<Vec<(u64, GroupMode, std::thread::ThreadId)>>>;

fn noting(calls: &Calls) -> Box<dyn Actor> {
    let calls = Arc::clone(calls);
    actor_fn("noting", move |ctx: &TickContext| {
        calls.lock().unwrap().push((ctx.tick, ctx.mode, std::thread::current().id()));
        Outcome::Continue
    })
}

/// A hosted group at 1 kHz beside one at 100 Hz that counts its releases.
fn started(group: RateGroup, actor: Box<dyn Actor>) -> (RunningGraph, HostedGroup) {
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(group.name("haptic").hosted(), vec![actor]);
    graph.group(RateGroup::hz(100).name("other"), vec![actor_fn("other", |_| Outcome::Continue)]);
    let mut running = graph.build().unwrap().start().unwrap();
    let hosted = running.take_hosted("haptic").unwrap();
    assert!(running.take_hosted("haptic").is_none() && running.take_hosted("other").is_none());
    (running, hosted)
}

#[test]
fn releases_run_on_the_thread_that_calls_and_keep_the_nominal_grid() {
    let calls = Calls::default();
    let (running, mut haptic) = started(RateGroup::hz(1000), noting(&calls));
    let (start, mut ran) = (Instant::now(), 0);
    while start.elapsed() < Duration::from_millis(60) {
        ran += u64::from(haptic.release() == HostRelease::Ran);
    }
    drop(haptic);
    let report = running.stop();
    assert_eq!(report.fault, None);
    let books = &report.groups[0];
    assert_eq!(books.released, ran);
    assert_eq!(books.released + books.skipped, books.elapsed_periods);
    // A host that spins loses no period but to the machine, and runs none ahead of its time.
    assert!(books.elapsed_periods >= 55 && books.elapsed_periods <= 70, "{books:?}");
    let calls = calls.lock().unwrap();
    assert!(calls.iter().all(|(_, _, thread)| *thread == std::thread::current().id()));
    assert!(calls.windows(2).all(|pair| pair[1].0 > pair[0].0));
}

// Check that what each actor takes is recorded as of a group with a thread of its own.
#[test]
fn several_actors_of_a_hosted_group_are_timed_apart() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let spinning = actor_fn("spinning", |_| {
        let start = Instant::now();
        while start.elapsed() < Duration::from_micros(300) {}
        Outcome::Continue
    });
    let idle = actor_fn("idle", |_| Outcome::Continue);
    graph.group(RateGroup::hz(1000).name("haptic").hosted(), vec![idle, spinning]);
    let mut running = graph.build().unwrap().start().unwrap();
    let mut haptic = running.take_hosted("haptic").unwrap();
    assert_eq!(haptic.release(), HostRelease::Ran);
    drop(haptic);
    running.stop();
    let mut records = Vec::new();
    drain.drain(&mut records);
    let times: Vec<ActorTimes> = records.iter().filter_map(ActorTimes::from_record).collect();
    assert_eq!((times.len(), times[0].actors), (1, 2));
    assert!(times[0].spent()[1] >= Nanos(300_000), "{times:?}");
}

#[test]
fn time_begins_with_the_first_release_for_all_groups() {
    let (running, mut haptic) = started(RateGroup::hz(1000), noting(&Calls::default()));
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!((running.elapsed(), haptic.elapsed()), (Nanos::ZERO, Nanos::ZERO));
    assert_eq!(running.live()[1].released, 0, "nobody runs ahead of the host");
    assert_eq!(haptic.release(), HostRelease::Ran);
    running.wait_for(Duration::from_millis(100));
    drop(haptic);
    let report = running.stop();
    assert_eq!((report.groups[0].released, report.groups[0].skipped), (1, 0), "what waited is no slip");
    assert!(report.groups[1].released > 2);
}

#[test]
fn a_period_has_one_release_and_a_pause_is_skipped() {
    let (running, mut haptic) = started(RateGroup::hz(10), noting(&Calls::default()));
    assert_eq!(haptic.release(), HostRelease::Ran);
    // Release 1 is open from an eighth of its period on.
    assert_eq!([haptic.release(), haptic.release()], [HostRelease::Early; 2]);
    std::thread::sleep(Duration::from_millis(420));
    assert_eq!(haptic.release(), HostRelease::Ran);
    drop(haptic);
    let report = running.stop();
    let books = &report.groups[0];
    assert_eq!(books.released, 2);
    assert!(books.skipped >= 3, "{books:?}");
    assert_eq!(books.slips.total(), books.skipped);
}

#[test]
fn a_stop_winds_down_by_the_releases_that_follow() {
    let calls = Calls::default();
    let (running, mut haptic) = started(RateGroup::hz(1000).wind_down(Nanos(20 * MS)), noting(&calls));
    haptic.release();
    running.request_stop();
    let start = Instant::now();
    while haptic.release() != HostRelease::Ended {
        assert!(start.elapsed() < Duration::from_secs(5));
        std::thread::yield_now();
    }
    assert_eq!(haptic.release(), HostRelease::Ended);
    drop(haptic);
    assert_eq!(running.stop().fault, None);
    let stopping = calls.lock().unwrap().iter().filter(|(_, mode, _)| *mode == GroupMode::Stopping).count();
    assert!((1..=20).contains(&stopping), "{stopping}");
}

#[test]
fn a_panic_stops_at_the_release_and_is_in_the_report() {
    let panics = actor_fn("panics", |ctx: &TickContext| match ctx.tick {
        0 => Outcome::Continue,
        _ => panic!("deliberate"),
    });
    let (running, mut haptic) = started(RateGroup::hz(1000), panics);
    while haptic.release() != HostRelease::Ended {
        std::thread::yield_now();
    }
    drop(haptic);
    let fault = running.stop().fault.unwrap();
    assert_eq!((fault.group.as_str(), fault.kind), ("haptic", RuntimeFaultKind::Panic));
    assert!(fault.what.contains("deliberate"), "{fault}");
}

#[test]
fn a_release_that_the_overrun_policy_stops_has_not_run() {
    for wind_down in [Nanos::ZERO, Nanos(50 * MS)] {
        let group = RateGroup::hz(100).overrun(OverrunPolicy::Stop).wind_down(wind_down);
        let (running, mut haptic) = started(group, noting(&Calls::default()));
        let mut ran = u64::from(haptic.release() == HostRelease::Ran);
        // A host that pauses for some periods.
        std::thread::sleep(Duration::from_millis(60));
        loop {
            match haptic.release() {
                HostRelease::Ran => ran += 1,
                HostRelease::Early => std::thread::yield_now(),
                HostRelease::Ended => break,
            }
        }
        drop(haptic);
        let report = running.stop();
        let fault = report.fault.unwrap();
        assert!(matches!(fault.kind, RuntimeFaultKind::Overrun { .. }), "{fault}");
        assert_eq!(report.groups[0].released, ran);
    }
}

#[test]
fn a_group_that_nobody_took_or_that_is_dropped_keeps_no_stop_waiting() {
    let start = Instant::now();
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(RateGroup::hz(1000).name("haptic").hosted(), vec![]);
    graph.group(RateGroup::hz(100).name("log").observer(), vec![]);
    assert_eq!(graph.build().unwrap().start().unwrap().stop().fault, None);
    let (running, haptic) = started(RateGroup::hz(1000), noting(&Calls::default()));
    drop(haptic);
    running.wait_for(Duration::MAX);
    assert_eq!(running.stop().fault, None);
    assert!(start.elapsed() < STOP_BOUND);
}

#[test]
fn a_host_that_holds_its_group_and_does_not_come_is_given_up() {
    let (running, haptic) = started(RateGroup::hz(1000), noting(&Calls::default()));
    let fault = running.stop().fault.unwrap();
    assert_eq!((fault.group.as_str(), fault.kind), ("haptic", RuntimeFaultKind::GivenUp));
    drop(haptic);
}

#[test]
fn virtual_time_releases_it_by_the_clock() {
    let calls = Calls::default();
    let mut graph = Runtime::builder(Execution::Virtual);
    graph.group(RateGroup::hz(1000).name("haptic").hosted(), vec![noting(&calls)]);
    let mut running = graph.build().unwrap().start().unwrap();
    assert!(running.take_hosted("haptic").is_none());
    running.wait_for(Duration::ZERO);
    assert_eq!(calls.lock().unwrap().len(), 1);
    running.wait_for(Duration::from_millis(5));
    assert_eq!(running.stop().groups[0].released, 6);
}

#[test]
fn a_hosted_group_cannot_be_restartable() {
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.restartable(RateGroup::hz(1000).hosted(), Restart::default(), || Ok(vec![]));
    let error = graph.build().unwrap_err().to_string();
    assert!(error.contains("hosted"), "{error}");
}
