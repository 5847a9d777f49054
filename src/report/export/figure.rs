//! The figures of a rate group that have a distribution.

use crate::log::TickGauge;
use crate::runtime::TickTiming;

/// A duration that each release of a rate group has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Figure {
    /// From when a release was due until its thread ran: woke - scheduled.
    Lateness,
    /// What its work took: end - start.
    Execution,
    /// How far a period was from what was scheduled: |(woke - woke before) - (scheduled - scheduled before)|.
    PeriodError,
    /// From cycle to cycle: the magnitude of the difference of two consecutive period errors, with their signs. Between
    /// releases without a skipped period that is the difference of two periods, each from wake to wake.
    Jitter,
}

impl Figure {
    /// Its name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lateness => "lateness",
            Self::Execution => "execution time",
            Self::PeriodError => "period error",
            Self::Jitter => "cycle-to-cycle jitter",
        }
    }
}

/// Measures a figure release by release.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gauge {
    figure: Figure,
    releases: TickGauge,
}

impl Gauge {
    pub(super) fn new(figure: Figure) -> Self {
        Self { figure, releases: TickGauge::default() }
    }

    /// The figure of this release (ns); `None` for the first ones of figures that compare releases.
    pub(super) fn measure(&mut self, timing: &TickTiming) -> Option<u64> {
        let figures = self.releases.measure(timing);
        match self.figure {
            Figure::Lateness => Some(figures.lateness),
            Figure::Execution => Some(figures.execution),
            Figure::PeriodError => figures.period_error.map(i64::unsigned_abs),
            Figure::Jitter => figures.jitter,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::Nanos;

    #[test]
    fn each_figure_of_four_releases_is_what_its_definition_gives() {
        let timings = [(0, 5, 9), (100, 130, 140), (300, 310, 316), (400, 400, 450)].map(|(scheduled, woke, end)| {
            let (woke, start) = (Nanos(woke), Nanos(woke + 1));
            TickTiming { scheduled: Nanos(scheduled), woke, start, end: Nanos(end), ..TickTiming::default() }
        });
        let measured = |figure| {
            let mut gauge = Gauge::new(figure);
            timings.iter().filter_map(|timing| gauge.measure(timing)).collect::<Vec<_>>()
        };
        assert_eq!(measured(Figure::Lateness), [5, 30, 10, 0]);
        assert_eq!(measured(Figure::Execution), [3, 9, 5, 49]);
        // Periods of 125, 180 and 90 ns where 100, 200 and 100 were scheduled.
        assert_eq!(measured(Figure::PeriodError), [25, 20, 10]);
        // Errors of 25, -20 and -10 ns.
        assert_eq!(measured(Figure::Jitter), [45, 10]);
    }
}
