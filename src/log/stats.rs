//! How a rate group keeps time, condensed once a second for the log and for a live display.

use super::percentiles::{Distribution, Percentiles};
use super::records::TextEvent;
use crate::runtime::Nanos;
use crate::runtime::TickTiming;

const SECOND: u64 = 1_000_000_000;

/// The state of a rate group at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GroupStats {
    /// The moment: the release that closed the second, or the end of the run.
    pub time: Nanos,
    /// The number of the group.
    pub group: u16,
    /// The number of releases since the start.
    pub released: u64,
    /// The number of periods skipped since the start.
    pub skipped: u64,
    /// The number of deadlines missed since the start.
    pub missed: u64,
    /// The number of records lost since the start, because a ring was full: those of all threads together, kept by the first group.
    pub lost_records: u64,
    /// The lateness of wake-ups since the start (ns).
    pub lateness: Percentiles<u64>,
    /// The lateness of wake-ups in the last second (ns).
    pub lateness_last_second: Percentiles<u64>,
    /// The execution time since the start (ns).
    pub execution: Percentiles<u64>,
    /// The execution time in the last second (ns).
    pub execution_last_second: Percentiles<u64>,
    /// The number of uses of ports recorded since the start, which `/ports` holds of this group.
    pub port_uses: u64,
    /// The events of this group since the start, in number and as digests, which `/log` holds of it.
    pub events: EventSum,
}

/// The number of events and the sum of their digests: the order does not matter, any change does.
///
/// # Real-time
/// A plain value: its methods are wait-free and bounded by the length of the message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventSum {
    /// The number of events.
    pub count: u64,
    /// The wrapping sum of a 64-bit digest (FNV-1a) of time, level and message of each.
    pub digest: u64,
}

impl EventSum {
    /// Counts one event.
    pub fn push(&mut self, event: &TextEvent) {
        let (time, level) = (event.time.0.to_le_bytes(), (event.level as u16).to_le_bytes());
        let bytes = time.iter().chain(&level).chain(event.message.as_bytes());
        let digest = bytes.fold(0xcbf2_9ce4_8422_2325, |digest: u64, byte| {
            (digest ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        self.add(Self { count: 1, digest });
    }

    /// Adds the events of another group.
    pub fn add(&mut self, other: Self) {
        self.count = self.count.wrapping_add(other.count);
        self.digest = self.digest.wrapping_add(other.digest);
    }
}

/// Counts the releases of one group and gives a [`GroupStats`] for each second.
#[derive(Clone, Debug, Default)]
pub struct StatsCounter {
    now: GroupStats,
    lateness: Distribution,
    lateness_second: Distribution,
    execution: Distribution,
    execution_second: Distribution,
}

impl StatsCounter {
    /// A counter for `group`.
    pub fn new(group: u16) -> Self {
        let now = GroupStats { group, ..GroupStats::default() };
        Self { now, lateness: Distribution::bounded(), execution: Distribution::bounded(), ..Self::default() }
    }

    /// Counts one release. Returns the statistics of the second before if this release begins another one. Allocates.
    pub fn push(&mut self, timing: &TickTiming) -> Option<GroupStats> {
        let closed = self.now.released > 0 && timing.scheduled.0 / SECOND > self.now.time.0 / SECOND;
        // Stamped with the release that closes the second, so that messages stay in the order of time.
        let stats = closed.then(|| self.close_second(timing.scheduled));
        let lateness = timing.woke.saturating_sub(timing.scheduled).0;
        let execution = timing.end.saturating_sub(timing.start).0;
        self.now.time = timing.scheduled;
        self.now.released += 1;
        self.now.skipped += u64::from(timing.slips);
        self.now.missed += u64::from(timing.missed());
        self.lateness.push(lateness);
        self.lateness_second.push(lateness);
        self.execution.push(execution);
        self.execution_second.push(execution);
        stats
    }

    /// Counts one use of a port.
    pub fn push_port_use(&mut self) {
        self.now.port_uses += 1;
    }

    /// Counts one event.
    pub fn push_event(&mut self, event: &TextEvent) {
        self.now.events.push(event);
    }

    /// Sets the number of records of this group lost since the start.
    pub fn set_lost(&mut self, total: u64) {
        self.now.lost_records = total;
    }

    /// The statistics up to the last release, for a run that ends at `time`.
    pub fn finish(mut self, time: Nanos) -> GroupStats {
        self.close_second(time)
    }

    fn close_second(&mut self, time: Nanos) -> GroupStats {
        let stats = GroupStats {
            time,
            lateness: self.lateness.percentiles(),
            lateness_last_second: self.lateness_second.percentiles(),
            execution: self.execution.percentiles(),
            execution_last_second: self.execution_second.percentiles(),
            ..self.now
        };
        self.lateness_second.clear();
        self.execution_second.clear();
        stats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Level;

    // Check that a changed time, level or message, a missing and a doubled event give another sum, and another order the
    // same.
    #[test]
    fn the_sum_of_events_knows_every_one_of_them() {
        let event = |time, level, message: &str| TextEvent { time: Nanos(time), level, message: message.to_owned() };
        let sum = |events: &[TextEvent]| {
            let mut sum = EventSum::default();
            events.iter().for_each(|event| sum.push(event));
            sum
        };
        let (one, two) = (event(1, Level::Info, "here"), event(2, Level::Error, "there"));
        let both = sum(&[one.clone(), two.clone()]);
        assert_eq!(sum(&[two.clone(), one.clone()]), both);
        let others =
            [event(3, Level::Error, "there"), event(2, Level::Warning, "there"), event(2, Level::Error, "their")];
        for other in others {
            assert_ne!(sum(&[one.clone(), other]), both);
        }
        assert!(sum(std::slice::from_ref(&one)) != both && sum(&[one, two.clone(), two]) != both);
    }

    #[test]
    fn each_second_is_reported_once_beside_the_whole_run() {
        let mut counter = StatsCounter::new(2);
        let mut reports = Vec::new();
        for tick in 0..2500_u64 {
            let scheduled = Nanos(tick * 1_000_000);
            let woke = scheduled + Nanos(tick / 1000 * 100);
            let timing = TickTiming {
                tick,
                scheduled,
                woke,
                start: woke,
                end: woke + Nanos(7),
                deadline: scheduled + Nanos(1_000_000),
                ..TickTiming::default()
            };
            reports.extend(counter.push(&timing));
        }
        counter.set_lost(3);
        reports.push(counter.finish(Nanos(2_500_000_000)));
        let last_second: Vec<u64> = reports.iter().map(|r| r.lateness_last_second.count).collect();
        assert_eq!(last_second, [1000, 1000, 500]);
        assert_eq!((reports[1].lateness.p50, reports[1].lateness_last_second.p50), (0, 100));
        assert_eq!((reports[2].group, reports[2].released, reports[2].lost_records), (2, 2500, 3));
        assert_eq!(reports[2].execution.max, 7);
        assert_eq!(reports.iter().map(|r| r.time.0).collect::<Vec<_>>(), [1_000_000_000, 2_000_000_000, 2_500_000_000]);
    }
}
