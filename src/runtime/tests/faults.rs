//! What happens when actors fail: wind-down, restart, threads left behind; in both executions where both can show it.

#[macro_use]
mod support;

use palpate_runtime::{
    Actor, Event, Execution, GroupMode, Nanos, Outcome, RateGroup, Record, Restart, Runtime, RuntimeBuilder,
    RuntimeFaultKind, RuntimeReport, SlipCause, TickContext, actor_fn,
};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

in_both_executions! {
    a_group_winds_down_without_the_actor_that_failed
    a_group_winds_down_when_a_stop_is_requested
    a_group_winds_down_at_the_end_if_it_asked_for_that
    a_failed_group_is_started_again_and_the_others_do_not_notice
    a_group_that_fails_too_often_stops_the_run
    a_restart_that_fails_stops_the_run_and_says_why
    values_and_samples_reach_the_restarted_group_and_come_back
    a_panic_whose_payload_panics_is_contained
    every_actor_may_fail_in_the_wind_down_and_the_group_ends_with_its_sums
    an_observers_fault_does_not_hide_the_one_that_ends_the_run
}

/// GroupMode and release of every call.
type Calls = Arc<Mutex<Vec<(GroupMode, u64)>>>;

/// Writes down how it is called; the first call from release `panic_at` on fails (that one may have been skipped).
struct Caller {
    calls: Calls,
    panic_at: Option<u64>,
    stopped: Sender<()>,
}

impl Actor for Caller {
    fn name(&self) -> &str {
        "caller"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        assert!(self.panic_at.is_none_or(|tick| ctx.tick < tick), "injected");
        self.calls.lock().unwrap().push((ctx.mode, ctx.tick));
        Outcome::Continue
    }

    fn stop(&mut self, _: &TickContext) {
        self.stopped.send(()).unwrap();
    }
}

fn caller(panic_at: Option<u64>) -> (Box<dyn Actor>, Calls, Receiver<()>) {
    let (calls, (stopped, stops)) = (Calls::default(), channel());
    (Box::new(Caller { calls: Arc::clone(&calls), panic_at, stopped }), calls, stops)
}

fn finish(graph: &mut RuntimeBuilder) -> RuntimeReport {
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(20));
    running.stop()
}

#[track_caller]
fn assert_identity(report: &RuntimeReport) {
    for group in &report.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods, "{group:?}");
        assert_eq!(group.slips.total(), group.skipped, "{group:?}");
    }
}

fn stopping(calls: &Calls) -> Vec<u64> {
    calls.lock().unwrap().iter().filter(|call| call.0 == GroupMode::Stopping).map(|call| call.1).collect()
}

fn a_group_winds_down_without_the_actor_that_failed(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (failing, failing_calls, failing_stops) = caller(Some(20));
    let (other, other_calls, other_stops) = caller(None);
    graph.group(RateGroup::hz(1000).wind_down(Nanos(30 * MS)), vec![other, failing]);
    let report = finish(&mut graph);
    assert_identity(&report);
    let fault = report.fault.unwrap();
    assert!(fault.what.contains("/faults.rs:") && fault.what.ends_with("injected"), "{fault}");
    // Check that the failed one is not called again and is stopped once, the other runs on for 30 periods
    assert!(failing_calls.lock().unwrap().iter().all(|call| call.0 == GroupMode::Normal && call.1 < 20));
    assert_eq!(failing_stops.iter().count(), 1);
    assert_eq!(other_stops.iter().count(), 1);
    let stopping = stopping(&other_calls);
    let failed = other_calls.lock().unwrap().iter().filter(|call| call.0 == GroupMode::Normal).map(|call| call.1).max();
    let failed = failed.unwrap();
    assert!(failed >= 20 && stopping.iter().all(|tick| (failed + 1..=failed + 30).contains(tick)), "{stopping:?}");
    let skipped = report.groups[0].skipped as usize;
    assert!(stopping.len() + skipped >= 30 && stopping.len() <= 30, "{stopping:?}");
}

fn a_group_winds_down_when_a_stop_is_requested(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (actor, calls, _stops) = caller(None);
    graph.group(RateGroup::hz(1000).wind_down(Nanos(30 * MS)), vec![actor]);
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(50));
    let report = running.stop();
    assert_identity(&report);
    assert_eq!(report.fault, None);
    let stopping = stopping(&calls);
    assert!(!stopping.is_empty() && stopping.last().unwrap() - stopping[0] < 30, "{stopping:?}");
    assert_eq!(*stopping.last().unwrap() + 1, report.groups[0].elapsed_periods);
}

fn a_group_winds_down_at_the_end_if_it_asked_for_that(execution: Execution) {
    for at_end in [false, true] {
        let mut graph = Runtime::builder(execution);
        let (actor, calls, _stops) = caller(None);
        let group = RateGroup::hz(1000).wind_down(Nanos(20 * MS));
        graph.group(if at_end { group.wind_down_at_end() } else { group }, vec![actor]).until(Nanos(40 * MS));
        let report = finish(&mut graph);
        assert_identity(&report);
        let group = &report.groups[0];
        let (planned, stopping) = (if at_end { 61 } else { 41 }, stopping(&calls));
        assert_eq!(stopping.is_empty(), !at_end);
        // Check that only periods that were overdue when it began to wind down, and so were skipped, come on top
        let overdue = group.elapsed_periods.checked_sub(planned).unwrap();
        assert!(overdue <= if at_end { group.skipped } else { 0 }, "{group:?}");
        assert!(stopping.iter().all(|tick| tick + 20 >= group.elapsed_periods), "{stopping:?}");
    }
}

/// A 1 kHz witness and a 100 Hz group whose n-th set of actors fails from release `fail_at[n]` on.
fn graph_that_fails(execution: Execution, fail_at: &'static [u64], at_most: u32) -> (RuntimeReport, Vec<Record>, u64) {
    let mut graph = Runtime::builder(execution);
    let mut drain = graph.drain();
    let made = Arc::new(Mutex::new(0_u64));
    let count = Arc::clone(&made);
    let factory = move || {
        let mut made = count.lock().unwrap();
        let fail_at = fail_at.get(*made as usize).copied();
        *made += 1;
        Ok(vec![actor_fn("slow", move |ctx: &TickContext| {
            assert!(fail_at.is_none_or(|tick| ctx.tick < tick), "injected");
            Outcome::Continue
        })])
    };
    graph.group(RateGroup::hz(1000).name("fast"), vec![]);
    graph.restartable(RateGroup::hz(100).name("slow"), Restart { at_most, ..Restart::default() }, factory);
    graph.until(Nanos(300 * MS));
    let report = finish(&mut graph);
    let mut records = Vec::new();
    drain.drain(&mut records);
    let made = *made.lock().unwrap();
    (report, records, made)
}

fn a_failed_group_is_started_again_and_the_others_do_not_notice(execution: Execution) {
    let (report, records, made) = graph_that_fails(execution, &[5, 12], 3);
    assert_identity(&report);
    assert_eq!(report.fault, None);
    assert_eq!((report.restarts.len(), made), (2, 3));
    let [fast, slow] = &report.groups[..] else { panic!("two groups") };
    assert_eq!(fast.elapsed_periods, 301);
    assert_eq!((fast.slips.of(SlipCause::Fault), fast.slips.of(SlipCause::StalledPeer)), (0, 0));
    // Check that the books go on: the failed releases ran, what was due while the group was down is skipped as such
    assert_eq!(slow.elapsed_periods, 31);
    let restarted = records.iter().filter_map(Event::from_record).filter(|event| event.code == Event::RESTARTED);
    assert_eq!(restarted.map(|event| event.detail).collect::<Vec<_>>(), [1, 2]);
}

fn a_group_that_fails_too_often_stops_the_run(execution: Execution) {
    let (report, _, made) = graph_that_fails(execution, &[3, 6, 9, 12], 2);
    assert_identity(&report);
    assert_eq!((report.restarts.len(), made), (2, 3));
    let fault = report.fault.unwrap();
    assert_eq!((fault.group.as_str(), fault.actor.as_str()), ("slow", "slow"));
    assert!(report.groups[0].elapsed_periods < 301);
    assert_eq!(report.groups.len(), 2);
}

fn a_restart_that_fails_stops_the_run_and_says_why(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let mut made = 0;
    let factory = move || {
        made += 1;
        if made == 2 {
            return Err("no spare part".into());
        }
        Ok(vec![actor_fn("a", |ctx| if ctx.tick >= 3 { Outcome::Fault(9) } else { Outcome::Continue })])
    };
    graph.restartable(RateGroup::hz(100), Restart::default(), factory);
    let report = finish(&mut graph);
    assert_identity(&report);
    let fault = report.fault.unwrap().to_string();
    assert!(fault.contains("reported fault 9") && fault.contains("no spare part"), "{fault}");
}

fn values_and_samples_reach_the_restarted_group_and_come_back(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (up, down) = (graph.queue_port::<u64>(64), graph.exchange_port(|| 0_u64));
    let (mut samples, mut newest) = (up.writer(), down.reader());
    let seen = Arc::new(Mutex::new(Vec::new()));
    let seen_by_fast = Arc::clone(&seen);
    let fast = actor_fn("fast", move |ctx| {
        samples.push(ctx, ctx.tick);
        if newest.refresh(ctx) {
            seen_by_fast.lock().unwrap().push((newest.version(), *newest.get()));
        }
        Outcome::Continue
    });
    let mut fails = true;
    let factory = move || {
        let (mut samples, mut newest) = (up.reader(), down.writer());
        let fail_at = if std::mem::take(&mut fails) { 10 } else { u64::MAX };
        Ok(vec![actor_fn("slow", move |ctx| {
            if let Some(sample) = std::iter::from_fn(|| samples.pop(ctx)).last() {
                *newest.buffer() = sample;
                newest.publish(ctx);
            }
            assert!(ctx.tick < fail_at, "injected");
            Outcome::Continue
        })])
    };
    graph.group(RateGroup::hz(1000).name("fast"), vec![fast]);
    graph.restartable(RateGroup::hz(100).name("slow"), Restart::default(), factory).until(Nanos(400 * MS));
    let report = finish(&mut graph);
    assert_identity(&report);
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    let seen = seen.lock().unwrap();
    // Check that versions and samples only ever grow, and that both go on after the restart
    assert!(seen.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1), "{seen:?}");
    assert!(seen.last().unwrap().1 > 300, "{seen:?}");
}

#[test]
fn a_thread_that_never_returns_is_left_behind_with_its_ports() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let down = graph.exchange_port(|| 0_u64);
    let mut newest = down.reader();
    let seen = Arc::new(Mutex::new(Vec::new()));
    let seen_by_fast = Arc::clone(&seen);
    let fast = actor_fn("fast", move |ctx| {
        if newest.refresh(ctx) {
            seen_by_fast.lock().unwrap().push(*newest.get());
        }
        Outcome::Continue
    });
    let (let_go, held) = channel::<()>();
    let held = Arc::new(Mutex::new(held));
    let hung = Arc::new(Mutex::new(None));
    let hung_at = Arc::clone(&hung);
    let mut incarnation = 0;
    let factory = move || {
        incarnation += 1;
        let (mut newest, held, mine) = (down.writer(), Arc::clone(&held), incarnation);
        let hung_at = Arc::clone(&hung_at);
        Ok(vec![actor_fn("slow", move |ctx| {
            if mine == 1 && ctx.tick >= 5 {
                hung_at.lock().unwrap().get_or_insert(ctx.tick);
                // Until the test is over: then it publishes into nowhere.
                let _ = held.lock().unwrap().recv();
            }
            *newest.buffer() = mine;
            newest.publish(ctx);
            Outcome::Continue
        })])
    };
    let restart = Restart { at_most: 3, hung_after: Nanos(100 * MS) };
    graph.group(RateGroup::hz(1000).name("fast"), vec![fast]);
    graph.restartable(RateGroup::hz(100).name("slow"), restart, factory);
    let running = graph.build().unwrap().start().unwrap();
    let begun = Instant::now();
    while !seen.lock().unwrap().contains(&2) {
        assert!(begun.elapsed() < Duration::from_secs(20), "the group was not started again");
        running.wait_for(Duration::from_millis(10));
    }
    let released_before = seen.lock().unwrap().len();
    drop(let_go);
    running.wait_for(Duration::from_millis(100));
    let report = running.stop();
    assert_identity(&report);
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    assert!(report.restarts[0].what.contains("left behind"), "{}", report.restarts[0]);
    assert!(report.groups[1].slips.of(SlipCause::Fault) >= 10, "{:?}", report.groups[1]);
    // Check that nothing of the old thread is seen after the new one, and its release leaves no record
    let seen = seen.lock().unwrap();
    assert!(seen.len() > released_before && seen.windows(2).all(|pair| pair[0] <= pair[1]), "{seen:?}");
    let mut records = Vec::new();
    drain.drain(&mut records);
    let codes = records.iter().filter_map(Event::from_record).map(|event| event.code);
    // Before that it may be taken for one that gets no processor, on a machine that does not give it any.
    assert_eq!(
        codes.skip_while(|&code| code == Event::STARVED).collect::<Vec<_>>(),
        [Event::ABANDONED, Event::RESTARTED]
    );
    let ticks: Vec<u64> = records
        .iter()
        .filter_map(palpate_runtime::TickTiming::from_record)
        .filter(|timing| timing.group == 1)
        .map(|timing| timing.tick)
        .collect();
    assert!(
        ticks.windows(2).all(|pair| pair[0] < pair[1]) && !ticks.contains(&hung.lock().unwrap().unwrap()),
        "{ticks:?}"
    );
}

#[test]
fn a_thread_that_never_returns_from_the_wind_down_ends_the_run_and_is_not_replaced() {
    let (let_go, held) = channel::<()>();
    let held = Arc::new(Mutex::new(held));
    let (calls, made) = (Calls::default(), Arc::new(Mutex::new(0)));
    let (seen, count) = (Arc::clone(&calls), Arc::clone(&made));
    let factory = move || {
        *count.lock().unwrap() += 1;
        let (seen, held, mut stopping) = (Arc::clone(&seen), Arc::clone(&held), 0);
        Ok(vec![actor_fn("slow", move |ctx| {
            seen.lock().unwrap().push((ctx.mode, ctx.tick));
            stopping += u64::from(ctx.mode == GroupMode::Stopping);
            if stopping == 3 {
                let _ = held.lock().unwrap().recv();
            }
            Outcome::Continue
        })])
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    let group = RateGroup::hz(100).wind_down(Nanos(200 * MS)).wind_down_at_end();
    let restart = Restart { hung_after: Nanos(100 * MS), ..Restart::default() };
    let report = finish(graph.restartable(group, restart, factory).until(Nanos(50 * MS)));
    drop(let_go);
    assert_eq!((report.restarts, *made.lock().unwrap()), (vec![], 1));
    assert_eq!(report.fault.map(|fault| fault.kind), Some(RuntimeFaultKind::Hung));
    // Check that nothing runs in normal mode after the end
    let calls = calls.lock().unwrap();
    assert!(calls.iter().all(|&(mode, tick)| mode == GroupMode::Stopping || tick <= 5), "{calls:?}");
}

/// Panics, and does not return from its stop until it is let go.
struct HangsInStop(Arc<Mutex<Receiver<()>>>);

impl Actor for HangsInStop {
    fn name(&self) -> &str {
        "hangs in stop"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        assert!(ctx.tick < 3, "injected");
        Outcome::Continue
    }

    fn stop(&mut self, _: &TickContext) {
        let _ = self.0.lock().unwrap().recv();
    }
}

#[test]
fn a_panic_is_the_fault_also_if_the_stop_after_it_never_returns() {
    let (let_go, held) = channel::<()>();
    let held = Arc::new(Mutex::new(held));
    let made = Arc::new(Mutex::new(0));
    let count = Arc::clone(&made);
    let factory = move || {
        let mut made = count.lock().unwrap();
        *made += 1;
        Ok(vec![match *made {
            1 => Box::new(HangsInStop(Arc::clone(&held))) as Box<dyn Actor>,
            _ => actor_fn("replacement", |_| Outcome::Continue),
        }])
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    let restart = Restart { hung_after: Nanos(100 * MS), ..Restart::default() };
    let running = graph.restartable(RateGroup::hz(100), restart, factory).build().unwrap().start().unwrap();
    let begun = Instant::now();
    while *made.lock().unwrap() < 2 {
        assert!(begun.elapsed() < Duration::from_secs(20), "the group was not started again");
        running.wait_for(Duration::from_millis(10));
    }
    running.wait_for(Duration::from_millis(50));
    drop(let_go);
    let report = running.stop();
    assert_eq!((report.fault, report.restarts.len()), (None, 1));
    let fault = &report.restarts[0];
    assert_eq!((fault.kind, fault.actor.as_str()), (RuntimeFaultKind::Panic, "hangs in stop"));
    assert!(fault.what.contains("injected") && fault.what.contains("left behind"), "{fault}");
}

fn an_observers_fault_does_not_hide_the_one_that_ends_the_run(execution: Execution) {
    let (failed, fails) = channel();
    let log = actor_fn("log", move |ctx| {
        if ctx.tick >= 2 {
            let _ = failed.send(());
            panic!("injected");
        }
        Outcome::Continue
    });
    let mut left = None;
    let work = actor_fn("work", move |_| {
        left = left.map(|left: u32| left - 1).or(fails.try_recv().ok().map(|()| 50));
        if left == Some(0) { Outcome::Fault(7) } else { Outcome::Continue }
    });
    let mut graph = Runtime::builder(execution);
    graph.group(RateGroup::hz(1000).name("log").observer(), vec![log]);
    graph.group(RateGroup::hz(1000).name("work"), vec![work]);
    let report = finish(&mut graph);
    assert_identity(&report);
    let fault = report.fault.unwrap();
    assert_eq!((fault.group.as_str(), fault.kind), ("work", RuntimeFaultKind::Reported(7)));
}

#[test]
fn a_group_that_gets_no_processor_is_late_and_not_left_behind() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    // One tick that keeps core 0 for itself for longer than a release may hang.
    let hog = actor_fn("hog", |ctx| {
        if ctx.tick == 1 {
            support::busy(Duration::from_millis(500));
        }
        Outcome::Continue
    });
    let seen = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&seen);
    let factory = move || {
        let sink = Arc::clone(&sink);
        Ok(vec![actor_fn("slow", move |ctx| {
            support::busy(Duration::from_millis(2));
            sink.lock().unwrap().push(ctx.tick);
            Outcome::Continue
        })])
    };
    let restart = Restart { at_most: 3, hung_after: Nanos(100 * MS) };
    graph.group(RateGroup::hz(10).name("hog").realtime(50).pin(0), vec![hog]);
    graph.restartable(RateGroup::hz(100).name("slow").pin(0), restart, factory).until(Nanos(1_500 * MS));
    let report = finish(&mut graph);
    assert_identity(&report);
    assert_eq!((report.fault, report.restarts), (None, vec![]));
    let slow = &report.groups[1];
    assert!(slow.skipped >= 20, "core 0 was not taken: {slow:?}");
    // Check that it goes on to the end, and that the log says why it was late.
    assert!(seen.lock().unwrap().iter().any(|&tick| tick >= 120), "{slow:?}");
    let mut records = Vec::new();
    drain.drain(&mut records);
    let events: Vec<Event> = records.iter().filter_map(Event::from_record).collect();
    assert!(events.iter().any(|event| (event.group, event.code) == (1, Event::STARVED)), "{events:?}");
    assert!(events.iter().all(|event| event.code != Event::ABANDONED), "{events:?}");
}

/// Thrown by an actor: to drop it panics, and to drop what that throws does so too.
struct Explosive(u32);

impl Drop for Explosive {
    fn drop(&mut self) {
        if self.0 > 0 {
            std::panic::panic_any(Explosive(self.0 - 1));
        }
    }
}

fn a_panic_whose_payload_panics_is_contained(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let failing = actor_fn("failing", |ctx: &TickContext| match ctx.tick {
        0..3 => Outcome::Continue,
        _ => std::panic::panic_any(Explosive(3)),
    });
    graph.group(RateGroup::hz(1000).name("fails"), vec![failing]);
    graph.group(RateGroup::hz(100).name("other"), vec![]);
    let report = finish(&mut graph);
    assert_identity(&report);
    assert_eq!(report.groups.len(), 2);
    let fault = report.fault.unwrap();
    assert_eq!((fault.group.as_str(), fault.actor.as_str()), ("fails", "failing"));
    // Check that the place is that of the first panic
    assert!(fault.what.contains("/faults.rs:") && fault.what.ends_with("no text was given"), "{fault}");
    let line: u32 = fault.what.split(':').nth(1).unwrap().parse().unwrap();
    assert!(line > line!() - 20, "{fault}");
}

fn every_actor_may_fail_in_the_wind_down_and_the_group_ends_with_its_sums(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let actors = (0..40).map(|n| {
        actor_fn(&format!("a{n}"), move |ctx: &TickContext| match ctx.mode {
            GroupMode::Stopping => Outcome::Fault(n),
            _ if n == 0 && ctx.tick >= 5 => Outcome::Fault(99),
            _ => Outcome::Continue,
        })
    });
    graph.group(RateGroup::hz(1000).name("all").wind_down(Nanos(100 * MS)), actors.collect());
    let running = graph.build().unwrap().start().unwrap();
    if execution == Execution::Threaded {
        // Nobody takes the mail meanwhile: that of the whole wind-down waits.
        std::thread::sleep(Duration::from_millis(400));
    }
    running.wait_for(Duration::from_secs(20));
    let report = running.stop();
    assert_identity(&report);
    assert_eq!(report.groups.len(), 1, "its end was lost");
    assert_eq!(report.fault.unwrap().what, "reported fault 99");
}

/// Whatever of it is called panics.
struct Broken;

impl Actor for Broken {
    fn name(&self) -> &str {
        panic!("no name")
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        panic!("no tick")
    }
}

impl Drop for Broken {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            panic!("no drop");
        }
    }
}

/// An error that cannot even say what it is.
#[derive(Debug)]
struct Unspeakable;

impl std::fmt::Display for Unspeakable {
    fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        panic!("no words")
    }
}

impl std::error::Error for Unspeakable {}

#[test]
fn a_replacement_of_which_everything_panics_ends_the_run_in_order() {
    let mut made = 0;
    let factory = move || {
        made += 1;
        match made {
            1 => Ok(vec![actor_fn("first", |ctx| if ctx.tick >= 3 { Outcome::Fault(9) } else { Outcome::Continue })]),
            2 => Ok(vec![Box::new(Broken) as Box<dyn Actor>, Box::new(Broken)]),
            _ => Err(Unspeakable.into()),
        }
    };
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.restartable(RateGroup::hz(100).name("slow"), Restart::default(), factory);
    let report = finish(&mut graph);
    assert_identity(&report);
    assert_eq!((report.groups.len(), report.restarts.len()), (1, 1));
    let fault = report.fault.unwrap();
    assert!(fault.actor.contains("no name") && fault.what.contains("no words"), "{fault}");
}
