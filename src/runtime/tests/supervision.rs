//! Wind-down, restarts, overrun policies and device-paced groups together: what one of them does, the others must bear.

mod device_clock;
#[macro_use]
mod support;

use device_clock::DeviceClock;
use palpate_runtime::{
    Actor, Disturbance, Execution, GroupMode, Nanos, Outcome, OverrunPolicy, RateGroup, Restart, Runtime,
    RuntimeBuilder, RuntimeFaultKind, RuntimeReport, SlipCause, TickContext, actor_fn,
};
use std::collections::HashSet;
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

in_both_executions! {
    a_fault_during_the_wind_down_takes_nothing_from_the_other_actors
    the_first_panic_may_come_during_the_wind_down
    a_group_out_of_restarts_winds_down
    a_group_that_winds_down_is_not_started_again
    the_stop_policy_is_not_answered_by_a_restart
    time_lost_in_a_restart_is_no_overrun
    a_factory_that_panics_stops_the_run_and_says_where
    a_silent_device_takes_no_time_from_the_wind_down
    a_stop_that_was_requested_before_takes_no_time_from_the_wind_down
}

type Calls = Arc<Mutex<Vec<(GroupMode, u64)>>>;

/// Writes down its calls; fails from release `fails_at` on, and goes on after a panic if it `recovers`.
struct Caller {
    calls: Calls,
    fails_at: u64,
    recovers: bool,
}

impl Actor for Caller {
    fn name(&self) -> &str {
        "caller"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.calls.lock().unwrap().push((ctx.mode, ctx.tick));
        assert!(ctx.tick < self.fails_at, "injected");
        Outcome::Continue
    }

    fn recover(&mut self) -> bool {
        self.fails_at = u64::MAX;
        self.recovers
    }
}

fn fails_at(tick: u64, calls: &Calls) -> Box<dyn Actor> {
    Box::new(Caller { calls: Arc::clone(calls), fails_at: tick, recovers: false })
}

fn finish(graph: &mut RuntimeBuilder) -> RuntimeReport {
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(20));
    let report = running.stop();
    for group in &report.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods, "{group:?}");
        assert_eq!(group.slips.total(), group.skipped, "{group:?}");
    }
    report
}

fn stopping(calls: &Calls) -> Vec<u64> {
    calls.lock().unwrap().iter().filter(|call| call.0 == GroupMode::Stopping).map(|call| call.1).collect()
}

/// Check that the wind-down had its whole length: 30 periods, of which the host may have cost some.
#[track_caller]
fn assert_whole_wind_down(calls: &Calls, report: &RuntimeReport) {
    let (stopping, group) = (stopping(calls), &report.groups[0]);
    assert!(!stopping.is_empty() && stopping.len() as u64 + group.skipped >= 30, "{stopping:?} {group:?}");
    assert!(group.elapsed_periods - stopping[0] <= 30 && stopping.len() <= 30, "{stopping:?} {group:?}");
}

fn a_stop_that_was_requested_before_takes_no_time_from_the_wind_down(execution: Execution) {
    let calls = Calls::default();
    let mut graph = Runtime::builder(execution);
    let group = RateGroup::hz(1000).wind_down(Nanos(30 * MS));
    let running = graph.group(group, vec![fails_at(u64::MAX, &calls)]).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(20));
    running.request_stop();
    // Some of the wind-down, but not all of it.
    running.wait_for(Duration::from_millis(10));
    assert_whole_wind_down(&calls, &running.stop());
}

fn a_fault_during_the_wind_down_takes_nothing_from_the_other_actors(execution: Execution) {
    let (well, first, second) = (Calls::default(), Calls::default(), Calls::default());
    let mut graph = Runtime::builder(execution);
    let seen = Arc::clone(&second);
    let fails_stopping = actor_fn("second", move |ctx| {
        seen.lock().unwrap().push((ctx.mode, ctx.tick));
        assert!(ctx.mode != GroupMode::Stopping, "injected");
        Outcome::Continue
    });
    let actors = vec![fails_at(u64::MAX, &well), fails_at(20, &first), fails_stopping];
    let report = finish(graph.group(RateGroup::hz(1000).wind_down(Nanos(30 * MS)), actors));
    assert!(report.fault.as_ref().is_some_and(|fault| fault.actor == "caller"), "{:?}", report.fault);
    assert_whole_wind_down(&well, &report);
    assert!(stopping(&first).is_empty());
    // Check that the second failed while it was winding down, once
    assert_eq!(stopping(&second).len(), 1, "{second:?}");
}

fn the_first_panic_may_come_during_the_wind_down(execution: Execution) {
    let calls = Calls::default();
    let actor = Caller { calls: Arc::clone(&calls), fails_at: 30, recovers: true };
    let mut graph = Runtime::builder(execution);
    let group = RateGroup::hz(1000).wind_down(Nanos(30 * MS)).wind_down_at_end();
    let report = finish(graph.group(group, vec![Box::new(actor)]).until(Nanos(20 * MS)));
    assert!(report.fault.is_some());
    // Check that it goes on after its panic, in place of being dropped with all that it holds
    let after = stopping(&calls).iter().filter(|&&tick| tick > 31).count() as u64;
    assert!(after + report.groups[0].skipped >= 18, "{:?}", stopping(&calls));
}

fn a_group_out_of_restarts_winds_down(execution: Execution) {
    let well = Calls::default();
    let (seen, mut made) = (Arc::clone(&well), 0);
    let factory = move || {
        made += 1;
        let failing = Calls::default();
        Ok(vec![fails_at(u64::MAX, &seen), fails_at(20 * made, &failing)])
    };
    let mut graph = Runtime::builder(execution);
    let group = RateGroup::hz(1000).wind_down(Nanos(30 * MS));
    let restart = Restart { at_most: 1, ..Restart::default() };
    let report = finish(graph.restartable(group, restart, factory));
    assert_eq!(report.restarts.len(), 1);
    assert!(report.fault.is_some());
    assert_whole_wind_down(&well, &report);
}

fn a_group_that_winds_down_is_not_started_again(execution: Execution) {
    let (well, mut made) = (Calls::default(), 0);
    let seen = Arc::clone(&well);
    let count = Arc::new(Mutex::new(0));
    let counted = Arc::clone(&count);
    let factory = move || {
        made += 1;
        *counted.lock().unwrap() = made;
        Ok(vec![fails_at(u64::MAX, &seen), fails_at(25, &Calls::default())])
    };
    let mut graph = Runtime::builder(execution);
    let group = RateGroup::hz(1000).wind_down(Nanos(30 * MS)).wind_down_at_end();
    let report = finish(graph.restartable(group, Restart::default(), factory).until(Nanos(20 * MS)));
    assert_eq!((report.restarts.len(), *count.lock().unwrap()), (0, 1));
    assert!(report.fault.is_some());
    assert_whole_wind_down(&well, &report);
    // Check that nothing runs in normal mode after the end
    assert!(well.lock().unwrap().iter().all(|&(mode, tick)| (mode == GroupMode::Stopping) == (tick > 20)), "{well:?}");
}

/// Its release `long` and those right after it overrun by some periods, in the way of the execution.
fn overruns_at(graph: &mut RuntimeBuilder, execution: Execution, long: u64) -> Box<dyn Actor> {
    if execution == Execution::Virtual {
        graph.disturb("g", move |release| Disturbance {
            work: Nanos(if release == long { 5 * MS } else { 0 }),
            ..Disturbance::default()
        });
    }
    let mut done = false;
    actor_fn("a", move |ctx| {
        if execution == Execution::Threaded && ctx.tick >= long && !std::mem::replace(&mut done, true) {
            std::thread::sleep(Duration::from_millis(5));
        }
        Outcome::Continue
    })
}

fn the_stop_policy_is_not_answered_by_a_restart(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let actor = overruns_at(&mut graph, execution, 20);
    let mut actors = Some(vec![actor]);
    let factory = move || Ok(actors.take().expect("it is made once"));
    let group = RateGroup::hz(1000).name("g").overrun(OverrunPolicy::Stop);
    let report = finish(graph.restartable(group, Restart::default(), factory));
    assert_eq!(report.restarts, []);
    let fault = report.fault.unwrap();
    assert!(fault.what.starts_with("stopped by its overrun policy"), "{fault}");
}

fn time_lost_in_a_restart_is_no_overrun(execution: Execution) {
    // The host may stop everything, which then is an overrun: some attempts, of which one has to pass.
    let attempt = || {
        let mut graph = Runtime::builder(execution);
        let mut made = 0;
        let factory = move || {
            made += 1;
            if made > 1 {
                std::thread::sleep(Duration::from_millis(30));
            }
            Ok(vec![fails_at(if made == 1 { 10 } else { u64::MAX }, &Calls::default())])
        };
        let group = RateGroup::hz(100).overrun(OverrunPolicy::Stop);
        finish(graph.restartable(group, Restart::default(), factory).until(Nanos(300 * MS)))
    };
    let passed = |report: &RuntimeReport| {
        // A stall before the failure has ended the run without a restart.
        assert!(
            report.restarts.len() == 1
                || report.fault.as_ref().is_some_and(|fault| matches!(fault.kind, RuntimeFaultKind::Overrun { .. })),
            "{report}"
        );
        report.fault.is_none()
    };
    let report = (0..5).map(|_| attempt()).find(passed).expect("one attempt without a stall");
    let slips = report.groups[0].slips;
    assert_eq!(slips.total(), slips.of(SlipCause::Fault));
    assert_eq!(slips.total() > 0, execution == Execution::Threaded);
}

fn a_factory_that_panics_stops_the_run_and_says_where(execution: Execution) {
    let mut made = 0;
    let factory = move || {
        made += 1;
        assert!(made == 1, "no spare part");
        Ok(vec![fails_at(3, &Calls::default())])
    };
    let mut graph = Runtime::builder(execution);
    let report = finish(graph.restartable(RateGroup::hz(100).name("g"), Restart::default(), factory));
    let fault = report.fault.unwrap().to_string();
    assert!(fault.contains("injected") && fault.contains("could not be started again"), "{fault}");
    assert!(fault.contains("factory: panicked at src/runtime/tests/supervision.rs:"), "{fault}");
    assert!(fault.ends_with("no spare part"), "{fault}");
}

/// Waits for a device that falls silent.
struct Waiting(DeviceClock, Calls);

impl Actor for Waiting {
    fn name(&self) -> &str {
        "waiting"
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        self.0.wait(timeout.to_duration())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.1.lock().unwrap().push((ctx.mode, ctx.tick));
        Outcome::Continue
    }
}

fn a_silent_device_takes_no_time_from_the_wind_down(execution: Execution) {
    let calls = Calls::default();
    let clock = DeviceClock::new(Duration::from_millis(1), [Duration::from_millis(50), Duration::from_secs(9)]);
    let mut graph = Runtime::builder(execution);
    if execution == Execution::Virtual {
        graph.disturb("g", |release| Disturbance {
            stall: Nanos(if release == 50 { 9000 * MS } else { 0 }),
            ..Disturbance::default()
        });
    }
    let group = RateGroup::hz(1000).name("g").device_paced(Nanos(1000 * MS)).wind_down(Nanos(30 * MS));
    let running = graph.group(group, vec![Box::new(Waiting(clock, Arc::clone(&calls)))]).build().unwrap();
    let running = running.start().unwrap();
    running.wait_for(Duration::from_millis(150));
    let report = running.stop();
    let group = &report.groups[0];
    assert_eq!((report.fault, group.released + group.skipped), (None, group.elapsed_periods));
    // Check that the clock releases it from the stop on: the periods before are the device's, the rest is wind-down. On
    // threads the stop is noticed within a slice of 50 ms.
    let stopping = stopping(&calls);
    assert!(!stopping.is_empty() && stopping.len() <= 30, "{stopping:?}");
    assert!(group.slips.of(SlipCause::StalledPeer) >= 90, "{group:?}");
    assert!(execution == Execution::Threaded || (stopping.len(), group.watchdog_takeovers) == (30, 0), "{group:?}");
}

#[test]
fn a_device_that_is_waited_for_is_no_hung_thread() {
    let silent = [Duration::from_millis(50), Duration::from_millis(400)];
    let factory = move || {
        let clock = DeviceClock::new(Duration::from_millis(1), silent);
        Ok(vec![Box::new(Waiting(clock, Calls::default())) as Box<dyn Actor>])
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    let group = RateGroup::hz(1000).device_paced(Nanos(1000 * MS));
    let restart = Restart { hung_after: Nanos(100 * MS), ..Restart::default() };
    let report = finish(graph.restartable(group, restart, factory).until(Nanos(600 * MS)));
    assert_eq!((report.fault, report.restarts), (None, vec![]));
}

/// Does not come back from its wait until it is let go, and then says that there is a frame.
struct Held(Arc<Mutex<std::sync::mpsc::Receiver<()>>>, Calls);

impl Actor for Held {
    fn name(&self) -> &str {
        "held"
    }

    fn wait(&mut self, _: Nanos) -> bool {
        let _ = self.0.lock().unwrap().recv();
        true
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.1.lock().unwrap().push((ctx.mode, ctx.tick));
        Outcome::Continue
    }
}

#[test]
fn a_thread_that_was_left_behind_in_its_wait_releases_nothing_when_it_comes_back() {
    let (old, new) = (Calls::default(), Calls::default());
    let (let_go, held) = channel::<()>();
    let held = Arc::new(Mutex::new(held));
    let (old_calls, new_calls, mut made) = (Arc::clone(&old), Arc::clone(&new), 0);
    let factory = move || {
        made += 1;
        let clock = DeviceClock::new(Duration::from_millis(1), [Duration::MAX; 2]);
        Ok(vec![match made {
            1 => Box::new(Held(Arc::clone(&held), Arc::clone(&old_calls))) as Box<dyn Actor>,
            _ => Box::new(Waiting(clock, Arc::clone(&new_calls))),
        }])
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    let group = RateGroup::hz(1000).device_paced(Nanos(10 * MS));
    let restart = Restart { hung_after: Nanos(100 * MS), ..Restart::default() };
    let running = graph.restartable(group, restart, factory).build().unwrap().start().unwrap();
    let begun = Instant::now();
    while new.lock().unwrap().len() < 50 {
        assert!(begun.elapsed() < Duration::from_secs(20), "the group was not started again");
        running.wait_for(Duration::from_millis(5));
    }
    drop(let_go);
    running.wait_for(Duration::from_millis(100));
    let report = running.stop();
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    assert!(old.lock().unwrap().is_empty());
    // Check that the books never counted a release of the old one
    assert_eq!(new.lock().unwrap().len() as u64, report.groups[0].released);
}

#[test]
fn nobody_waits_for_a_factory_that_takes_long() {
    let (let_go, held) = channel::<()>();
    let mut made = 0;
    let factory = move || {
        made += 1;
        if made == 2 {
            let _ = held.recv();
        }
        Ok(vec![fails_at(if made == 1 { 3 } else { u64::MAX }, &Calls::default())])
    };
    let fast = Calls::default();
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(RateGroup::hz(1000).name("fast"), vec![fails_at(u64::MAX, &fast)]);
    graph.restartable(RateGroup::hz(100).name("slow"), Restart::default(), factory);
    let running = graph.until(Nanos(500 * MS)).build().unwrap().start().unwrap();
    // Check that the program's questions are answered while the factory is held: it is let go only afterwards
    for _ in 0..20 {
        running.wait_for(Duration::from_millis(10));
        assert!(!running.finished() && running.elapsed() > Nanos::ZERO);
    }
    assert!(fast.lock().unwrap().len() > 10);
    drop(let_go);
    running.wait_for(Duration::from_secs(20));
    let report = running.stop();
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    assert!(report.groups[1].slips.of(SlipCause::Fault) >= 10, "{:?}", report.groups[1]);
    assert_eq!(report.grant.groups.len(), 2);
}

#[test]
fn a_disturbance_is_asked_once_for_each_release_also_when_the_group_winds_down_or_is_started_again() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&asked);
    let mut graph = Runtime::builder(Execution::Virtual);
    graph.disturb("g", move |release| {
        sink.lock().unwrap().push(release);
        Disturbance::default()
    });
    let mut made = 0;
    let factory = move || {
        made += 1;
        Ok(vec![fails_at(if made == 1 { 5 } else { u64::MAX }, &Calls::default())])
    };
    let group = RateGroup::hz(1000).name("g").wind_down(Nanos(10 * MS));
    let running = graph.restartable(group, Restart::default(), factory).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(20));
    let report = running.stop();
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().collect::<HashSet<_>>().len(), asked.len(), "{asked:?}");
    assert_eq!(asked.len() as u64, report.groups[0].released);
}

#[test]
fn an_observer_that_asks_for_restarts_is_refused() {
    for execution in [Execution::Virtual, Execution::Threaded] {
        let mut graph = Runtime::builder(execution);
        graph.group(RateGroup::hz(100), vec![]);
        graph.restartable(RateGroup::hz(10).name("log").observer(), Restart::default(), || Ok(vec![]));
        let error = graph.build().unwrap_err().to_string();
        assert!(error.contains("rate group `log`") && error.contains("observer cannot be restartable"), "{error}");
    }
}
