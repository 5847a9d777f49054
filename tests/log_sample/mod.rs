//! A small run for the log tests: every kind of record, at the rates of a real one.

use palpate::log::{
    CommandSample, ContactPointSample, ContactSample, Environment, ForceSample, GlobalTick, GroupInfo, GroupStats,
    Level, LogEntry, LogRecord, LoggedExecution, McapWriter, Percentiles, ProbeSample, Resync, ServedBy, TextEvent,
    ToolSample,
};
use palpate::model::Turn;
use palpate::model::contact::ContactMode;
use palpate::runtime::{Event, SlipCause, TickTiming};
use palpate::runtime::{GroupMode, PortUse};
use palpate::runtime::{Nanos, Rate};

/// An environment with two groups.
pub fn environment() -> Environment {
    Environment {
        palpate_version: "0.1.0".into(),
        instruction_set: "avx2".into(),
        execution: LoggedExecution::Threaded { start_unix_ns: 1_700_000_000_000_000_000 },
        model: "patch".into(),
        haptic_hz: 1000.0,
        global_hz: 30.0,
        groups: vec![GroupInfo::new("haptic", 1000.0), GroupInfo::new("global", 30.0)],
        limit_stages: vec!["finite".into(), "clamp".into(), "slew".into()],
        granted: [("policy", "SCHED_OTHER"), ("mlock", "refused")]
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .into(),
        ..Environment::default()
    }
}

/// The entries of `ticks` haptic ticks in time order, with slips, misses, a fault, text and statistics among them.
pub fn entries(ticks: u64) -> Vec<LogEntry> {
    let mut entries = vec![LogEntry::Text(TextEvent {
        time: Nanos::ZERO,
        level: Level::Warning,
        message: "priority refused, running without".into(),
    })];
    let (haptic, global) = (Rate::hz(1000), Rate::hz(30));
    for n in 0..ticks {
        let time = haptic.release(n);
        let phase = n as f64 * 0.01;
        entries.push(LogEntry::Record(LogRecord::Tick(timing(0, n, time, 1_000_000))));
        if global.release(global.last_release(time)) + Nanos(999_999) >= time {
            let k = global.last_release(time);
            entries.push(LogEntry::Record(LogRecord::Tick(timing(1, k, global.release(k), 33_333_333))));
            entries.extend(resync(k, time));
        }
        let contact = ContactSample {
            time,
            mode: ContactMode::from_code((n % 4) as u16),
            triangle: if n % 4 == 0 { u32::MAX } else { n as u32 },
            weights: [phase.fract(), -0.0],
            normal: [0.0, phase.sin() as f32, phase.cos() as f32],
            normal_force_n: phase as f32,
            tangential_force_n: -0.0,
            area_m2: 1e-6 * (n % 3) as f32,
            count: (n % 3) as u16,
            device: 0,
        };
        let point = |k: u64| ContactPointSample {
            time,
            place_m: [phase as f32, -0.0, k as f32],
            normal: [0.0, 0.0, -1.0],
            force_n: [0.1, f32::MIN_POSITIVE, -0.0],
            triangle: (n + k) as u32,
            mode: ContactMode::Slip,
            device: 0,
        };
        let force_n = [phase.sin(), -0.0, f64::MIN_POSITIVE * n as f64];
        entries.extend(
            [
                LogRecord::Force(ForceSample {
                    time,
                    force_n,
                    model_version: n as u32 / 33,
                    served_by: ServedBy::Patch,
                    model_age_s: (n % 33) as f64 * 1e-3,
                    energy_j: -phase,
                    torque_n_m: [0.0, -0.0, 1e-3 * (n % 3) as f64],
                    device: 0,
                }),
                LogRecord::Command(CommandSample {
                    time,
                    force_n,
                    limits: (n % 5) as u16,
                    energy_j: 1e-3 * n as f64,
                    tank_j: 1e-4,
                    torque_n_m: [phase, 0.0, -0.0],
                    device: 0,
                }),
                LogRecord::Tool(ToolSample {
                    time,
                    id: n as u32,
                    position_m: [phase, 0.1, -phase],
                    velocity_m_s: [0.0, -0.0, 1.0 / 3.0],
                    buttons: 3,
                    orientation: Turn::from_euler_angles(phase, -0.0, 0.1),
                    device: 0,
                }),
            ]
            .map(LogEntry::Record),
        );
        // A message of several records, which come back as they were given.
        entries.extend((0..n % 3).map(|k| LogEntry::Record(LogRecord::ContactPoint(point(k)))));
        entries.extend(
            [
                LogRecord::Contact(contact),
                LogRecord::Port(PortUse { time, port: 2, tick: n, count: n + 1, sequence: n, ..PortUse::default() }),
                LogRecord::Probe(ProbeSample { time, node: 851, local_m: [phase; 3], global_m: [0.1; 3], device: 0 }),
            ]
            .map(LogEntry::Record),
        );
    }
    let end = haptic.release(ticks);
    let event = Event { stamp: end, group: 1, code: Event::FAULT, detail: u64::MAX };
    entries.push(LogEntry::Record(LogRecord::Event(event)));
    let lateness = Percentiles { count: ticks, p50: 50, p90: 60, p99: 70, p999: 80, max: u64::MAX };
    entries.push(LogEntry::Stats(GroupStats {
        time: end,
        group: 0,
        released: ticks,
        skipped: 2,
        missed: 1,
        lost_records: 4,
        lateness,
        ..GroupStats::default()
    }));
    entries.sort_by_key(time_of);
    entries
}

/// When an entry happened.
pub fn time_of(entry: &LogEntry) -> Nanos {
    match entry {
        LogEntry::Environment(_) | LogEntry::Attachment { .. } => Nanos::ZERO,
        LogEntry::Record(record) => record.time(),
        LogEntry::Stats(stats) => stats.time,
        LogEntry::Text(event) => event.time,
        LogEntry::Scene(frame) => frame.time,
    }
}

fn timing(group: u16, tick: u64, scheduled: Nanos, period: u64) -> TickTiming {
    let woke = scheduled + Nanos(50_000 + tick * 7919 % 1000);
    let long = tick % 50 == 49;
    let after_long = tick > 0 && tick.is_multiple_of(50);
    TickTiming {
        group,
        tick,
        scheduled,
        woke,
        start: woke + Nanos(300),
        end: woke + Nanos(if long { 2 * period } else { 20_000 }),
        deadline: scheduled + Nanos(period),
        slips: u32::from(after_long),
        cause: if long || after_long { SlipCause::LongTick } else { SlipCause::None },
        given_up: u8::from(after_long && tick.is_multiple_of(100)),
        mode: if after_long { GroupMode::Degraded } else { GroupMode::Normal },
    }
}

fn resync(k: u64, time: Nanos) -> [LogEntry; 2] {
    [
        LogRecord::Global(GlobalTick { time, version: k as u32 + 1, first_tick: 33 * k, last_tick: 33 * k + 32 }),
        LogRecord::Resync(Resync {
            time,
            version: k as u32 + 1,
            age: Nanos(33_333_333),
            jump_before_n: 0.01 * k as f64,
            jump_after_n: 0.001 * k as f64,
            energy_j: 1e-6,
            device: 0,
        }),
    ]
    .map(LogEntry::Record)
}

/// The entries as a log, a chunk every `chunk` entries.
pub fn log_of(entries: &[LogEntry], chunk: usize) -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new(), "memory", &environment()).unwrap();
    for (i, entry) in entries.iter().enumerate() {
        match entry {
            LogEntry::Record(record) => writer.write(record).unwrap(),
            LogEntry::Text(event) => writer.write_text(event).unwrap(),
            LogEntry::Stats(stats) => writer.write_stats(stats).unwrap(),
            LogEntry::Environment(environment) => writer.set_environment(environment),
            LogEntry::Scene(frame) => writer.write_scene(frame).unwrap(),
            LogEntry::Attachment { .. } => {}
        }
        if i % chunk == chunk - 1 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap()
}
