//! One of the worst moments as both pictures of it show it, the drawn one and that of the script: lanes and forces.

use palpate::log::magnitude;
use palpate::runtime::Nanos;
use palpate::runtime::{SlipCause, TickTiming};

use crate::timing::{ForcePoint, TimingReport, WorstTick};

/// What is shown of a lane and of a force, at most: the page stays small however fast the groups are.
const MOST_TICKS: usize = 400;
const MOST_FORCES: usize = 500;
/// Around the worst tick, at least, in the part that is shown first.
const LEAST_AROUND: Nanos = Nanos(1_000_000);

/// A release and what its actors took of it.
pub(crate) struct Bar<'a> {
    pub(crate) timing: &'a TickTiming,
    pub(crate) spent: &'a [Nanos],
}

impl Bar<'_> {
    /// The times between which periods were skipped before it, by cause.
    pub(crate) fn skipped(&self, period: Nanos) -> Vec<(SlipCause, Nanos, Nanos)> {
        let mut from = self.timing.scheduled.saturating_sub(Nanos(period.0.saturating_mul(self.timing.slips.into())));
        let mut spans = Vec::new();
        for (cause, count) in self.timing.slips_by_cause() {
            let to = from + Nanos(period.0.saturating_mul(count.into()));
            if count > 0 {
                spans.push((cause, from, to));
            }
            from = to;
        }
        spans
    }
}

/// A rate group.
pub(crate) struct Lane<'a> {
    pub(crate) name: String,
    pub(crate) period: Nanos,
    pub(crate) actors: Vec<String>,
    pub(crate) bars: Vec<Bar<'a>>,
}

/// The force of one device: time, magnitude before the safety pipeline and after it (N).
pub(crate) struct Trace {
    pub(crate) name: String,
    pub(crate) points: Vec<(Nanos, f64, Option<f64>)>,
}

/// A moment.
pub(crate) struct View<'a> {
    pub(crate) worst: &'a WorstTick,
    pub(crate) lanes: Vec<Lane<'a>>,
    pub(crate) traces: Vec<Trace>,
    /// When the first of the periods was due that the worst tick stands for: time zero of the pictures.
    pub(crate) due: Nanos,
    /// All that is known.
    pub(crate) range: [Nanos; 2],
    /// What is shown first.
    pub(crate) focus: [Nanos; 2],
}

impl<'a> View<'a> {
    pub(crate) fn of(report: &TimingReport, worst: &'a WorstTick) -> Self {
        let WorstTick { timing, moment, .. } = worst;
        let due = timing.end.saturating_sub(worst.overdue);
        let around = Nanos(worst.overdue.0 / 5 * 3).max(LEAST_AROUND).max(Nanos(worst.period.0.saturating_mul(2)));
        let focus = [due.saturating_sub(around).max(moment.from), (timing.end + around).min(moment.to)];
        let environment = report.run.environment.clone().unwrap_or_default();
        let mut lanes: Vec<Lane<'a>> = Vec::new();
        for same in moment.ticks.chunk_by(|a, b| a.group == b.group) {
            let group = same[0].group;
            let name = environment.group_name(group);
            let period = report.groups.iter().find(|group| group.name == name).and_then(|group| group.period);
            let info = environment.groups.get(usize::from(group));
            let times = moment.actors.iter().filter(|times| times.group == group);
            let spent: std::collections::HashMap<Nanos, &[Nanos]> =
                times.map(|times| (times.scheduled, times.spent())).collect();
            let of = |timing: &'a TickTiming| Bar {
                timing,
                spent: spent.get(&timing.scheduled).copied().unwrap_or_default(),
            };
            let most = spent.values().map(|spent| spent.len()).max().unwrap_or(0);
            let actor = |number| info.map_or_else(|| format!("actor {number}"), |info| info.actor_name(number));
            lanes.push(Lane {
                name,
                period: period.unwrap_or_default(),
                actors: (0..most).map(actor).collect(),
                bars: nearest(same, MOST_TICKS, due, |tick| tick.scheduled).into_iter().map(of).collect(),
            });
        }
        Self { worst, lanes, traces: traces(report, worst, due), due, range: [moment.from, moment.to], focus }
    }

    /// Time counted from [`due`](Self::due) (ns).
    pub(crate) fn relative(&self, time: Nanos) -> i64 {
        time.0.wrapping_sub(self.due.0).cast_signed()
    }

    /// The lane and the bar of the worst tick, if they are shown.
    pub(crate) fn place(&self) -> Option<(usize, usize)> {
        self.lanes.iter().enumerate().find_map(|(lane, bars)| {
            let place = bars.bars.iter().position(|bar| *bar.timing == self.worst.timing)?;
            Some((lane, place))
        })
    }
}

fn traces(report: &TimingReport, worst: &WorstTick, due: Nanos) -> Vec<Trace> {
    let mut traces = Vec::new();
    for (number, device) in (0_u16..).zip(&report.run.devices) {
        let points: Vec<ForcePoint> =
            worst.moment.forces.iter().filter(|point| point.device == number).copied().collect();
        if points.is_empty() {
            continue;
        }
        let shown = nearest(&points, MOST_FORCES, due, |point| point.time);
        let point = |point: &ForcePoint| (point.time, magnitude(point.force_n), point.commanded_n.map(magnitude));
        traces.push(Trace { name: device.name.clone(), points: shown.into_iter().map(point).collect() });
    }
    traces
}

/// At most `most` of `all`, those nearest to a time, in their order.
fn nearest<T>(all: &[T], most: usize, time: Nanos, of: impl Fn(&T) -> Nanos) -> Vec<&T> {
    let mut kept: Vec<&T> = all.iter().collect();
    if kept.len() > most {
        kept.sort_by_key(|one| of(one).0.abs_diff(time.0));
        kept.truncate(most);
        kept.sort_by_key(|one| of(one));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_nearest_to_the_moment_are_kept() {
        let times: Vec<Nanos> = (0..100).map(Nanos).collect();
        let kept: Vec<u64> = nearest(&times, 5, Nanos(40), |time| *time).into_iter().map(|time| time.0).collect();
        assert_eq!(kept, [38, 39, 40, 41, 42]);
        assert_eq!(nearest(&times, 100, Nanos(40), |time| *time).len(), 100);
    }

    #[test]
    fn what_the_policy_gave_up_is_told_from_what_was_skipped_before() {
        let timing = TickTiming {
            scheduled: Nanos(50),
            slips: 4,
            given_up: 1,
            cause: SlipCause::LongTick,
            ..TickTiming::default()
        };
        let spans = Bar { timing: &timing, spent: &[] }.skipped(Nanos(10));
        let expected = [(SlipCause::LongTick, Nanos(10), Nanos(40)), (SlipCause::Policy, Nanos(40), Nanos(50))];
        assert_eq!(spans, expected);
    }
}
