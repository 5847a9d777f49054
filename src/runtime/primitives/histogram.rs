//! A histogram of times that one thread writes and any thread reads while it is written, wait-free on both sides.
//!
//! Log-linear: below 32 ns every nanosecond has its own bucket, above that every octave has 32 of equal width. A
//! percentile is therefore never below the exact one and at most 1/32 (3.1 %) above it; count, sum and maximum are exact.
//! Times above 17 s share the last bucket. It is a fixed 8 kB, whatever it holds.
//!
//! The writer makes plain loads and stores, no read-modify-write: it costs a tick a few nanoseconds, and readers cost
//! it nothing but the cache line that they read. A reader may see a time in the buckets that is not in the sum yet.

use crate::primitives::sync::{AtomicU64, CachePadded, Ordering};
use crate::time::Nanos;
use std::fmt;
use std::sync::Arc;

/// Buckets per octave, and the first time that shares its bucket (ns).
const FINE: u64 = 32;
const FINE_BITS: u32 = FINE.ilog2();
/// Times from 2^34 ns on (17 s) share the last bucket.
const LIMIT: u64 = 1 << 34;
const BUCKETS: usize = bucket(LIMIT) + 1;

/// The bucket of a time up to [`LIMIT`].
const fn bucket(time: u64) -> usize {
    if time < FINE {
        return time as usize;
    }
    let shift = time.ilog2() - FINE_BITS;
    (shift as u64 * FINE + (time >> shift)) as usize
}

/// The largest time of a bucket (ns).
fn last_of(bucket: usize) -> u64 {
    let bucket = bucket as u64;
    if bucket < 2 * FINE {
        return bucket;
    }
    let shift = bucket / FINE - 1;
    ((bucket % FINE + FINE + 1) << shift) - 1
}

struct Shared {
    counts: [AtomicU64; BUCKETS],
    sum: AtomicU64,
    max: AtomicU64,
}

/// Makes an empty histogram.
///
/// # Real-time
/// Not real-time safe: allocates.
pub(crate) fn histogram() -> (HistogramWriter, HistogramReader) {
    let counts = std::array::from_fn(|_| AtomicU64::new(0));
    let shared = Arc::new(CachePadded(Shared { counts, sum: AtomicU64::new(0), max: AtomicU64::new(0) }));
    // Zeros may come from the system as pages still to be faulted in; a store is never left out.
    shared.counts.iter().for_each(|count| count.store(0, Ordering::Relaxed));
    (HistogramWriter(Arc::clone(&shared)), HistogramReader(shared))
}

/// The side that counts.
pub(crate) struct HistogramWriter(Arc<CachePadded<Shared>>);

impl HistogramWriter {
    /// Counts a time.
    ///
    /// # Real-time
    /// Wait-free (three loads and stores, nothing shared is locked), real-time safe.
    #[inline]
    pub(crate) fn record(&mut self, time: Nanos) {
        let Shared { counts, sum, max } = &**self.0;
        // Relaxed loads: this thread alone stores.
        if time.0 > max.load(Ordering::Relaxed) {
            max.store(time.0, Ordering::Relaxed);
        }
        sum.store(sum.load(Ordering::Relaxed).wrapping_add(time.0), Ordering::Relaxed);
        let count = &counts[bucket(time.0.min(LIMIT))];
        // Release: with the acquire in `snapshot`, so that a reader that sees the count also sees a maximum and a sum
        // that hold it.
        count.store(count.load(Ordering::Relaxed) + 1, Ordering::Release);
    }
}

impl_debug!(HistogramWriter);

/// The reading side of a histogram: any thread may look, as often as it likes, while times are counted.
#[derive(Clone)]
pub struct HistogramReader(Arc<CachePadded<Shared>>);

impl HistogramReader {
    /// All times counted so far.
    ///
    /// # Real-time
    /// Wait-free, never disturbs the writer; allocates: for threads that show it.
    pub fn snapshot(&self) -> Histogram {
        // Acquire: with the release in `record`; maximum and sum are read after the counts and are at least theirs.
        let counts: Box<[u64]> = self.0.counts.iter().map(|count| count.load(Ordering::Acquire)).collect();
        let (sum, max) = (self.0.sum.load(Ordering::Relaxed), self.0.max.load(Ordering::Relaxed));
        Histogram { count: counts.iter().sum(), counts, sum: Nanos(sum), max: Nanos(max) }
    }
}

impl fmt::Debug for HistogramReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.snapshot().fmt(f)
    }
}

/// A histogram of times as it was at one moment: counts, sum, maximum and percentiles.
///
/// # Real-time
/// Its methods are bounded and real-time safe; cloning it allocates, and dropping it frees memory.
#[derive(Clone, PartialEq, Eq)]
pub struct Histogram {
    counts: Box<[u64]>,
    count: u64,
    sum: Nanos,
    max: Nanos,
}

impl Default for Histogram {
    /// A histogram of nothing.
    fn default() -> Self {
        Self { counts: vec![0; BUCKETS].into(), count: 0, sum: Nanos::ZERO, max: Nanos::ZERO }
    }
}

impl Histogram {
    /// What two histograms held together.
    pub(crate) fn merged(&self, other: &Self) -> Self {
        let counts = self.counts.iter().zip(&other.counts).map(|(a, b)| a + b).collect();
        let sum = Nanos(self.sum.0.wrapping_add(other.sum.0));
        Self { counts, count: self.count + other.count, sum, max: self.max.max(other.max) }
    }

    /// The number of times that were counted.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The sum of all times that were counted.
    pub fn sum(&self) -> Nanos {
        self.sum
    }

    /// The largest time that was counted; zero if there is none.
    pub fn max(&self) -> Nanos {
        self.max
    }

    /// The time that a share `q` (0 to 1) of all times does not exceed: never below the exact one, at most 1/32 above
    /// it; zero if nothing was counted.
    pub fn percentile(&self, q: f64) -> Nanos {
        let rank = ((q * self.count as f64).ceil() as u64).clamp(1, self.count.max(1));
        let mut below = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            below += count;
            if below >= rank {
                // The last bucket has no end of its own.
                let last = if bucket + 1 == BUCKETS { u64::MAX } else { last_of(bucket) };
                return Nanos(last.min(self.max.0));
            }
        }
        Nanos::ZERO
    }
}

impl fmt::Debug for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} times, p50 {}, p99 {}, max {}", self.count, self.percentile(0.5), self.percentile(0.99), self.max)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Times of every magnitude, also beyond the last bucket.
    fn times() -> impl Strategy<Value = Vec<u64>> {
        prop::collection::vec((0_u32..40, any::<u64>()).prop_map(|(bits, x)| x & ((1 << bits) - 1)), 1..300)
    }

    proptest! {
        #[test]
        fn percentiles_are_never_below_the_exact_ones_and_at_most_a_32nd_above(mut exact in times(), q in 0.0_f64..=1.0) {
            let (mut writer, reader) = histogram();
            exact.iter().for_each(|&time| writer.record(Nanos(time)));
            let shown = reader.snapshot();
            exact.sort_unstable();
            prop_assert_eq!(shown.count(), exact.len() as u64);
            prop_assert_eq!(shown.sum().0, exact.iter().sum::<u64>());
            prop_assert_eq!(shown.max().0, exact[exact.len() - 1]);
            let rank = ((q * exact.len() as f64).ceil() as usize).clamp(1, exact.len());
            let (exact, got) = (exact[rank - 1], shown.percentile(q).0);
            prop_assert!(got >= exact, "{got} < {exact}");
            prop_assert!(exact >= LIMIT || got - exact <= exact / FINE, "{got} for {exact}");
        }

        #[test]
        fn histograms_merged_hold_what_one_of_both_would_hold(first in times(), second in times()) {
            let of = |times: &[u64]| {
                let (mut writer, reader) = histogram();
                times.iter().for_each(|&time| writer.record(Nanos(time)));
                reader.snapshot()
            };
            prop_assert!(of(&first).merged(&of(&second)) == of(&[first, second].concat()));
        }

        #[test]
        fn every_time_is_in_the_bucket_that_ends_at_or_after_it(time in 0..LIMIT) {
            let bucket = bucket(time);
            prop_assert!(time <= last_of(bucket) && (bucket == 0 || last_of(bucket - 1) < time));
        }
    }

    #[test]
    fn buckets_cover_every_time_without_a_gap() {
        assert_eq!(BUCKETS, 961);
        assert_eq!(last_of(BUCKETS - 2), LIMIT - 1);
        assert!((1..BUCKETS - 1).all(|n| bucket(last_of(n - 1) + 1) == n && bucket(last_of(n)) == n));
    }

    #[test]
    fn an_empty_histogram_shows_zeros() {
        let shown = histogram().1.snapshot();
        assert_eq!((shown.count(), shown.max(), shown.percentile(0.99)), (0, Nanos::ZERO, Nanos::ZERO));
    }

    #[test]
    fn a_reader_beside_the_writer_never_sees_less_than_before_nor_a_percentile_above_the_maximum() {
        const COUNT: u64 = 200_000;
        let (mut writer, reader) = histogram();
        let thread = std::thread::spawn(move || (0..COUNT).for_each(|n| writer.record(Nanos(n))));
        let mut before = reader.snapshot();
        while before.count() < COUNT {
            let shown = reader.snapshot();
            assert!(shown.count() >= before.count() && shown.max() >= before.max() && shown.sum() >= before.sum());
            // Check that the maximum holds every time that was counted: here the n-th time is n
            assert!(shown.count() == 0 || shown.max().0 >= shown.count() - 1);
            before = shown;
        }
        thread.join().unwrap();
        assert_eq!((before.max().0, before.sum().0), (COUNT - 1, COUNT * (COUNT - 1) / 2));
    }
}
