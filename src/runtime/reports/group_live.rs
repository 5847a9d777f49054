//! The state of a group at one moment of its run: plain figures.

use crate::primitives::histogram::Histogram;
use crate::records::timing::SlipCounts;
use crate::time::{Nanos, Rate};

/// A rate group at one moment of its run: counts, lateness and execution times so far.
///
/// The parts are read one after the other while the group goes on: a release that is counted in the histograms may not
/// be in [`released`](Self::released) yet, never the other way round. When the run is over they agree.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct GroupLive {
    /// The group's name.
    pub name: String,
    /// The rate of the group.
    pub rate: Rate,
    /// The number of releases that ran.
    pub released: u64,
    /// The number of periods without a release.
    pub skipped: u64,
    /// The number of releases that ended after their deadline.
    pub missed: u64,
    /// The skipped periods by cause; their sum is `skipped`.
    pub slips: SlipCounts,
    /// The missed deadlines by cause; their sum is `missed`.
    pub misses: SlipCounts,
    /// The lateness of every release: from its scheduled time to the end of the wait.
    pub lateness: Histogram,
    /// The execution time of every release, from the first actor's start to the last one's end; its sum is the time
    /// that the group was at work.
    pub execution: Histogram,
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
