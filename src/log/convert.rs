//! Records to protobuf messages and back, bit for bit.

use super::percentiles::Percentiles;
use super::records::{
    CommandSample, ContactMode, ContactSample, ForceSample, GlobalTick, ProbeSample, Resync, ServedBy,
};
use super::schema::{self, Vector3};
use super::stats::{EventSum, GroupStats};
use crate::runtime::GroupMode;
use crate::runtime::{ActorTimes, SlipCause, TickTiming};
use crate::runtime::{PortUse, PortUseKind};
use crate::runtime::Nanos;

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<Vector3> for [f64; 3] {
    fn from(v: Vector3) -> Self {
        [v.x, v.y, v.z]
    }
}

// Numbers that do not fit come only from a damaged or foreign log; they saturate.
fn narrow(value: u32) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}

fn code(value: i32) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}

impl From<&TickTiming> for schema::TickTiming {
    fn from(r: &TickTiming) -> Self {
        Self {
            group: r.group.into(),
            tick: r.tick,
            scheduled_ns: r.scheduled.0,
            woke_ns: r.woke.0,
            start_ns: r.start.0,
            end_ns: r.end.0,
            deadline_ns: r.deadline.0,
            slips: r.slips,
            cause: r.cause as i32,
            given_up: r.given_up.into(),
            mode: r.mode as i32,
            lateness_ns: r.woke.saturating_sub(r.scheduled).0,
            execution_ns: r.end.saturating_sub(r.start).0,
        }
    }
}

impl From<schema::TickTiming> for TickTiming {
    fn from(m: schema::TickTiming) -> Self {
        Self {
            group: narrow(m.group),
            tick: m.tick,
            scheduled: Nanos(m.scheduled_ns),
            woke: Nanos(m.woke_ns),
            start: Nanos(m.start_ns),
            end: Nanos(m.end_ns),
            deadline: Nanos(m.deadline_ns),
            slips: m.slips,
            cause: SlipCause::from_code(u8::try_from(m.cause).unwrap_or(u8::MAX)),
            given_up: u8::try_from(m.given_up).unwrap_or(u8::MAX),
            mode: GroupMode::from_code(u8::try_from(m.mode).unwrap_or(u8::MAX)),
        }
    }
}

impl From<&ActorTimes> for schema::ActorTimes {
    fn from(r: &ActorTimes) -> Self {
        let spent_ns = r.spent().iter().map(|spent| spent.0).collect();
        Self { time_ns: r.scheduled.0, group: r.group.into(), spent_ns }
    }
}

impl From<schema::ActorTimes> for ActorTimes {
    fn from(m: schema::ActorTimes) -> Self {
        let mut spent = [Nanos::ZERO; ActorTimes::MAX];
        spent.iter_mut().zip(&m.spent_ns).for_each(|(to, from)| *to = Nanos(*from));
        let actors = u8::try_from(m.spent_ns.len()).unwrap_or(u8::MAX);
        Self { group: narrow(m.group), scheduled: Nanos(m.time_ns), actors, spent }
    }
}

impl From<&ForceSample> for schema::Force {
    fn from(r: &ForceSample) -> Self {
        Self {
            time_ns: r.time.0,
            force_n: r.force_n.into(),
            model_version: r.model_version,
            model_age_s: r.model_age_s,
            served_by: r.served_by as i32,
            energy_j: r.energy_j,
            device: r.device.into(),
        }
    }
}

impl From<schema::Force> for ForceSample {
    fn from(m: schema::Force) -> Self {
        Self {
            time: Nanos(m.time_ns),
            force_n: m.force_n.into(),
            model_version: m.model_version,
            model_age_s: m.model_age_s,
            served_by: ServedBy::from_code(code(m.served_by)),
            energy_j: m.energy_j,
            device: narrow(m.device),
        }
    }
}

impl From<&CommandSample> for schema::CommandedForce {
    fn from(r: &CommandSample) -> Self {
        Self {
            time_ns: r.time.0,
            force_n: r.force_n.into(),
            limits: r.limits.into(),
            energy_j: r.energy_j,
            tank_j: r.tank_j,
            device: r.device.into(),
        }
    }
}

impl From<schema::CommandedForce> for CommandSample {
    fn from(m: schema::CommandedForce) -> Self {
        Self {
            time: Nanos(m.time_ns),
            force_n: m.force_n.into(),
            limits: narrow(m.limits),
            energy_j: m.energy_j,
            tank_j: m.tank_j,
            device: narrow(m.device),
        }
    }
}

impl From<&ContactSample> for schema::Contact {
    fn from(r: &ContactSample) -> Self {
        let [b, c] = r.weights;
        Self {
            time_ns: r.time.0,
            mode: r.mode as i32,
            triangle: r.triangle,
            weight_a: 1.0 - b - c,
            weight_b: b,
            weight_c: c,
            normal: r.normal.into(),
            normal_force_n: r.normal_force_n,
            tangential_force_n: r.tangential_force_n,
            device: r.device.into(),
        }
    }
}

impl From<schema::Contact> for ContactSample {
    fn from(m: schema::Contact) -> Self {
        Self {
            time: Nanos(m.time_ns),
            mode: ContactMode::from_code(code(m.mode)),
            triangle: m.triangle,
            weights: [m.weight_b, m.weight_c],
            normal: m.normal.into(),
            normal_force_n: m.normal_force_n,
            tangential_force_n: m.tangential_force_n,
            device: narrow(m.device),
        }
    }
}

impl From<&Resync> for schema::Resync {
    fn from(r: &Resync) -> Self {
        Self {
            time_ns: r.time.0,
            version: r.version,
            age_ns: r.age.0,
            jump_before_n: r.jump_before_n,
            jump_after_n: r.jump_after_n,
            energy_j: r.energy_j,
            device: r.device.into(),
        }
    }
}

impl From<schema::Resync> for Resync {
    fn from(m: schema::Resync) -> Self {
        Self {
            time: Nanos(m.time_ns),
            version: m.version,
            age: Nanos(m.age_ns),
            jump_before_n: m.jump_before_n,
            jump_after_n: m.jump_after_n,
            energy_j: m.energy_j,
            device: narrow(m.device),
        }
    }
}

impl From<&GlobalTick> for schema::GlobalTick {
    fn from(r: &GlobalTick) -> Self {
        Self { time_ns: r.time.0, version: r.version, first_tick: r.first_tick, last_tick: r.last_tick }
    }
}

impl From<schema::GlobalTick> for GlobalTick {
    fn from(m: schema::GlobalTick) -> Self {
        Self { time: Nanos(m.time_ns), version: m.version, first_tick: m.first_tick, last_tick: m.last_tick }
    }
}

impl From<&PortUse> for schema::PortUse {
    fn from(r: &PortUse) -> Self {
        Self {
            time_ns: r.time.0,
            group: r.group.into(),
            port: r.port,
            kind: r.kind as i32,
            tick: r.tick,
            count: r.count,
            sequence: r.sequence,
        }
    }
}

impl From<schema::PortUse> for PortUse {
    fn from(m: schema::PortUse) -> Self {
        Self {
            time: Nanos(m.time_ns),
            group: narrow(m.group),
            port: m.port,
            // An unknown kind reads as one that its sequence number does not fit.
            kind: PortUseKind::from_code(m.kind.cast_unsigned()).unwrap_or_default(),
            tick: m.tick,
            count: m.count,
            sequence: m.sequence,
        }
    }
}

impl From<&ProbeSample> for schema::Probe {
    fn from(r: &ProbeSample) -> Self {
        Self {
            time_ns: r.time.0,
            node: r.node,
            local_m: r.local_m.into(),
            global_m: r.global_m.into(),
            device: r.device.into(),
        }
    }
}

impl From<schema::Probe> for ProbeSample {
    fn from(m: schema::Probe) -> Self {
        Self {
            time: Nanos(m.time_ns),
            node: m.node,
            local_m: m.local_m.into(),
            global_m: m.global_m.into(),
            device: narrow(m.device),
        }
    }
}

impl From<Percentiles<u64>> for schema::Percentiles {
    fn from(p: Percentiles<u64>) -> Self {
        Self { count: p.count, p50_ns: p.p50, p90_ns: p.p90, p99_ns: p.p99, p999_ns: p.p999, max_ns: p.max }
    }
}

impl From<schema::Percentiles> for Percentiles<u64> {
    fn from(m: schema::Percentiles) -> Self {
        Self { count: m.count, p50: m.p50_ns, p90: m.p90_ns, p99: m.p99_ns, p999: m.p999_ns, max: m.max_ns }
    }
}

impl From<&GroupStats> for schema::Stats {
    fn from(s: &GroupStats) -> Self {
        Self {
            time_ns: s.time.0,
            group: s.group.into(),
            released: s.released,
            skipped: s.skipped,
            missed: s.missed,
            lost_records: s.lost_records,
            lateness: s.lateness.into(),
            lateness_last_second: s.lateness_last_second.into(),
            execution: s.execution.into(),
            execution_last_second: s.execution_last_second.into(),
            port_uses: s.port_uses,
            events: s.events.count,
            events_digest: s.events.digest,
        }
    }
}

impl From<schema::Stats> for GroupStats {
    fn from(m: schema::Stats) -> Self {
        Self {
            time: Nanos(m.time_ns),
            group: narrow(m.group),
            released: m.released,
            skipped: m.skipped,
            missed: m.missed,
            lost_records: m.lost_records,
            lateness: m.lateness.into(),
            lateness_last_second: m.lateness_last_second.into(),
            execution: m.execution.into(),
            execution_last_second: m.execution_last_second.into(),
            port_uses: m.port_uses,
            events: EventSum { count: m.events, digest: m.events_digest },
        }
    }
}
