//! What a run has to say when it is over.

use crate::primitives::histogram::Histogram;
use crate::records::timing::SlipCounts;
use crate::system::grant::SystemGrant;
use crate::time::{Nanos, Rate};
use std::fmt;

/// The sums of one rate group. `released + skipped == elapsed_periods`, exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupReport {
    /// The group's name.
    pub name: String,
    /// Its rate.
    pub rate: Rate,
    /// Releases that ran.
    pub released: u64,
    /// Periods without a release.
    pub skipped: u64,
    /// The skipped periods by cause; their sum is `skipped`.
    pub slips: SlipCounts,
    /// Periods from the start to the last release or skipped period.
    pub elapsed_periods: u64,
    /// Releases that ended after their deadline.
    pub missed_deadlines: u64,
    /// Releases in which an actor reported a degraded result.
    pub degraded: u64,
    /// Releases in [`GroupMode::Degraded`](crate::GroupMode::Degraded), which an overrun policy sets.
    pub in_degraded_mode: u64,
    /// How often the watchdog of a device-paced group took over.
    pub watchdog_takeovers: u64,
}

/// Why a run ended before it should: the first fatal event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RuntimeFault {
    /// The rate group it happened in.
    pub group: String,
    /// The actor; empty if it was the group itself (an overrun policy).
    pub actor: String,
    /// The scheduled time of the release it happened in.
    pub at: Nanos,
    /// What happened.
    pub what: String,
}

impl fmt::Display for RuntimeFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rate group `{}`", self.group)?;
        if !self.actor.is_empty() {
            write!(f, ", actor `{}`", self.actor)?;
        }
        write!(f, ", t = {} s: {}", self.at.as_secs_f64(), self.what)
    }
}

/// What the releases of one rate group cost, see [`RuntimeBuilder::measure_cost`](crate::RuntimeBuilder::measure_cost).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupCost {
    /// The group's name.
    pub name: String,
    /// CPU time of each release: its actors and the runtime's own books.
    pub cpu: Histogram,
}

/// The report of a run.
///
/// A group that did not end when it was told to has no sums and is the fault, unless there was one before.
#[derive(Clone, Debug, PartialEq)]
pub struct RuntimeReport {
    /// One per rate group that ended, in graph order.
    pub groups: Vec<GroupReport>,
    /// What the system granted.
    pub grant: SystemGrant,
    /// The fault that ended the run, if one did.
    pub fault: Option<RuntimeFault>,
    /// Faults that were answered by starting the group again, group by group.
    pub restarts: Vec<RuntimeFault>,
    /// Records that a full ring dropped; 0 if the graph has no drain.
    pub lost_records: u64,
    /// What the releases cost, in graph order; empty unless it was asked for.
    pub costs: Vec<GroupCost>,
}

impl fmt::Display for RuntimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for group in &self.groups {
            writeln!(
                f,
                "{}: {}, {} released + {} skipped = {} periods, {} deadlines missed, {} degraded",
                group.name,
                group.rate,
                group.released,
                group.skipped,
                group.elapsed_periods,
                group.missed_deadlines,
                group.degraded
            )?;
        }
        for group in self.grant.groups.iter().filter(|group| !group.refused.is_empty()) {
            writeln!(f, "{}: {}", group.name, group.refused)?;
        }
        if self.lost_records > 0 {
            writeln!(f, "{} records lost", self.lost_records)?;
        }
        for fault in &self.restarts {
            writeln!(f, "restarted after a fault: {fault}")?;
        }
        match &self.fault {
            Some(fault) => write!(f, "stopped by a fault: {fault}"),
            None => f.write_str("no fault"),
        }
    }
}
