//! One suite, run against both executors: the same actors see the same order, ports, starts, stops and faults.

mod device_clock;
#[macro_use]
mod support;

use device_clock::DeviceClock;
use palpate_runtime::{
    Actor, ActorError, Disturbance, Event, Execution, GrantHandle, GraphErrorKind, GroupMode, Nanos, Outcome,
    OverrunPolicy, RateGroup, Record, Runtime, RuntimeBuilder, RuntimeReport, SlipCause, TickContext, TickTiming,
    actor_fn,
};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

in_both_executions! {
    commits_follow_all_ticks_in_reverse_order
    starts_run_in_group_order_on_the_building_thread_before_release_zero
    every_actor_is_stopped_once_after_its_last_release
    released_plus_skipped_is_elapsed_and_until_is_the_last_release
    an_offset_shifts_every_release
    a_reader_in_the_same_release_sees_what_an_earlier_actor_published
    what_start_publishes_is_there_at_release_zero
    versions_and_stamps_travel_with_the_value
    a_queue_keeps_every_sample_in_order
    a_release_looks_at_each_port_once
    a_full_queue_drops_and_counts
    an_observer_ends_last_and_sees_everything
    a_panic_stops_the_whole_graph_in_order
    a_panic_in_commit_and_in_stop_is_caught
    a_reported_fault_stops_the_graph_and_nothing_commits
    a_panicking_observer_is_told_and_stops_nobody
    a_failed_start_stops_what_was_started_and_names_the_actor
    degraded_releases_are_counted_and_changes_recorded
    a_stop_handle_ends_an_endless_run
    the_grant_is_known_when_actors_start
    dropping_a_run_stops_its_actors
    an_outlet_shows_the_newest_value_outside
    a_rephased_group_keeps_its_distance_and_accounts_for_every_period
    a_degraded_group_tells_its_actors_and_recovers
    a_group_that_catches_up_runs_what_is_due_in_order
    the_stop_policy_ends_the_run_at_an_overrun
    groups_with_offsets_keep_their_distance
    a_device_paced_group_keeps_the_nominal_grid
    a_watchdog_takes_over_from_a_silent_device_and_hands_back
}

type Log = Arc<Mutex<Vec<String>>>;

fn log() -> Log {
    Arc::default()
}

fn lines(log: &Log) -> Vec<String> {
    log.lock().unwrap().clone()
}

/// Writes down everything that is done to it.
struct Witness {
    name: &'static str,
    log: Log,
    /// What it does at this release, if anything special.
    at: Option<(u64, Deed)>,
}

#[derive(Clone, Copy, PartialEq)]
enum Deed {
    PanicInTick,
    PanicInCommit,
    PanicInStop,
    Fault,
    FailStart,
}

impl Witness {
    fn boxed(name: &'static str, log: &Log) -> Box<dyn Actor> {
        Box::new(Self { name, log: Arc::clone(log), at: None })
    }

    fn doing(name: &'static str, log: &Log, tick: u64, deed: Deed) -> Box<dyn Actor> {
        Box::new(Self { name, log: Arc::clone(log), at: Some((tick, deed)) })
    }

    fn note(&self, what: &str) {
        self.log.lock().unwrap().push(format!("{} {what}", self.name));
    }

    fn does(&self, tick: u64, deed: Deed) -> bool {
        self.at == Some((tick, deed))
    }
}

impl Actor for Witness {
    fn name(&self) -> &str {
        self.name
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.note("start");
        assert_eq!((ctx.tick, ctx.scheduled), (0, Nanos::ZERO));
        if self.does(0, Deed::FailStart) { Err("no device".into()) } else { Ok(()) }
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.note(&format!("tick {}", ctx.tick));
        assert!(!self.does(ctx.tick, Deed::PanicInTick), "deliberate");
        if self.does(ctx.tick, Deed::Fault) { Outcome::Fault(77) } else { Outcome::Continue }
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.note(&format!("commit {}", ctx.tick));
        assert!(!self.does(ctx.tick, Deed::PanicInCommit), "deliberate");
        Outcome::Continue
    }

    fn stop(&mut self, _: &TickContext) {
        self.note("stop");
        assert!(!matches!(self.at, Some((_, Deed::PanicInStop))), "deliberate");
    }
}

fn run(graph: &mut RuntimeBuilder) -> RuntimeReport {
    let running = graph.build().unwrap().start().unwrap();
    // Far beyond the end of any run here: it returns as soon as everything has ended.
    running.wait_for(Duration::from_secs(60));
    assert!(running.finished());
    running.stop()
}

/// A group whose every period is run, however late: the tests here are about order, not about time.
fn group(name: &str, hz: u32) -> RateGroup {
    RateGroup::hz(hz).name(name).overrun(OverrunPolicy::CatchUp { max: 1_000_000 })
}

fn commits_follow_all_ticks_in_reverse_order(execution: Execution) {
    let log = log();
    let actors = vec![Witness::boxed("a", &log), Witness::boxed("b", &log), Witness::boxed("c", &log)];
    run(Runtime::builder(execution).group(group("g", 1000), actors).until(Nanos(MS)));
    let ticks: Vec<_> = lines(&log).into_iter().filter(|line| line.contains(['0', '1'])).collect();
    let expected =
        |n: u64| ["a tick", "b tick", "c tick", "c commit", "b commit", "a commit"].map(|what| format!("{what} {n}"));
    assert_eq!(ticks, [expected(0), expected(1)].concat());
}

fn starts_run_in_group_order_on_the_building_thread_before_release_zero(execution: Execution) {
    struct ThreadNote(Log, std::thread::ThreadId);
    impl Actor for ThreadNote {
        fn name(&self) -> &str {
            "thread"
        }
        fn start(&mut self, _: &TickContext) -> Result<(), ActorError> {
            assert_eq!(std::thread::current().id(), self.1);
            self.0.lock().unwrap().push("thread start".into());
            Ok(())
        }
        fn tick(&mut self, _: &TickContext) -> Outcome {
            Outcome::Continue
        }
    }
    let log = log();
    let mut graph = Runtime::builder(execution);
    graph
        .group(group("one", 1000), vec![Witness::boxed("a", &log), Witness::boxed("b", &log)])
        .group(group("two", 100), vec![Box::new(ThreadNote(Arc::clone(&log), std::thread::current().id()))])
        .group(group("three", 100), vec![Witness::boxed("c", &log)])
        .until(Nanos::ZERO);
    run(&mut graph);
    assert_eq!(lines(&log)[..4], ["a start", "b start", "thread start", "c start"]);
}

fn every_actor_is_stopped_once_after_its_last_release(execution: Execution) {
    let log = log();
    let mut graph = Runtime::builder(execution);
    graph
        .group(group("one", 1000), vec![Witness::boxed("a", &log), Witness::boxed("b", &log)])
        .group(group("two", 300), vec![Witness::boxed("c", &log)])
        .until(Nanos(5 * MS));
    run(&mut graph);
    let lines = lines(&log);
    for name in ["a", "b", "c"] {
        let own: Vec<_> = lines.iter().filter(|line| line.starts_with(name)).collect();
        assert_eq!(own.iter().filter(|line| line.ends_with("stop")).count(), 1);
        assert!(own.last().unwrap().ends_with("stop"));
    }
}

fn released_plus_skipped_is_elapsed_and_until_is_the_last_release(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    graph
        .group(RateGroup::hz(1000).name("fast"), vec![])
        .group(RateGroup::hz(30).name("slow"), vec![])
        .until(Nanos(100 * MS));
    let report = run(&mut graph);
    let periods: Vec<u64> = report.groups.iter().map(|group| group.elapsed_periods).collect();
    assert_eq!(periods, [101, 4]);
    for group in &report.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods);
        assert_eq!(group.slips.total(), group.skipped);
    }
    assert_eq!(report.fault, None);
}

fn an_offset_shifts_every_release(execution: Execution) {
    let seen: Arc<Mutex<Vec<Nanos>>> = Arc::default();
    let sink = Arc::clone(&seen);
    let actor = actor_fn("a", move |ctx| {
        assert!(ctx.now >= ctx.scheduled);
        sink.lock().unwrap().push(ctx.scheduled);
        Outcome::Continue
    });
    let offset = Nanos(MS / 2);
    run(Runtime::builder(execution).group(group("g", 1000).offset(offset), vec![actor]).until(Nanos(3 * MS)));
    assert_eq!(*seen.lock().unwrap(), [0, 1, 2].map(|n| Nanos(n * MS + MS / 2)));
}

fn a_reader_in_the_same_release_sees_what_an_earlier_actor_published(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut writer, mut reader) = graph.exchange(|| 0);
    let publish = actor_fn("writer", move |ctx| {
        *writer.buffer() = ctx.tick;
        assert_eq!(writer.publish(ctx), ctx.tick + 1);
        Outcome::Continue
    });
    let read = actor_fn("reader", move |ctx| {
        assert!(reader.refresh(ctx));
        assert!(!reader.refresh(ctx));
        assert_eq!((*reader.get(), reader.version(), reader.published()), (ctx.tick, ctx.tick + 1, ctx.scheduled));
        Outcome::Continue
    });
    let report = run(graph.group(group("g", 1000), vec![publish, read]).until(Nanos(10 * MS)));
    assert_eq!((report.fault, report.groups[0].released), (None, 11));
}

fn what_start_publishes_is_there_at_release_zero(execution: Execution) {
    struct Early(palpate_runtime::Writer<u32>, palpate_runtime::QueueWriter<u32>);
    impl Actor for Early {
        fn name(&self) -> &str {
            "early"
        }
        fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
            *self.0.buffer() = 42;
            self.0.publish(ctx);
            self.1.push(ctx, 43);
            Ok(())
        }
        fn tick(&mut self, _: &TickContext) -> Outcome {
            Outcome::Continue
        }
    }
    let mut graph = Runtime::builder(execution);
    let (writer, mut reader) = graph.exchange(|| 0);
    let (tx, mut rx) = graph.queue(4);
    let read = actor_fn("reader", move |ctx| {
        if ctx.tick == 0 {
            assert!(reader.refresh(ctx));
            assert_eq!((*reader.get(), reader.version(), rx.pop(ctx)), (42, 1, Some(43)));
        }
        Outcome::Continue
    });
    graph
        .group(group("reader", 1000), vec![read])
        .group(group("early", 30).latency(Nanos(30 * MS)), vec![Box::new(Early(writer, tx))])
        .until(Nanos(MS));
    assert_eq!(run(&mut graph).fault, None);
}

fn versions_and_stamps_travel_with_the_value(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut writer, mut reader) = graph.exchange(|| Box::new([0_u64; 100]));
    let publish = actor_fn("writer", move |ctx| {
        writer.buffer().fill(ctx.tick);
        writer.publish(ctx);
        Outcome::Continue
    });
    let mut own = Box::new([0; 100]);
    let read = actor_fn("reader", move |ctx| {
        let before = reader.version();
        if reader.refresh(ctx) {
            assert!(reader.version() > before);
            assert_eq!(reader.published(), Nanos((reader.version() - 1) * MS));
            // The reader owns its buffer: it may swap its content out.
            std::mem::swap(&mut own, reader.get_mut());
            assert!(own.iter().all(|&tick| tick + 1 == reader.version()));
        }
        Outcome::Continue
    });
    graph.group(group("w", 1000), vec![publish]).group(group("r", 300), vec![read]).until(Nanos(50 * MS));
    assert_eq!(run(&mut graph).fault, None);
}

fn a_queue_keeps_every_sample_in_order(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut tx, mut rx) = graph.queue(64);
    let send = actor_fn("sender", move |ctx| {
        assert!(tx.push(ctx, ctx.tick));
        Outcome::Continue
    });
    let got: Arc<Mutex<Vec<u64>>> = Arc::default();
    let sink = Arc::clone(&got);
    let receive = actor_fn("receiver", move |ctx| {
        while let Some(next) = rx.peek(ctx) {
            assert_eq!(rx.pop(ctx), Some(next));
            sink.lock().unwrap().push(next);
        }
        Outcome::Continue
    });
    // An observer ticks once more when the sender is gone, so it gets everything.
    graph
        .group(group("s", 1000), vec![send])
        .group(RateGroup::hz(200).name("r").observer(), vec![receive])
        .until(Nanos(50 * MS));
    assert_eq!(run(&mut graph).fault, None);
    assert_eq!(*got.lock().unwrap(), (0..=50).collect::<Vec<_>>());
}

// Check that what arrives after the first look of a release waits for the next one, newest values and samples alike.
fn a_release_looks_at_each_port_once(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut writer, mut reader) = graph.exchange(|| 0);
    let (mut tx, mut rx) = graph.queue(8);
    let actor = actor_fn("both", move |ctx| {
        // What the release before left behind: nothing at first, then one value and one sample.
        let left_behind = ctx.tick > 0;
        assert_eq!(reader.refresh(ctx), left_behind);
        assert_eq!(rx.peek(ctx).is_some(), left_behind);
        writer.publish(ctx);
        tx.push(ctx, ctx.tick);
        assert!(!reader.refresh(ctx));
        assert_eq!(rx.pop(ctx), left_behind.then(|| ctx.tick - 1));
        assert_eq!(rx.pop(ctx), None);
        Outcome::Continue
    });
    let report = run(graph.group(group("g", 1000), vec![actor]).until(Nanos(3 * MS)));
    assert_eq!(report.fault, None);
}

fn a_full_queue_drops_and_counts(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut tx, mut rx) = graph.queue(3);
    let send = actor_fn("sender", move |ctx| {
        // Three is rounded up to four, in both executions.
        let sent: Vec<bool> = (0..6).map(|n| tx.push(ctx, n)).collect();
        assert_eq!(sent, [true, true, true, true, false, false]);
        assert_eq!(tx.dropped(), 2);
        assert_eq!((0..5).map(|_| rx.pop(ctx)).collect::<Vec<_>>(), [Some(0), Some(1), Some(2), Some(3), None]);
        Outcome::Continue
    });
    let report = run(graph.group(group("g", 1000), vec![send]).until(Nanos::ZERO));
    assert_eq!(report.fault, None);
}

fn an_observer_ends_last_and_sees_everything(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let log = log();
    let mut recorder = graph.recorder(1024);
    let mut drain = graph.drain();
    let work = actor_fn("work", move |ctx| {
        recorder.push(Event { stamp: ctx.scheduled, group: 0, code: 1000.into(), detail: ctx.tick });
        Outcome::Continue
    });
    let records: Arc<Mutex<Vec<Record>>> = Arc::default();
    let sink = Arc::clone(&records);
    let logger = actor_fn("logger", move |_| {
        drain.drain(&mut sink.lock().unwrap());
        Outcome::Continue
    });
    graph
        .group(group("log", 100).observer(), vec![Witness::boxed("observer", &log), logger])
        .group(group("work", 1000), vec![work, Witness::boxed("worker", &log)])
        .until(Nanos(35 * MS));
    let report = run(&mut graph);
    let lines = lines(&log);
    let place = |what: &str| lines.iter().rposition(|line| line.starts_with(what)).unwrap();
    assert!(place("worker stop") < place("observer tick"), "{lines:?}");
    assert_eq!(lines.last().unwrap(), "observer stop");
    // Its last tick is no release, so the identity holds for it too.
    let observer = &report.groups[0];
    assert_eq!(observer.released + observer.skipped, observer.elapsed_periods);
    assert_eq!(lines.iter().filter(|line| line.starts_with("observer tick")).count() as u64, observer.released + 1);
    let records = records.lock().unwrap();
    let details: Vec<u64> = records.iter().filter_map(Event::from_record).map(|event| event.detail).collect();
    assert_eq!(details, (0..=35).collect::<Vec<_>>());
    let timings = records.iter().filter_map(TickTiming::from_record).filter(|timing| timing.group == 1);
    assert_eq!(timings.map(|timing| timing.tick).collect::<Vec<_>>(), (0..=35).collect::<Vec<_>>());
    assert_eq!(report.lost_records, 0);
}

/// Runs two groups and an observer, the first with the culprit, and returns the report, the log and the events.
fn with_culprit(
    execution: Execution,
    culprit: impl Fn(&Log) -> Box<dyn Actor>,
) -> (RuntimeReport, Vec<String>, Vec<Event>) {
    let mut graph = Runtime::builder(execution);
    let log = log();
    let mut drain = graph.drain();
    graph
        .group(group("bad", 1000), vec![Witness::boxed("first", &log), culprit(&log), Witness::boxed("third", &log)])
        .group(group("good", 1000), vec![Witness::boxed("other", &log)])
        .group(group("log", 100).observer(), vec![Witness::boxed("observer", &log)])
        .until(Nanos(60_000 * MS));
    let report = run(&mut graph);
    let mut records = Vec::new();
    drain.drain(&mut records);
    (report, lines(&log), records.iter().filter_map(Event::from_record).collect())
}

fn stops(lines: &[String]) -> usize {
    lines.iter().filter(|line| line.ends_with(" stop")).count()
}

fn a_panic_stops_the_whole_graph_in_order(execution: Execution) {
    let (report, lines, events) = with_culprit(execution, |log| Witness::doing("culprit", log, 7, Deed::PanicInTick));
    let fault = report.fault.unwrap();
    assert_eq!((&*fault.group, &*fault.actor, fault.at), ("bad", "culprit", Nanos(7 * MS)));
    assert!(fault.what.starts_with("panicked at ") && fault.what.ends_with(": deliberate"), "{fault}");
    assert_eq!(events, [Event { stamp: Nanos(7 * MS), group: 0, code: Event::PANIC, detail: 1 }]);
    // Nothing of the group goes on, every actor is stopped, the observer last.
    assert!(!lines.contains(&"third tick 7".to_owned()) && !lines.contains(&"first commit 7".to_owned()));
    assert_eq!(stops(&lines), 5);
    assert_eq!(lines.last().unwrap(), "observer stop");
    for group in &report.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods);
    }
}

fn a_panic_in_commit_and_in_stop_is_caught(execution: Execution) {
    let (report, lines, _) = with_culprit(execution, |log| Witness::doing("culprit", log, 3, Deed::PanicInCommit));
    assert_eq!(report.fault.unwrap().actor, "culprit");
    assert_eq!(stops(&lines), 5);

    let mut graph = Runtime::builder(execution);
    let log = log();
    let actors = vec![Witness::doing("culprit", &log, 0, Deed::PanicInStop), Witness::boxed("next", &log)];
    let report = run(graph.group(group("g", 1000), actors).until(Nanos(MS)));
    let fault = report.fault.unwrap();
    assert!(fault.actor == "culprit" && fault.what.contains("in stop"), "{fault}");
    assert_eq!(stops(&self::lines(&log)), 2);
}

fn a_reported_fault_stops_the_graph_and_nothing_commits(execution: Execution) {
    let (report, lines, events) = with_culprit(execution, |log| Witness::doing("culprit", log, 5, Deed::Fault));
    let fault = report.fault.unwrap();
    assert!(fault.what.contains("fault 77"), "{fault}");
    assert_eq!(events, [Event { stamp: Nanos(5 * MS), group: 0, code: Event::FAULT, detail: 77 }]);
    assert!(!lines.contains(&"third tick 5".to_owned()) && !lines.contains(&"first commit 5".to_owned()));
    assert_eq!(stops(&lines), 5);
}

fn a_panicking_observer_is_told_and_stops_nobody(execution: Execution) {
    let log = log();
    let mut graph = Runtime::builder(execution);
    graph
        .group(group("log", 100).observer(), vec![Witness::doing("observer", &log, 2, Deed::PanicInTick)])
        .group(group("work", 1000), vec![Witness::boxed("worker", &log)])
        .until(Nanos(100 * MS));
    let report = run(&mut graph);
    assert_eq!(report.fault.unwrap().group, "log");
    // Check that the others ran to their end
    let work = &report.groups[1];
    assert_eq!((work.elapsed_periods, work.released + work.skipped), (101, 101));
    let lines = lines(&log);
    assert_eq!(stops(&lines), 2);
    // After its own fault it is stopped, last, but never ticked again.
    assert_eq!(lines.iter().filter(|line| line.starts_with("observer tick")).count(), 3);
    assert_eq!(lines.last().unwrap(), "observer stop");
}

fn a_failed_start_stops_what_was_started_and_names_the_actor(execution: Execution) {
    let log = log();
    let mut graph = Runtime::builder(execution);
    graph
        .group(group("one", 1000), vec![Witness::boxed("a", &log)])
        .group(group("two", 1000), vec![Witness::doing("b", &log, 0, Deed::FailStart), Witness::boxed("c", &log)]);
    let error = graph.build().unwrap().start().unwrap_err();
    assert_eq!(error.to_string(), "rate group `two`, actor `b`: no device");
    assert_eq!(error.kind(), GraphErrorKind::Actor);
    assert_eq!(error.into_actor_error().unwrap().to_string(), "no device");
    assert_eq!(lines(&log), ["a start", "b start", "a stop", "b stop"]);
}

fn degraded_releases_are_counted_and_changes_recorded(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let mut drain = graph.drain();
    let actor = actor_fn("a", |ctx| match ctx.tick {
        3..=5 => Outcome::Degraded(9),
        _ => Outcome::Continue,
    });
    let report = run(graph.group(group("g", 1000), vec![actor]).until(Nanos(10 * MS)));
    assert_eq!((report.groups[0].degraded, report.fault), (3, None));
    let mut records = Vec::new();
    drain.drain(&mut records);
    let events: Vec<_> = records.iter().filter_map(Event::from_record).map(|e| (e.stamp, e.code, e.detail)).collect();
    let expected = [(Nanos(3 * MS), Event::DEGRADED, 9), (Nanos(6 * MS), Event::DEGRADED, Event::RECOVERED)];
    assert_eq!(events, expected);
}

fn a_stop_handle_ends_an_endless_run(execution: Execution) {
    let log = log();
    let mut graph = Runtime::builder(execution);
    // One release in a hundred seconds: the stop must not wait for the next.
    let slow = RateGroup::new(palpate_runtime::Rate::new(1, 100)).name("slow");
    graph
        .group(slow, vec![Witness::boxed("slow", &log)])
        .group(group("fast", 1000), vec![Witness::boxed("fast", &log)]);
    let running = graph.build().unwrap().start().unwrap();
    let handle = running.stop_handle();
    running.wait_for(Duration::from_millis(20));
    assert!(!running.finished() && !handle.requested());
    std::thread::spawn(move || handle.request()).join().unwrap();
    running.wait_for(Duration::from_secs(60));
    assert!(running.finished());
    assert_eq!(stops(&lines(&log)), 2);
    assert_eq!(running.stop().fault, None);
}

fn the_grant_is_known_when_actors_start(execution: Execution) {
    struct Asks(GrantHandle);
    impl Actor for Asks {
        fn name(&self) -> &str {
            "asks"
        }
        fn start(&mut self, _: &TickContext) -> Result<(), ActorError> {
            let grant = self.0.get().unwrap();
            assert_eq!(grant.groups[0].name, "g");
            assert!(!grant.groups[0].wait.is_empty() && grant.cores > 0);
            Ok(())
        }
        fn tick(&mut self, _: &TickContext) -> Outcome {
            Outcome::Continue
        }
    }
    let mut graph = Runtime::builder(execution);
    let grants = graph.grants();
    assert_eq!(grants.get(), None);
    let report = run(graph.group(group("g", 1000), vec![Box::new(Asks(grants))]).until(Nanos::ZERO));
    assert_eq!(report.grant.virtual_time, execution == Execution::Virtual);
}

fn dropping_a_run_stops_its_actors(execution: Execution) {
    let log = log();
    let mut graph = Runtime::builder(execution);
    let running = graph.group(group("g", 1000), vec![Witness::boxed("a", &log)]).build().unwrap().start().unwrap();
    drop(running);
    assert_eq!(stops(&lines(&log)), 1);
}

fn an_outlet_shows_the_newest_value_outside(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (mut writer, mut reader) = graph.outlet(|| 0);
    let actor = actor_fn("a", move |ctx| {
        *writer.buffer() = ctx.tick;
        writer.publish(ctx);
        Outcome::Continue
    });
    // The declared latency does not delay what leaves the graph.
    run(graph.group(group("g", 1000).latency(Nanos(MS)), vec![actor]).until(Nanos(5 * MS)));
    assert!(reader.refresh());
    assert_eq!((*reader.get(), reader.version(), reader.published()), (5, 6, Nanos(5 * MS)));
}

/// Runs a group at 1 kHz for 60 ms whose release 10, or the first after it, works for 5.4 ms; its report, timings, events
/// and what its actor was told. In virtual time that work is injected, on threads it is done.
fn overrun(
    execution: Execution,
    policy: OverrunPolicy,
) -> (RuntimeReport, Vec<TickTiming>, Vec<Event>, Vec<TickContext>) {
    const WORK: Duration = Duration::from_micros(5400);
    let mut graph = Runtime::builder(execution);
    let mut drain = graph.drain();
    let contexts: Arc<Mutex<Vec<TickContext>>> = Arc::default();
    let sink = Arc::clone(&contexts);
    let mut done = false;
    let actor = actor_fn("a", move |ctx| {
        sink.lock().unwrap().push(*ctx);
        if execution == Execution::Threaded && ctx.tick >= 10 && !std::mem::replace(&mut done, ctx.tick >= 10) {
            let start = Instant::now();
            while start.elapsed() < WORK {
                std::hint::spin_loop();
            }
        }
        Outcome::Continue
    });
    if execution == Execution::Virtual {
        let work = |release| Nanos(if release == 10 { WORK.as_nanos() as u64 } else { 0 });
        graph.disturb("g", move |release| Disturbance { work: work(release), ..Disturbance::default() });
    }
    let report = run(graph.group(RateGroup::hz(1000).name("g").overrun(policy), vec![actor]).until(Nanos(60 * MS)));
    let mut records = Vec::new();
    drain.drain(&mut records);
    let group = &report.groups[0];
    assert_eq!(group.released + group.skipped, group.elapsed_periods);
    let timings: Vec<_> = records.iter().filter_map(TickTiming::from_record).collect();
    let contexts = contexts.lock().unwrap().clone();
    let told = |ctx: &TickContext| (ctx.tick, ctx.scheduled, ctx.slips, ctx.mode);
    let recorded = timings.iter().map(|t| (t.tick, t.scheduled, t.slips, t.mode));
    // Check that actors are told what is recorded
    assert_eq!(contexts.iter().map(told).collect::<Vec<_>>(), recorded.collect::<Vec<_>>());
    (report, timings, records.iter().filter_map(Event::from_record).collect(), contexts)
}

fn a_rephased_group_keeps_its_distance_and_accounts_for_every_period(execution: Execution) {
    let (report, timings, _, _) = overrun(execution, OverrunPolicy::Rephase);
    let group = &report.groups[0];
    assert_eq!(group.elapsed_periods, 61);
    assert!(group.slips.of(SlipCause::LongTick) >= 4, "{group:?}");
    for pair in timings.windows(2) {
        let distance = pair[1].scheduled.0 - pair[0].scheduled.0;
        if pair[1].slips > 0 && pair[1].woke <= Nanos(60 * MS) {
            // It runs at once, and that is when it was due.
            assert!(pair[1].scheduled == pair[1].woke && distance > MS, "{pair:?}");
        } else {
            assert_eq!(distance, (pair[1].tick - pair[0].tick) * MS);
        }
    }
    // Tick numbers stay true to the clock, and nothing is due after the end.
    assert!(timings.iter().all(|t| t.scheduled.0 / MS == t.tick && t.scheduled <= Nanos(60 * MS)));
}

fn a_degraded_group_tells_its_actors_and_recovers(execution: Execution) {
    let (report, timings, events, _) = overrun(execution, OverrunPolicy::Degrade { recover_after: 4 });
    let group = &report.groups[0];
    assert_eq!(group.elapsed_periods, 61);
    let is_degraded = |t: &TickTiming| t.mode == GroupMode::Degraded;
    let long = timings.iter().position(|t| t.slips >= 4 && t.cause == SlipCause::LongTick).unwrap();
    // The release after the overrun is degraded, and four more if they are in time.
    assert!(timings.iter().skip(long).take(5).all(is_degraded));
    if execution == Execution::Virtual {
        assert_eq!(group.in_degraded_mode, 5);
    }
    assert_eq!(group.in_degraded_mode, timings.iter().filter(|t| is_degraded(t)).count() as u64);
    let changes: Vec<_> = events.iter().map(|e| (e.stamp, e.code, e.detail == Event::RECOVERED)).collect();
    // A group begins in normal mode; its first release may be late already.
    let before = std::iter::once(false).chain(timings.iter().map(is_degraded));
    let changed = before.zip(&timings).filter(|&(before, after)| before != is_degraded(after));
    assert_eq!(changes, changed.map(|(before, after)| (after.scheduled, Event::MODE, before)).collect::<Vec<_>>());
    assert_eq!(events[0].detail, u64::from(timings.iter().find(|t| is_degraded(t)).unwrap().slips));
}

fn a_group_that_catches_up_runs_what_is_due_in_order(execution: Execution) {
    let (report, timings, _, _) = overrun(execution, OverrunPolicy::CatchUp { max: 2 });
    assert_eq!(report.groups[0].elapsed_periods, 61);
    let after = timings.iter().position(|t| t.slips > 0 && t.cause == SlipCause::LongTick).unwrap();
    // Two more were due when the first of them ran, and they follow.
    assert!(timings[after].woke >= timings[after].scheduled + Nanos(2 * MS));
    assert!(timings[after + 1..after + 3].iter().all(|t| t.slips == 0 && t.woke >= t.scheduled));
}

fn the_stop_policy_ends_the_run_at_an_overrun(execution: Execution) {
    let (report, timings, events, _) = overrun(execution, OverrunPolicy::Stop);
    let group = &report.groups[0];
    assert_eq!(report.fault.unwrap().group, "g");
    assert_eq!((group.slips.of(SlipCause::Policy), timings.iter().filter(|t| t.slips > 0).count()), (1, 0));
    assert_eq!(events.iter().map(|e| (e.code, e.detail)).collect::<Vec<_>>(), [(Event::STOPPED, group.skipped)]);
}

fn groups_with_offsets_keep_their_distance(execution: Execution) {
    let order: Arc<Mutex<Vec<(u64, Nanos)>>> = Arc::default();
    let mut graph = Runtime::builder(execution);
    for k in 0..3_u64 {
        let sink = Arc::clone(&order);
        let note = actor_fn("note", move |ctx| {
            assert!(ctx.now >= ctx.scheduled);
            sink.lock().unwrap().push((k, ctx.scheduled));
            Outcome::Continue
        });
        graph.group(group(&format!("g{k}"), 100).offset(Nanos(k * 3 * MS)), vec![note]);
    }
    let report = run(graph.until(Nanos(45 * MS)));
    // The last releases that are due by the end: at 40, 43 and 36 ms.
    assert_eq!(report.groups.iter().map(|group| group.elapsed_periods).collect::<Vec<_>>(), [5, 5, 4]);
    let order = order.lock().unwrap();
    for k in 0..3 {
        let own: Vec<u64> = order.iter().filter(|(group, _)| *group == k).map(|(_, at)| at.0 / MS).collect();
        assert_eq!(own, (0..5).map(|n| 10 * n + 3 * k).filter(|&at| at <= 45).collect::<Vec<_>>());
    }
}

/// Reads a device.
struct Reads(DeviceClock);

impl Actor for Reads {
    fn name(&self) -> &str {
        "reads"
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        self.0.wait(timeout.to_duration())
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        Outcome::Continue
    }
}

/// Runs a device-paced group for 100 ms whose device is silent between two times; the watchdog waits for 10 ms.
fn device_paced(execution: Execution, silent_ms: [u64; 2]) -> (RuntimeReport, Vec<TickTiming>, Vec<Event>) {
    let mut graph = Runtime::builder(execution);
    let mut drain = graph.drain();
    let actor = Reads(DeviceClock::new(Duration::from_millis(1), silent_ms.map(Duration::from_millis)));
    if execution == Execution::Virtual {
        let [from, to] = silent_ms;
        let stall = move |release: u64| if release == from { Nanos((to - from) * MS) } else { Nanos::ZERO };
        graph.disturb("g", move |release| Disturbance { stall: stall(release), ..Disturbance::default() });
    }
    let spec = RateGroup::hz(1000).name("g").device_paced(Nanos(10 * MS));
    let report = run(graph.group(spec, vec![Box::new(actor)]).until(Nanos(100 * MS)));
    let mut records = Vec::new();
    drain.drain(&mut records);
    let group = &report.groups[0];
    // Check that simulated time does not stretch against the clock, whatever the device does
    assert_eq!((group.released + group.skipped, group.elapsed_periods, &report.fault), (101, 101, &None));
    let timings: Vec<_> = records.iter().filter_map(TickTiming::from_record).collect();
    assert!(timings.iter().all(|t| t.scheduled == Nanos(t.tick * MS)));
    (report, timings, records.iter().filter_map(Event::from_record).collect())
}

fn a_device_paced_group_keeps_the_nominal_grid(execution: Execution) {
    let (report, timings, _) = device_paced(execution, [200, 200]);
    let group = &report.groups[0];
    assert!(group.released > 50, "{group:?}");
    assert!(group.skipped == 0 || execution == Execution::Threaded, "{group:?}");
    assert!(timings.iter().all(|t| t.woke + Nanos(MS) > t.scheduled));
}

fn a_watchdog_takes_over_from_a_silent_device_and_hands_back(execution: Execution) {
    let (report, timings, events) = device_paced(execution, [20, 60]);
    assert!(report.groups[0].watchdog_takeovers >= 1);
    assert!(report.groups[0].slips.of(SlipCause::StalledPeer) >= 9);
    let changes: Vec<_> = events.iter().map(|e| (e.code, e.detail == Event::RECOVERED)).collect();
    let pairs = [(Event::WATCHDOG, false), (Event::WATCHDOG, true)];
    assert_eq!(changes[..2], pairs);
    assert!(changes.chunks(2).all(|chunk| chunk == &pairs[..chunk.len()]));
    // The clock released the group while the device was silent.
    let takeover = timings.iter().find(|t| t.slips >= 9 && t.cause == SlipCause::StalledPeer).unwrap();
    assert!(timings.iter().filter(|t| t.tick > takeover.tick && t.tick < 59).count() >= 5);
}
