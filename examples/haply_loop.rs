//! The client of the Haply Inverse service at 1 kHz, and what became of every command.
//!
//! A soft wall at 1 kHz, released by the service's replies. Without an address a mock service is started in the same process, so
//! that nothing is needed; with `--address HOST:PORT --events HOST:PORT` it is a service that runs already.
//!
//! Look for: no lost command and no missing reply, as many commands as releases, and the round trip far below a millisecond.
//!
//! `cargo run --release --features haply --example haply_loop -- --seconds 600`

use std::sync::{Arc, Mutex};
use std::time::Duration;

use palpate::devices::haply::mock::{MockOptions, MockService};
use palpate::devices::haply::{Haply, HaplyCounts, HaplyOptions};
use palpate::prelude::*;
use palpate::runtime::{Actor, Execution, Outcome, RateGroup, Runtime, SlipCause, TickContext};

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
        match self.device.write(force) {
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

fn main() -> Result<(), Error> {
    let seconds: f64 = argument("--seconds").and_then(|text| text.parse().ok()).unwrap_or(5.0);
    let mut options = HaplyOptions::new(3.0);
    let mock = match argument("--address") {
        Some(address) => {
            options.address = address;
            options.events_address = argument("--events");
            None
        }
        None => {
            let mock = MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() })?;
            (options.address, options.events_address) = (mock.address(), Some(mock.events_address()));
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

    let (left, histogram) = (left.lock().expect("no holder panics"), histogram.lock().expect("no holder panics"));
    let (counts, group) = (left.counts, &report.groups[0]);
    println!("periods      {} = {} released + {} skipped", group.elapsed_periods, group.released, group.skipped);
    for cause in [SlipCause::StalledPeer, SlipCause::LateWake, SlipCause::LongTick, SlipCause::Policy] {
        println!("  skipped    {:12} {}", cause.name(), group.slips.of(cause));
    }
    println!("watchdog     {} take-overs", group.watchdog_takeovers);
    println!("commands     {} sent, {} answered, {} lost", counts.commands, counts.replies, counts.lost);
    println!(
        "replies      missing for more than two ticks {} times, {} connections again",
        counts.stale, counts.reconnects
    );
    println!("ticks        {} without a new state, {} with a fault", left.no_state, left.faults);
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
        println!("the service  {:?}", mock.counts());
    }
    Ok(())
}
