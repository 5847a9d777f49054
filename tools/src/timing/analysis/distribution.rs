//! What is drawn of a distribution: bins, and its percentiles up to the rarest.

use palpate::log::{Distribution, Percentiles};

/// Bins per octave, on an axis that is logarithmic.
const PER_OCTAVE: u32 = 4;
/// Steps of the percentile axis from each halving of the rest to the next: 50 %, 75 %, 87.5 %, ... have as many between.
const STEPS_PER_HALVING: u32 = 4;

/// How many values lie between two limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// The least value.
    pub from: f64,
    /// All values are below this.
    pub to: f64,
    /// How many.
    pub count: u64,
}

/// A distribution of durations (ns) as a chart shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// The percentiles in numbers.
    pub percentiles: Percentiles<u64>,
    /// A quarter of an octave each, from the least value to the largest, empty ones among them; zero counts for 1 ns.
    pub bins: Vec<Bin>,
    /// Share of the values (0 to 1) and the least value that so many do not exceed; the last is the maximum.
    pub curve: Vec<(f64, u64)>,
}

impl Shape {
    /// Of `distribution`.
    pub fn of(distribution: &Distribution) -> Self {
        let counts = distribution.counts();
        Self { percentiles: distribution.percentiles(), bins: bins(&counts), curve: curve(&counts) }
    }
}

fn edge(bin: i32) -> f64 {
    f64::from(bin).mul_add(f64::from(PER_OCTAVE).recip(), 0.0).exp2()
}

fn bins(counts: &[(u64, u64)]) -> Vec<Bin> {
    let place = |value: u64| ((value.max(1) as f64).log2() * f64::from(PER_OCTAVE)).floor() as i32;
    let (Some(&(least, _)), Some(&(largest, _))) = (counts.first(), counts.last()) else { return Vec::new() };
    let first = place(least);
    let mut bins: Vec<Bin> =
        (first..=place(largest)).map(|bin| Bin { from: edge(bin), to: edge(bin + 1), count: 0 }).collect();
    for &(value, count) in counts {
        if let Some(bin) = usize::try_from(place(value) - first).ok().and_then(|bin| bins.get_mut(bin)) {
            bin.count = bin.count.saturating_add(count);
        }
    }
    bins
}

/// Shares that halve what is left, in steps, as long as one value is left beyond them.
fn shares(total: u64) -> Vec<f64> {
    let mut shares = Vec::new();
    let mut rest = 1.0_f64;
    while rest * total as f64 >= 1.0 {
        shares.extend(
            (0..STEPS_PER_HALVING).map(|step| 1.0 - rest * (1.0 - f64::from(step) / f64::from(2 * STEPS_PER_HALVING))),
        );
        rest /= 2.0;
    }
    shares.push(1.0);
    shares
}

fn curve(counts: &[(u64, u64)]) -> Vec<(f64, u64)> {
    // Counts of other programs may be anything.
    let total = counts.iter().map(|&(_, count)| count).fold(0, u64::saturating_add);
    if total == 0 {
        return Vec::new();
    }
    let (mut at, mut seen) = (0, counts[0].1);
    let mut curve = Vec::new();
    for share in shares(total) {
        let rank = ((share * total as f64).ceil() as u64).clamp(1, total);
        while seen < rank && at + 1 < counts.len() {
            at += 1;
            seen = seen.saturating_add(counts[at].1);
        }
        curve.push((share, counts[at].0));
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_every_value_and_the_curve_ends_at_the_maximum() {
        let mut distribution = Distribution::default();
        (0..10_000_u64).for_each(|i| distribution.push(i * i % 7919 + 100));
        let shape = Shape::of(&distribution);
        assert_eq!(shape.bins.iter().map(|bin| bin.count).sum::<u64>(), 10_000);
        assert!(shape.bins.windows(2).all(|pair| pair[0].to == pair[1].from));
        assert_eq!(shape.curve.last(), Some(&(1.0, shape.percentiles.max)));
        let at = |share: f64| shape.curve.iter().find(|point| point.0 == share).unwrap().1;
        assert_eq!(at(0.5), shape.percentiles.p50);
        assert!(shape.curve.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1));
        assert_eq!(Shape::of(&Distribution::default()), Shape::default());
    }
}
