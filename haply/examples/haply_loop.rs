//! The client of the Haply Inverse service at 1 kHz, and what became of every command.
//!
//! A soft wall at 1 kHz, released by the service's replies. Without an address a mock service is started, in a process of its own
//! as the real one is, so that nothing is needed; with `--address HOST:PORT --events HOST:PORT` it is a service that runs already.
//! The client asks for SCHED_FIFO 80, the mock for 70 (with `chrt`): a service without it answers when the machine has time.
//!
//! Look for: no lost command and no missing reply, as many commands as releases, and the round trip far below a millisecond.
//!
//! `cargo run --release -p palpate-haply --features mock --example haply_loop -- --seconds 600`

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use palpate::ErrorKind;
use palpate::devices::ForceCommand;
use palpate::prelude::*;
use palpate::runtime::{Actor, Execution, Outcome, RateGroup, Runtime, SlipCause, TickContext};
use palpate_haply::mock::{MockOptions, MockService};
use palpate_haply::{Haply, HaplyCounts, HaplyOptions};

/// A wall below the mock's hand: height (m) and stiffness (N/m).
const WALL_M: f64 = 0.14;
const WALL_N_PER_M: f64 = 200.0;

/// Round trips up to this are counted one by one in steps of a microsecond; the rest counts as this.
const MOST_US: usize = 100_000;

/// What is left when the loop is over.
#[derive(Default)]
struct Left {
    counts: HaplyCounts,
    faults: u64,
    no_state: u64,
    peak_n: f64,
}

struct Loop {
    device: Haply,
    position: Vec3,
    /// Round trips, a count per microsecond.
    histogram: Arc<Mutex<Vec<u64>>>,
    counted: Vec<u64>,
    replies: u64,
    sum: Left,
    left: Arc<Mutex<Left>>,
}

impl Actor for Loop {
    fn name(&self) -> &str {
        "haply"
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        self.device.wait(timeout.to_duration())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        match self.device.read(ctx.scheduled) {
            Ok(state) => self.position = state.position,
            Err(_) => self.sum.no_state += 1,
        }
        // Every reply has been seen by the wait before this tick, one at a time.
        let replies = self.device.counts().replies;
        if replies != self.replies
            && let Some(round_trip) = self.device.round_trip()
        {
            self.replies = replies;
            self.counted[(round_trip.as_micros() as usize).min(MOST_US - 1)] += 1;
        }
        let depth_m = (WALL_M - self.position.z).max(0.0);
        let force = Vec3::new(0.0, 0.0, WALL_N_PER_M * depth_m);
        self.sum.peak_n = self.sum.peak_n.max(force.z);
        let expires = ctx.scheduled + Nanos(100_000_000);
        match self.device.write(ForceCommand::until(force, expires)) {
            Ok(()) => Outcome::Continue,
            Err(fault) => {
                self.sum.faults += 1;
                Outcome::Degraded(fault.code())
            }
        }
    }

    fn stop(&mut self, _: &TickContext) {
        self.sum.counts = self.device.counts();
        *self.left.lock().expect("no holder panics") = std::mem::take(&mut self.sum);
        *self.histogram.lock().expect("no holder panics") = std::mem::take(&mut self.counted);
    }
}

/// The value of `--name` on the command line.
fn argument(name: &str) -> Option<String> {
    std::env::args().skip_while(|argument| argument != name).nth(1)
}

/// The round trip (us) below which a share `p` of all lies.
fn percentile(histogram: &[u64], p: f64) -> usize {
    let all: u64 = histogram.iter().sum();
    let mut below = 0;
    let reaches = |count: &u64| {
        below += count;
        below as f64 >= p * all as f64
    };
    histogram.iter().position(reaches).unwrap_or(0)
}

/// The mock in a process of its own; it ends with this.
struct Service {
    process: Child,
    said: BufReader<std::process::ChildStdout>,
    address: String,
    events_address: String,
    has_priority: bool,
}

impl Service {
    fn start() -> Result<Self, Error> {
        let fail = |error: std::io::Error| Error::new(ErrorKind::Device, format!("the mock does not start: {error}"));
        let this = std::env::current_exe().map_err(fail)?;
        let mut with_priority = Command::new("chrt");
        with_priority.args(["-f", "70"]).arg(&this);
        for (mut command, has_priority) in [(with_priority, true), (Command::new(&this), false)] {
            let command = command.arg("--serve").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
            // Neither a `chrt` that is missing nor one that is refused is the end.
            let Ok(mut process) = command.spawn() else { continue };
            let Some(mut said) = process.stdout.take().map(BufReader::new) else { continue };
            let mut line = String::new();
            said.read_line(&mut line).map_err(fail)?;
            if let Some((address, events)) = line.trim().split_once(' ') {
                let (address, events_address) = (address.to_owned(), events.to_owned());
                return Ok(Self { process, said, address, events_address, has_priority });
            }
            let _ = process.wait();
        }
        Err(fail(std::io::Error::other("it said no address")))
    }

    /// Ends it; gives what it has seen.
    fn end(mut self) -> String {
        drop(self.process.stdin.take());
        let mut seen = String::new();
        let _ = self.said.read_to_string(&mut seen);
        let _ = self.process.wait();
        seen
    }
}

/// The other process: a mock until its input ends.
fn serve() -> Result<(), Error> {
    let mock = MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() })?;
    println!("{} {}", mock.address(), mock.events_address());
    let _ = std::io::stdin().read_to_end(&mut Vec::new());
    print!("{:?}", mock.counts());
    Ok(())
}

fn main() -> Result<(), Error> {
    if std::env::args().any(|argument| argument == "--serve") {
        return serve();
    }
    let seconds: f64 = argument("--seconds").and_then(|text| text.parse().ok()).unwrap_or(5.0);
    let mut options = HaplyOptions::new(3.0);
    let mock = match argument("--address") {
        Some(address) => {
            options.address = address;
            options.events_address = argument("--events");
            None
        }
        None => {
            let mock = Service::start()?;
            options.address.clone_from(&mock.address);
            options.events_address = Some(mock.events_address.clone());
            Some(mock)
        }
    };
    let device = Haply::connect(options)?;
    println!("device {}, {seconds} s at 1 kHz, released by the service's replies", device.id());

    let (histogram, left): (Arc<Mutex<Vec<u64>>>, Arc<Mutex<Left>>) = (Arc::default(), Arc::default());
    let actor = Loop {
        device,
        position: Vec3::new(0.0, 0.0, 1.0),
        histogram: Arc::clone(&histogram),
        counted: vec![0; MOST_US],
        replies: 0,
        sum: Left::default(),
        left: Arc::clone(&left),
    };
    let group = RateGroup::hz(1000).name("haptic").realtime(80).device_paced(Nanos(3_000_000));
    let graph = Runtime::builder(Execution::Threaded)
        .group(group, vec![Box::new(actor)])
        .until(Nanos::from_secs_f64(seconds))
        .build()?;
    let running = graph.start()?;
    running.wait_for(Duration::from_secs_f64(seconds + 5.0));
    let report = running.stop();

    for grant in &report.grant.groups {
        let refused = if grant.refused.is_empty() { String::new() } else { format!(", {}", grant.refused) };
        println!("client       {} priority {}{refused}", grant.policy, grant.priority);
    }
    if let Some(mock) = &mock {
        let policy =
            if mock.has_priority { "SCHED_FIFO priority 70" } else { "no real-time priority, `chrt` is refused" };
        println!("mock         a process of its own, {policy}");
    }
    let (left, histogram) = (left.lock().expect("no holder panics"), histogram.lock().expect("no holder panics"));
    let (counts, group) = (left.counts, &report.groups[0]);
    let share = 100.0 * group.skipped as f64 / group.elapsed_periods.max(1) as f64;
    println!(
        "ticks        {} periods = {} released + {} skipped ({share:.3} %)",
        group.elapsed_periods, group.released, group.skipped
    );
    for cause in [SlipCause::StalledPeer, SlipCause::LateWake, SlipCause::LongTick, SlipCause::Policy] {
        println!("  skipped    {:12} {}", cause.name(), group.slips.of(cause));
    }
    println!("watchdog     {} take-overs", group.watchdog_takeovers);
    println!("commands     {} sent, {} answered, {} lost", counts.commands, counts.replies, counts.lost);
    println!(
        "replies      missing for more than two ticks {} times, {} connections again",
        counts.stale, counts.reconnects
    );
    println!("states       {} ticks without a new one, {} with a fault", left.no_state, left.faults);
    println!("force        peak {:.2} N asked for", left.peak_n);
    let max = histogram.iter().rposition(|&count| count > 0).unwrap_or(0);
    println!(
        "round trip   p50 {} us, p99 {} us, p99.9 {} us, max {max} us, of {} replies",
        percentile(&histogram, 0.5),
        percentile(&histogram, 0.99),
        percentile(&histogram, 0.999),
        histogram.iter().sum::<u64>()
    );
    if let Some(mock) = mock {
        println!("the service  {}", mock.end());
    }
    Ok(())
}
