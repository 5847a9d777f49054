//! The timing of one rate group over a run.

use super::percentiles::{Distribution, Percentiles};
use crate::runtime::GroupMode;
use crate::runtime::{SlipCause, TickTiming};
use crate::runtime::Nanos;

/// How often each cause of a slip or a missed deadline occurred.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CauseCounts([u64; SlipCause::ALL.len()]);

impl CauseCounts {
    fn add(&mut self, cause: SlipCause, count: u64) {
        self.0[cause as usize] += count;
    }

    /// The count of one cause; [`SlipCause::None`] counts those that no cause was recorded for.
    pub fn of(&self, cause: SlipCause) -> u64 {
        self.0[cause as usize]
    }

    /// Every cause with its count, those without a recorded cause last.
    pub fn iter(&self) -> impl Iterator<Item = (SlipCause, u64)> {
        SlipCause::ALL[1..].iter().chain(&SlipCause::ALL[..1]).map(|&cause| (cause, self.of(cause)))
    }

    /// The sum of all causes.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// How one rate group kept time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupReport {
    /// The group's name.
    pub name: String,
    /// Its rate, if the environment of the run is known (Hz).
    pub rate_hz: Option<f64>,
    /// Releases that ran.
    pub released: u64,
    /// Periods skipped, by cause.
    pub skipped: CauseCounts,
    /// Deadlines missed, by cause.
    pub missed: CauseCounts,
    /// Periods between the first and the last release, both counted: `released + skipped` unless records were lost.
    pub elapsed_periods: u64,
    /// Releases in degraded mode, which an overrun policy sets.
    pub in_degraded_mode: u64,
    /// Records that were lost because a ring was full.
    pub lost_records: u64,
    /// Wake-up lateness, woke - scheduled (ns).
    pub lateness: Percentiles<u64>,
    /// Execution time, end - start (ns).
    pub execution: Percentiles<u64>,
    /// Magnitude of the difference between the time from wake-up to wake-up and the time that was scheduled (ns).
    pub period_error: Percentiles<u64>,
    /// Cycle-to-cycle jitter: magnitude of the difference between one period error and the next, with their signs (ns).
    pub jitter: Percentiles<u64>,
    /// Execution time of all releases together.
    pub busy: Nanos,
    /// The scheduled time of the last release.
    pub last_release: Nanos,
}

/// Gathers a [`GroupReport`].
#[derive(Clone, Debug, Default)]
pub(crate) struct GroupCounter {
    released: u64,
    skipped: CauseCounts,
    missed: CauseCounts,
    in_degraded_mode: u64,
    first_tick: u64,
    last: TickTiming,
    lost_records: u64,
    busy: Nanos,
    gauge: TickGauge,
    pub(super) lateness: Distribution,
    pub(super) execution: Distribution,
    pub(super) period_error: Distribution,
    pub(super) jitter: Distribution,
}

/// Measures a group release by release.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TickGauge {
    last: Option<TickTiming>,
    last_error: Option<i64>,
}

impl TickGauge {
    /// The figures of the release that comes next.
    pub(crate) fn measure(&mut self, timing: &TickTiming) -> TickFigures {
        let figures = self.figures(timing);
        (self.last, self.last_error) = (Some(*timing), figures.period_error);
        figures
    }

    /// The figures that a release would have if it came next.
    fn figures(&self, timing: &TickTiming) -> TickFigures {
        let between = |later: Nanos, earlier: Nanos| later.0.wrapping_sub(earlier.0).cast_signed();
        let error = |last: TickTiming| {
            let measured = between(timing.woke, last.woke);
            measured.wrapping_sub(between(timing.scheduled, last.scheduled))
        };
        let period_error = self.last.map(error);
        TickFigures {
            lateness: timing.woke.saturating_sub(timing.scheduled).0,
            execution: timing.end.saturating_sub(timing.start).0,
            period_error,
            jitter: period_error.zip(self.last_error).map(|(error, before)| error.abs_diff(before)),
        }
    }
}

/// The figures of one release (ns).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TickFigures {
    /// Woke - scheduled.
    pub(crate) lateness: u64,
    /// End - start.
    pub(crate) execution: u64,
    /// Time since the wake-up before less the time that was scheduled; `None` for the first release.
    pub(crate) period_error: Option<i64>,
    /// Change of the period error; `None` for the first two.
    pub(crate) jitter: Option<u64>,
}

impl GroupCounter {
    pub(super) fn push(&mut self, timing: &TickTiming) {
        for (cause, slips) in timing.slips_by_cause() {
            self.skipped.add(cause, slips.into());
        }
        self.in_degraded_mode += u64::from(timing.mode == GroupMode::Degraded);
        if timing.missed() {
            self.missed.add(timing.cause, 1);
        }
        let figures = self.gauge.measure(timing);
        self.lateness.push(figures.lateness);
        self.execution.push(figures.execution);
        figures.period_error.into_iter().for_each(|error| self.period_error.push(error.unsigned_abs()));
        figures.jitter.into_iter().for_each(|jitter| self.jitter.push(jitter));
        if self.released == 0 {
            // Periods skipped before the first release belong to the run as well.
            self.first_tick = timing.tick.saturating_sub(timing.slips.into());
        }
        self.busy = self.busy + Nanos(figures.execution);
        self.released += 1;
        self.last = *timing;
    }

    /// Counts releases of which the lateness alone is known (ns).
    pub(super) fn push_lateness(&mut self, lateness: u64, count: u64) {
        self.released += count;
        self.lateness.push_many(lateness, count);
    }

    /// The figures that a release would have if it came next.
    pub(crate) fn figures(&self, timing: &TickTiming) -> TickFigures {
        self.gauge.figures(timing)
    }

    /// Notes that `total` records have been lost since the start.
    pub(super) fn set_lost(&mut self, total: u64) {
        self.lost_records = self.lost_records.max(total);
    }

    pub(super) fn report(&self, name: String, rate_hz: Option<f64>) -> GroupReport {
        let elapsed = self.last.tick.wrapping_sub(self.first_tick).wrapping_add(1);
        GroupReport {
            name,
            rate_hz,
            released: self.released,
            skipped: self.skipped,
            missed: self.missed,
            elapsed_periods: if self.released == 0 { 0 } else { elapsed },
            in_degraded_mode: self.in_degraded_mode,
            lost_records: self.lost_records,
            lateness: self.lateness.percentiles(),
            execution: self.execution.percentiles(),
            period_error: self.period_error.percentiles(),
            jitter: self.jitter.percentiles(),
            busy: self.busy,
            last_release: self.last.scheduled,
        }
    }
}
