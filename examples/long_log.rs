//! Writes the log of a long run without running it: three rate groups, forces, and a few known faults. For trying out how
//! long `palpate timing` takes, and on what.
//!
//! ```text
//! cargo run --release --example long_log -- 3600 hour.mcap          # an hour: 11 million records
//! cargo run --release -- timing hour.mcap
//! ```
//!
//! Lateness and execution time are drawn from distributions with long tails, as those of real threads are. The faults are
//! printed: the report must name each of them.

use std::path::PathBuf;

use palpate::Error;
use palpate::log::{
    CommandSample, Environment, ForceSample, GlobalTick, GroupInfo, LogRecord, LoggedExecution, McapWriter, Resync,
    ServedBy,
};
use palpate::runtime::{ActorTimes, SlipCause, TickTiming};
use palpate::runtime::{Nanos, Rate};

const GROUPS: [(&str, u32); 3] = [("local", 1000), ("global", 30), ("logger", 20)];
/// What the groups take of each release (ns), at the median.
const WORK: [u64; 3] = [20_000, 3_000_000, 200_000];

/// Something that happens to a group: at a second of the run, as long as this.
struct Fault {
    group: usize,
    at_s: u64,
    lasts: Nanos,
    cause: SlipCause,
}

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let seconds: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(10);
    let path = PathBuf::from(arguments.next().unwrap_or_else(|| "long.mcap".to_owned()));
    let faults = [
        Fault { group: 0, at_s: seconds / 4, lasts: Nanos(12_400_000), cause: SlipCause::LateWake },
        Fault { group: 0, at_s: seconds / 2, lasts: Nanos(5_200_000), cause: SlipCause::LongTick },
        Fault { group: 1, at_s: 3 * seconds / 4, lasts: Nanos(110_000_000), cause: SlipCause::LongTick },
    ];
    for fault in &faults {
        println!("{} at {} s: {} of {}", fault.cause.name(), fault.at_s, fault.lasts, GROUPS[fault.group].0);
    }
    let records = write(&path, seconds, &faults)?;
    println!("{}: {records} records of {seconds} s", path.display());
    Ok(())
}

fn write(path: &std::path::Path, seconds: u64, faults: &[Fault]) -> Result<u64, Error> {
    let mut groups = GROUPS.map(|(name, hz)| GroupInfo::new(name, hz.into()));
    groups[0].actors = ["device", "local"].map(str::to_owned).into();
    groups[0].cpu = Some(1);
    let environment = Environment {
        palpate_version: env!("CARGO_PKG_VERSION").to_owned(),
        execution: LoggedExecution::Threaded { start_unix_ns: 1_790_000_000_000_000_000 },
        model: "patch".to_owned(),
        haptic_hz: 1000.0,
        global_hz: 30.0,
        groups: groups.into(),
        ..Environment::default()
    };
    let mut writer = McapWriter::create(path, &environment)?;
    let mut clocks: Vec<Clock> = (0..GROUPS.len()).map(|group| Clock::new(group, seconds, faults)).collect();
    let mut random = Random(1);
    let mut records = 0;
    let mut put = |record: LogRecord| {
        records += 1;
        writer.write(&record)
    };
    // The group whose release is due next, the faster one first.
    while let Some(clock) = clocks.iter_mut().filter(|clock| !clock.has_ended()).min_by_key(|clock| clock.due()) {
        let timing = clock.release(&mut random);
        put(LogRecord::Tick(timing))?;
        let time = timing.scheduled;
        match timing.group {
            0 => {
                let spent = timing.end.saturating_sub(timing.start);
                let mut times = [Nanos::ZERO; ActorTimes::MAX];
                times[0] = Nanos(spent.0 / 8);
                times[1] = spent.saturating_sub(times[0]);
                put(LogRecord::Actors(ActorTimes { group: 0, scheduled: time, actors: 2, spent: times }))?;
                let force_n = [0.0, 0.2 * (time.as_secs_f64() * 3.0).sin(), 1.0];
                let model_age_s = (time.0 % 33_000_000) as f64 / 1e9;
                let served_by = ServedBy::Patch;
                put(LogRecord::Force(ForceSample { time, force_n, served_by, model_age_s, ..ForceSample::default() }))?;
                put(LogRecord::Command(CommandSample { time, force_n, ..CommandSample::default() }))?;
            }
            1 => {
                let version = timing.tick as u32;
                put(LogRecord::Global(GlobalTick { time, version, ..GlobalTick::default() }))?;
                let jump_before_n = 0.1 * random.uniform();
                let jump_after_n = 0.1 * jump_before_n;
                let age = Nanos(3_000_000);
                put(LogRecord::Resync(Resync {
                    time,
                    version,
                    age,
                    jump_before_n,
                    jump_after_n,
                    ..Resync::default()
                }))?;
            }
            _ => {}
        }
    }
    writer.finish()?;
    Ok(records)
}

/// The releases of one group.
struct Clock<'a> {
    group: usize,
    rate: Rate,
    next: u64,
    end: u64,
    faults: Vec<&'a Fault>,
    /// A release that took too long holds up the next ones.
    busy_until: Nanos,
    delayed_by: SlipCause,
}

impl<'a> Clock<'a> {
    fn new(group: usize, seconds: u64, faults: &'a [Fault]) -> Self {
        let rate = Rate::hz(GROUPS[group].1);
        let end = rate.last_release(Nanos(seconds * 1_000_000_000)) + 1;
        let faults = faults.iter().filter(|fault| fault.group == group).collect();
        Self { group, rate, next: 0, end, faults, busy_until: Nanos::ZERO, delayed_by: SlipCause::None }
    }

    fn has_ended(&self) -> bool {
        self.next >= self.end
    }

    /// When the next release that is not skipped is due.
    fn due(&self) -> Nanos {
        self.rate.release(self.next.max(self.rate.last_release(self.free())))
    }

    /// When the group is ready for its next release.
    fn free(&self) -> Nanos {
        let due = self.rate.release(self.next);
        let woken = self.fault(due, SlipCause::LateWake).map_or(Nanos::ZERO, |fault| due + fault.lasts);
        self.busy_until.max(woken)
    }

    fn fault(&self, due: Nanos, cause: SlipCause) -> Option<&'a Fault> {
        let hits = |fault: &&&Fault| fault.cause == cause && due == Nanos(fault.at_s * 1_000_000_000);
        self.faults.iter().find(hits).copied()
    }

    fn release(&mut self, random: &mut Random) -> TickTiming {
        let first = self.rate.release(self.next);
        let scheduled = self.due();
        let tick = self.rate.last_release(scheduled);
        let slips = (tick - self.next) as u32;
        let overslept = self.fault(first, SlipCause::LateWake).is_some();
        let woke = self.free().max(scheduled) + Nanos(random.long_tailed(60.0));
        let long = self.fault(scheduled, SlipCause::LongTick).map_or(0, |fault| fault.lasts.0);
        let start = woke + Nanos(300);
        let end = start + Nanos(WORK[self.group] + random.long_tailed(WORK[self.group] as f64 / 20.0) + long);
        let deadline = self.rate.release(tick + 1);
        let cause = match (overslept, end > deadline) {
            (true, _) => SlipCause::LateWake,
            (false, true) => SlipCause::LongTick,
            (false, false) if slips > 0 => self.delayed_by,
            _ => SlipCause::None,
        };
        (self.next, self.busy_until, self.delayed_by) = (tick + 1, end, cause);
        let group = self.group as u16;
        TickTiming { group, tick, scheduled, woke, start, end, deadline, slips, cause, ..TickTiming::default() }
    }
}

/// Numbers that are the same every time: splitmix64.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A time with this median (ns): log-logistic, one in a thousand is thirty times the median.
    fn long_tailed(&mut self, median: f64) -> u64 {
        let u = self.uniform().clamp(1e-9, 1.0 - 1e-9);
        (median * (u / (1.0 - u)).sqrt()) as u64
    }
}
