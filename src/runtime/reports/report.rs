//! What a run has to say when it is over.

use crate::graph::view::GraphView;
use crate::primitives::histogram::Histogram;
use crate::records::timing::SlipCounts;
use crate::reports::text::{by_cause, measured};
use crate::system::grant::SystemGrant;
use crate::time::{Nanos, Rate};
use std::fmt;

/// The sums of one rate group over a run: `released + skipped == elapsed_periods`, exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupReport {
    /// The group's name.
    pub name: String,
    /// The rate of the group.
    pub rate: Rate,
    /// The number of releases that ran.
    pub released: u64,
    /// The number of periods without a release.
    pub skipped: u64,
    /// The skipped periods by cause; their sum is `skipped`.
    pub slips: SlipCounts,
    /// The number of periods from the start to the last release or skipped period.
    pub elapsed_periods: u64,
    /// The number of releases that ended after their deadline.
    pub missed_deadlines: u64,
    /// The missed deadlines by cause; their sum is `missed_deadlines`.
    pub misses: SlipCounts,
    /// The number of releases in which an actor reported a degraded result.
    pub degraded: u64,
    /// The number of releases in [`GroupMode::Degraded`](crate::GroupMode::Degraded), which an overrun policy sets.
    pub in_degraded_mode: u64,
    /// The number of times that the watchdog of a device-paced group took over.
    pub watchdog_takeovers: u64,
    /// The lateness of every release: from its scheduled time to the end of the wait.
    pub lateness: Histogram,
    /// The execution time of every release: from the first actor's start to the last one's end.
    pub execution: Histogram,
}

/// The kind of a fault, as far as a program can act on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RuntimeFaultKind {
    /// An actor panicked. The sentence has its words and, where known, the place in the source.
    Panic,
    /// An actor reported a [fault](crate::Outcome::Fault) with this code of the program's own.
    Reported(u32),
    /// The group's policy is to stop at an overrun, and one came.
    Overrun {
        /// The number of periods that were due at once.
        skipped: u64,
    },
    /// A release did not return for as long as its [restart policy](crate::Restart::hung_after) allows.
    Hung,
    /// A group did not end within [`STOP_BOUND`](crate::STOP_BOUND) of a stop and its wind-down and was given up with its thread.
    GivenUp,
    /// A re-execution left its recording, or the recording lacks what a release needs.
    Recording,
}

/// The first fatal event of a run: why it ended before it should.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RuntimeFault {
    /// The name of the rate group that the fault happened in.
    pub group: String,
    /// The name of the actor; empty if it was the group itself (an overrun policy).
    pub actor: String,
    /// The scheduled time of the release that the fault happened in.
    pub at: Nanos,
    /// The kind of the fault, for programs.
    pub kind: RuntimeFaultKind,
    /// A sentence that says what happened.
    pub what: String,
}

impl RuntimeFault {
    /// A fault of a group itself, not of an actor in it.
    pub(crate) fn of_group(group: &str, at: Nanos, kind: RuntimeFaultKind, what: String) -> Self {
        Self { group: group.to_owned(), actor: String::new(), at, kind, what }
    }
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

/// The cost of the releases of one rate group in virtual time, see
/// [`RuntimeBuilder::measure_cost`](crate::RuntimeBuilder::measure_cost).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupCost {
    /// The group's name.
    pub name: String,
    /// The CPU time of each release: its actors and the runtime's own books.
    pub cpu: Histogram,
}

/// The report of a run.
///
/// A group that did not end when it was told to has no sums and is the fault, unless there was one before.
///
/// ```
/// use palpate_runtime::{Disturbance, Execution, Nanos, Outcome, RateGroup, Runtime, SlipCause, actor_fn};
/// use std::time::Duration;
///
/// let mut graph = Runtime::builder(Execution::Virtual);
/// graph.group(RateGroup::hz(1000).name("loop"), vec![actor_fn("idle", |_| Outcome::Continue)]);
/// // Release 3 takes 2.5 ms: the one at 4 ms is skipped, the one at 5 ms runs late.
/// let long = |n| Disturbance { work: Nanos(if n == 3 { 2_500_000 } else { 0 }), ..Disturbance::default() };
/// let running = graph.disturb("loop", long).until(Nanos(9_000_000)).build()?.start()?;
/// running.wait_for(Duration::MAX);
/// let group = &running.stop().groups[0];
/// assert_eq!((group.released, group.skipped, group.elapsed_periods), (9, 1, 10));
/// assert_eq!(group.slips.of(SlipCause::LongTick), 1);
/// # Ok::<(), palpate_runtime::GraphError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RuntimeReport {
    /// The sums of each rate group that ended, in graph order.
    pub groups: Vec<GroupReport>,
    /// The graph with its times and what went through its ports.
    pub graph: GraphView,
    /// The privileges that the system granted.
    pub grant: SystemGrant,
    /// The fault that ended the run, if one did; else the first of an observer, which ends that one alone.
    pub fault: Option<RuntimeFault>,
    /// Faults that were answered by starting the group again, group by group.
    pub restarts: Vec<RuntimeFault>,
    /// The number of records that a full ring dropped; 0 if the graph has no drain.
    pub lost_records: u64,
    /// The cost of the releases of each group, in graph order; empty unless it was asked for.
    pub costs: Vec<GroupCost>,
}

impl fmt::Display for RuntimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_table(f)?;
        for group in &self.groups {
            for (what, counts) in [("skipped", by_cause(&group.slips)), ("missed", by_cause(&group.misses))] {
                if !counts.is_empty() {
                    writeln!(f, "{what:10} {}: {counts}", group.name)?;
                }
            }
        }
        for group in self.grant.groups.iter().filter(|group| !group.refused.is_empty()) {
            writeln!(f, "refused    {}: {}", group.name, group.refused)?;
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

impl RuntimeReport {
    /// A line per group: counts, then how late releases began and how long they took (p50, p99 and the maximum).
    fn write_table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.groups.iter().map(|group| group.name.chars().count()).max().unwrap_or(0).max(5);
        write!(f, "{:width$} {:>10}", "group", "rate")?;
        ["periods", "released", "skipped", "missed", "degraded"].iter().try_for_each(|name| write!(f, " {name:>9}"))?;
        ["late p50", "p99", "max", "work p50", "p99", "max"].iter().try_for_each(|name| write!(f, " {name:>10}"))?;
        writeln!(f)?;
        for group in &self.groups {
            write!(f, "{:width$} {:>10}", group.name, group.rate.to_string())?;
            let counts = [group.elapsed_periods, group.released, group.skipped, group.missed_deadlines, group.degraded];
            counts.iter().try_for_each(|count| write!(f, " {count:>9}"))?;
            for times in [&group.lateness, &group.execution] {
                let figures = [times.percentile(0.5), times.percentile(0.99), times.max()];
                figures.iter().try_for_each(|time| write!(f, " {:>10}", measured(*time)))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
