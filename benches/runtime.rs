//! What the runtime itself costs: recording a tick, the scheduler around the actors of a real-time group, and how much
//! faster than real time virtual time is.
//!
//! `cargo bench --bench runtime`
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
//! - *virtual time*: time simulated over time taken, the median of five runs.

use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::runtime::{Execution, Outcome, OverrunPolicy, RateGroup, Runtime, RuntimeBuilder, TickTiming, actor_fn};
use palpate::scene::Scene;
use palpate::session::Session;
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

fn woke_to_actor(seconds: u64) -> Vec<f64> {
    let mut graph = Runtime::builder(Execution::Threaded);
    graph.group(haptic(), vec![actor_fn("nothing to do", |_| Outcome::Continue)]);
    timings_of(graph, seconds).iter().map(|timing| timing.end.saturating_sub(timing.woke).0 as f64).collect()
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

fn demo_scene() -> Duration {
    let scene = Scene::demo().with_model(LocalModelKind::Patch);
    let session = Session::from_scene(scene).virtual_time().build().expect("a valid scene");
    let start = Instant::now();
    let summary = session.run().expect("it runs");
    let took = start.elapsed();
    assert_eq!(summary.runtime.fault, None);
    took
}

fn main() {
    println!("| what | ticks | p50 (ns) | p90 (ns) | p99 (ns) | target |");
    println!("| --- | ---: | ---: | ---: | ---: | --- |");
    print_nanos("recording a tick", recording(5), 100.0);
    print_nanos("woke to first actor, and back", woke_to_actor(5), 1000.0);
    print_nanos("last actor to sleep", actor_to_sleep(5), 1000.0);
    println!();
    println!("| virtual time | times real time | target |");
    println!("| --- | ---: | --- |");
    let empty = multiple(60.0, || empty_graph(60));
    println!("| three empty groups, 1 kHz, 100 Hz, 30 Hz | {empty:.0} | >= 200: {} |", verdict(empty >= 200.0));
    let demo = multiple(Scene::demo().run.duration_s, demo_scene);
    println!("| the demo scene with `patch` | {demo:.1} | >= 3: {} |", verdict(demo >= 3.0));
}
