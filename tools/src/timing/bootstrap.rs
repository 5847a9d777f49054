//! How sure a ratio of two runs is: the percentile bootstrap over blocks of time.
//!
//! Ticks that follow each other are not independent (a competing load lasts longer than one of them), so whole blocks of
//! a run are drawn with replacement, as Künsch (1989) does for dependent data, from each run by itself. The middle
//! 95 % of the ratios that a thousand such pairs of runs give is the interval (Efron 1979). Blocks are counted in buckets
//! 0.8 % wide, so an interval is no finer.

use palpate::random::uniform;

use super::analysis::{Block, Buckets};

/// Pairs of runs that are drawn.
const DRAWS: u64 = 1000;
/// Of the intervals, on each side (in thousandths).
const TAIL: usize = 25;
/// Blocks that are too few to say anything.
const LEAST_BLOCKS: usize = 8;
/// Samples beyond a percentile that are too few to say anything about it.
const LEAST_BEYOND: u64 = 10;
const SEED: u64 = 0x0070_616c_7061_7465;

/// The percentiles that are compared, in thousandths.
pub(super) const PERMILLE: [u64; 4] = [500, 900, 990, 999];

/// The 95 % interval of b / a for each percentile; `None` where there is too little to say.
pub(super) fn percentile_ratios(
    [a, b]: [&[Block]; 2],
    figure: impl Fn(&Block) -> &Buckets,
) -> [Option<[f64; 2]>; PERMILLE.len()] {
    let sides = [Side::new(a, &figure), Side::new(b, &figure)];
    let mut ratios: [Vec<f64>; PERMILLE.len()] = Default::default();
    if sides.iter().all(|side| side.blocks.len() >= LEAST_BLOCKS) {
        for draw in 0..DRAWS {
            let [of_a, of_b] = [0, 1].map(|side| sides[side].draw(2 * draw + side as u64));
            ratios.iter_mut().zip(of_a.into_iter().zip(of_b)).for_each(|(ratios, (a, b))| ratios.push(b / a));
        }
    }
    let total = sides.iter().map(|side| side.total).min().unwrap_or(0);
    let mut intervals = [None; PERMILLE.len()];
    for ((interval, ratios), permille) in intervals.iter_mut().zip(ratios).zip(PERMILLE) {
        let is_known = total * (1000 - permille) >= LEAST_BEYOND * 1000;
        *interval = if is_known { middle(ratios) } else { None };
    }
    intervals
}

/// The 95 % interval of the ratio of two shares, such as skipped periods per period.
pub(super) fn share_ratio([a, b]: [&[Block]; 2], share: impl Fn(&Block) -> [u64; 2]) -> Option<[f64; 2]> {
    if a.len() < LEAST_BLOCKS || b.len() < LEAST_BLOCKS {
        return None;
    }
    let drawn = |blocks: &[Block], seed: u64| {
        let mut sum = [0; 2];
        for block in chosen(blocks.len(), seed) {
            let [some, all] = share(&blocks[block]);
            sum = [sum[0] + some, sum[1] + all];
        }
        sum[0] as f64 / sum[1] as f64
    };
    middle((0..DRAWS).map(|draw| drawn(b, 2 * draw + 1) / drawn(a, 2 * draw)).collect())
}

/// The blocks of one run that is drawn.
fn chosen(blocks: usize, draw: u64) -> impl Iterator<Item = usize> {
    let place = draw.wrapping_mul(1 << 20);
    (0..blocks as u64).map(move |n| ((uniform(SEED, place + n) * blocks as f64) as usize).min(blocks - 1))
}

/// The middle of the ratios; `None` if any of them is no number.
fn middle(mut ratios: Vec<f64>) -> Option<[f64; 2]> {
    if ratios.is_empty() || ratios.iter().any(|ratio| !ratio.is_finite()) {
        return None;
    }
    ratios.sort_unstable_by(f64::total_cmp);
    let tail = ratios.len() * TAIL / 1000;
    Some([ratios[tail], ratios[ratios.len() - 1 - tail]])
}

/// One run: its blocks, with the buckets that any of them uses and no others.
struct Side {
    least: Vec<u64>,
    blocks: Vec<Vec<u32>>,
    total: u64,
}

impl Side {
    fn new(blocks: &[Block], figure: impl Fn(&Block) -> &Buckets) -> Self {
        let mut sum: Vec<u64> = Vec::new();
        for block in blocks {
            let counts = figure(block).counts();
            sum.resize(sum.len().max(counts.len()), 0);
            sum.iter_mut().zip(counts).for_each(|(sum, count)| *sum += u64::from(*count));
        }
        let used: Vec<usize> = (0..sum.len()).filter(|&bucket| sum[bucket] > 0).collect();
        let of_block = |block: &Block| {
            let counts = figure(block).counts();
            used.iter().map(|&bucket| counts.get(bucket).copied().unwrap_or(0)).collect()
        };
        let least = used.iter().map(|&bucket| Buckets::least_of(bucket)).collect();
        Self { least, blocks: blocks.iter().map(of_block).collect(), total: sum.iter().sum() }
    }

    /// The percentiles of one run that is drawn; NaN if it has no samples.
    fn draw(&self, draw: u64) -> [f64; PERMILLE.len()] {
        let mut sum = vec![0_u64; self.least.len()];
        for block in chosen(self.blocks.len(), draw) {
            sum.iter_mut().zip(&self.blocks[block]).for_each(|(sum, count)| *sum += u64::from(*count));
        }
        let total: u64 = sum.iter().sum();
        let mut found = [f64::NAN; PERMILLE.len()];
        let (mut seen, mut next) = (0, 0);
        for (least, count) in self.least.iter().zip(sum) {
            seen += count;
            while total > 0 && next < PERMILLE.len() && seen * 1000 >= total * PERMILLE[next] {
                // Zero has no ratio: what takes less than a nanosecond takes one.
                found[next] = (*least).max(1) as f64;
                next += 1;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exponential times with a mean that wanders from block to block.
    fn run(seed: u64, scale: f64) -> Vec<Block> {
        let block = |n: u64| {
            let mut block = Block::default();
            let own = scale * (0.8 + 0.4 * uniform(seed, 1_000_000 + n));
            for i in 0..200 {
                let time = -own * (1.0 - uniform(seed, n * 200 + i)).ln();
                block.lateness.push(time as u64);
                block.released += 1;
                block.skipped += u64::from(time > 3.0 * scale);
            }
            block
        };
        (0..64).map(block).collect()
    }

    // Check coverage: of forty pairs of runs with a known ratio, about 95 % have it in their interval.
    #[test]
    fn an_interval_holds_the_true_ratio_about_as_often_as_it_says() {
        let mut held = [0; 3];
        for pair in 0..40 {
            let (a, b) = (run(2 * pair, 10_000.0), run(2 * pair + 1, 15_000.0));
            let intervals = percentile_ratios([&a, &b], |block| &block.lateness);
            for (held, interval) in held.iter_mut().zip(intervals) {
                let [low, high] = interval.unwrap();
                *held += i32::from((low..=high).contains(&1.5));
                assert!(high - low < 1.0, "{low} {high}");
            }
        }
        assert!(held.iter().all(|held| (33..=40).contains(held)), "{held:?}");
    }

    #[test]
    fn where_there_is_too_little_nothing_is_said() {
        let (a, b) = (run(1, 10_000.0), run(2, 10_000.0));
        assert_eq!(percentile_ratios([&a[..7], &b], |block| &block.lateness), [None; 4]);
        // 9 blocks of 200: 1.8 samples lie beyond p99.9, 18 beyond p99.
        let few = percentile_ratios([&a[..9], &b], lateness_of);
        assert!(few[2].is_some() && few[3].is_none());
        assert_eq!(percentile_ratios([&a, &b], |block| &block.jitter), [None; 4]);
        assert!(share_ratio([&a, &b], |block| [block.skipped, block.released]).is_some());
        assert_eq!(share_ratio([&a, &b], |block| [block.missed, block.released]), None);
    }

    fn lateness_of(block: &Block) -> &Buckets {
        &block.lateness
    }
}
