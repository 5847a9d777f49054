//! Values over the time of a run, in a bounded number of bins however long it lasts.

use palpate::runtime::Nanos;

/// What a bin can do: take in the bin that follows it.
pub trait Absorb: Default {
    /// Adds what happened in `later`.
    fn absorb(&mut self, later: Self);
}

/// Bins of equal width from the first moment on. When there are too many, neighbours are joined and the width doubles.
#[derive(Clone, Debug, PartialEq)]
pub struct OverTime<B> {
    start: Nanos,
    width: Nanos,
    bins: Vec<B>,
    most: usize,
}

impl<B: Absorb> OverTime<B> {
    /// No bin yet; there will be at most `most`, an even number, none narrower than `least_width`.
    pub fn new(most: usize, least_width: Nanos) -> Self {
        Self { start: Nanos::ZERO, width: Nanos(least_width.0.max(1)), bins: Vec::new(), most: most.max(2) }
    }

    /// The bin at `time`; what lies before the first moment belongs to the first bin. Allocates.
    pub fn at(&mut self, time: Nanos) -> &mut B {
        if self.bins.is_empty() {
            self.start = time;
        }
        let mut place = self.place(time);
        while place >= self.most as u64 {
            self.join_neighbours();
            place = self.place(time);
        }
        // Below `most`.
        let place = place as usize;
        if place >= self.bins.len() {
            self.bins.resize_with(place + 1, B::default);
        }
        &mut self.bins[place]
    }

    /// Every bin with the time at which it begins.
    pub fn iter(&self) -> impl Iterator<Item = (Nanos, &B)> {
        (0..).zip(&self.bins).map(|(place, bin): (u64, _)| (self.start + Nanos(place * self.width.0), bin))
    }

    /// The bins in their order.
    pub fn bins(&self) -> &[B] {
        &self.bins
    }

    /// How long each bin lasts.
    pub fn width(&self) -> Nanos {
        self.width
    }

    fn place(&self, time: Nanos) -> u64 {
        time.saturating_sub(self.start).0 / self.width.0
    }

    fn join_neighbours(&mut self) {
        let mut bins = std::mem::take(&mut self.bins).into_iter();
        while let Some(mut bin) = bins.next() {
            if let Some(later) = bins.next() {
                bin.absorb(later);
            }
            self.bins.push(bin);
        }
        self.width = Nanos(self.width.0.saturating_mul(2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[derive(Debug, Default)]
    struct Sum(u64);

    impl Absorb for Sum {
        fn absorb(&mut self, later: Self) {
            self.0 += later.0;
        }
    }

    proptest! {
        // Check that nothing is lost, that the number of bins stays bounded, and that each value is in the bin of its time.
        #[test]
        fn nothing_is_lost_and_the_bins_stay_few(start in 0_u64..1000, times in prop::collection::vec(0_u64..100_000, 1..200)) {
            let mut times = times;
            times.sort_unstable();
            let mut bins = OverTime::<Sum>::new(8, Nanos(3));
            times.iter().for_each(|time| bins.at(Nanos(start + time)).0 += 1);
            prop_assert!(bins.bins().len() <= 8);
            let width = bins.width().0;
            for (from, bin) in bins.iter() {
                let inside = times.iter().filter(|time| (from.0..from.0 + width).contains(&(start + **time))).count();
                prop_assert_eq!(bin.0, inside as u64);
            }
        }
    }
}
