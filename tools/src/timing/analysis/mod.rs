//! One pass over a log.

mod blocks;
mod cyclictest;
mod device;
mod distribution;
mod group;
mod over_time;
mod recent;
mod worst;

use std::collections::{BTreeMap, HashMap};

use palpate::log::{Analysis, Environment, GroupInfo, LogEntry, LogRecord, RunReport, Window};
use palpate::runtime::Nanos;
use palpate::runtime::TickTiming;

pub use blocks::{Block, Buckets};
pub use cyclictest::read_cyclictest;
pub use device::{DeviceTiming, ForceBin, ResyncBin};
pub use distribution::Shape;
pub use group::{ActorTiming, GroupTiming, TickBin};
pub use recent::ForcePoint;
#[cfg(test)]
pub use recent::Moment;
pub use worst::WorstTick;

use group::GroupDetail;
use recent::Recent;
use worst::Worst;

/// The part of a log that is looked at: a span of log time and some of the rate groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Span of log time.
    pub window: Window,
    /// Names of the groups that are looked at; all if empty.
    pub groups: Vec<String>,
}

impl Selection {
    /// True if the group `name` is looked at.
    pub fn has_group(&self, name: &str) -> bool {
        self.groups.is_empty() || self.groups.iter().any(|group| group == name)
    }
}

/// The groups on one core.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoreUse {
    /// The core; `None` for groups that the system may put anywhere.
    pub cpu: Option<usize>,
    /// Each group with the share of the time (0 to 1) in which it was at work, from the start of a release to its end.
    /// That is elapsed time: what took the core away meanwhile is in it.
    pub groups: Vec<(String, f64)>,
}

impl CoreUse {
    /// The share of all its groups together.
    pub fn share(&self) -> f64 {
        self.groups.iter().map(|(_, share)| share).sum()
    }
}

/// The timing of a run, as its log tells it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimingReport {
    /// Sums over the run, as they are printed at its end.
    pub run: RunReport,
    /// Each group in detail, in the order of [`RunReport::groups`].
    pub(crate) groups: Vec<GroupTiming>,
    /// Each device over time, in the order of [`RunReport::devices`].
    pub(crate) devices: Vec<DeviceTiming>,
    /// Processor cores with the groups on them; those that may run anywhere come last.
    pub(crate) cores: Vec<CoreUse>,
    /// The worst ticks, the worst first.
    pub worst: Vec<WorstTick>,
    /// The time of the first record and of the last.
    pub(crate) span: [Nanos; 2],
}

impl TimingReport {
    /// Gives groups other names, all at once, so that they are compared with groups of those names: `(old, new)` each. A
    /// group that has one of the new names already is set aside.
    pub fn rename_groups(&mut self, names: &[(String, String)]) {
        let sums = self.run.groups.iter_mut().map(|group| &mut group.name);
        let details = self.groups.iter_mut().map(|group| &mut group.name);
        let on_cores = self.cores.iter_mut().flat_map(|core| &mut core.groups).map(|(name, _)| name);
        let worst = self.worst.iter_mut().map(|worst| &mut worst.group);
        for name in sums.chain(details).chain(on_cores).chain(worst) {
            match names.iter().find(|(old, _)| old == name) {
                Some((_, new)) => new.clone_into(name),
                None if names.iter().any(|(_, new)| new == name) => name.push_str(" (not compared)"),
                None => {}
            }
        }
    }
}

/// Gathers a [`TimingReport`] from the entries of a log, in their order. Allocates.
#[derive(Clone, Debug, Default)]
pub struct TimingAnalysis {
    selection: Selection,
    sums: Analysis,
    groups: BTreeMap<u16, GroupDetail>,
    devices: BTreeMap<u16, DeviceTiming>,
    recent: Recent,
    worst: Worst,
    span: Option<[Nanos; 2]>,
}

impl TimingAnalysis {
    /// An analysis of the part of a log that `selection` names.
    pub fn new(selection: Selection) -> Self {
        Self { selection, ..Self::default() }
    }

    /// Takes in one entry of the log, in the log's order.
    pub fn push_entry(&mut self, entry: &LogEntry) {
        match entry {
            LogEntry::Record(record) => self.push(record),
            LogEntry::Text(event) if !self.selection.window.contains(event.time) => {}
            // Sums since the start of the run say nothing about a part of it, but for what was lost.
            entry => self.sums.push_entry(entry),
        }
    }

    /// Counts a lateness of a group as often as it occurred, where nothing else is known of its releases (ns).
    pub(super) fn push_lateness(&mut self, group: u16, lateness: u64, count: u64) {
        self.sums.push_lateness(group, lateness, count);
    }

    fn push(&mut self, record: &LogRecord) {
        let time = record.time();
        if !self.selection.window.contains(time) {
            return;
        }
        let [first, last] = self.span.unwrap_or([time; 2]);
        self.span = Some([first.min(time), last.max(time)]);
        match record {
            LogRecord::Tick(timing) => self.push_tick(timing),
            LogRecord::Actors(times) => {
                self.recent.push_actors(times);
                self.groups.entry(times.group).or_default().push_actors(times);
            }
            LogRecord::Force(sample) => {
                self.recent.push_force(sample);
                self.devices.entry(sample.device).or_default().push_force(sample);
            }
            LogRecord::Command(sample) => {
                self.recent.push_command(sample);
                self.devices.entry(sample.device).or_default().push_command(sample);
            }
            LogRecord::Resync(resync) => self.devices.entry(resync.device).or_default().push_resync(resync),
            _ => {}
        }
        self.sums.push(record);
    }

    fn push_tick(&mut self, timing: &TickTiming) {
        let figures = self.sums.figures(timing);
        let detail = self.groups.entry(timing.group).or_default();
        detail.push(timing, &figures);
        self.recent.push_tick(timing);
        if !self.is_looked_at(timing.group) {
            return;
        }
        let deadline = timing.deadline.saturating_sub(timing.scheduled);
        let period = self.groups.get(&timing.group).and_then(GroupDetail::period);
        if period.is_none() && timing.deadline == timing.end {
            // The first release of a group whose deadlines are not in the log.
            return;
        }
        let period = period.unwrap_or(deadline);
        self.worst.push(timing, period, &self.recent);
    }

    /// Nobody waits for a group in the background: it is among the worst only if it was asked for.
    fn is_looked_at(&self, group: u16) -> bool {
        let Some(environment) = self.sums.environment() else { return true };
        let info = environment.groups.get(usize::from(group));
        let is_background = info.is_some_and(|info| info.background);
        self.selection.has_group(&environment.group_name(group)) && !(is_background && self.selection.groups.is_empty())
    }

    /// The report on all entries that were read.
    pub fn report(self) -> TimingReport {
        let mut run = self.sums.report();
        let span = self.span.unwrap_or_default();
        if self.selection.window.from > Nanos::ZERO {
            run.duration = span[1].saturating_sub(span[0]);
        }
        let unknown = Environment::default();
        let environment = self.sums.environment().unwrap_or(&unknown).clone();
        let name = |group: u16| environment.group_name(group);
        let empty = GroupDetail::default();
        let mut groups = Vec::new();
        for (&number, counter) in &self.sums.groups() {
            let detail = self.groups.get(&number).unwrap_or(&empty);
            let info = environment.groups.get(usize::from(number));
            groups.push(detail.report(name(number), counter, info));
        }
        // A core is as busy as it is, whichever group is looked at.
        let cores = cores(&run, &environment, span);
        let lost = run.lost_records();
        run.groups.retain(|group| self.selection.has_group(&group.name));
        // Whose records were lost is not known: the first group has the sum, whichever that is.
        let hidden = lost.saturating_sub(run.lost_records());
        run.groups.first_mut().into_iter().for_each(|first| first.lost_records += hidden);
        groups.retain(|group| self.selection.has_group(&group.name));
        let mut devices = Vec::new();
        for (number, device) in (0..).zip(&run.devices) {
            let over_time = self.devices.get(&number).cloned().unwrap_or_default();
            devices.push(DeviceTiming { name: device.name.clone(), ..over_time });
        }
        let unknown = GroupInfo::default();
        let info = |group: u16| environment.groups.get(usize::from(group)).unwrap_or(&unknown);
        let actor = |group: u16, actor: usize| info(group).actor_name(actor);
        TimingReport { cores, worst: self.worst.report(&self.recent, name, actor), run, groups, devices, span }
    }
}

/// The use of each core in the time between `from` and `to`.
fn cores(run: &RunReport, environment: &Environment, [from, to]: [Nanos; 2]) -> Vec<CoreUse> {
    let elapsed = to.saturating_sub(from).as_secs_f64();
    let mut cores: BTreeMap<usize, CoreUse> = BTreeMap::new();
    let mut anywhere = CoreUse::default();
    // The first of a name, as it is looked for everywhere.
    let cpus: HashMap<&str, _> = environment.groups.iter().rev().map(|info| (info.name.as_str(), info.cpu)).collect();
    for group in run.groups.iter().filter(|group| group.released > 0 && elapsed > 0.0) {
        let cpu = cpus.get(group.name.as_str()).copied().flatten();
        let on = match cpu {
            Some(cpu) => cores.entry(cpu).or_insert_with(|| CoreUse { cpu: Some(cpu), groups: Vec::new() }),
            None => &mut anywhere,
        };
        on.groups.push((group.name.clone(), group.busy.as_secs_f64() / elapsed));
    }
    let anywhere = (!anywhere.groups.is_empty()).then_some(anywhere);
    cores.into_values().chain(anywhere).collect()
}
