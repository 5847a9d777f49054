//! Every figure of a report by a name of its own, such as `local.lateness.p99`: for conditions, comparisons and programs.
//!
//! | name | unit |
//! | --- | --- |
//! | `GROUP.released`, `.skipped`, `.missed`, `.elapsed_periods`, `.in_degraded_mode`, `.lost_records` | counts |
//! | `GROUP.skipped.CAUSE`, `GROUP.missed.CAUSE` | counts; the causes that occurred |
//! | `GROUP.lateness.P`, `.execution.P`, `.period_error.P`, `.jitter.P`, `GROUP.ACTOR.execution.P` | ns |
//! | `GROUP.skipped_share`, `.missed_share` | share of the periods, 0 to 1 |
//! | `GROUP.utilisation`, `coreN.utilisation`, `anywhere.utilisation` | share of the time, 0 to 1 |
//! | `resync.jump_before.P`, `resync.jump_after.P`; `resync.age.P` | N; ns |
//! | `force.model_age.P`; `force.peak`, `force.peak_commanded`; `force.ticks`, `force.not_finite` | s; N; counts |
//! | `contact.free`, `.stick`, `.slip`, `.lost`, `limits.limited` | counts |
//! | `ledger.least`, `ledger.last`, `tank.least` | J |
//! | `skipped`, `missed`, `lost_records`, `events` | counts of the whole run |
//! | `duration` | s |
//!
//! `P` is `count`, `p50`, `p90`, `p99`, `p999` or `max`; without a sample there is only the count. With several devices
//! the name of the device comes first: `left.resync.age.p99`.

use std::collections::HashSet;

use palpate::log::{DeviceReport, GroupSummary, Percentiles};
use palpate::runtime::SlipCause;
use palpate::runtime::SlipCounts;

use super::analysis::TimingReport;

/// The unit of a [`Figure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A number of things.
    Count,
    /// Nanoseconds.
    Nanoseconds,
    /// Seconds.
    Seconds,
    /// Newtons.
    Newtons,
    /// Joules.
    Joules,
    /// A share, 0 to 1.
    Share,
}

/// The value of a figure: integers stay exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FigureValue {
    /// A count or nanoseconds.
    Integer(u64),
    /// Any other value.
    Real(f64),
}

impl FigureValue {
    /// The value as a double, which is exact below 2^53.
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Integer(value) => value as f64,
            Self::Real(value) => value,
        }
    }
}

/// One number of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of the figure, such as `local.lateness.p99`.
    pub name: String,
    /// Value of the figure in its unit.
    pub value: FigureValue,
    /// Unit of the value.
    pub unit: Unit,
}

impl TimingReport {
    /// All figures, in a fixed order.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures = Figures::default();
        let run = &self.run;
        figures.real("duration", Unit::Seconds, run.duration.as_secs_f64());
        for (name, count) in [
            ("skipped", run.skipped()),
            ("missed", run.missed()),
            ("lost_records", run.lost_records()),
            ("events", run.event_count),
        ] {
            figures.count(name, count);
        }
        for (group, timing) in run.groups.iter().zip(&self.groups) {
            figures.group(group);
            for actor in &timing.actors {
                figures.durations(&format!("{}.{}.execution", group.name, actor.name), actor.execution.percentiles);
            }
        }
        let looked_at: HashSet<&str> = run.groups.iter().map(|group| group.name.as_str()).collect();
        for core in &self.cores {
            // A core counts all of its groups, also those that are not looked at.
            for (group, share) in core.groups.iter().filter(|(group, _)| looked_at.contains(group.as_str())) {
                figures.real(&format!("{group}.utilisation"), Unit::Share, *share);
            }
            let core_name = core.cpu.map_or("anywhere".to_owned(), |cpu| format!("core{cpu}"));
            figures.real(&format!("{core_name}.utilisation"), Unit::Share, core.share());
        }
        run.devices.iter().for_each(|device| figures.device(device));
        figures.0
    }
}

/// The name of a cause in a figure.
pub(crate) fn cause_name(cause: SlipCause) -> &'static str {
    match cause {
        SlipCause::None => "unattributed",
        SlipCause::LateWake => "late_wake",
        SlipCause::LongTick => "long_tick",
        SlipCause::StalledPeer => "stalled_peer",
        SlipCause::Policy => "policy",
        SlipCause::Fault => "fault",
    }
}

#[derive(Default)]
struct Figures(Vec<Figure>);

impl Figures {
    fn add(&mut self, name: &str, unit: Unit, value: FigureValue) {
        self.0.push(Figure { name: name.to_owned(), value, unit });
    }

    fn count(&mut self, name: &str, count: u64) {
        self.add(name, Unit::Count, FigureValue::Integer(count));
    }

    fn real(&mut self, name: &str, unit: Unit, value: f64) {
        self.add(name, unit, FigureValue::Real(value));
    }

    fn durations(&mut self, name: &str, percentiles: Percentiles<u64>) {
        self.percentiles(name, Unit::Nanoseconds, percentiles.map(FigureValue::Integer));
    }

    fn reals(&mut self, name: &str, unit: Unit, percentiles: Percentiles<f64>) {
        self.percentiles(name, unit, percentiles.map(FigureValue::Real));
    }

    fn percentiles(&mut self, name: &str, unit: Unit, p: Percentiles<FigureValue>) {
        self.count(&format!("{name}.count"), p.count);
        if p.count > 0 {
            for (which, value) in [("p50", p.p50), ("p90", p.p90), ("p99", p.p99), ("p999", p.p999), ("max", p.max)] {
                self.add(&format!("{name}.{which}"), unit, value);
            }
        }
    }

    fn causes(&mut self, name: &str, counts: SlipCounts) {
        self.count(name, counts.total());
        for (cause, count) in counts.iter().filter(|&(_, count)| count > 0) {
            self.count(&format!("{name}.{}", cause_name(cause)), count);
        }
    }

    fn group(&mut self, group: &GroupSummary) {
        let name = |figure: &str| format!("{}.{figure}", group.name);
        self.count(&name("released"), group.released);
        if group.released > 0 && group.execution.count == 0 {
            // Nothing else is known of it.
            self.durations(&name("lateness"), group.lateness);
            return;
        }
        self.causes(&name("skipped"), group.skipped);
        self.causes(&name("missed"), group.missed);
        for (figure, count) in [
            ("elapsed_periods", group.elapsed_periods),
            ("in_degraded_mode", group.in_degraded_mode),
            ("lost_records", group.lost_records),
        ] {
            self.count(&name(figure), count);
        }
        if group.elapsed_periods > 0 {
            let share = |count: u64| count as f64 / group.elapsed_periods as f64;
            self.real(&name("skipped_share"), Unit::Share, share(group.skipped.total()));
            self.real(&name("missed_share"), Unit::Share, share(group.missed.total()));
        }
        for (figure, percentiles) in [
            ("lateness", group.lateness),
            ("execution", group.execution),
            ("period_error", group.period_error),
            ("jitter", group.jitter),
        ] {
            self.durations(&name(figure), percentiles);
        }
    }

    fn device(&mut self, device: &DeviceReport) {
        let DeviceReport { resyncs, force, contact, limits, .. } = device;
        let prefix = if device.name.is_empty() { String::new() } else { format!("{}.", device.name) };
        let name = |figure: &str| format!("{prefix}{figure}");
        self.reals(&name("resync.jump_before"), Unit::Newtons, resyncs.jump_before_n);
        self.reals(&name("resync.jump_after"), Unit::Newtons, resyncs.jump_after_n);
        self.durations(&name("resync.age"), resyncs.age_ns);
        self.reals(&name("force.model_age"), Unit::Seconds, force.model_age_s);
        self.real(&name("force.peak"), Unit::Newtons, force.peak_n);
        self.real(&name("force.peak_commanded"), Unit::Newtons, force.peak_commanded_n);
        for (figure, count) in [
            ("force.ticks", force.ticks),
            ("force.not_finite", force.not_finite),
            ("contact.free", contact.free),
            ("contact.stick", contact.stick),
            ("contact.slip", contact.slip),
            ("contact.lost", contact.lost),
            ("limits.limited", limits.limited),
        ] {
            self.count(&name(figure), count);
        }
        for (figure, joules) in [
            ("ledger.least", limits.energy.least_j),
            ("ledger.last", limits.energy.last_j),
            ("tank.least", limits.energy.least_tank_j),
        ] {
            self.real(&name(figure), Unit::Joules, joules);
        }
    }
}
