//! Parameters and commands from outside reach a running actor, are recorded with their values, and are repeated.

use palpate_runtime::{
    Channel, Execution, GraphErrorKind, Nanos, Outcome, PortEnd, RateGroup, Record, Recording, Restart, Runtime,
    RuntimeBuilder, RuntimeReport, actor_fn,
};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// What a release of the actor had in hand: its number, the gain, and the commands that it took.
type Seen = Vec<(u64, [f64; 2], Vec<u64>)>;

struct Ran {
    seen: Seen,
    records: Vec<Record>,
    report: RuntimeReport,
}

/// A graph whose actor notes what it gets; two threads outside set and send as long as it runs, if they are to.
fn run(mut graph: RuntimeBuilder, drive: bool) -> Ran {
    let (seen, records) = (Arc::new(Mutex::new(Seen::new())), Arc::new(Mutex::new(Vec::new())));
    let mut drain = graph.drain();
    let gain = graph.link("gain", "knob", "actor").parameter([1.0, 0.0]);
    let orders = graph.link("orders", "operator", "actor").commands::<u64>(4);
    let (mut read_gain, mut receive) = (gain.reader(), orders.receiver());
    let (sink, all) = (Arc::clone(&seen), Arc::clone(&records));
    let actor = actor_fn("actor", move |ctx| {
        read_gain.refresh(ctx);
        // A release looks once.
        assert!(!read_gain.refresh(ctx));
        let taken = std::iter::from_fn(|| receive.pop(ctx)).collect();
        sink.lock().unwrap().push((ctx.tick, read_gain.get(), taken));
        Outcome::Continue
    });
    let logger = actor_fn("logger", move |_| {
        drain.drain(&mut all.lock().unwrap());
        Outcome::Continue
    });
    graph.group(RateGroup::hz(500).name("g"), vec![actor]);
    graph.group(RateGroup::hz(100).name("log").observer(), vec![logger]).until(Nanos(300 * MS));
    let running = graph.build().unwrap().start().unwrap();
    if drive {
        std::thread::scope(|scope| {
            for hand in 0..2_u64 {
                let (gain, orders) = (gain.clone(), orders.clone());
                scope.spawn(move || {
                    for n in 0..150 {
                        gain.set([hand as f64, n as f64]);
                        orders.send(10_000 * hand + n);
                        std::thread::sleep(Duration::from_micros(700 + 900 * hand));
                    }
                });
            }
        });
    }
    running.wait_for(Duration::MAX);
    let report = running.stop();
    drop((gain, orders));
    let (seen, records) = (seen.lock().unwrap().clone(), records.lock().unwrap().clone());
    Ran { seen, records, report }
}

#[test]
fn values_from_outside_are_repeated_release_by_release() {
    let original = run(Runtime::builder(Execution::Threaded), true);
    assert_eq!(original.report.fault, None);
    // Check that there was something to repeat: several gains and commands, each command once and in its hand's order
    let commands: Vec<u64> = original.seen.iter().flat_map(|(_, _, taken)| taken.clone()).collect();
    for hand in 0..2 {
        let own: Vec<_> = commands.iter().filter(|command| *command / 10_000 == hand).collect();
        assert!(own.len() > 10 && own.windows(2).all(|pair| pair[0] < pair[1]), "{own:?}");
    }
    let mut gains: Vec<_> = original.seen.iter().map(|(_, gain, _)| *gain).collect();
    gains.dedup();
    assert!(gains.len() > 10);
    let ports = &original.report.graph.ports;
    assert_eq!((ports[1].taken, ports[1].sent >= ports[1].taken), (commands.len() as u64, true));
    assert_eq!(ports[0].from, PortEnd::Outside("knob".to_owned()));

    let recording = Recording::from_records(&original.records);
    let again = run(Runtime::reexecution(recording.clone()), false);
    assert_eq!((again.report.fault, &again.seen), (None, &original.seen));
    // Check that what is set during a re-execution changes nothing, and that its own recording is as good
    let driven = run(Runtime::reexecution(recording), true);
    assert_eq!(driven.seen, original.seen);
    let third = run(Runtime::reexecution(Recording::from_records(&driven.records)), false);
    assert_eq!(third.seen, original.seen);
}

#[test]
fn a_missing_value_from_outside_is_refused_by_name() {
    let mut records = run(Runtime::builder(Execution::Threaded), true).records;
    let place = records.iter().position(|record| record.channel == Channel::INPUT && record.words[0] == 1).unwrap();
    records.remove(place);
    let mut graph = Runtime::reexecution(Recording::from_records(&records));
    let (gain, orders) = (graph.parameter(1.0), graph.commands::<u64>(4));
    graph.group(RateGroup::hz(500).name("g"), vec![]).group(RateGroup::hz(100).name("log").observer(), vec![]);
    let error = graph.build().unwrap_err();
    assert_eq!(error.kind(), GraphErrorKind::Recording);
    let said = error.to_string();
    assert!(said.contains("from outside through port") && said.contains("rate group `g`"), "{said}");
    drop((gain, orders));
}

#[test]
fn a_release_that_does_not_look_where_it_took_a_value_has_left_the_recording() {
    let records = run(Runtime::builder(Execution::Threaded), true).records;
    let mut graph = Runtime::reexecution(Recording::from_records(&records));
    let (gain, orders) = (graph.parameter(1.0), graph.commands::<u64>(4));
    graph.group(RateGroup::hz(500).name("g"), vec![actor_fn("blind", |_| Outcome::Continue)]);
    graph.group(RateGroup::hz(100).name("log").observer(), vec![]);
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    let fault = running.stop().fault.unwrap();
    assert!(fault.what.contains("left the recording"), "{fault}");
    drop((gain, orders));
}

#[test]
fn actors_that_are_made_again_take_the_value_set_last() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let gain = graph.parameter(1_i32);
    let seen = Arc::new(Mutex::new(Vec::new()));
    let (own, sink) = (gain.clone(), Arc::clone(&seen));
    let factory = move || {
        let (mut reader, sink) = (own.reader(), Arc::clone(&sink));
        let actor = actor_fn("actor", move |ctx| {
            reader.refresh(ctx);
            sink.lock().unwrap().push(reader.get());
            if ctx.tick == 3 { Outcome::Fault(1) } else { Outcome::Continue }
        });
        Ok(vec![actor])
    };
    graph.restartable(RateGroup::hz(100), Restart::default(), factory).until(Nanos(60 * MS));
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(15));
    gain.set(-7);
    running.wait_for(Duration::MAX);
    assert_eq!(running.stop().restarts.len(), 1);
    assert_eq!((seen.lock().unwrap().clone(), gain.value()), (vec![1, 1, -7, -7, -7, -7, -7], -7));
}

#[test]
fn a_change_that_panics_leaves_the_value_that_was_set_last() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let gain = graph.parameter(1.0);
    gain.set(2.0);
    let fails = || {
        gain.update(|value| {
            *value = 3.0;
            panic!("injected");
        });
    };
    assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(fails)).is_err());
    // Check that nothing is shown that was never sent
    assert_eq!(gain.value(), 2.0);
    gain.update(|value| *value += 1.0);
    assert_eq!(gain.value(), 3.0);
}
