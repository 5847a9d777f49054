//! What happened in a run, from its records, in one pass.

mod faults;
mod group;
mod haptics;

use std::collections::BTreeMap;

use self::faults::Faults;
pub use self::group::{GroupCounter, GroupSummary, TickFigures, TickGauge};
use self::haptics::HapticsCounter;
pub use self::haptics::{
    ContactReport, DeviceReport, EnergyReport, ForceReport, LimitReport, ResyncReport, TouchReport, magnitude,
};
use super::entry::LogEntry;
use super::records::{Environment, Level, LogRecord, LoggedExecution, TextEvent};
use crate::runtime::Nanos;
use crate::runtime::{Event, TickTiming};

/// Events that a report lists; the others are only counted.
const EVENTS_KEPT: usize = 100;

/// The findings of an [`Analysis`]; as text by [`Display`](std::fmt::Display).
#[derive(Clone, Debug, PartialEq)]
pub struct RunReport {
    /// The environment of the run, if it is known.
    pub environment: Option<Environment>,
    /// The time of the last record.
    pub duration: Nanos,
    /// The rate groups in their order.
    pub groups: Vec<GroupSummary>,
    /// The devices in their order; there is always one.
    pub devices: Vec<DeviceReport>,
    /// The first events, in words.
    pub events: Vec<TextEvent>,
    /// The number of all events.
    pub event_count: u64,
    /// The gravest event.
    pub worst_event: Option<Level>,
    /// The first fault that no restart answered.
    pub fault: Option<TextEvent>,
    /// The last restart of a rate group.
    pub restart: Option<TextEvent>,
    /// The damage of the log that the records came from; set by whoever read it.
    pub damage: Option<String>,
    /// The number of messages in the log by topic; set by whoever read it.
    pub messages: BTreeMap<String, u64>,
}

impl Default for RunReport {
    /// The report of a run of which nothing is known.
    fn default() -> Self {
        Analysis::default().report()
    }
}

impl RunReport {
    /// True if the run was in simulated time, where lateness is zero by construction.
    pub fn is_virtual(&self) -> bool {
        self.environment.as_ref().is_some_and(|environment| environment.execution == LoggedExecution::Virtual)
    }

    /// The number of records lost because a ring was full, all groups together.
    pub fn lost_records(&self) -> u64 {
        self.groups.iter().map(|group| group.lost_records).fold(0, u64::saturating_add)
    }

    /// The number of periods skipped, all groups together but those in the background.
    pub fn skipped(&self) -> u64 {
        self.foreground().map(|group| group.skipped.total()).sum()
    }

    /// The number of deadlines missed, all groups together but those in the background.
    pub fn missed(&self) -> u64 {
        self.foreground().map(|group| group.missed.total()).sum()
    }

    /// True if nobody waits for the releases of the group `name`.
    pub fn is_background(&self, name: &str) -> bool {
        let groups = self.environment.iter().flat_map(|environment| &environment.groups);
        groups.into_iter().any(|group| group.background && group.name == name)
    }

    fn foreground(&self) -> impl Iterator<Item = &GroupSummary> {
        self.groups.iter().filter(|group| !self.is_background(&group.name))
    }
}

/// Gathers a [`RunReport`] from records in any order that is in time order within each group.
///
/// Memory grows with the number of distinct durations, unless it is [`bounded`](Self::bounded).
///
/// ```
/// use palpate::log::{Analysis, LogRecord};
/// use palpate::runtime::TickTiming;
///
/// let mut analysis = Analysis::default();
/// analysis.push(&LogRecord::Tick(TickTiming::default()));
/// assert_eq!(analysis.report().groups[0].released, 1);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Analysis {
    is_bounded: bool,
    environment: Option<Environment>,
    duration: Nanos,
    groups: BTreeMap<u16, GroupCounter>,
    /// By device.
    haptics: BTreeMap<u16, HapticsCounter>,
    events: Vec<TextEvent>,
    faults: Faults,
    event_count: u64,
    worst_event: Option<Level>,
}

impl Analysis {
    /// An analysis for a run of any length while it goes on: see [`Distribution::bounded`](super::Distribution::bounded).
    pub fn bounded() -> Self {
        Self { is_bounded: true, ..Self::default() }
    }

    fn group(&mut self, group: u16) -> &mut GroupCounter {
        let bounded = self.is_bounded;
        self.groups
            .entry(group)
            .or_insert_with(|| if bounded { GroupCounter::bounded() } else { GroupCounter::default() })
    }

    /// Counts one record. Allocates.
    pub fn push(&mut self, record: &LogRecord) {
        self.duration = self.duration.max(record.time());
        match record {
            LogRecord::Tick(r) => self.group(r.group).push(r),
            LogRecord::Event(r) => self.push_event(r),
            LogRecord::Force(r) => self.device(record).push_force(r),
            LogRecord::Command(r) => self.device(record).push_command(r),
            LogRecord::Contact(r) => self.device(record).push_contact(r),
            LogRecord::Resync(r) => self.device(record).push_resync(r),
            LogRecord::Actors(_)
            | LogRecord::Tool(_)
            | LogRecord::ContactPoint(_)
            | LogRecord::Global(_)
            | LogRecord::Port(_)
            | LogRecord::Input(_)
            | LogRecord::Probe(_)
            | LogRecord::Link(_) => {}
        }
    }

    fn device(&mut self, record: &LogRecord) -> &mut HapticsCounter {
        let bounded = self.is_bounded;
        let new = || if bounded { HapticsCounter::bounded() } else { HapticsCounter::default() };
        self.haptics.entry(record.device()).or_insert_with(new)
    }

    /// Counts one entry of a log.
    pub fn push_entry(&mut self, entry: &LogEntry) {
        match entry {
            LogEntry::Environment(environment) => self.set_environment(environment),
            LogEntry::Attachment { .. } | LogEntry::Scene(_) => {}
            LogEntry::Record(record) => self.push(record),
            LogEntry::Stats(stats) => self.set_lost(stats.group, stats.lost_records),
            LogEntry::Text(event) => self.push_text(event),
        }
    }

    /// Says what the run is about: names and rates of groups, limiter stages.
    pub fn set_environment(&mut self, environment: &Environment) {
        self.environment = Some(environment.clone());
    }

    /// Counts one event in words.
    pub fn push_text(&mut self, event: &TextEvent) {
        self.event_count += 1;
        self.worst_event = self.worst_event.max(Some(event.level));
        self.faults.push(event);
        if self.events.len() < EVENTS_KEPT {
            self.events.push(event.clone());
        }
    }

    /// Notes that `total` records of `group` have been lost since the start.
    pub fn set_lost(&mut self, group: u16, total: u64) {
        self.group(group).set_lost(total);
    }

    /// The environment of the run, if it is known.
    pub fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// Counts releases of which the lateness alone is known (ns).
    pub fn push_lateness(&mut self, group: u16, lateness: u64, count: u64) {
        self.group(group).push_lateness(lateness, count);
    }

    /// The figures of a release that is pushed next.
    pub fn figures(&self, timing: &TickTiming) -> TickFigures {
        self.groups
            .get(&timing.group)
            .map_or_else(|| GroupCounter::default().figures(timing), |group| group.figures(timing))
    }

    /// The groups that have records and those that the environment promised: they are part of a report though they never
    /// ran.
    pub fn groups(&self) -> BTreeMap<u16, GroupCounter> {
        let promised = self.environment.as_ref().map_or(0, |environment| environment.groups.len());
        let mut groups = self.groups.clone();
        for group in 0..u16::try_from(promised).unwrap_or(u16::MAX) {
            groups.entry(group).or_default();
        }
        groups
    }

    /// The findings so far.
    pub fn report(&self) -> RunReport {
        let groups = self.groups();
        let unknown = Environment::default();
        let environment = self.environment.as_ref().unwrap_or(&unknown);
        let rate =
            |group: u16| environment.groups.get(usize::from(group)).map(|info| info.rate_hz).filter(|hz| *hz > 0.0);
        let groups = groups.iter().map(|(&id, counter)| counter.report(environment.group_name(id), rate(id))).collect();
        let mut events = self.events.clone();
        events.sort_by_key(|event| event.time);
        RunReport {
            environment: self.environment.clone(),
            duration: self.duration,
            groups,
            devices: self.devices(environment),
            events,
            event_count: self.event_count,
            worst_event: self.worst_event,
            fault: self.faults.first(),
            restart: self.faults.restart(),
            damage: None,
            messages: BTreeMap::new(),
        }
    }

    /// Those that the environment promised, those with records, and at least one.
    fn devices(&self, environment: &Environment) -> Vec<DeviceReport> {
        let mut devices = self.haptics.clone();
        for device in 0..u16::try_from(environment.devices.len().max(1)).unwrap_or(u16::MAX) {
            devices.entry(device).or_default();
        }
        let name = |device| environment.device_prefix(device).trim_start_matches('/').to_owned();
        devices.iter().map(|(&device, counter)| counter.report(name(device), &environment.limit_stages)).collect()
    }

    fn push_event(&mut self, event: &Event) {
        let name = self.environment.as_ref().map_or_else(
            || Environment::default().group_name(event.group),
            |environment| environment.group_name(event.group),
        );
        self.push_text(&TextEvent::describe(event, &name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{CommandSample, ContactReport, ContactSample, ForceSample, GroupInfo, Resync, TouchReport};
    use crate::model::contact::ContactMode;
    use crate::runtime::GroupMode;
    use crate::runtime::{SlipCause, TickTiming};

    fn tick(tick: u64, late: u64, work: u64, slips: u32, cause: SlipCause) -> LogRecord {
        let scheduled = Nanos(tick * 1_000_000);
        let woke = scheduled + Nanos(late);
        let deadline = scheduled + Nanos(1_000_000);
        LogRecord::Tick(TickTiming {
            group: 0,
            tick,
            scheduled,
            woke,
            start: woke,
            end: woke + Nanos(work),
            deadline,
            slips,
            cause,
            ..TickTiming::default()
        })
    }

    #[test]
    fn slips_that_a_policy_gave_up_and_degraded_releases_are_counted_apart() {
        let mut analysis = Analysis::default();
        let timing = TickTiming { tick: 4, slips: 3, cause: SlipCause::LongTick, ..TickTiming::default() };
        analysis.push(&LogRecord::Tick(TickTiming { given_up: 1, mode: GroupMode::Degraded, ..timing }));
        let group = &analysis.report().groups[0];
        assert_eq!((group.skipped.of(SlipCause::LongTick), group.skipped.of(SlipCause::Policy)), (2, 1));
        assert_eq!(group.in_degraded_mode, 1);
    }

    // Check that every period is accounted for and every slip and miss keeps its cause.
    #[test]
    fn slips_and_misses_are_counted_by_cause_and_add_up_to_the_elapsed_periods() {
        let mut analysis = Analysis::default();
        analysis.push(&tick(0, 10, 5, 0, SlipCause::None));
        analysis.push(&tick(1, 30, 2_500_000, 0, SlipCause::LongTick));
        analysis.push(&tick(4, 20, 5, 2, SlipCause::LongTick));
        analysis.push(&tick(6, 20, 5, 1, SlipCause::LateWake));
        let report = analysis.report();
        let group = &report.groups[0];
        assert_eq!((group.released, group.skipped.total(), group.elapsed_periods), (4, 3, 7));
        assert_eq!((group.skipped.of(SlipCause::LongTick), group.skipped.of(SlipCause::LateWake)), (2, 1));
        assert_eq!((group.missed.total(), group.missed.of(SlipCause::LongTick)), (1, 1));
        assert_eq!((group.lateness.p50, group.lateness.max), (20, 30));
        assert_eq!((group.period_error.count, group.period_error.p50, group.period_error.max), (3, 10, 20));
        assert_eq!(group.execution.max, 2_500_000);
        assert_eq!(report.duration, Nanos(6_000_000));
    }

    #[test]
    fn force_contact_resyncs_and_limits_are_summed_up() {
        let mut analysis = Analysis::default();
        analysis.set_environment(&Environment {
            limit_stages: vec!["finite".into(), "clamp".into()],
            groups: vec![GroupInfo::new("haptic", 1000.0)],
            ..Environment::default()
        });
        for n in 1..=100_u64 {
            let time = Nanos(n * 1_000_000);
            let force_n = if n == 50 { [f64::NAN, 0.0, 0.0] } else { [0.0, 3.0, -4.0] };
            analysis.push(&LogRecord::Force(ForceSample {
                time,
                force_n,
                model_age_s: n as f64,
                ..ForceSample::default()
            }));
            let limits = if n <= 10 { 0b1010 } else { 0 };
            analysis.push(&LogRecord::Command(CommandSample {
                time,
                force_n: [1.0, 0.0, 0.0],
                limits,
                ..CommandSample::default()
            }));
            let mode = ContactMode::from_code((n % 4) as u16);
            analysis.push(&LogRecord::Contact(ContactSample { time, mode, ..ContactSample::default() }));
        }
        analysis.push(&LogRecord::Resync(Resync { jump_before_n: 0.5, age: Nanos(7), ..Resync::default() }));
        let report = analysis.report();
        assert_eq!(
            (report.devices[0].force.ticks, report.devices[0].force.peak_n, report.devices[0].force.not_finite),
            (100, 5.0, 1)
        );
        assert_eq!((report.devices[0].force.peak_commanded_n, report.devices[0].force.model_age_s.p99), (1.0, 99.0));
        assert_eq!(report.devices[0].contact, ContactReport { free: 25, stick: 25, slip: 25, lost: 25 });
        assert_eq!(report.devices[0].limits.stages, [("clamp".to_owned(), 10), ("bit 3".to_owned(), 10)]);
        assert_eq!(report.devices[0].limits.share(), 0.1);
        assert_eq!((report.devices[0].resyncs.jump_before_n.max, report.devices[0].resyncs.age_ns.p50), (0.5, 7));
        assert_eq!((report.groups[0].name.as_str(), report.groups[0].released), ("haptic", 0));
    }

    #[test]
    fn a_tool_with_a_shape_is_summed_up_by_places_pressure_and_area() {
        let mut analysis = Analysis::default();
        let contact = |count, normal_force_n, area_m2| {
            LogRecord::Contact(ContactSample { count, normal_force_n, area_m2, ..ContactSample::default() })
        };
        [contact(1, 3.0, 0.0), contact(0, 0.0, 0.0)].iter().for_each(|record| analysis.push(record));
        assert_eq!(analysis.report().devices[0].touch, None, "a point");
        [contact(7, 0.5, 1.0), contact(3, 2.0, 0.5), contact(5, 1.0, 0.125), contact(0, f32::NAN, 0.25)]
            .iter()
            .for_each(|record| analysis.push(record));
        let expected = TouchReport { most_places: 7, peak_pressure_pa: 8.0, area_at_peak_m2: 0.5 };
        assert_eq!(analysis.report().devices[0].touch, Some(expected));
        let text = analysis.report().to_string();
        assert!(text.contains("touch      7 places at most, mean pressure up to 8.00 Pa"), "{text}");
    }

    #[test]
    fn events_are_listed_in_time_order_with_the_gravest_level() {
        let mut analysis = Analysis::default();
        analysis.push(&LogRecord::Event(Event { stamp: Nanos(9), group: 1, code: Event::PANIC, detail: 0 }));
        analysis.push_text(&TextEvent { time: Nanos(3), level: Level::Warning, message: "mlock refused".into() });
        let report = analysis.report();
        let messages: Vec<&str> = report.events.iter().map(|event| event.message.as_str()).collect();
        assert_eq!(messages, ["mlock refused", "group-1: actor 0 panicked"]);
        assert_eq!((report.event_count, report.worst_event), (2, Some(Level::Error)));
    }
}
