//! What the runtime itself costs: recording a tick, the scheduler around the actors of a real-time group, and how much
//! faster than real time virtual time is.
//!
//! `cargo bench -p palpate-runtime`
//!
//! The first two are measured where they happen: on a 1 kHz group's own thread, by the timing records that it leaves
//! anyway, so that nothing in the hot path is there for the measurement.
//!
//! - *recording a tick*: one timing record into the ring, between two clock reads in the tick of a 1 kHz actor, so with
//!   caches as cold as a tick finds them; the time of the two reads alone, taken in the same tick, is subtracted.
//! - *woke to first actor*: from `woke`, the clock read that ends the wait, to `end`, the clock read after the actor's
//!   work, of a group whose actor does nothing. It holds all that lies between waking and the actor's first line, and the
//!   way back too.
//! - *last actor to sleep*: after a stall a group that catches up runs its late releases back to back. From `end` of one
//!   to `woke` of the next lies all that comes between an actor's last line and the next sleep (closing the books,
//!   recording, finding the next release, looking at the stop flag and at the clock), and nothing else, because there is
//!   no sleep. The actor walks through 256 kB to leave the scheduler's data out of the first-level cache.
//! - *woke to last actor, each*: as the second, for several actors that do nothing, over their number. Times of the first
//!   twelve are told apart, those beyond are timed together.
//! - *rates*: what a group that does nothing loses at high rates: releases whose wait had not ended a period later
//!   (skipped), and how often that happened (overruns). A host that stalls the machine for 10 ms skips 500 at 50 kHz at
//!   once, so the second tells more about the wait.
//! - *virtual time*: time simulated over time taken by three groups that do nothing, and the time of one release by the
//!   number of groups, medians of five runs.

use palpate_runtime::{
    Execution, Nanos, Outcome, OverrunPolicy, RateGroup, Runtime, RuntimeBuilder, SlipCause, TickTiming, actor_fn,
};
use std::hint::black_box;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let rank = (percent / 100.0 * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

fn verdict(met: bool) -> &'static str {
    if met { "met" } else { "missed" }
}

fn print_nanos(what: &str, values: Vec<f64>, target_ns: f64) {
    let values = sorted(values);
    let [p50, p90, p99] = [50.0, 90.0, 99.0].map(|percent| percentile(&values, percent));
    let met = verdict(p50 <= target_ns);
    println!("| {what} | {} | {p50:.0} | {p90:.0} | {p99:.0} | p50 <= {target_ns:.0}: {met} |", values.len());
}

/// The group that is measured: the last core, a priority like that of a haptic loop.
fn haptic() -> RateGroup {
    let core = std::thread::available_parallelism().map_or(1, usize::from) - 1;
    RateGroup::hz(1000).name("measured").pin(core).realtime(80)
}

/// Runs a graph in real time to its end and returns the timing of its first group.
fn timings_of(mut graph: RuntimeBuilder, seconds: u64) -> Vec<TickTiming> {
    let mut drain = graph.drain();
    let timings: Arc<Mutex<Vec<TickTiming>>> = Arc::default();
    let sink = Arc::clone(&timings);
    let logger = actor_fn("logger", move |_| {
        let mut records = Vec::new();
        drain.drain(&mut records);
        let own = records.iter().filter_map(TickTiming::from_record).filter(|timing| timing.group == 0);
        sink.lock().unwrap_or_else(PoisonError::into_inner).extend(own);
        Outcome::Continue
    });
    graph.group(RateGroup::hz(20).name("log").observer().pin(0), vec![logger]);
    let running = graph.until(Nanos(seconds * 1000 * MS)).build().expect("a valid graph").start().expect("it starts");
    running.wait_for(Duration::MAX);
    let report = running.stop();
    assert_eq!((&report.fault, report.lost_records), (&None, 0));
    let refused = &report.grant.groups[0].refused;
    if !refused.is_empty() {
        println!("refused: {refused}");
    }
    std::mem::take(&mut *timings.lock().unwrap_or_else(PoisonError::into_inner))
}

fn recording(seconds: u64) -> Vec<f64> {
    let mut graph = Runtime::builder(Execution::Threaded);
    // Room for the whole run: what is measured here is the push, not a drain that runs at the same time.
    let mut recorder = graph.recorder(seconds as usize * 1024);
    let costs: Arc<Mutex<Vec<f64>>> = Arc::default();
    let sink = Arc::clone(&costs);
    let mut own = Vec::with_capacity(seconds as usize * 1024);
    let actor = actor_fn("recorder", move |ctx| {
        let timing = TickTiming { tick: ctx.tick, scheduled: ctx.scheduled, woke: ctx.now, ..TickTiming::default() };
        let before = Instant::now();
        recorder.push(black_box(timing));
        let after = Instant::now();
        let clock = after.elapsed();
        own.push((after - before).as_secs_f64() * 1e9 - clock.as_secs_f64() * 1e9);
        if ctx.scheduled == Nanos(seconds * 1000 * MS) {
            *sink.lock().unwrap_or_else(PoisonError::into_inner) = std::mem::take(&mut own);
        }
        Outcome::Continue
    });
    graph.group(haptic(), vec![actor]);
    timings_of(graph, seconds);
    std::mem::take(&mut *costs.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The time of one actor of so many.
fn woke_to_actor(seconds: u64, actors: usize) -> Vec<f64> {
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(haptic(), (0..actors).map(|_| actor_fn("nothing to do", |_| Outcome::Continue)).collect());
    let took = |timing: &TickTiming| timing.end.saturating_sub(timing.woke).0 as f64 / actors as f64;
    timings_of(graph, seconds).iter().map(took).collect()
}

fn actor_to_sleep(seconds: u64) -> Vec<f64> {
    const STALL: Duration = Duration::from_millis(100);
    let mut cold = vec![0_u64; 256 * 1024 / 8];
    let actor = actor_fn("stalls", move |ctx| {
        if ctx.tick % 300 == 100 {
            let start = Instant::now();
            while start.elapsed() < STALL {
                std::hint::spin_loop();
            }
        }
        cold.iter_mut().for_each(|word| *word = word.wrapping_add(ctx.tick));
        black_box(&mut cold);
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(haptic().overrun(OverrunPolicy::CatchUp { max: 1000 }), vec![actor]);
    let timings = timings_of(graph, seconds);
    let back_to_back = timings.windows(2).filter(|pair| pair[1].scheduled < pair[0].end);
    back_to_back.map(|pair| pair[1].woke.saturating_sub(pair[0].end).0 as f64).collect()
}

/// The median over five runs of simulated seconds per second.
fn multiple(simulated_s: f64, mut run: impl FnMut() -> Duration) -> f64 {
    let multiples = (0..5).map(|_| simulated_s / run().as_secs_f64()).collect();
    percentile(&sorted(multiples), 50.0)
}

/// Prints what a group loses at this rate within so many periods, and what of it the wait can do something about.
fn print_rate(hz: u32, periods: u64) {
    let core = std::thread::available_parallelism().map_or(1, usize::from) - 1;
    // The actor sees where numbers are missing: (last tick, overruns, most skipped at once).
    let seen = Arc::new(Mutex::new((0_u64, 0_u64, 0_u64)));
    let sink = Arc::clone(&seen);
    let (mut last, mut overruns, mut most) = (0, 0, 0);
    let actor = actor_fn("nothing to do", move |ctx| {
        let skipped = ctx.tick.saturating_sub(last + 1);
        (last, overruns, most) = (ctx.tick, overruns + u64::from(skipped > 0), most.max(skipped));
        if let Ok(mut seen) = sink.try_lock() {
            *seen = (last, overruns, most);
        }
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(RateGroup::hz(hz).name("fast").pin(core).realtime(80), vec![actor]);
    let end = Nanos(periods * 1000 * MS / u64::from(hz));
    let running = graph.until(end).build().expect("a valid graph").start().expect("it starts");
    running.wait_for(Duration::MAX);
    let report = running.stop();
    assert_eq!(report.fault, None);
    let (group, granted) = (&report.groups[0], &report.grant.groups[0]);
    let (_, overruns, most) = *seen.lock().unwrap_or_else(PoisonError::into_inner);
    let (late, long) = (group.slips.of(SlipCause::LateWake), group.slips.of(SlipCause::LongTick));
    println!(
        "| {} | {} | {} | {late} / {long} | {overruns} | {most} | {} |",
        hz / 1000,
        group.released,
        group.skipped,
        granted.wait
    );
}

/// The time of one release of a graph of so many groups that do nothing (ns).
fn release_ns(groups: usize) -> f64 {
    let releases = 400_000;
    let run = || {
        let mut graph = Runtime::builder(Execution::Virtual);
        for _ in 0..groups {
            graph.group(RateGroup::hz(1000), vec![actor_fn("nothing to do", |_| Outcome::Continue)]);
        }
        let end = Nanos(releases / groups as u64 * MS);
        let running = graph.until(end).build().expect("a valid graph").start().expect("it starts");
        let start = Instant::now();
        running.wait_for(Duration::MAX);
        let took = start.elapsed();
        let released: u64 = running.stop().groups.iter().map(|group| group.released).sum();
        took.as_secs_f64() * 1e9 / released as f64
    };
    percentile(&sorted((0..5).map(|_| run()).collect()), 50.0)
}

fn empty_graph(seconds: u64) -> Duration {
    let mut graph = Runtime::builder(Execution::Virtual);
    for hz in [1000, 100, 30] {
        graph.group(RateGroup::hz(hz), vec![actor_fn("nothing to do", |_| Outcome::Continue)]);
    }
    let running = graph.until(Nanos(seconds * 1000 * MS)).build().expect("a valid graph").start().expect("it starts");
    let start = Instant::now();
    running.wait_for(Duration::MAX);
    let took = start.elapsed();
    let report = running.stop();
    assert_eq!(report.groups[0].released, seconds * 1000 + 1);
    took
}

fn main() {
    println!("| what | ticks | p50 (ns) | p90 (ns) | p99 (ns) | target |");
    println!("| --- | ---: | ---: | ---: | ---: | --- |");
    print_nanos("recording a tick", recording(5), 100.0);
    print_nanos("woke to first actor, and back", woke_to_actor(5, 1), 1000.0);
    print_nanos("last actor to sleep", actor_to_sleep(5), 1000.0);
    println!();
    println!("| woke to last actor, each | ticks | p50 (ns) | p90 (ns) | p99 (ns) |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    for actors in [1, 4, 12, 13, 24, 100] {
        let times = sorted(woke_to_actor(2, actors));
        let [p50, p90, p99] = [50.0, 90.0, 99.0].map(|percent| percentile(&times, percent));
        println!("| {actors} actors | {} | {p50:.0} | {p90:.0} | {p99:.0} |", times.len());
    }
    println!();
    println!("| kHz | released | skipped | late wake / long tick | overruns | most at once | wait |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | --- |");
    for hz in [10_000, 20_000, 50_000] {
        print_rate(hz, 40_000);
    }
    println!();
    println!("| virtual time | times real time | target |");
    println!("| --- | ---: | --- |");
    let empty = multiple(60.0, || empty_graph(60));
    println!("| three empty groups, 1 kHz, 100 Hz, 30 Hz | {empty:.0} | >= 200: {} |", verdict(empty >= 200.0));
    println!();
    println!("| groups in virtual time, 1 kHz | one release (ns) |");
    println!("| --- | ---: |");
    for groups in [1, 4, 16, 64, 256] {
        println!("| {groups} | {:.0} |", release_ns(groups));
    }
}
