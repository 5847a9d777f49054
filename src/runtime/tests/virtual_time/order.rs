//! Virtual time: order of releases, when publications become visible, and bit-identical records.

use palpate_runtime::{
    Channel, Event, Execution, Nanos, Outcome, Rate, RateGroup, Record, Runtime, TickTiming, actor_fn,
};
use proptest::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// The version that a 1 kHz reader sees at each tick, of a 100 Hz writer with this latency.
fn versions_seen(latency: Nanos, reader_first: bool) -> Vec<u64> {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut writer, mut reader) = graph.exchange(|| 0);
    let (mut tx, mut rx) = graph.queue(64);
    let write = actor_fn("writer", move |ctx| {
        *writer.buffer() = ctx.tick;
        writer.publish(ctx);
        tx.push(ctx, ctx.tick);
        Outcome::Continue
    });
    let seen: Arc<Mutex<Vec<u64>>> = Arc::default();
    let sink = Arc::clone(&seen);
    let read = actor_fn("reader", move |ctx| {
        if reader.refresh(ctx) {
            assert_eq!(*reader.get() + 1, reader.version());
            // Versions become visible one by one, and samples at the same time as states.
            assert_eq!(rx.pop(ctx), Some(*reader.get()));
        }
        assert_eq!(rx.peek(ctx), None);
        sink.lock().unwrap().push(reader.version());
        Outcome::Continue
    });
    let writer = (RateGroup::hz(100).name("w").latency(latency), vec![write]);
    let reader = (RateGroup::hz(1000).name("r"), vec![read]);
    for (group, actors) in if reader_first { [reader, writer] } else { [writer, reader] } {
        graph.group(group, actors);
    }
    let running = graph.until(Nanos(60 * MS)).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(1));
    assert_eq!(running.stop().fault, None);
    seen.lock().unwrap().clone()
}

#[test]
fn a_publication_is_visible_from_its_release_plus_the_latency_on() {
    // 0, half a period, one, one and a half, two periods of the writer.
    for latency_ms in [0, 5, 10, 15, 20] {
        let seen = versions_seen(Nanos(latency_ms * MS), false);
        let expected: Vec<u64> =
            (0..=60).map(|tick: u64| if tick < latency_ms { 0 } else { (tick - latency_ms) / 10 + 1 }).collect();
        assert_eq!(seen, expected, "latency {latency_ms} ms");
    }
}

#[test]
fn a_latency_between_two_ticks_of_the_reader_counts_from_the_later_one() {
    let seen = versions_seen(Nanos(4 * MS + 1), false);
    assert_eq!((seen[4], seen[5]), (0, 1));
}

#[test]
fn without_latency_the_order_of_the_groups_decides_at_equal_times() {
    let (after, before) = (versions_seen(Nanos(0), false), versions_seen(Nanos(0), true));
    assert_eq!((after[0], after[10], after[11]), (1, 2, 2));
    assert_eq!((before[0], before[1], before[10], before[11]), (0, 1, 1, 2));
    // With latency it does not: visibility is a matter of time alone.
    assert_eq!(versions_seen(Nanos(5 * MS), false), versions_seen(Nanos(5 * MS), true));
}

#[test]
fn readers_in_the_writers_own_group_see_at_once_what_others_wait_for() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut writer, mut reader) = graph.exchange(|| 0);
    let write = actor_fn("writer", move |ctx| {
        *writer.buffer() = ctx.tick;
        writer.publish(ctx);
        Outcome::Continue
    });
    let read = actor_fn("reader", move |ctx| {
        // Check that a group's own actors see what they would see on a thread, where one ticks after the other
        assert!(reader.refresh(ctx));
        assert_eq!(reader.version(), ctx.tick + 1);
        Outcome::Continue
    });
    let group = RateGroup::hz(1000).latency(Nanos(2 * MS));
    let running = graph.group(group, vec![write, read]).until(Nanos(10 * MS)).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(1));
    assert_eq!(running.stop().fault, None);
}

#[test]
fn the_pool_of_a_port_stays_small_when_nobody_reads() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let made = Arc::new(Mutex::new(0));
    let count = Arc::clone(&made);
    let (mut writer, _reader) = graph.exchange(move || *count.lock().unwrap() += 1);
    let write = actor_fn("writer", move |ctx| {
        writer.publish(ctx);
        Outcome::Continue
    });
    let group = RateGroup::hz(1000).latency(Nanos(5 * MS));
    let running = graph.group(group, vec![write]).until(Nanos(5_000 * MS)).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(10));
    running.stop();
    // Five in flight, one visible, one each for writer and reader, one being handed over.
    assert!(*made.lock().unwrap() <= 9, "{} buffers", *made.lock().unwrap());
}

#[test]
fn releases_run_in_the_order_of_time_then_group() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let order: Arc<Mutex<Vec<(Nanos, usize)>>> = Arc::default();
    let rates = [Rate::hz(1000), Rate::hz(300), Rate::hz(30), Rate::new(2997, 100), Rate::hz(1000)];
    for (index, rate) in rates.into_iter().enumerate() {
        let order = Arc::clone(&order);
        let note = actor_fn("note", move |ctx| {
            assert_eq!((ctx.scheduled, ctx.now), (rate.release(ctx.tick), ctx.scheduled));
            order.lock().unwrap().push((ctx.scheduled, index));
            Outcome::Continue
        });
        graph.group(RateGroup::new(rate), vec![note]);
    }
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(150));
    running.wait_for(Duration::from_millis(50));
    assert_eq!(running.elapsed(), Nanos(200 * MS));
    assert_eq!(running.stop().fault, None);
    let order = order.lock().unwrap();
    assert!(order.is_sorted());
    assert_eq!(order.len(), 201 + 61 + 7 + 6 + 201);
}

/// A graph with feedback between its groups; its records depend on everything a port can do.
fn records(latency: Nanos, steps: &[u64]) -> Vec<Record> {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut down, mut model) = graph.exchange(|| [0.0_f64; 8]);
    let (mut up, mut samples) = graph.queue(64);
    let mut recorder = graph.recorder(4096);
    let mut drain = graph.drain();
    let mut state = 0.1_f64;
    let fast = actor_fn("fast", move |ctx| {
        model.refresh(ctx);
        state = (3.9 * state * (1.0 - state) + 1e-3 * model.get()[0].sin()).clamp(0.0, 1.0);
        up.push(ctx, state);
        let words = [state.to_bits(), model.version(), ctx.dt_measured.to_bits(), 0, 0, 0];
        recorder.push(Record { stamp: ctx.scheduled, channel: Channel::FIRST_USER, code: 0, index: 0, words });
        Outcome::Continue
    });
    let slow = actor_fn("slow", move |ctx| {
        let sum: f64 = std::iter::from_fn(|| samples.pop(ctx)).sum();
        down.buffer().fill(sum);
        down.publish(ctx);
        if ctx.tick % 3 == 0 { Outcome::Degraded(1) } else { Outcome::Continue }
    });
    let all: Arc<Mutex<Vec<Record>>> = Arc::default();
    let sink = Arc::clone(&all);
    let logger = actor_fn("logger", move |_| {
        drain.drain(&mut sink.lock().unwrap());
        Outcome::Continue
    });
    let running = graph
        .group(RateGroup::hz(1000).name("fast"), vec![fast])
        .group(RateGroup::hz(30).name("slow").latency(latency), vec![slow])
        .group(RateGroup::hz(20).name("logger").observer(), vec![logger])
        .until(Nanos(500 * MS))
        .build()
        .unwrap()
        .start()
        .unwrap();
    for &step in steps {
        running.wait_for(Duration::from_nanos(step));
    }
    running.wait_for(Duration::from_secs(1));
    assert_eq!(running.stop().fault, None);
    all.lock().unwrap().clone()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn two_runs_give_identical_records_however_they_are_advanced(
        latency in 0_u64..80 * MS,
        steps in prop::collection::vec(0_u64..60 * MS, 0..10),
    ) {
        let reference = records(Nanos(latency), &[]);
        prop_assert!(reference.iter().filter(|record| record.channel == Channel::FIRST_USER).count() == 501);
        prop_assert_eq!(records(Nanos(latency), &steps), reference);
    }
}

#[test]
fn virtual_timing_is_on_time_and_lasts_the_declared_latency() {
    let all = records(Nanos(7 * MS), &[]);
    let timings: Vec<_> = all.iter().filter_map(TickTiming::from_record).collect();
    for t in &timings {
        assert_eq!((t.woke, t.start, t.slips), (t.scheduled, t.scheduled, 0));
        let latency = if t.group == 1 { Nanos(7 * MS) } else { Nanos::ZERO };
        assert_eq!(t.end, t.scheduled + latency);
        assert!(!t.missed());
    }
    assert_eq!(timings.iter().filter(|t| t.group == 0).count(), 501);
    let changes = all.iter().filter_map(Event::from_record).filter(|event| event.code == Event::DEGRADED).count();
    // Releases 0, 3, ... 15 of 0..=15 are degraded: one change into and, but for the last, one out of each.
    assert_eq!(changes, 11);
}
