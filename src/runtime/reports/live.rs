//! What a running group shows of itself: counts and times, readable at any moment without disturbing a tick.

use crate::accounting::ledger::Ledger;
use crate::primitives::histogram::{Histogram, HistogramReader, HistogramWriter, histogram};
use crate::primitives::sync::{AtomicU64, CachePadded, Ordering};
use crate::rate_group::RateGroup;
use crate::records::timing::{SlipCause, SlipCounts, TickTiming};
use crate::reports::group_live::GroupLive;
use crate::time::Rate;
use std::sync::{Arc, OnceLock};

#[derive(Debug, Default)]
struct Counts {
    released: AtomicU64,
    /// By cause.
    skipped: [AtomicU64; SlipCause::ALL.len()],
    missed: [AtomicU64; SlipCause::ALL.len()],
}

/// What one writer shows. Each has its own: one that was fenced counts on where nobody looks.
#[derive(Debug)]
struct Shown {
    counts: Arc<CachePadded<Counts>>,
    lateness: HistogramReader,
    execution: HistogramReader,
    /// Lateness and execution of all writers before.
    before: Option<(Histogram, Histogram)>,
    /// What the writer shows that has taken its place.
    next: OnceLock<Arc<Shown>>,
}

/// The group's side.
#[derive(Debug)]
pub(crate) struct LiveWriter {
    counts: Arc<CachePadded<Counts>>,
    lateness: HistogramWriter,
    execution: HistogramWriter,
}

/// The side of whoever wants to know.
#[derive(Clone, Debug)]
pub(crate) struct LiveReader {
    name: String,
    rate: Rate,
    first: Arc<Shown>,
}

pub(crate) fn live(group: &RateGroup) -> (LiveWriter, LiveReader) {
    let (writer, first) = Shown::new(Counts::default(), None);
    (writer, LiveReader { name: group.name.clone(), rate: group.rate, first })
}

impl Shown {
    fn new(counts: Counts, before: Option<(Histogram, Histogram)>) -> (LiveWriter, Arc<Self>) {
        let counts = Arc::new(CachePadded(counts));
        let ((lateness, lateness_shown), (execution, execution_shown)) = (histogram(), histogram());
        let writer = LiveWriter { counts: Arc::clone(&counts), lateness, execution };
        let next = OnceLock::new();
        (writer, Arc::new(Self { counts, lateness: lateness_shown, execution: execution_shown, before, next }))
    }

    /// The times of this writer and of all before it.
    fn times(&self) -> (Histogram, Histogram) {
        let (lateness, execution) = (self.lateness.snapshot(), self.execution.snapshot());
        match &self.before {
            Some(before) => (before.0.merged(&lateness), before.1.merged(&execution)),
            None => (lateness, execution),
        }
    }
}

impl LiveWriter {
    /// Shows a release that the ledger has closed.
    #[inline]
    pub(crate) fn release(&mut self, timing: &TickTiming, ledger: &Ledger) {
        self.lateness.record(timing.woke.saturating_sub(timing.scheduled));
        self.execution.record(timing.end.saturating_sub(timing.start));
        self.count(ledger);
    }

    /// Shows the books, after a change that is no release.
    #[inline]
    pub(crate) fn count(&self, ledger: &Ledger) {
        let Counts { released, skipped, missed } = &**self.counts;
        for cause in SlipCause::ALL {
            skipped[cause as usize].store(ledger.skipped.of(cause), Ordering::Relaxed);
            missed[cause as usize].store(ledger.missed.of(cause), Ordering::Relaxed);
        }
        // Release: with the acquire in `read`, so that whoever sees this release also sees its times and its skips.
        released.store(ledger.released, Ordering::Release);
    }
}

impl LiveReader {
    /// The group's side for actors that take the place of others; what the one before still counts is seen by nobody.
    pub(crate) fn next_writer(&self) -> LiveWriter {
        let last = self.last();
        let Counts { released, skipped, missed } = &**last.counts;
        let copy = |count: &AtomicU64| AtomicU64::new(count.load(Ordering::Acquire));
        let counts = Counts {
            released: copy(released),
            skipped: skipped.each_ref().map(copy),
            missed: missed.each_ref().map(copy),
        };
        let (writer, shown) = Shown::new(counts, Some(last.times()));
        // Set once: only the one who starts a group again comes here.
        let _ = last.next.set(shown);
        writer
    }

    /// The name of the group.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Skipped periods and missed deadlines so far.
    pub(crate) fn counts(&self) -> (SlipCounts, SlipCounts) {
        let counts = &self.last().counts;
        (sums(&counts.skipped), sums(&counts.missed))
    }

    /// Lateness and execution so far.
    pub(crate) fn times(&self) -> (Histogram, Histogram) {
        self.last().times()
    }

    /// What the writer in force shows: as many steps away as the group was started again.
    fn last(&self) -> &Shown {
        let mut last = &self.first;
        while let Some(next) = last.next.get() {
            last = next;
        }
        last
    }

    pub(crate) fn read(&self) -> GroupLive {
        let shown = self.last();
        // Acquire: with the release in `count`; everything below is read afterwards.
        let released = shown.counts.released.load(Ordering::Acquire);
        let (lateness, execution) = shown.times();
        let [slips, misses] = [&shown.counts.skipped, &shown.counts.missed].map(sums);
        GroupLive {
            name: self.name.clone(),
            rate: self.rate,
            released,
            skipped: slips.total(),
            missed: misses.total(),
            slips,
            misses,
            lateness,
            execution,
        }
    }
}

/// What was counted for each cause.
fn sums(counts: &[AtomicU64; SlipCause::ALL.len()]) -> SlipCounts {
    let mut sums = SlipCounts::default();
    SlipCause::ALL.into_iter().for_each(|cause| sums.add(cause, counts[cause as usize].load(Ordering::Relaxed)));
    sums
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::time::Nanos;

    #[test]
    fn counts_and_times_go_on_with_the_next_writer_and_a_fenced_one_has_no_part_in_them() {
        let group = RateGroup::hz(1000).name("g");
        let (mut fenced, reader) = live(&group);
        let mut ledger = Ledger::new(0, &group, None);
        let timing = |us: u64| TickTiming { end: Nanos(1000 * us), ..TickTiming::default() };
        let early = reader.clone();
        ledger.released = 1;
        fenced.release(&timing(7), &ledger);
        let mut next = reader.next_writer();
        assert_eq!((reader.read().released, reader.read().execution.max()), (1, Nanos(7000)));
        ledger.released = 100;
        fenced.release(&timing(900), &ledger);
        ledger.released = 2;
        next.release(&timing(5), &ledger);
        for reader in [&reader, &early] {
            let shown = reader.read();
            let times = (shown.execution.count(), shown.execution.sum(), shown.execution.max());
            assert_eq!((shown.released, times), (2, (2, Nanos(12_000), Nanos(7000))));
        }
    }
}
