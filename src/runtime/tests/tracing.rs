//! A program's own subscriber hears of slips, misses, restarts and faults, with group and cause, and never on a thread of
//! a group.

use palpate_runtime::{
    Disturbance, Execution, Nanos, Outcome, RateGroup, Restart, Runtime, RuntimeFault, RuntimeFaultKind, RuntimeReport,
    SlipCause, actor_fn,
};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// An event: its target, its fields, and the name of the thread that told it.
#[derive(Clone, Debug, Default)]
struct Heard {
    target: String,
    fields: BTreeMap<String, String>,
    thread: String,
}

impl Visit for Heard {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.fields.insert(field.name().to_owned(), format!("{value:?}").trim_matches('"').to_owned());
    }
}

impl Heard {
    fn field(&self, name: &str) -> &str {
        &self.fields[name]
    }
}

/// Keeps what it hears.
#[derive(Clone, Default)]
struct Ear(Arc<Mutex<Vec<Heard>>>);

impl Subscriber for Ear {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let thread = std::thread::current().name().unwrap_or_default().to_owned();
        let mut heard = Heard { target: event.metadata().target().to_owned(), thread, ..Heard::default() };
        event.record(&mut heard);
        self.0.lock().unwrap().push(heard);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

impl Ear {
    fn all(&self) -> Vec<Heard> {
        self.0.lock().unwrap().clone()
    }

    fn of(&self, target: &str) -> Vec<Heard> {
        self.all().into_iter().filter(|heard| heard.target == format!("palpate_runtime::{target}")).collect()
    }

    /// The counts of all events of a target and cause.
    fn sum(&self, target: &str, cause: &str) -> u64 {
        let counts = self.of(target).into_iter().filter(|heard| heard.field("cause") == cause);
        counts.map(|heard| heard.field("count").parse::<u64>().unwrap()).sum()
    }
}

fn assert_agrees(ear: &Ear, report: &RuntimeReport, group: usize) {
    for cause in &SlipCause::ALL[1..] {
        assert_eq!(ear.sum("slip", cause.name()), report.groups[group].slips.of(*cause), "{cause:?}");
        assert_eq!(ear.sum("miss", cause.name()), report.groups[group].misses.of(*cause), "{cause:?}");
    }
}

#[test]
fn slips_and_misses_of_virtual_time_are_told_with_group_cause_and_count() {
    let ear = Ear::default();
    let report = tracing::subscriber::with_default(ear.clone(), || {
        let mut graph = Runtime::builder(Execution::Virtual);
        graph.group(RateGroup::hz(1000).name("loop"), vec![]).until(Nanos(99_000_000));
        graph.disturb("loop", |n| Disturbance {
            work: Nanos(if n % 50 == 3 { 2_500_000 } else { 0 }),
            ..Disturbance::default()
        });
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::from_millis(30));
        assert_eq!(ear.sum("slip", "long tick"), 1);
        running.wait_for(Duration::MAX);
        running.stop()
    });
    assert_agrees(&ear, &report, 0);
    assert_eq!((ear.sum("slip", "long tick"), ear.sum("miss", "long tick")), (2, 2));
    assert!(ear.all().iter().all(|heard| heard.field("group") == "loop"), "{:?}", ear.all());
}

#[test]
fn slips_restarts_and_faults_of_threads_are_told_while_the_program_does_not_look_and_off_their_threads() {
    let ear = Ear::default();
    let report = tracing::subscriber::with_default(ear.clone(), || {
        let mut graph = Runtime::builder(Execution::Threaded);
        let mut panics = false;
        let factory = move || {
            let first = !std::mem::replace(&mut panics, true);
            let actor = actor_fn("actor", move |ctx| {
                assert!(!(first && ctx.tick > 20), "the first one fails");
                let start = Instant::now();
                while ctx.tick == 10 && start.elapsed() < Duration::from_millis(60) {
                    std::hint::spin_loop();
                }
                if ctx.tick > 120 { Outcome::Fault(42) } else { Outcome::Continue }
            });
            Ok(vec![actor])
        };
        graph.restartable(RateGroup::hz(200).name("worker"), Restart { at_most: 1, ..Restart::default() }, factory);
        let running = graph.build().unwrap().start().unwrap();
        // Check that it is told without anybody asking the run
        let start = Instant::now();
        while ear.of("fault").is_empty() && start.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(ear.of("fault").len(), 1);
        running.stop()
    });
    assert_agrees(&ear, &report, 0);
    assert!(report.groups[0].skipped > 0);
    // Check that a program need not read sentences
    let kinds = |faults: &[RuntimeFault]| faults.iter().map(|fault| fault.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&report.restarts), [RuntimeFaultKind::Panic]);
    assert_eq!(kinds(report.fault.as_slice()), [RuntimeFaultKind::Reported(42)]);
    let [restart] = &ear.of("restart")[..] else { panic!("{:?}", ear.all()) };
    let [fault] = &ear.of("fault")[..] else { panic!("{:?}", ear.all()) };
    assert!(restart.field("cause").contains("the first one fails"), "{restart:?}");
    assert!(fault.field("cause").contains("42"), "{fault:?}");
    for heard in ear.all() {
        assert_eq!(heard.field("group"), "worker");
        assert_ne!(heard.thread, "worker", "{heard:?}");
    }
}

#[test]
fn a_run_whose_group_cannot_restart_is_told_of_too() {
    let ear = Ear::default();
    tracing::subscriber::with_default(ear.clone(), || {
        let mut graph = Runtime::builder(Execution::Threaded);
        graph.group(RateGroup::hz(200).name("worker"), vec![actor_fn("actor", |_| Outcome::Fault(7))]);
        let running = graph.build().unwrap().start().unwrap();
        let start = Instant::now();
        while ear.of("fault").is_empty() && start.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(5));
        }
        drop(running);
    });
    assert_eq!(ear.of("fault").len(), 1);
}

/// Does something with each event, after it was counted.
#[derive(Clone)]
struct Handler(Ear, Arc<dyn Fn() + Send + Sync>, &'static str);

impl Subscriber for Handler {
    fn enabled(&self, event: &Metadata<'_>) -> bool {
        event.target().contains(self.2)
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        self.0.event(event);
        self.1();
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// A group that fails twice: at its first start and at its second.
fn fails_twice() -> palpate_runtime::RunningGraph {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut starts = 0;
    let factory = move || {
        starts += 1;
        let fails = starts <= 2;
        let actor = move |ctx: &palpate_runtime::TickContext| {
            assert!(!(fails && ctx.tick % 10 == 9), "fails");
            Outcome::Continue
        };
        Ok(vec![actor_fn("actor", actor)])
    };
    graph.restartable(RateGroup::hz(200).name("worker"), Restart { at_most: 5, ..Restart::default() }, factory);
    graph.build().unwrap().start().unwrap()
}

fn until(what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(what());
}

#[test]
fn a_subscriber_that_blocks_keeps_neither_restarts_nor_questions_nor_the_stop() {
    let (ear, blocked) = (Ear::default(), Arc::new(Mutex::new(())));
    let (held, own) = (blocked.lock().unwrap(), Arc::clone(&blocked));
    let handler = Handler(ear.clone(), Arc::new(move || drop(own.lock())), "");
    let running = tracing::subscriber::with_default(handler, fails_twice);
    until(|| !ear.all().is_empty());
    let before = running.live()[0].released;
    until(|| running.live()[0].released > before + 40);
    assert!(!running.finished());
    let report = running.stop();
    assert_eq!((report.restarts.len(), report.fault), (2, None));
    drop(held);
}

#[test]
fn a_subscriber_that_panics_loses_its_event_alone() {
    let ear = Ear::default();
    let handler = Handler(ear.clone(), Arc::new(|| panic!("the subscriber fails")), "");
    let running = tracing::subscriber::with_default(handler, fails_twice);
    until(|| ear.of("restart").len() == 2);
    assert_eq!(running.stop().restarts.len(), 2);
}

#[test]
fn a_subscriber_may_ask_the_run_in_both_executions_and_threads_are_told_of_by_one_thread() {
    for execution in [Execution::Virtual, Execution::Threaded] {
        let (ear, slot) = (Ear::default(), Arc::new(Mutex::new(None::<Arc<palpate_runtime::RunningGraph>>)));
        let asked = Arc::clone(&slot);
        let ask = move || {
            let run = asked.lock().unwrap().clone();
            run.map(|run| (run.elapsed(), run.finished()));
        };
        tracing::subscriber::with_default(Handler(ear.clone(), Arc::new(ask), ""), || {
            let mut graph = Runtime::builder(execution);
            graph.group(
                RateGroup::hz(200).name("worker"),
                vec![actor_fn("actor", |ctx| if ctx.tick >= 40 { Outcome::Fault(7) } else { Outcome::Continue })],
            );
            let running = Arc::new(graph.build().unwrap().start().unwrap());
            *slot.lock().unwrap() = Some(Arc::clone(&running));
            running.wait_for(Duration::from_secs(30));
            until(|| !ear.of("fault").is_empty());
            slot.lock().unwrap().take();
        });
        let teller = |heard: &Heard| execution == Execution::Virtual || heard.thread == "teller";
        assert!(ear.all().iter().all(teller), "{:?}", ear.all());
    }
}

#[test]
fn a_subscriber_of_restarts_or_of_faults_alone_hears_them() {
    for target in ["restart", "fault"] {
        let ear = Ear::default();
        let handler = Handler(ear.clone(), Arc::new(|| {}), target);
        let running = tracing::subscriber::with_default(handler, || {
            let mut graph = Runtime::builder(Execution::Threaded);
            let factory = || Ok(vec![actor_fn("actor", |_| Outcome::Fault(7))]);
            graph.restartable(RateGroup::hz(200).name("worker"), Restart { at_most: 1, ..Restart::default() }, factory);
            graph.build().unwrap().start().unwrap()
        });
        until(|| !ear.of(target).is_empty());
        drop(running);
        assert_eq!(ear.all().len(), 1);
    }
}

#[test]
fn an_observers_fault_is_told_as_that_and_keeps_no_other_from_being_told() {
    let ear = Ear::default();
    tracing::subscriber::with_default(ear.clone(), || {
        let mut graph = Runtime::builder(Execution::Virtual);
        let fails_at = |tick, code| {
            let outcome = move |now| if now == tick { Outcome::Fault(code) } else { Outcome::Continue };
            vec![actor_fn("actor", move |ctx| outcome(ctx.tick))]
        };
        graph.group(RateGroup::hz(1000).name("log").observer(), fails_at(2, 1));
        graph.group(RateGroup::hz(1000).name("work"), fails_at(50, 7));
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::from_millis(10));
        let told = ear.of("fault");
        assert_eq!((told.len(), told[0].field("group"), told[0].field("message")), (1, "log", "the observer stops"));
        running.wait_for(Duration::from_millis(90));
        running.stop();
    });
    let told = ear.of("fault");
    assert_eq!((told.len(), told[1].field("group"), told[1].field("message")), (2, "work", "the run stops"));
}
