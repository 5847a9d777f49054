//! Exact percentiles of many values.
//!
//! Percentiles are nearest-rank: the p-th is the smallest value that at least p percent of the samples do not exceed.
//! It is always one of the samples, never interpolated, so any other program that sorts the same samples finds the
//! same number.

/// The percentiles that every report shows. All zero if `count` is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Percentiles<T> {
    /// The number of samples.
    pub count: u64,
    /// The median: half of the samples do not exceed it.
    pub p50: T,
    /// The value that 90 % of the samples do not exceed.
    pub p90: T,
    /// The value that 99 % of the samples do not exceed.
    pub p99: T,
    /// The value that 99.9 % of the samples do not exceed.
    pub p999: T,
    /// The largest sample.
    pub max: T,
}

impl<T> Percentiles<T> {
    /// Percentiles in another unit, each converted by `f`.
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Percentiles<U> {
        let Self { count, p50, p90, p99, p999, max } = self;
        Percentiles { count, p50: f(p50), p90: f(p90), p99: f(p99), p999: f(p999), max: f(max) }
    }
}

/// How often each value occurred: exact percentiles in memory that grows with the number of *distinct* values.
///
/// Durations in nanoseconds repeat so much that an hour at 1 kHz (3.6 million samples) typically has some 10^5 distinct
/// values, a few megabytes. A [`bounded`](Self::bounded) one takes a fifth of a megabyte at most.
#[derive(Clone, Debug, Default)]
pub struct Distribution {
    /// Value and how often, rising.
    counts: Vec<(u64, u64)>,
    /// Leading bits that values are rounded down to, once they have become too many; `None` if memory may grow.
    kept_bits: Option<u32>,
    max: u64,
    /// Not yet counted: sorting many at once is several times cheaper than finding the place of each.
    pending: Vec<(u64, u64)>,
}

/// Values that are kept before they are counted, at least; with many distinct values a quarter of those.
const PENDING: usize = 1024;

/// Distinct values that a bounded distribution keeps.
const MOST: usize = 8192;

impl Distribution {
    /// A distribution for a run of any length: exact up to 8,192 distinct values, from then on percentiles are too small by
    /// less than 0.8 % if they span forty octaves, less if fewer; number and maximum stay exact. It reserves its memory at once.
    pub fn bounded() -> Self {
        let (counts, pending) = (Vec::with_capacity(MOST + MOST / 4), Vec::with_capacity(MOST / 4));
        Self { counts, kept_bits: Some(u64::BITS), max: 0, pending }
    }

    /// Counts one value. Allocates.
    pub fn push(&mut self, value: u64) {
        self.push_many(value, 1);
    }

    /// Counts a value as often as it occurred. Numbers that come from elsewhere may be anything: sums end at the largest
    /// number that there is.
    pub fn push_many(&mut self, value: u64, count: u64) {
        if count == 0 {
            return;
        }
        self.max = self.max.max(value);
        self.pending.push((self.kept_bits.map_or(value, |bits| leading(value, bits)), count));
        if self.pending.len() >= PENDING.max(self.counts.len() / 4) {
            self.counts.append(&mut self.pending);
            add_equal(&mut self.counts);
            self.coarsen();
        }
    }

    /// Drops one bit after the other while there are too many distinct values.
    fn coarsen(&mut self) {
        while let Some(bits) = &mut self.kept_bits
            && self.counts.len() > MOST
        {
            *bits -= 1;
            self.counts.iter_mut().for_each(|(value, _)| *value = leading(*value, *bits));
            add_equal(&mut self.counts);
        }
    }

    /// The number of values.
    pub fn count(&self) -> u64 {
        self.counts.iter().chain(&self.pending).map(|&(_, count)| count).fold(0, u64::saturating_add)
    }

    /// Forgets all values.
    pub fn clear(&mut self) {
        self.counts.clear();
        self.pending.clear();
        (self.kept_bits, self.max) = (self.kept_bits.map(|_| u64::BITS), 0);
    }

    /// Every value with the number of times it occurred, rising.
    pub fn counts(&self) -> Vec<(u64, u64)> {
        let mut all = [&self.counts[..], &self.pending].concat();
        add_equal(&mut all);
        all
    }

    /// The percentiles.
    pub fn percentiles(&self) -> Percentiles<u64> {
        let counts = self.counts();
        let total = counts.iter().map(|&(_, count)| count).fold(0, u64::saturating_add);
        // Ranks in thousandths, so that no rounding of 0.999 * n can pick a neighbour.
        let ranks = [500, 900, 990, 999, 1000].map(|permille| (u128::from(total) * permille).div_ceil(1000));
        let mut found = [0; 5];
        let (mut seen, mut next) = (0_u128, 0);
        for (value, count) in counts {
            seen += u128::from(count);
            while next < ranks.len() && ranks[next] <= seen {
                found[next] = value;
                next += 1;
            }
        }
        let [p50, p90, p99, p999, _] = found;
        Percentiles { count: total, p50, p90, p99, p999, max: self.max }
    }
}

/// Sorts values, and makes one of equal ones with the sum of their counts.
fn add_equal(counts: &mut Vec<(u64, u64)>) {
    // Mostly they are sorted already: a stable sort makes use of that.
    counts.sort();
    counts.dedup_by(|(value, count), (other, sum)| {
        let is_same = value == other;
        *sum = sum.saturating_add(if is_same { *count } else { 0 });
        is_same
    });
}

/// The value with all but its leading `bits` cleared: a relative step, for the bits of a double too.
fn leading(value: u64, bits: u32) -> u64 {
    let dropped = (u64::BITS - value.leading_zeros()).saturating_sub(bits);
    value >> dropped << dropped
}

/// A [`Distribution`] of non-negative doubles, exact to the bit.
#[derive(Clone, Debug, Default)]
pub struct Magnitudes(Distribution);

impl Magnitudes {
    /// Magnitudes for a run of any length, see [`Distribution::bounded`].
    pub fn bounded() -> Self {
        Self(Distribution::bounded())
    }

    /// Counts the magnitude of one value; NaN ranks above infinity, so that it shows as the maximum. Allocates.
    pub fn push(&mut self, value: f64) {
        // The bits of non-negative doubles sort as the doubles do.
        self.0.push(value.abs().to_bits());
    }

    /// Every magnitude with the number of times it occurred, rising.
    pub fn counts(&self) -> Vec<(f64, u64)> {
        self.0.counts().into_iter().map(|(bits, count)| (f64::from_bits(bits), count)).collect()
    }

    /// The percentiles.
    pub fn percentiles(&self) -> Percentiles<f64> {
        self.0.percentiles().map(f64::from_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn nearest_rank(sorted: &[u64], permille: usize) -> u64 {
        sorted[(sorted.len() * permille).div_ceil(1000) - 1]
    }

    proptest! {
        // Check that counting gives what sorting gives.
        #[test]
        fn percentiles_equal_those_of_the_sorted_vector(mut values in prop::collection::vec(0_u64..50, 1..9000)) {
            let mut distribution = Distribution::default();
            values.iter().for_each(|&value| distribution.push(value));
            values.sort_unstable();
            let got = distribution.percentiles();
            prop_assert_eq!(got.count, values.len() as u64);
            prop_assert_eq!(got.p50, nearest_rank(&values, 500));
            prop_assert_eq!(got.p90, nearest_rank(&values, 900));
            prop_assert_eq!(got.p99, nearest_rank(&values, 990));
            prop_assert_eq!(got.p999, nearest_rank(&values, 999));
            prop_assert_eq!(got.max, values[values.len() - 1]);
        }
    }

    // Check that a bounded one is within its promise for any spread of values, with exact number and maximum, and small.
    proptest! {
        #[test]
        fn a_bounded_distribution_stays_small_and_near_the_exact_one(octaves in 1_u32..40, seed in any::<u64>()) {
            let (mut bounded, mut exact) = (Distribution::bounded(), Distribution::default());
            let mut state = seed;
            for _ in 0..60_000 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let value = (state >> 24) >> (state % u64::from(octaves));
                bounded.push(value);
                exact.push(value);
            }
            prop_assert!(bounded.counts().len() <= MOST + MOST / 4, "{} values", bounded.counts().len());
            let (got, want) = (bounded.percentiles(), exact.percentiles());
            prop_assert_eq!((got.count, got.max), (want.count, want.max));
            for (got, want) in [(got.p50, want.p50), (got.p90, want.p90), (got.p99, want.p99), (got.p999, want.p999)] {
                prop_assert!(got <= want && (want - got) as f64 <= want as f64 / 128.0, "{got} for {want}");
            }
        }
    }

    #[test]
    fn no_samples_give_a_count_of_zero() {
        assert_eq!(Distribution::default().percentiles(), Percentiles::default());
    }

    #[test]
    fn magnitudes_rank_as_numbers() {
        let mut jumps = Magnitudes::default();
        [-3.0, 0.5, -0.0, 1e-12].into_iter().for_each(|jump| jumps.push(jump));
        let got = jumps.percentiles();
        assert_eq!((got.p50, got.max), (1e-12, 3.0));
    }
}
