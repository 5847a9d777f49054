//! What keeping records costs a haptic tick: the same tick with and without, pairwise interleaved in one run.
//!
//! `cargo bench --bench logging`
//!
//! A haptic tick of a session leaves five records: its timing, which the group itself makes, and the tool, the force, the
//! commanded force and the contact of its actors. The tick here walks through 256 kB and sums it up, some 15 us, so that
//! the ring is as cold as a real tick leaves it; the rings have the capacity of a session's.
//!
//! - *a tick in virtual time*: two graphs with the same actor, one with a drain and four pushes, the other with neither a
//!   drain nor a recorder. Each is advanced by one release in turn, in an order that changes from pair to pair; the
//!   difference of the two is one sample. The rings are emptied between pairs, not in them.
//! - *a tick in real time*: one 1 kHz group on the last core; of every 32 ticks the first 16 push their four records. The
//!   difference of the execution times of a tick with and the tick without 16 later is one sample.
//! - *telling two actors apart*: the two clock readings and the record that a group of two actors has besides.
//! - *one push*: the mean of each of many batches of 256 pushes in a row.
//!
//! The machine may be busy: the median of paired differences moves little with that, the 99th percentile is the machine's.

use std::hint::black_box;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use palpate::log::{CommandSample, ContactSample, ForceSample, LogRecord, ToolSample};
use palpate::runtime::Nanos;
use palpate::runtime::{
    Actor, ActorTimes, Execution, Outcome, RateGroup, Recorder, RunningGraph, Runtime, TickContext, TickTiming,
    actor_fn,
};

const MS: u64 = 1_000_000;
const PAIRS: usize = 100_000;
/// Ticks in a row with records, and without: a session records in every tick, and the first ones of a block are left out.
const BLOCK: u64 = 16;
const SETTLING: u64 = 4;
/// As in a session at 1 kHz: four seconds.
const RING: usize = 4 * 4000;

fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let rank = (percent / 100.0 * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

fn print(what: &str, mut values: Vec<f64>, target_ns: f64) {
    values.sort_by(f64::total_cmp);
    let [p1, p50, p99] = [1.0, 50.0, 99.0].map(|percent| percentile(&values, percent));
    let met = if p50 <= target_ns { "met" } else { "missed" };
    println!("| {what} | {} | {p1:.0} | {p50:.0} | {p99:.0} | p50 <= {target_ns:.0}: {met} |", values.len());
}

/// The work of a tick.
struct Work(Vec<f64>);

impl Work {
    fn new() -> Self {
        Self(vec![1.0; 256 * 1024 / 8])
    }

    fn tick(&mut self, ctx: &TickContext) -> f64 {
        let mut sum = ctx.tick as f64;
        for value in &mut self.0 {
            *value = 0.5 * (*value + 1.0);
            sum += *value;
        }
        black_box(sum)
    }
}

/// What the actors of a session record in a tick.
fn record(recorder: &mut Recorder, ctx: &TickContext, sum: f64) {
    let (time, force_n) = (ctx.scheduled, [sum, 1.0, 2.0]);
    LogRecord::Tool(ToolSample { time, position_m: force_n, ..ToolSample::default() }).push_to(recorder);
    LogRecord::Force(ForceSample { time, force_n, ..ForceSample::default() }).push_to(recorder);
    LogRecord::Contact(ContactSample { time, normal: force_n.map(|f| f as f32), ..ContactSample::default() })
        .push_to(recorder);
    LogRecord::Command(CommandSample { time, force_n, ..CommandSample::default() }).push_to(recorder);
}

fn haptic(mut recorder: Option<Recorder>) -> Box<dyn Actor> {
    let mut work = Work::new();
    actor_fn("haptic", move |ctx| {
        let sum = work.tick(ctx);
        if let Some(recorder) = &mut recorder {
            record(recorder, ctx, sum);
        }
        Outcome::Continue
    })
}

fn advance(running: &RunningGraph) -> f64 {
    let begun = Instant::now();
    running.wait_for(Duration::from_millis(1));
    begun.elapsed().as_secs_f64() * 1e9
}

fn virtual_pairs() -> (Vec<f64>, Vec<f64>) {
    let mut with = Runtime::builder(Execution::Virtual);
    let mut drain = with.drain();
    let recorder = with.recorder(RING);
    with.group(RateGroup::hz(1000).name("local"), vec![haptic(Some(recorder))]);
    let mut without = Runtime::builder(Execution::Virtual);
    without.group(RateGroup::hz(1000).name("local"), vec![haptic(None)]);
    let start =
        |graph: &mut palpate::runtime::RuntimeBuilder| graph.build().expect("valid").start().expect("it starts");
    let (with, without) = (start(&mut with), start(&mut without));
    let (mut differences, mut ticks, mut records) = (Vec::with_capacity(PAIRS), Vec::with_capacity(PAIRS), Vec::new());
    for pair in 0..PAIRS {
        let (a, b) = if pair % 2 == 0 {
            let a = advance(&with);
            (a, advance(&without))
        } else {
            let b = advance(&without);
            (advance(&with), b)
        };
        differences.push(a - b);
        ticks.push(b);
        if pair % 500 == 499 {
            drain.drain(&mut records);
            records.clear();
        }
    }
    assert_eq!(drain.lost(), 0);
    (differences, ticks)
}

fn real_pairs(seconds: u64) -> Vec<f64> {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let mut recorder = graph.recorder(RING);
    let mut work = Work::new();
    let actor = actor_fn("haptic", move |ctx| {
        let sum = work.tick(ctx);
        if is_recorded(ctx.tick) {
            record(&mut recorder, ctx, sum);
        }
        Outcome::Continue
    });
    let timings: Arc<Mutex<Vec<TickTiming>>> = Arc::default();
    let sink = Arc::clone(&timings);
    let mut records = Vec::new();
    let logger = actor_fn("logger", move |_| {
        drain.drain(&mut records);
        let own =
            records.drain(..).filter_map(|record| TickTiming::from_record(&record)).filter(|timing| timing.group == 0);
        sink.lock().unwrap_or_else(PoisonError::into_inner).extend(own);
        Outcome::Continue
    });
    let core = std::thread::available_parallelism().map_or(1, usize::from) - 1;
    graph.group(RateGroup::hz(1000).name("local").pin(core).realtime(80), vec![actor]);
    graph.group(RateGroup::hz(20).name("logger").observer(), vec![logger]);
    let running = graph.until(Nanos(seconds * 1000 * MS)).build().expect("valid").start().expect("it starts");
    running.wait_for(Duration::MAX);
    assert_eq!(running.stop().fault, None);
    let timings = timings.lock().unwrap_or_else(PoisonError::into_inner);
    let execution = |timing: &TickTiming| timing.end.saturating_sub(timing.start).0 as f64;
    // A tick of a block with records and the one at the same place of the block without that follows.
    let pair = |pair: &[TickTiming]| {
        let (a, b) = (pair.first()?, pair.last()?);
        let is_pair = b.tick == a.tick + BLOCK && is_recorded(a.tick) && a.tick % BLOCK >= SETTLING;
        is_pair.then(|| execution(a) - execution(b))
    };
    timings.windows(BLOCK as usize + 1).filter_map(pair).collect()
}

/// Every second block of ticks in real time pushes its records.
fn is_recorded(tick: u64) -> bool {
    (tick / BLOCK).is_multiple_of(2)
}

/// What telling actors apart costs a tick of two actors: the clock is read twice more, and one record is pushed.
fn actor_times() -> Vec<f64> {
    per_call(|recorder, i, begun| {
        let mut spent = [Nanos::ZERO; ActorTimes::MAX];
        spent[0] = Nanos::from_duration(black_box(begun.elapsed()));
        spent[1] = Nanos::from_duration(black_box(begun.elapsed()));
        recorder.push(ActorTimes { group: 0, scheduled: Nanos(i), actors: 2, spent });
    })
}

fn pushes() -> Vec<f64> {
    per_call(|recorder, i, _| {
        black_box(LogRecord::Force(ForceSample { time: Nanos(i), ..ForceSample::default() })).push_to(recorder);
    })
}

/// What a call of `push` takes (ns), as means of batches after which the ring is emptied; it is told which of its batch it is
/// and when that began.
fn per_call(mut push: impl FnMut(&mut Recorder, u64, Instant)) -> Vec<f64> {
    const BATCH: u64 = 256;
    let mut graph = Runtime::builder(Execution::Virtual);
    let mut drain = graph.drain();
    let mut recorder = graph.recorder(RING);
    let mut records = Vec::new();
    let mut batch = |_| {
        let begun = Instant::now();
        for i in 0..BATCH {
            push(&mut recorder, i, begun);
        }
        let took = begun.elapsed().as_secs_f64() * 1e9 / BATCH as f64;
        drain.drain(&mut records);
        records.clear();
        took
    };
    (0..20_000).map(&mut batch).collect()
}

fn main() {
    println!("| what | samples | p1 (ns) | p50 (ns) | p99 (ns) | target |");
    println!("| --- | ---: | ---: | ---: | ---: | --- |");
    let (differences, ticks) = virtual_pairs();
    print("the tick without records, virtual time", ticks, 1e6);
    print("five records kept less none, virtual time", differences, 100.0);
    print("four records kept less none, real time", real_pairs(20), 100.0);
    print("telling two actors apart, in a row", actor_times(), 100.0);
    print("one push", pushes(), 25.0);
}
