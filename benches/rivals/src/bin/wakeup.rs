//! How late the runtime's threads wake up, against `cyclictest` (Debian: rt-tests).
//!
//!     cargo run --release --manifest-path benches/rivals/Cargo.toml --bin wakeup [-- --rounds 12 --seconds 4]
//!
//! Every round runs three things for some seconds each, one after the other on the same core, with the same priority and
//! at 1 kHz: `cyclictest -m -p80 -i1000 -N`, a group that waits with a plain sleep, and a group that sleeps and then
//! spins with the margin that adapts. Lateness is the clock after the wake-up less the time asked for, in all three: in
//! cyclictest by its histogram with bins of 1 ns, here from the timing records: `woke` less the time of the release that
//! the thread waited for, which is `scheduled` less one period for each that was skipped over a late wake. All samples of all
//! rounds are pooled, the first of each run included. Samples beyond 1 ms, for which cyclictest's histogram has no bin,
//! count as its largest.
//!
//! The share of a core is the processor time of the group's thread over the wall time, by the kernel's books
//! (`/proc/thread-self/schedstat`).

use palpate_runtime::GraphError;
use palpate_runtime::{Execution, Outcome, RateGroup, Runtime, TickTiming, Wait, actor_fn};
use palpate_runtime::Nanos;
use palpate_rivals::{cores, percentile, smoke, sorted, verdict};
use std::process::{Command, ExitCode};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

const PRIORITY: u8 = 80;
const PERIOD: Nanos = Nanos(1_000_000);
/// The last bin of cyclictest's histogram (ns).
const LAST_BIN: u32 = 1_000_000;

/// What to run.
struct Plan {
    rounds: u32,
    seconds: f64,
    core: usize,
}

impl Plan {
    fn from_arguments() -> Result<Self, String> {
        let (rounds, seconds) = if smoke() { (1.0, 0.3) } else { (12.0, 4.0) };
        let mut plan = Self { rounds: rounds as u32, seconds, core: cores() - 1 };
        let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--smoke");
        while let Some(name) = arguments.next() {
            let value = arguments.next().and_then(|value| value.parse::<f64>().ok()).filter(|&value| value > 0.0);
            match (&*name, value) {
                ("--rounds", Some(value)) => plan.rounds = value as u32,
                ("--seconds", Some(value)) => plan.seconds = value,
                _ => return Err(format!("`{name}`: the options are --smoke, --rounds N and --seconds S")),
            }
        }
        Ok(plan)
    }
}

/// All that one contestant has shown so far.
#[derive(Default)]
struct Pool {
    /// (us)
    lateness: Vec<f64>,
    busy: Duration,
    wall: Duration,
    granted: String,
}

impl Pool {
    fn add(&mut self, run: Pool) {
        self.lateness.extend(run.lateness);
        self.busy += run.busy;
        self.wall += run.wall;
        self.granted = run.granted;
    }

    /// In percent.
    fn share_of_a_core(&self) -> f64 {
        100.0 * self.busy.as_secs_f64() / self.wall.as_secs_f64()
    }
}

fn cyclictest(plan: &Plan) -> Result<Pool, String> {
    let file = std::env::temp_dir().join(format!("palpate-cyclictest-{}.json", std::process::id()));
    let status = Command::new("cyclictest")
        .args(["-q", "-m", "-t1", "-i1000", "-N", &format!("-p{PRIORITY}"), &format!("-a{}", plan.core)])
        .args([format!("-l{}", (plan.seconds * 1000.0) as u32), format!("-h{LAST_BIN}")])
        .arg(format!("--json={}", file.display()))
        .stdout(std::process::Stdio::null())
        .status()
        .map_err(|error| format!("cyclictest: {error}; install it (Debian: rt-tests)"))?;
    let text = std::fs::read_to_string(&file).map_err(|error| format!("what cyclictest wrote: {error}"));
    // A temporary file that cannot be removed does no harm.
    let _ = std::fs::remove_file(&file);
    if !status.success() {
        return Err(format!("cyclictest ended with {status}; does it have the right to priority {PRIORITY}?"));
    }
    let lateness = read_json(&text?).ok_or("cyclictest wrote no histogram that this program can read")?;
    Ok(Pool { lateness, ..Pool::default() })
}

/// All samples of the first thread (us).
fn read_json(text: &str) -> Option<Vec<f64>> {
    let document: serde_json::Value = serde_json::from_str(text).ok()?;
    let thread = document.get("thread")?.get("0")?;
    let cycles = thread.get("cycles")?.as_u64()? as usize;
    let largest = thread.get("max")?.as_f64()?;
    let mut lateness = Vec::with_capacity(cycles);
    for (nanos, count) in thread.get("histogram")?.as_object()? {
        let nanos: f64 = nanos.parse().ok()?;
        lateness.extend(std::iter::repeat_n(nanos / 1e3, count.as_u64()? as usize));
    }
    // What had no bin.
    lateness.extend(std::iter::repeat_n(largest / 1e3, cycles.saturating_sub(lateness.len())));
    Some(lateness)
}

/// Processor time of the calling thread.
fn busy_here() -> Duration {
    let books = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    Duration::from_nanos(books.split(' ').next().and_then(|nanos| nanos.parse().ok()).unwrap_or(0))
}

fn palpate(plan: &Plan, wait: Wait) -> Result<Pool, GraphError> {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let lateness: Arc<Mutex<Vec<f64>>> = Arc::default();
    let sink = Arc::clone(&lateness);
    let mut records = Vec::new();
    let logger = actor_fn("logger", move |_| {
        records.clear();
        drain.drain(&mut records);
        let timings = records.iter().filter_map(TickTiming::from_record).filter(|timing| timing.group == 0);
        let late = timings.map(|timing| {
            let asked = timing.scheduled.saturating_sub(Nanos(u64::from(timing.slips) * PERIOD.0));
            timing.woke.saturating_sub(asked).0 as f64 / 1e3
        });
        sink.lock().unwrap_or_else(PoisonError::into_inner).extend(late);
        Outcome::Continue
    });
    let end = Nanos::from_secs_f64(plan.seconds);
    let span: Arc<Mutex<(Duration, Duration)>> = Arc::default();
    let result = Arc::clone(&span);
    let mut begun = None;
    let measured = actor_fn("nothing to do", move |ctx| {
        // The first release and one near the end read a file; all others do nothing.
        if begun.is_none() {
            begun = Some((busy_here(), ctx.now));
        } else if ctx.scheduled + Nanos(20_000_000) == end
            && let Some((busy, then)) = begun
        {
            *result.lock().unwrap_or_else(PoisonError::into_inner) =
                (busy_here().saturating_sub(busy), ctx.now.saturating_sub(then).to_duration());
        }
        Outcome::Continue
    });
    // On another core than the one that is measured, if there is one.
    let observer = RateGroup::hz(20).name("log").observer().pin((plan.core + 1) % cores());
    let running = graph
        .group(RateGroup::hz(1000).name("measured").pin(plan.core).realtime(PRIORITY).wait(wait), vec![measured])
        .group(observer, vec![logger])
        .until(end)
        .build()?
        .start()?;
    running.wait_for(Duration::MAX);
    let report = running.stop();
    let grant = &report.grant.groups[0];
    let granted = match &*grant.refused {
        "" => format!("{} {} on core {}: {}", grant.policy, grant.priority, plan.core, grant.wait),
        refused => format!("refused: {refused}"),
    };
    let lateness = std::mem::take(&mut *lateness.lock().unwrap_or_else(PoisonError::into_inner));
    let (busy, wall) = *span.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(Pool { lateness, busy, wall, granted })
}

fn measure(plan: &Plan) -> Result<[Pool; 3], String> {
    let mut pools: [Pool; 3] = Default::default();
    for round in 0..plan.rounds as usize {
        // Nobody always comes first.
        for turn in 0..3 {
            let place = (round + turn) % 3;
            let run = match place {
                0 => cyclictest(plan)?,
                1 => palpate(plan, Wait::Sleep).map_err(|error| error.to_string())?,
                _ => palpate(plan, Wait::Auto).map_err(|error| error.to_string())?,
            };
            pools[place].add(run);
        }
    }
    Ok(pools)
}

fn print(plan: &Plan, pools: [Pool; 3]) {
    println!(
        "{} interleaved rounds of {} s at 1 kHz, priority {PRIORITY}, core {}; lateness in us, all samples pooled\n",
        plan.rounds, plan.seconds, plan.core
    );
    let [rival, sleep, spin] = pools.each_ref().map(|pool| sorted(pool.lateness.clone()));
    let row = |name: &str, samples: &[f64], share: &str| {
        let [p50, p99, p999, max] = [50.0, 99.0, 99.9, 100.0].map(|percent| percentile(samples, percent));
        let count = samples.len();
        println!("| {name} | {count} | {p50:.2} | {p99:.2} | {p999:.1} | {max:.0} | {share} |");
    };
    println!("| contestant | samples | p50 | p99 | p99.9 | max | share of a core |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    row("cyclictest", &rival, "");
    row("palpate, sleep", &sleep, &format!("{:.1} %", pools[1].share_of_a_core()));
    row("palpate, sleep then spin", &spin, &format!("{:.1} %", pools[2].share_of_a_core()));
    println!();
    println!("| ratio to cyclictest | p50 | target | p99 | target |");
    println!("| --- | ---: | --- | ---: | --- |");
    for (name, samples, [target_p50, target_p99]) in
        [("palpate, sleep", &sleep, [1.15, 1.25]), ("palpate, sleep then spin", &spin, [0.05, 0.3])]
    {
        let [p50, p99] = [50.0, 99.0].map(|percent| percentile(samples, percent) / percentile(&rival, percent));
        println!("| {name} | {p50:.3} | {} | {p99:.3} | {} |", verdict(p50, target_p50), verdict(p99, target_p99));
    }
    println!();
    println!("share of a core, sleep then spin: {}", verdict(pools[2].share_of_a_core(), 15.0));
    for pool in &pools[1..] {
        println!("granted: {}", pool.granted);
    }
}

fn main() -> ExitCode {
    let plan = match Plan::from_arguments() {
        Ok(plan) => plan,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    match measure(&plan) {
        Ok(pools) => {
            print(&plan, pools);
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
