//! What ports show when a half is taken again by a group that was started again: the same in both executions.

#[macro_use]
mod support;

use palpate_runtime::{
    Actor, ActorError, Execution, Nanos, Outcome, PortUse, PortUseKind, Rate, RateGroup, Reader, Record, Recording,
    Restart, Runtime, RuntimeBuilder, RuntimeReport, TickContext, Writer, actor_fn,
};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

in_both_executions! {
    the_first_publication_after_a_restart_reaches_the_new_reader
    a_port_within_the_restarted_group_shows_what_start_published
    a_new_reader_begins_with_the_initial_value
    a_reader_that_stays_keeps_its_value_and_gets_the_last_one_of_the_failed_writer
    an_outlet_that_stays_keeps_its_value_and_gets_the_last_one_of_the_failed_writer
    a_reader_of_an_outlet_that_is_taken_again_has_nothing_left_to_take
    what_start_publishes_after_a_restart_is_not_followed_by_older_values
    a_receiver_that_stays_gets_the_samples_of_both_senders_in_order
    a_new_receiver_gets_what_is_sent_from_then_on
    a_new_sender_goes_on_with_the_count_of_dropped_samples
    a_writer_whose_place_was_taken_publishes_and_counts_nothing
    the_record_of_a_run_with_restarts_has_no_gaps
}

type Seen<T> = Arc<Mutex<Vec<T>>>;

fn seen<T>() -> (Seen<T>, Seen<T>) {
    let seen = Seen::default();
    (Arc::clone(&seen), seen)
}

/// Runs the graph until `over` and a little longer.
#[track_caller]
fn run_until(graph: &mut RuntimeBuilder, mut over: impl FnMut() -> bool) -> RuntimeReport {
    let running = graph.build().unwrap().start().unwrap();
    let begun = Instant::now();
    while !over() {
        assert!(begun.elapsed() < Duration::from_secs(20), "it does not happen");
        running.wait_for(Duration::from_millis(10));
    }
    running.wait_for(Duration::from_millis(100));
    let report = running.stop();
    assert_eq!(report.fault, None);
    report
}

/// Adds a group that is started again whenever its actors fail; they are made by `make`, which is told how often it was
/// called before.
fn restartable(
    graph: &mut RuntimeBuilder,
    group: RateGroup,
    mut make: impl FnMut(u64) -> Vec<Box<dyn Actor>> + Send + 'static,
) {
    let mut made = 0;
    graph.restartable(group, Restart::default(), move || {
        made += 1;
        Ok(make(made - 1))
    });
}

fn fast() -> RateGroup {
    RateGroup::hz(1000).name("fast")
}

fn slow() -> RateGroup {
    RateGroup::hz(100).name("slow")
}

fn publish(writer: &mut Writer<u64>, ctx: &TickContext, value: u64) -> u64 {
    *writer.buffer() = value;
    writer.publish(ctx)
}

/// Version and value.
fn shown(reader: &Reader<u64>) -> (u64, u64) {
    (reader.version(), *reader.get())
}

fn the_first_publication_after_a_restart_reaches_the_new_reader(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.exchange_port(|| 0_u64);
    let mut writer = port.writer();
    let (asked, ask) = seen::<u64>();
    let mut answered = 0;
    // Publishes as often as it was asked, no more.
    let answers = actor_fn("answers", move |ctx| {
        if asked.lock().unwrap().len() > answered {
            answered += 1;
            publish(&mut writer, ctx, 10 * answered as u64);
        }
        Outcome::Continue
    });
    let (got, collect) = seen();
    graph.group(fast(), vec![answers]);
    restartable(&mut graph, slow(), move |incarnation| {
        let (mut reader, ask, collect) = (port.reader(), Arc::clone(&ask), Arc::clone(&collect));
        ask.lock().unwrap().push(incarnation);
        vec![actor_fn("asks", move |ctx| {
            if reader.refresh(ctx) {
                collect.lock().unwrap().push(shown(&reader));
                assert!(incarnation == 3, "injected");
            }
            Outcome::Continue
        })]
    });
    let report = run_until(&mut graph, || got.lock().unwrap().len() == 4);
    assert_eq!(report.restarts.len(), 3);
    assert_eq!(*got.lock().unwrap(), [(1, 10), (2, 20), (3, 30), (4, 40)]);
}

/// Publishes in `start`.
struct Starter {
    writer: Writer<u64>,
    value: u64,
}

impl Actor for Starter {
    fn name(&self) -> &str {
        "starter"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        let version = publish(&mut self.writer, ctx, self.value);
        if version > 0 { Ok(()) } else { Err("the writer is fenced".into()) }
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        Outcome::Continue
    }
}

fn a_port_within_the_restarted_group_shows_what_start_published(execution: Execution) {
    for reader_first in [false, true] {
        let mut graph = Runtime::builder(execution);
        let port = graph.exchange_port(|| 0_u64);
        let (got, collect) = seen();
        restartable(&mut graph, slow(), move |incarnation| {
            let (mut reader, writer) = if reader_first {
                let reader = port.reader();
                (reader, port.writer())
            } else {
                let writer = port.writer();
                (port.reader(), writer)
            };
            let collect = Arc::clone(&collect);
            let reads = actor_fn("reads", move |ctx| {
                let fresh = reader.refresh(ctx);
                if fresh {
                    collect.lock().unwrap().push(shown(&reader));
                }
                assert!(incarnation == 3 || !fresh, "injected");
                Outcome::Continue
            });
            vec![Box::new(Starter { writer, value: 10 * incarnation }), reads]
        });
        let report = run_until(&mut graph, || got.lock().unwrap().len() == 4);
        assert_eq!(report.restarts.len(), 3);
        assert_eq!(*got.lock().unwrap(), [(1, 0), (2, 10), (3, 20), (4, 30)]);
    }
}

fn a_new_reader_begins_with_the_initial_value(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.exchange_port(|| 5_u64);
    let mut writer = port.writer();
    let mut value = 10;
    let publishes = actor_fn("publishes", move |ctx| {
        value += 10;
        // Enough for buffers to come round again.
        if value < 100 {
            publish(&mut writer, ctx, value);
        }
        Outcome::Continue
    });
    let (got, collect) = seen();
    graph.group(fast(), vec![publishes]);
    restartable(&mut graph, slow(), move |incarnation| {
        let (mut reader, collect) = (port.reader(), Arc::clone(&collect));
        vec![actor_fn("reads", move |ctx| {
            let fresh = reader.refresh(ctx);
            if incarnation == 0 {
                assert!(reader.version() < 8, "injected");
            } else {
                collect.lock().unwrap().push((fresh, shown(&reader), reader.published()));
            }
            Outcome::Continue
        })]
    });
    run_until(&mut graph, || !got.lock().unwrap().is_empty());
    // Check every release, since the writer says no more
    assert!(got.lock().unwrap().iter().all(|got| *got == (false, (0, 5), Nanos::ZERO)), "{:?}", got.lock().unwrap());
}

/// Publishes three times and fails after the third, in the same release; then never again.
fn fails_after_three(
    mut publish: impl FnMut(&TickContext, u64) -> u64 + Send + 'static,
    incarnation: u64,
) -> Box<dyn Actor> {
    let mut value = 0;
    actor_fn("publishes", move |ctx| {
        value += 1;
        if incarnation == 0 {
            publish(ctx, value);
            assert!(value < 3, "injected");
        }
        Outcome::Continue
    })
}

fn a_reader_that_stays_keeps_its_value_and_gets_the_last_one_of_the_failed_writer(execution: Execution) {
    // A fast reader looks before and after the new writer comes, a slow one only then.
    for reader_group in [RateGroup::hz(10), RateGroup::hz(2000)] {
        let mut graph = Runtime::builder(execution);
        let port = graph.exchange_port(|| 0_u64);
        let mut reader = port.reader();
        let (got, collect) = seen();
        let reads = actor_fn("reads", move |ctx| {
            reader.refresh(ctx);
            collect.lock().unwrap().push(shown(&reader));
            Outcome::Continue
        });
        restartable(&mut graph, fast(), move |incarnation| {
            let mut writer = port.writer();
            vec![fails_after_three(move |ctx, value| publish(&mut writer, ctx, value), incarnation)]
        });
        graph.group(reader_group, vec![reads]);
        let report = run_until(&mut graph, || got.lock().unwrap().contains(&(3, 3)));
        assert_eq!(report.restarts.len(), 1);
        let got = got.lock().unwrap();
        assert!(got.is_sorted() && got.last() == Some(&(3, 3)), "{got:?}");
    }
}

fn an_outlet_that_stays_keeps_its_value_and_gets_the_last_one_of_the_failed_writer(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.outlet_port(|| 0_u64);
    let mut display = port.reader();
    restartable(&mut graph, fast(), move |incarnation| {
        let mut writer = port.writer();
        let publish = move |ctx: &TickContext, value| {
            *writer.buffer() = value;
            writer.publish(ctx)
        };
        vec![fails_after_three(publish, incarnation)]
    });
    let running = graph.build().unwrap().start().unwrap();
    let begun = Instant::now();
    while running.live()[0].released < 10 {
        assert!(begun.elapsed() < Duration::from_secs(20), "the group was not started again");
        running.wait_for(Duration::from_millis(10));
    }
    assert!(display.refresh());
    assert_eq!((display.version(), *display.get()), (3, 3));
    assert!(!display.refresh());
    assert_eq!((display.version(), *display.get()), (3, 3));
    assert_eq!(running.stop().restarts.len(), 1);
}

fn a_reader_of_an_outlet_that_is_taken_again_has_nothing_left_to_take(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.outlet_port(|| 0_u64);
    let (mut writer, gone) = (port.writer(), port.reader());
    let ctx = TickContext::by_hand(Rate::hz(30), 0);
    writer.publish(&ctx);
    assert!(!writer.is_taken());
    let mut display = port.reader();
    drop(gone);
    // Check that who publishes only for somebody who looks is not kept from it for ever
    assert!(writer.is_taken());
    *writer.buffer() = 7;
    writer.publish(&ctx);
    assert!(!writer.is_taken());
    assert!(display.refresh() && writer.is_taken());
    assert_eq!(*display.get(), 7);
}

fn what_start_publishes_after_a_restart_is_not_followed_by_older_values(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.exchange_port(|| 0_u64);
    let (mut reader, port) = (port.reader(), port);
    let (got, collect) = seen();
    let reads = actor_fn("reads", move |ctx| {
        if reader.refresh(ctx) {
            collect.lock().unwrap().push((shown(&reader), reader.published() <= ctx.now));
        }
        Outcome::Continue
    });
    // In virtual time the last value is visible only 9 ms after the failure, what the new start says at once.
    restartable(&mut graph, slow().latency(Nanos(9 * MS)), move |incarnation| {
        let writer = port.writer();
        if incarnation == 0 {
            let mut writer = writer;
            return vec![fails_after_three(move |ctx, value| publish(&mut writer, ctx, value), 0)];
        }
        vec![Box::new(Starter { writer, value: 40 })]
    });
    graph.group(fast(), vec![reads]);
    run_until(&mut graph, || got.lock().unwrap().last().is_some_and(|last| last.0.1 == 40));
    let got = got.lock().unwrap();
    assert!(got.windows(2).all(|pair| pair[0].0.0 < pair[1].0.0) && got.iter().all(|got| got.1), "{got:?}");
    assert_eq!(got.last().unwrap().0, (4, 40));
}

fn a_receiver_that_stays_gets_the_samples_of_both_senders_in_order(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.queue_port::<u64>(64);
    let mut receiver = port.reader();
    let (got, collect) = seen();
    let receives = actor_fn("receives", move |ctx| {
        collect.lock().unwrap().extend(std::iter::from_fn(|| receiver.pop(ctx)));
        Outcome::Continue
    });
    restartable(&mut graph, fast(), move |incarnation| {
        let (mut sender, mut sent) = (port.writer(), 0);
        vec![actor_fn("sends", move |ctx| {
            sent += 1;
            if sent <= 3 {
                assert!(sender.push(ctx, 100 * incarnation + sent));
            }
            assert!(incarnation == 3 || sent < 3, "injected");
            Outcome::Continue
        })]
    });
    // Slow enough that several senders may come between two looks.
    graph.group(RateGroup::hz(5).offset(Nanos(50 * MS)), vec![receives]);
    let report = run_until(&mut graph, || got.lock().unwrap().last() == Some(&303));
    assert_eq!(report.restarts.len(), 3);
    assert_eq!(*got.lock().unwrap(), [1, 2, 3, 101, 102, 103, 201, 202, 203, 301, 302, 303]);
}

fn a_new_receiver_gets_what_is_sent_from_then_on(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.queue_port::<u64>(64);
    let mut sender = port.writer();
    let (asked, ask) = seen::<u64>();
    let mut answered = 0;
    let answers = actor_fn("answers", move |ctx| {
        if asked.lock().unwrap().len() > answered {
            answered += 1;
            for part in 0..3 {
                assert!(sender.push(ctx, 10 * answered as u64 + part));
            }
        }
        Outcome::Continue
    });
    let (got, collect) = seen();
    graph.group(fast(), vec![answers]);
    restartable(&mut graph, slow(), move |incarnation| {
        let (mut receiver, ask, collect) = (port.reader(), Arc::clone(&ask), Arc::clone(&collect));
        ask.lock().unwrap().push(incarnation);
        vec![actor_fn("asks", move |ctx| {
            // Two of three: the last one is lost with the receiver.
            for sample in std::iter::from_fn(|| receiver.pop(ctx)).filter(|sample| sample % 10 < 2) {
                collect.lock().unwrap().push(sample);
                assert!(incarnation == 2 || sample % 10 < 1, "injected");
            }
            Outcome::Continue
        })]
    });
    run_until(&mut graph, || got.lock().unwrap().len() == 6);
    assert_eq!(*got.lock().unwrap(), [10, 11, 20, 21, 30, 31]);
}

fn a_new_sender_goes_on_with_the_count_of_dropped_samples(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let port = graph.queue_port::<u64>(4);
    let _receiver = port.reader();
    let (got, collect) = seen();
    restartable(&mut graph, fast(), move |incarnation| {
        let (mut sender, collect) = (port.writer(), Arc::clone(&collect));
        vec![actor_fn("sends", move |ctx| {
            for sample in 0..6 {
                if incarnation == 0 {
                    sender.push(ctx, sample);
                }
            }
            collect.lock().unwrap().push(sender.dropped());
            assert!(incarnation > 0, "injected");
            Outcome::Continue
        })]
    });
    run_until(&mut graph, || got.lock().unwrap().len() > 2);
    assert!(got.lock().unwrap().iter().all(|dropped| *dropped == 2), "{:?}", got.lock().unwrap());
}

fn a_writer_whose_place_was_taken_publishes_and_counts_nothing(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let (port, queue) = (graph.exchange_port(|| 0_u64), graph.queue_port::<u64>(8));
    let (mut fenced, mut fenced_sender) = (port.writer(), queue.writer());
    let (mut writer, mut sender) = (port.writer(), queue.writer());
    let (mut reader, mut receiver) = (port.reader(), queue.reader());
    let (answers, answer) = seen();
    let late = actor_fn("late", move |ctx| {
        let version = publish(&mut fenced, ctx, 666);
        answer.lock().unwrap().push((version, fenced_sender.push(ctx, 666)));
        Outcome::Continue
    });
    let mut written = 0;
    let writes = actor_fn("writes", move |ctx| {
        written += 1;
        assert_eq!(publish(&mut writer, ctx, 7), written);
        assert!(sender.push(ctx, 7) && sender.dropped() == 0);
        Outcome::Continue
    });
    let mut read = 0;
    let reads = actor_fn("reads", move |ctx| {
        read += 1;
        assert!(reader.refresh(ctx));
        assert_eq!(shown(&reader), (read, 7));
        assert_eq!(std::iter::from_fn(|| receiver.pop(ctx)).collect::<Vec<_>>(), [7]);
        Outcome::Continue
    });
    // One group: every release ticks all three.
    graph.group(fast(), vec![late, writes, reads]);
    run_until(&mut graph, || answers.lock().unwrap().len() > 20);
    assert!(answers.lock().unwrap().iter().all(|answer| *answer == (0, false)));
}

fn the_record_of_a_run_with_restarts_has_no_gaps(execution: Execution) {
    let mut graph = Runtime::builder(execution);
    let mut drain = graph.drain();
    let (down, up, samples) = (graph.exchange_port(|| 0), graph.exchange_port(|| 0), graph.queue_port::<u64>(16));
    let (mut writer, mut reader, mut sender) = (down.writer(), up.reader(), samples.writer());
    let feeds = actor_fn("feeds", move |ctx| {
        reader.refresh(ctx);
        publish(&mut writer, ctx, ctx.tick);
        sender.push(ctx, ctx.tick);
        Outcome::Continue
    });
    let (failures, failed) = seen();
    graph.group(fast(), vec![feeds]);
    restartable(&mut graph, slow(), move |incarnation| {
        let (mut reader, mut writer, mut receiver) = (down.reader(), up.writer(), samples.reader());
        let failed = Arc::clone(&failed);
        vec![actor_fn("takes", move |ctx| {
            reader.refresh(ctx);
            let taken = std::iter::from_fn(|| receiver.pop(ctx)).count() as u64;
            publish(&mut writer, ctx, taken);
            if incarnation < 3 && ctx.tick >= 10 * (incarnation + 1) {
                failed.lock().unwrap().push(ctx.scheduled);
                return Outcome::Fault(1);
            }
            Outcome::Continue
        })]
    });
    let report = run_until(&mut graph, || failures.lock().unwrap().len() == 3);
    assert_eq!(report.restarts.len(), 3);
    let mut records = Vec::new();
    drain.drain(&mut records);
    assert_eq!(drain.lost(), 0);
    Recording::from_records(&records).check(|group| group.to_string()).unwrap();
    // Check that both exchanges and the queue were recorded after the last restart too
    for (port, kind) in [(0, PortUseKind::Took), (1, PortUseKind::Took), (2, PortUseKind::Saw)] {
        let mut uses = records.iter().filter_map(PortUse::from_record);
        let late = |used: &PortUse| (used.port, used.kind) == (port, kind) && used.time > failures.lock().unwrap()[2];
        assert!(uses.any(|used| late(&used)), "{kind:?} of port {port}");
    }
}

#[test]
fn a_thread_that_was_left_behind_records_no_use_and_counts_no_version() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let (up, down) = (graph.exchange_port(|| 0_u64), graph.exchange_port(|| 0_u64));
    let (mut writer, mut reader) = (up.writer(), down.reader());
    let (got, collect) = seen();
    let feeds = actor_fn("feeds", move |ctx| {
        publish(&mut writer, ctx, ctx.tick);
        if reader.refresh(ctx) {
            collect.lock().unwrap().push(shown(&reader));
        }
        Outcome::Continue
    });
    let ((let_go, held), (answer, answers)) = (channel::<()>(), channel());
    let held = Arc::new(Mutex::new(held));
    graph.group(fast(), vec![feeds]);
    let restart = Restart { at_most: 3, hung_after: Nanos(100 * MS) };
    let mut incarnation = 0;
    graph.restartable(slow(), restart, move || {
        incarnation += 1;
        let (mut reader, mut writer, mine) = (up.reader(), down.writer(), incarnation);
        let (held, answer) = (Arc::clone(&held), answer.clone());
        Ok(vec![actor_fn("takes", move |ctx| {
            let hangs = mine == 1 && ctx.tick >= 5;
            if hangs {
                // Until the test lets go: then it looks at a port that still has something for it, and publishes.
                let _ = held.lock().unwrap().recv();
            }
            let looked = reader.refresh(ctx);
            let version = publish(&mut writer, ctx, mine);
            if hangs {
                answer.send((looked, version, ctx.tick)).unwrap();
            }
            Outcome::Continue
        })])
    });
    let mut let_go = Some(let_go);
    let mut answered = None;
    let over = || {
        let second = |got: &(u64, u64)| got.1 == 2;
        if got.lock().unwrap().iter().filter(|got| second(got)).count() > 5 {
            let_go = None;
            answered = answered.or(answers.try_recv().ok());
        }
        answered.is_some()
    };
    let report = run_until(&mut graph, over);
    assert_eq!(report.restarts.len(), 1);
    let (looked, version, hung_at) = answered.unwrap();
    // Check that it really looked and found something
    assert!(looked);
    assert_eq!(version, 0);
    let mut records: Vec<Record> = Vec::new();
    drain.drain(&mut records);
    Recording::from_records(&records).check(|group| group.to_string()).unwrap();
    assert!(records.iter().filter_map(PortUse::from_record).all(|used| (used.group, used.tick) != (1, hung_at)));
    // Check that versions and writers only ever go on
    let got = got.lock().unwrap();
    assert!(got.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1), "{got:?}");
}
