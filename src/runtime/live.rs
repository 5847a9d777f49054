//! What a running group shows of itself: counts and times, readable at any moment without disturbing a tick.

use super::deadline::Ledger;
use super::histogram::{HistogramReader, HistogramWriter, Snapshot, histogram};
use super::rate_group::RateGroup;
use super::record::TickTiming;
use super::sync::{AtomicU64, CachePadded, Ordering};
use crate::time::{Nanos, Rate};
use std::sync::Arc;

/// A rate group at one moment of its run.
///
/// The parts are read one after the other while the group goes on: a release that is counted in the histograms may not be
/// in [`released`](Self::released) yet, never the other way round. When the run is over they agree.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct GroupLive {
    /// The group's name.
    pub name: String,
    /// Its rate.
    pub rate: Rate,
    /// Releases that ran.
    pub released: u64,
    /// Periods without a release.
    pub skipped: u64,
    /// Releases that ended after their deadline.
    pub missed: u64,
    /// From the scheduled time to the end of the wait, every release.
    pub lateness: Snapshot,
    /// From the first actor's start to the last one's end, every release; its sum is the time that the group was at work.
    pub execution: Snapshot,
}

#[derive(Debug, Default)]
struct Counts {
    released: AtomicU64,
    skipped: AtomicU64,
    missed: AtomicU64,
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
    counts: Arc<CachePadded<Counts>>,
    lateness: HistogramReader,
    execution: HistogramReader,
}

pub(crate) fn live(group: &RateGroup) -> (LiveWriter, LiveReader) {
    let counts = Arc::new(CachePadded(Counts::default()));
    let ((lateness, lateness_shown), (execution, execution_shown)) = (histogram(), histogram());
    let reader = LiveReader {
        name: group.name.clone(),
        rate: group.rate,
        counts: Arc::clone(&counts),
        lateness: lateness_shown,
        execution: execution_shown,
    };
    (LiveWriter { counts, lateness, execution }, reader)
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
        skipped.store(ledger.skipped.total(), Ordering::Relaxed);
        missed.store(ledger.missed, Ordering::Relaxed);
        // Release: with the acquire in `read`, so that whoever sees this release also sees its times and its skips.
        released.store(ledger.released, Ordering::Release);
    }
}

impl LiveReader {
    /// The group's side for actors that take the place of others.
    pub(crate) fn next_writer(&self) -> LiveWriter {
        let (lateness, execution) = (self.lateness.next_writer(), self.execution.next_writer());
        LiveWriter { counts: Arc::clone(&self.counts), lateness, execution }
    }

    pub(crate) fn read(&self) -> GroupLive {
        // Acquire: with the release in `count`; everything below is read afterwards.
        let released = self.counts.released.load(Ordering::Acquire);
        GroupLive {
            name: self.name.clone(),
            rate: self.rate,
            released,
            skipped: self.counts.skipped.load(Ordering::Relaxed),
            missed: self.counts.missed.load(Ordering::Relaxed),
            lateness: self.lateness.snapshot(),
            execution: self.execution.snapshot(),
        }
    }
}

impl GroupLive {
    /// The share of `elapsed` that the group was at work, from 0 to 1; waiting, also by spinning, is no work.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn busy(&self, elapsed: Nanos) -> f64 {
        if elapsed == Nanos::ZERO { 0.0 } else { self.execution.sum().0 as f64 / elapsed.0 as f64 }
    }
}
