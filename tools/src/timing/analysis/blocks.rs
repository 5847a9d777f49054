//! The parts of a run that a bootstrap draws from: ticks that follow each other are not independent, blocks nearly are.

use super::over_time::Absorb;

/// Buckets in each octave: a value is known to 0.8 %.
const FINE: u64 = 128;
const FINE_BITS: u32 = FINE.ilog2();

/// How often values occurred, log-linear: every octave has as many buckets of equal width.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Buckets(Vec<u32>);

impl Buckets {
    /// Counts one value. Allocates.
    pub fn push(&mut self, value: u64) {
        let bucket = bucket(value);
        if bucket >= self.0.len() {
            self.0.resize(bucket + 1, 0);
        }
        self.0[bucket] += 1;
    }

    /// The counts, by bucket.
    pub fn counts(&self) -> &[u32] {
        &self.0
    }

    /// The least value that is counted in `bucket`.
    pub fn least_of(bucket: usize) -> u64 {
        let bucket = bucket as u64;
        if bucket < 2 * FINE {
            return bucket;
        }
        let shift = bucket / FINE - 1;
        (bucket % FINE + FINE) << shift
    }

    fn add(&mut self, other: &Self) {
        if other.0.len() > self.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        self.0.iter_mut().zip(&other.0).for_each(|(sum, count)| *sum += count);
    }
}

fn bucket(value: u64) -> usize {
    if value < FINE {
        return value as usize;
    }
    let shift = value.ilog2() - FINE_BITS;
    (u64::from(shift) * FINE + (value >> shift)) as usize
}

/// What a group did in one part of the run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// Releases that ran.
    pub released: u64,
    /// Periods skipped before them.
    pub skipped: u64,
    /// Deadlines missed.
    pub missed: u64,
    /// Lateness (ns).
    pub lateness: Buckets,
    /// Execution time (ns).
    pub execution: Buckets,
    /// Period error (ns).
    pub period_error: Buckets,
    /// Cycle-to-cycle jitter (ns).
    pub jitter: Buckets,
}

impl Absorb for Block {
    fn absorb(&mut self, later: Self) {
        self.released += later.released;
        self.skipped += later.skipped;
        self.missed += later.missed;
        self.lateness.add(&later.lateness);
        self.execution.add(&later.execution);
        self.period_error.add(&later.period_error);
        self.jitter.add(&later.jitter);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_knows_its_values_to_less_than_a_percent() {
        for value in (0..5000).chain((12..63).map(|shift| (1_u64 << shift) - 1)).chain([u64::MAX]) {
            let (least, next) = (Buckets::least_of(bucket(value)), Buckets::least_of(bucket(value) + 1));
            assert!(least <= value && (value < next || next == 0), "{value}");
            assert!((value - least) as f64 <= 0.008 * value as f64, "{value} {least}");
        }
    }

    #[test]
    fn joined_blocks_hold_what_both_held() {
        let (mut one, mut two) = (Buckets::default(), Buckets::default());
        [5, 70_000].into_iter().for_each(|value| one.push(value));
        [5, 900_000_000].into_iter().for_each(|value| two.push(value));
        let mut block = Block { released: 2, lateness: one, ..Block::default() };
        block.absorb(Block { released: 2, skipped: 1, lateness: two, ..Block::default() });
        assert_eq!((block.released, block.skipped), (4, 1));
        assert_eq!((block.lateness.counts()[5], block.lateness.counts().iter().sum::<u32>()), (2, 4));
    }
}
