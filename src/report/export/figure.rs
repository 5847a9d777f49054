//! The figures of a rate group that have a distribution.

use crate::runtime::record::TickTiming;
use crate::time::Nanos;

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
    /// From cycle to cycle: the magnitude of the difference of two consecutive periods, each from wake to wake. A
    /// skipped period makes one period long, and shows in two differences.
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
    last: Option<TickTiming>,
    period: Option<Nanos>,
}

impl Gauge {
    pub(super) fn new(figure: Figure) -> Self {
        Self { figure, last: None, period: None }
    }

    /// The figure of this release (ns); `None` for the first ones of figures that compare releases.
    pub(super) fn measure(&mut self, timing: &TickTiming) -> Option<u64> {
        let last = self.last.replace(*timing);
        let period = last.map(|last| timing.woke.saturating_sub(last.woke));
        let period_before = std::mem::replace(&mut self.period, period);
        match self.figure {
            Figure::Lateness => Some(timing.woke.saturating_sub(timing.scheduled).0),
            Figure::Execution => Some(timing.end.saturating_sub(timing.start).0),
            Figure::PeriodError => {
                let scheduled = timing.scheduled.saturating_sub(last?.scheduled);
                Some(period?.0.abs_diff(scheduled.0))
            }
            Figure::Jitter => Some(period?.0.abs_diff(period_before?.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(measured(Figure::Jitter), [55, 90]);
    }
}
