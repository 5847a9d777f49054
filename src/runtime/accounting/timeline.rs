//! When the releases of a group are due: a grid of integers without drift, and the phase that a policy may shift it by.

use crate::rate_group::RateGroup;
use crate::time::{Nanos, Rate};

/// The due times of one group.
///
/// Periods are counted on the *nominal* grid, offset + n periods; release n is *due* a phase later. The phase is zero
/// until a [rephase](Self::rephase).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timeline {
    rate: Rate,
    offset: Nanos,
    period: Nanos,
    phase: Nanos,
    until: Nanos,
    /// The number of nominal periods that begin at or before `until`; the last is `count - 1`.
    count: u64,
}

impl Timeline {
    /// The releases of `group` that are due at or before `until`.
    pub(crate) fn new(group: &RateGroup, until: Option<Nanos>) -> Self {
        let count = match until {
            None => u64::MAX,
            Some(until) if until < group.offset => 0,
            Some(until) => group.rate.last_release(until.saturating_sub(group.offset)).saturating_add(1),
        };
        Self {
            rate: group.rate,
            offset: group.offset,
            period: group.rate.period(),
            phase: Nanos::ZERO,
            until: until.unwrap_or(Nanos(u64::MAX)),
            count,
        }
    }

    /// When release `n` is due.
    pub(crate) fn due(&self, n: u64) -> Nanos {
        self.offset + self.rate.release(n) + self.phase
    }

    /// When release `n` is due, if the run has one.
    pub(crate) fn release(&self, n: u64) -> Option<Nanos> {
        self.has_period(n).then(|| self.due(n)).filter(|&due| due <= self.until)
    }

    /// True if nominal period `n` begins within the run.
    pub(crate) fn has_period(&self, n: u64) -> bool {
        n < self.count
    }

    /// The latest release of the run due at `now`, but at least `next`, which the caller has waited for.
    pub(crate) fn latest_due(&self, next: u64, now: Nanos) -> u64 {
        let since = now.min(self.until).saturating_sub(self.offset).saturating_sub(self.phase);
        self.rate.last_release(since).min(self.count - 1).max(next)
    }

    /// The release that a device's frame at `time` runs: `next` up to half a period after it is due, then the nearest
    /// that the run has.
    pub(crate) fn of_frame(&self, next: u64, time: Nanos) -> u64 {
        let half_period = Nanos(self.period.0 / 2);
        self.rate.last_release((time + half_period).saturating_sub(self.offset)).min(self.count - 1).max(next)
    }

    /// From when on a frame runs release `n` or a later one: seven eighths of a period before it is due.
    ///
    /// More than the half that a nearest release would give, and that is what keeps a device whose frames drift across
    /// the grid from losing many: after a slip at half a period late it is half a period early, and jitter of three
    /// eighths of a period does not make it skip and leave out by turns.
    pub(crate) fn frames_from(&self, n: u64) -> Nanos {
        self.due(n).saturating_sub(Nanos(self.period.0 / 8 * 7))
    }

    /// The same without an end.
    pub(crate) fn unbounded(&self) -> Self {
        Self { count: u64::MAX, until: Nanos(u64::MAX), ..*self }
    }

    /// Lets release `count - 1` be the last, whenever it is due.
    pub(crate) fn end_before(&mut self, count: u64) {
        self.count = count;
        self.until = Nanos(u64::MAX);
    }

    /// Shifts the grid so that release `n` is due at `time`, as it was recorded.
    pub(crate) fn shift_to(&mut self, n: u64, time: Nanos) {
        self.phase = time.saturating_sub(self.offset + self.rate.release(n));
    }

    /// Shifts the grid so that the latest nominal release is due at `now`, and returns its number; `None`, and no
    /// shift, after the end of the run.
    pub(crate) fn rephase(&mut self, now: Nanos) -> Option<u64> {
        if now > self.until {
            return None;
        }
        let since = now.saturating_sub(self.offset);
        let release = self.rate.last_release(since);
        self.phase = since.saturating_sub(self.rate.release(release));
        Some(release)
    }
}

/// How a wait for a release ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wake {
    /// When the group was running again.
    pub(crate) woke: Nanos,
    /// What ended it.
    pub(crate) by: WokenBy,
    /// When that was there; the group may have been busy or asleep for longer.
    pub(crate) ready: Nanos,
    /// Virtual time: when the group's injected work is done and it can run again. `None`: when the release ends.
    pub(crate) free: Option<Nanos>,
}

/// What ends a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WokenBy {
    /// The clock: the release was due.
    Timer,
    /// The device that paces the group had something new.
    Frame,
}

impl Wake {
    /// The wait for a release due at `due` ended at `woke`.
    pub(crate) fn by_timer(due: Nanos, woke: Nanos) -> Self {
        Self { woke, by: WokenBy::Timer, ready: due, free: None }
    }

    /// The device delivered at `woke`.
    pub(crate) fn by_frame(woke: Nanos) -> Self {
        Self { woke, by: WokenBy::Frame, ready: woke, free: None }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn nothing_is_released_when_the_offset_is_past_the_end() {
        let timeline = Timeline::new(&RateGroup::hz(1000).offset(Nanos(5 * MS)), Some(Nanos(4 * MS)));
        assert_eq!((timeline.release(0), timeline.has_period(0)), (None, false));
    }

    #[test]
    fn an_offset_delays_every_release() {
        let timeline = Timeline::new(&RateGroup::hz(1000).offset(Nanos(MS / 4)), Some(Nanos(2 * MS)));
        assert_eq!(timeline.release(0), Some(Nanos(MS / 4)));
        assert_eq!(timeline.release(1), Some(Nanos(MS + MS / 4)));
        assert_eq!(timeline.release(2), None);
        assert_eq!(timeline.latest_due(0, Nanos(MS + MS / 4 - 1)), 0);
        assert_eq!(timeline.latest_due(0, Nanos(MS + MS / 4)), 1);
        assert_eq!(timeline.latest_due(0, Nanos(100 * MS)), 1);
    }

    #[test]
    fn a_frame_runs_the_next_release_or_the_nearest_later_one() {
        let timeline = Timeline::new(&RateGroup::hz(1000).offset(Nanos(2 * MS)), Some(Nanos(9 * MS)));
        // Release 3 is due at 5 ms.
        let [early, late] = [4 * MS + MS / 8, 5 * MS + MS / 2];
        assert_eq!([early, late - 1, late, late + MS].map(|time| timeline.of_frame(3, Nanos(time))), [3, 3, 4, 5]);
        assert_eq!(timeline.frames_from(3), Nanos(early));
        assert_eq!((timeline.frames_from(0), timeline.of_frame(3, Nanos(100 * MS))), (Nanos(MS + MS / 8), 7));
    }

    #[test]
    fn a_rephased_grid_keeps_its_rate_and_ends_with_the_run() {
        let mut timeline = Timeline::new(&RateGroup::hz(1000), Some(Nanos(5 * MS)));
        assert_eq!(timeline.rephase(Nanos(2 * MS + 700)), Some(2));
        assert_eq!([2, 3, 4].map(|n| timeline.release(n)), [2, 3, 4].map(|n| Some(Nanos(n * MS + 700))));
        // Period 5 begins within the run, its shifted release does not.
        assert_eq!((timeline.release(5), timeline.has_period(5)), (None, true));
        assert_eq!(timeline.latest_due(3, Nanos(4 * MS + 699)), 3);
        assert_eq!(timeline.latest_due(3, Nanos(50 * MS)), 4);
        assert_eq!(timeline.rephase(Nanos(5 * MS + 1)), None);
        assert_eq!(timeline.due(4), Nanos(4 * MS + 700));
    }
}
