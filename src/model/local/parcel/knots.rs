//! A motion by few of its samples.

use std::ops::Range;

/// Samples from one knot to the next, at most.
const MOST_APART: usize = 16;
/// Knots that a sample between them is told from: what is cubic in time comes back as it was.
const AROUND: usize = 4;
/// Knots that the next one is expected from.
const BEFORE: usize = 3;

/// The samples that tell those between them: the first, the last, and the more the less smooth the motion is there.
#[derive(Debug)]
pub(super) struct Knots(Vec<usize>);

impl Knots {
    /// Those that bring every number of `samples`, each of `size` numbers, back within `close`.
    pub(super) fn of(samples: &[f64], size: usize, close: f64) -> Self {
        let last = (samples.len() / size).saturating_sub(1);
        let mut told = vec![0.0; size];
        let mut knots = Self((0..last).step_by(MOST_APART).chain([last]).collect());
        loop {
            let mut is_far = |&number: &usize| {
                knots.between(number).any(|sample| {
                    knots.around(number, sample).write(samples, &mut told);
                    let apart = told.iter().zip(&samples[sample * size..]).map(|(a, b)| (a - b).abs());
                    apart.fold(false, |is_far, apart| is_far | (apart > close))
                })
            };
            let split: Vec<_> = (1..knots.0.len()).filter(&mut is_far).map(|number| knots.middle(number)).collect();
            if split.is_empty() {
                return knots;
            }
            knots.0.extend(split);
            knots.0.sort_unstable();
        }
    }

    /// Those that are so many samples apart; `None` if that cannot be.
    pub(super) fn apart(gaps: &[u8]) -> Option<Self> {
        let mut knots = vec![0];
        for &gap in gaps {
            let gap = Some(usize::from(gap)).filter(|gap| (1..=MOST_APART).contains(gap))?;
            knots.push(knots[knots.len() - 1] + gap);
        }
        Some(Self(knots))
    }

    /// How many samples each is after the one before.
    pub(super) fn gaps(&self) -> Vec<u8> {
        self.0.windows(2).map(|pair| (pair[1] - pair[0]) as u8).collect()
    }

    /// The samples that are knots.
    pub(super) fn samples(&self) -> &[usize] {
        &self.0
    }

    /// The curve through the ones before the `number`-th, at that one.
    pub(super) fn expected(&self, number: usize) -> Curve<'_> {
        Curve::through(&self.0[number.saturating_sub(BEFORE)..number], self.0[number])
    }

    /// The samples that are no knots, each with the curve that it is on.
    pub(super) fn others(&self) -> impl Iterator<Item = (usize, Curve<'_>)> {
        let between = move |number| self.between(number).map(move |sample| (sample, self.around(number, sample)));
        (1..self.0.len()).flat_map(between)
    }

    /// The samples between the `number`-th and the one before.
    fn between(&self, number: usize) -> Range<usize> {
        self.0[number - 1] + 1..self.0[number]
    }

    fn middle(&self, number: usize) -> usize {
        self.0[number - 1].midpoint(self.0[number])
    }

    /// The curve through the ones next to a `sample` before the `number`-th, two on either side where there are.
    fn around(&self, number: usize, sample: usize) -> Curve<'_> {
        let first = number.saturating_sub(AROUND / 2).min(self.0.len().saturating_sub(AROUND));
        Curve::through(&self.0[first..(first + AROUND).min(self.0.len())], sample)
    }
}

/// The polynomial through some samples, at another one (Lagrange).
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve<'a> {
    through: &'a [usize],
    weights: [f64; AROUND],
}

impl<'a> Curve<'a> {
    fn through(through: &'a [usize], at: usize) -> Self {
        let mut weights = [0.0; AROUND];
        for (weight, &own) in weights.iter_mut().zip(through) {
            let others = through.iter().filter(|&&other| other != own);
            let [at, own] = [at, own].map(|sample| sample as f64);
            *weight = others.map(|&other| (at - other as f64) / (own - other as f64)).product();
        }
        Self { through, weights }
    }

    /// Writes the numbers there, if `samples` has as many for each sample.
    pub(super) fn write(&self, samples: &[f64], numbers: &mut [f64]) {
        numbers.fill(0.0);
        let size = numbers.len();
        for (sample, weight) in self.through.iter().zip(self.weights) {
            numbers.iter_mut().zip(&samples[sample * size..]).for_each(|(number, of)| *number += of * weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check that what is cubic in time needs no more than the widest knots, and comes back as it was.
    #[test]
    fn a_cubic_comes_back_from_the_fewest_knots() {
        let cubic = |n: usize| [1.0, 1e-3].map(|scale| scale * (n as f64 - 20.0) * (n as f64 - 55.0) * n as f64);
        let samples: Vec<f64> = (0..70).flat_map(cubic).collect();
        let knots = Knots::of(&samples, 2, 1e-6);
        assert_eq!(knots.samples(), [0, 16, 32, 48, 64, 69]);
        assert_eq!(Knots::apart(&knots.gaps()).unwrap().samples(), knots.samples());
        let mut told = [0.0; 2];
        for (sample, curve) in knots.others() {
            curve.write(&samples, &mut told);
            assert!((told[0] - samples[2 * sample]).abs() < 1e-7);
        }
        assert_eq!(knots.others().count() + knots.samples().len(), 70);
    }

    #[test]
    fn knots_are_near_each_other_where_something_happens_and_there_alone() {
        let samples: Vec<f64> = (0..97).map(|n| f64::from(n >= 50)).collect();
        let knots = Knots::of(&samples, 1, 1e-3);
        let near = |range: Range<usize>| knots.samples().iter().filter(|sample| range.contains(sample)).count();
        assert_eq!(near(48..52), 4);
        assert!(near(0..32) <= 4 && near(70..97) <= 4, "{:?}", knots.samples());
    }

    #[test]
    fn one_sample_is_one_knot() {
        let knots = Knots::of(&[2.0, 3.0], 2, 0.1);
        assert_eq!((knots.samples(), knots.gaps().len(), knots.others().count()), (&[0][..], 0, 0));
    }
}
