//! One rate group in detail.

use palpate::log::{Distribution, GroupCounter, GroupInfo, TickFigures};
use palpate::runtime::Nanos;
use palpate::runtime::{ActorTimes, SlipCause, TickTiming};

use super::blocks::Block;
use super::distribution::Shape;
use super::over_time::{Absorb, OverTime};

/// Bins of a chart over time, at most.
const BINS: usize = 600;
const LEAST_BIN: Nanos = Nanos(1_000_000);
/// Blocks of a bootstrap, at most; half as many at least once the run is long enough.
const BLOCKS: usize = 128;
const LEAST_BLOCK: Nanos = Nanos(10_000_000);

/// What a group did in one bin of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickBin {
    /// Releases that ran.
    pub released: u64,
    /// Their lateness, summed up (ns).
    pub lateness_sum: u64,
    /// The largest lateness (ns).
    pub lateness_max: u64,
    /// The longest execution (ns).
    pub execution_max: u64,
    /// The longest time from when a release was due to when its work was done (ns): what a deadline limits.
    pub response_max: u64,
    /// Periods skipped, by the number of their [`SlipCause`].
    pub skipped: [u64; SlipCause::ALL.len()],
    /// Deadlines missed, likewise.
    pub missed: [u64; SlipCause::ALL.len()],
}

impl Absorb for TickBin {
    fn absorb(&mut self, later: Self) {
        self.released += later.released;
        self.lateness_sum = self.lateness_sum.saturating_add(later.lateness_sum);
        self.lateness_max = self.lateness_max.max(later.lateness_max);
        self.execution_max = self.execution_max.max(later.execution_max);
        self.response_max = self.response_max.max(later.response_max);
        self.skipped.iter_mut().zip(later.skipped).for_each(|(sum, count)| *sum += count);
        self.missed.iter_mut().zip(later.missed).for_each(|(sum, count)| *sum += count);
    }
}

/// What one actor of a group took of its releases.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActorTiming {
    /// Its name.
    pub name: String,
    /// Execution time (ns).
    pub execution: Shape,
}

/// How one rate group kept time, in detail; the sums are in [`GroupSummary`](palpate::log::GroupSummary).
#[derive(Clone, Debug, PartialEq)]
pub struct GroupTiming {
    /// Its name.
    pub name: String,
    /// From release to release, as scheduled, if there are two.
    pub period: Option<Nanos>,
    /// When a release has to be done, counted from when it is due.
    pub deadline: Option<Nanos>,
    /// The computing time that was declared for a release.
    pub budget: Option<Nanos>,
    /// Nobody waits for its releases.
    pub background: bool,
    /// Wake-up lateness.
    pub lateness: Shape,
    /// Execution time.
    pub execution: Shape,
    /// Magnitude of the period error.
    pub period_error: Shape,
    /// Cycle-to-cycle jitter.
    pub jitter: Shape,
    /// The same by actor; empty if the log does not tell them apart.
    pub actors: Vec<ActorTiming>,
    /// Over the time of the run.
    pub over_time: OverTime<TickBin>,
    /// For a bootstrap.
    pub blocks: OverTime<Block>,
}

/// Gathers a [`GroupTiming`].
#[derive(Clone, Debug)]
pub(super) struct GroupDetail {
    over_time: OverTime<TickBin>,
    blocks: OverTime<Block>,
    actors: Vec<Distribution>,
    first: Option<TickTiming>,
    last: TickTiming,
}

impl Default for GroupDetail {
    fn default() -> Self {
        Self {
            over_time: OverTime::new(BINS, LEAST_BIN),
            blocks: OverTime::new(BLOCKS, LEAST_BLOCK),
            actors: Vec::new(),
            first: None,
            last: TickTiming::default(),
        }
    }
}

impl GroupDetail {
    pub(super) fn push(&mut self, timing: &TickTiming, figures: &TickFigures) {
        let bin = self.over_time.at(timing.scheduled);
        bin.absorb(TickBin {
            released: 1,
            lateness_sum: figures.lateness,
            lateness_max: figures.lateness,
            execution_max: figures.execution,
            response_max: timing.end.saturating_sub(timing.scheduled).0,
            ..TickBin::default()
        });
        for (cause, slips) in timing.slips_by_cause() {
            bin.skipped[cause as usize] += u64::from(slips);
        }
        bin.missed[timing.cause as usize] += u64::from(timing.missed());
        let block = self.blocks.at(timing.scheduled);
        block.released += 1;
        block.skipped += u64::from(timing.slips);
        block.missed += u64::from(timing.missed());
        block.lateness.push(figures.lateness);
        block.execution.push(figures.execution);
        figures.period_error.into_iter().for_each(|error| block.period_error.push(error.unsigned_abs()));
        figures.jitter.into_iter().for_each(|jitter| block.jitter.push(jitter));
        self.first.get_or_insert(*timing);
        self.last = *timing;
    }

    pub(super) fn push_actors(&mut self, times: &ActorTimes) {
        let spent = times.spent();
        if self.actors.len() < spent.len() {
            self.actors.resize_with(spent.len(), Distribution::default);
        }
        self.actors.iter_mut().zip(spent).for_each(|(actor, spent)| actor.push(spent.0));
    }

    /// From release to release, as scheduled, so far.
    pub(super) fn period(&self) -> Option<Nanos> {
        let first = self.first?;
        let periods = self.last.tick.checked_sub(first.tick).filter(|&periods| periods > 0)?;
        Some(Nanos(self.last.scheduled.saturating_sub(first.scheduled).0 / periods))
    }

    pub(super) fn report(&self, name: String, counter: &GroupCounter, info: Option<&GroupInfo>) -> GroupTiming {
        let unknown = GroupInfo::default();
        let info = info.unwrap_or(&unknown);
        let actor = |(number, spent): (usize, &Distribution)| ActorTiming {
            name: info.actor_name(number),
            execution: Shape::of(spent),
        };
        let deadline = self.last.deadline.saturating_sub(self.last.scheduled);
        GroupTiming {
            name,
            period: self.period(),
            deadline: (deadline > Nanos::ZERO).then_some(deadline),
            budget: info.budget,
            background: info.background,
            lateness: Shape::of(&counter.lateness),
            execution: Shape::of(&counter.execution),
            period_error: Shape::of(&counter.period_error),
            jitter: Shape::of(&counter.jitter),
            actors: self.actors.iter().enumerate().map(actor).collect(),
            over_time: self.over_time.clone(),
            blocks: self.blocks.clone(),
        }
    }
}
