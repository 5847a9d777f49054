//! The timing of one rate group over a run.

use crate::log::percentiles::{Distribution, Percentiles};
use crate::runtime::GroupMode;
use crate::runtime::{Nanos, SlipCounts, TickTiming};

/// The timing of one rate group over a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupSummary {
    /// The name of the group.
    pub name: String,
    /// The rate of the group, if the environment of the run is known (Hz).
    pub rate_hz: Option<f64>,
    /// The number of releases that ran.
    pub released: u64,
    /// The number of periods skipped, by cause.
    pub skipped: SlipCounts,
    /// The number of deadlines missed, by cause.
    pub missed: SlipCounts,
    /// The number of periods between the first and the last release, both counted: `released + skipped` unless records were lost.
    pub elapsed_periods: u64,
    /// The number of releases in degraded mode, which an overrun policy sets.
    pub in_degraded_mode: u64,
    /// The number of records that were lost because a ring was full.
    pub lost_records: u64,
    /// The lateness of wake-ups, woke - scheduled (ns).
    pub lateness: Percentiles<u64>,
    /// The execution time, end - start (ns).
    pub execution: Percentiles<u64>,
    /// The magnitude of the difference between the time from wake-up to wake-up and the time that was scheduled (ns).
    pub period_error: Percentiles<u64>,
    /// The cycle-to-cycle jitter: magnitude of the difference between one period error and the next, with their signs (ns).
    pub jitter: Percentiles<u64>,
    /// The execution time of all releases together.
    pub busy: Nanos,
}

/// Gathers a [`GroupSummary`].
#[derive(Clone, Debug, Default)]
pub struct GroupCounter {
    released: u64,
    skipped: SlipCounts,
    missed: SlipCounts,
    in_degraded_mode: u64,
    first_tick: u64,
    last: TickTiming,
    lost_records: u64,
    busy: Nanos,
    gauge: TickGauge,
    /// The lateness of every release (ns).
    pub lateness: Distribution,
    /// The execution time of every release (ns).
    pub execution: Distribution,
    /// The magnitude of the period error of every release but the first (ns).
    pub period_error: Distribution,
    /// The jitter of every release but the first two (ns).
    pub jitter: Distribution,
}

/// Measures a group release by release.
#[derive(Clone, Copy, Debug, Default)]
pub struct TickGauge {
    last: Option<TickTiming>,
    last_error: Option<i64>,
}

impl TickGauge {
    /// The figures of the release that comes next.
    pub fn measure(&mut self, timing: &TickTiming) -> TickFigures {
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
pub struct TickFigures {
    /// The lateness of the wake-up, woke - scheduled (ns).
    pub lateness: u64,
    /// The execution time, end - start (ns).
    pub execution: u64,
    /// The time since the wake-up before less the time that was scheduled (ns); `None` for the first release.
    pub period_error: Option<i64>,
    /// The change of the period error (ns); `None` for the first two releases.
    pub jitter: Option<u64>,
}

impl GroupCounter {
    /// A counter for a run of any length, see [`Distribution::bounded`].
    pub(super) fn bounded() -> Self {
        let [lateness, execution, period_error, jitter] = [(); 4].map(|()| Distribution::bounded());
        Self { lateness, execution, period_error, jitter, ..Self::default() }
    }

    /// Counts one release. Allocates.
    pub fn push(&mut self, timing: &TickTiming) {
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
    pub fn push_lateness(&mut self, lateness: u64, count: u64) {
        self.released = self.released.saturating_add(count);
        self.lateness.push_many(lateness, count);
    }

    /// The figures that a release would have if it came next.
    pub fn figures(&self, timing: &TickTiming) -> TickFigures {
        self.gauge.figures(timing)
    }

    /// Notes that `total` records have been lost since the start.
    pub fn set_lost(&mut self, total: u64) {
        self.lost_records = self.lost_records.max(total);
    }

    /// The sums so far, for the group with this name and rate (Hz).
    pub fn report(&self, name: String, rate_hz: Option<f64>) -> GroupSummary {
        let elapsed = self.last.tick.wrapping_sub(self.first_tick).wrapping_add(1);
        GroupSummary {
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
        }
    }
}
