//! The runtime alone, without haptics: a controller at 1 kHz, an estimator at 100 Hz and a planner at 10 Hz keep a cart
//! on a moving target, in real time and twice in virtual time.
//!
//! `cargo run --release --example three_rates`
//!
//! What goes down is the newest value of something slow (an [exchange](palpate_runtime::RuntimeBuilder::exchange)): the
//! planner's target, the estimator's state. What goes up is every sample of something fast (a queue): measurements.

use palpate_runtime::{
    Execution, GraphError, Nanos, Outcome, RateGroup, Runtime, RuntimeBuilder, RuntimeReport, TickTiming, actor_fn,
};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

const NAMES: [&str; 3] = ["control", "estimate", "plan"];
const SECONDS: u64 = 2;

/// A measurement of the cart.
#[derive(Clone, Copy)]
struct Sample {
    t_s: f64,
    x_m: f64,
}

/// Where the estimator believes the cart to be.
#[derive(Clone, Copy, Default)]
struct State {
    t_s: f64,
    x_m: f64,
    v_m_per_s: f64,
}

/// What a run leaves behind.
struct Outputs {
    report: RuntimeReport,
    /// Position of the cart (m) after each control tick.
    track: Vec<f64>,
    timings: Vec<TickTiming>,
}

type Shared<T> = Arc<Mutex<Vec<T>>>;

fn take<T>(shared: &Shared<T>) -> Vec<T> {
    std::mem::take(&mut *shared.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The graph is the same in both executions: actors take their time from the context and their data from ports.
fn build(graph: &mut RuntimeBuilder) -> (Shared<f64>, Shared<TickTiming>) {
    let (mut send_target, mut target) = graph.exchange(|| 0.0);
    let (mut send_state, mut state) = graph.exchange(State::default);
    let (mut send_sample, mut samples) = graph.queue::<Sample>(256);
    let (mut up, mut progress) = graph.queue::<State>(64);

    // 10 Hz: a target that moves on when the cart has come near it.
    let mut goal_m = 0.1;
    let plan = actor_fn("planner", move |ctx| {
        while let Some(state) = progress.pop(ctx) {
            if (state.x_m - goal_m).abs() < 0.01 {
                goal_m = -goal_m;
            }
        }
        *send_target.buffer() = goal_m;
        send_target.publish(ctx);
        Outcome::Continue
    });

    // 100 Hz: position and velocity from all measurements since the last time.
    let mut estimate = State::default();
    let estimator = actor_fn("estimator", move |ctx| {
        while let Some(sample) = samples.pop(ctx) {
            let dt = sample.t_s - estimate.t_s;
            if dt > 0.0 {
                let error = sample.x_m - (estimate.x_m + estimate.v_m_per_s * dt);
                estimate.x_m += estimate.v_m_per_s * dt + 0.5 * error;
                estimate.v_m_per_s += 0.1 * error / dt;
                estimate.t_s = sample.t_s;
            }
        }
        *send_state.buffer() = estimate;
        send_state.publish(ctx);
        up.push(ctx, estimate);
        Outcome::Continue
    });

    // 1 kHz: pulls the cart (1 kg) to the target, damps it by the estimated velocity, and measures it.
    let (mut x_m, mut v_m_per_s) = (0.0, 0.0);
    let mut own_track = Vec::with_capacity(SECONDS as usize * 1000 + 1);
    let track: Shared<f64> = Arc::default();
    let sink = Arc::clone(&track);
    let controller = actor_fn("controller", move |ctx| {
        target.refresh(ctx);
        state.refresh(ctx);
        let force_n = 100.0 * (*target.get() - x_m) - 15.0 * state.get().v_m_per_s;
        v_m_per_s += force_n * ctx.dt_nominal;
        x_m += v_m_per_s * ctx.dt_nominal;
        send_sample.push(ctx, Sample { t_s: ctx.scheduled.as_secs_f64(), x_m });
        own_track.push(x_m);
        if ctx.scheduled == Nanos(SECONDS * 1_000_000_000) {
            // The last tick: it may take a lock and hand everything over.
            *sink.lock().unwrap_or_else(PoisonError::into_inner) = std::mem::take(&mut own_track);
        }
        Outcome::Continue
    });

    // 20 Hz, an observer: takes the timing records of all groups.
    let mut drain = graph.drain();
    let timings: Shared<TickTiming> = Arc::default();
    let sink = Arc::clone(&timings);
    let mut records = Vec::new();
    let logger = actor_fn("logger", move |_| {
        records.clear();
        drain.drain(&mut records);
        let timings = records.iter().filter_map(TickTiming::from_record);
        sink.lock().unwrap_or_else(PoisonError::into_inner).extend(timings);
        Outcome::Continue
    });

    // Virtual time: an estimate takes 2 ms, a plan 30 ms, before anybody sees it.
    graph
        .group(RateGroup::hz(1000).name(NAMES[0]).realtime(80), vec![controller])
        .group(RateGroup::hz(100).name(NAMES[1]).realtime(60).latency(Nanos(2_000_000)), vec![estimator])
        .group(RateGroup::hz(10).name(NAMES[2]).latency(Nanos(30_000_000)), vec![plan])
        .group(RateGroup::hz(20).name("log").observer(), vec![logger])
        .until(Nanos(SECONDS * 1_000_000_000));
    (track, timings)
}

fn run(execution: Execution) -> Result<Outputs, GraphError> {
    let mut graph = Runtime::builder(execution);
    let (track, timings) = build(&mut graph);
    let running = graph.build()?.start()?;
    running.wait_for(Duration::MAX);
    let report = running.stop();
    Ok(Outputs { report, track: take(&track), timings: take(&timings) })
}

/// Prints how late each group woke up.
fn print_lateness(timings: &[TickTiming]) {
    println!("{:9} {:>8} {:>11} {:>11} {:>11}   (lateness)", "group", "releases", "p50", "p99", "max");
    for (group, name) in NAMES.iter().enumerate() {
        let own = timings.iter().filter(|timing| usize::from(timing.group) == group);
        let mut late: Vec<Nanos> = own.map(|timing| timing.woke.saturating_sub(timing.scheduled)).collect();
        late.sort();
        let at = |percent: usize| late.get((late.len() * percent).div_ceil(100).saturating_sub(1)).copied();
        let text =
            |nanos: Option<Nanos>| nanos.map_or(String::new(), |nanos| format!("{:.1} us", nanos.0 as f64 / 1e3));
        println!("{name:9} {:>8} {:>11} {:>11} {:>11}", late.len(), text(at(50)), text(at(99)), text(at(100)));
    }
}

fn main() -> Result<(), GraphError> {
    println!("{SECONDS} s in real time");
    let real = run(Execution::Threaded)?;
    print_lateness(&real.timings);
    for group in &real.report.grant.groups {
        let refused = if group.refused.is_empty() { String::new() } else { format!("; refused: {}", group.refused) };
        println!("{:9} {} {}, {}{refused}", group.name, group.policy, group.priority, group.wait);
    }
    println!("{}\n", real.report);

    println!("the same graph twice in virtual time");
    let (one, other) = (run(Execution::Virtual)?, run(Execution::Virtual)?);
    let bits = |outputs: &Outputs| outputs.track.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&one), bits(&other), "virtual time is bit-identical every time");
    assert_eq!(one.timings, other.timings);
    println!("{} positions and {} timings, bit-identical in both runs", one.track.len(), one.timings.len());
    println!("the cart after {SECONDS} s: {:.6} m", one.track.last().copied().unwrap_or(0.0));
    Ok(())
}
