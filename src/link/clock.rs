//! The clock of the other computer, from round trips.
//!
//! A message goes out at t0, comes in over there at t1, is answered at t2 and is back at t3. If both ways took the same, the other clock
//! is ((t1 - t0) + (t2 - t3))/2 ahead (Mills, RFC 5905). The quicker the round trip, the less there is for the ways to differ by: of a
//! window of them the quickest counts.

use std::collections::VecDeque;

/// Round trips that are remembered: with twenty a second those of the last 1.6 s.
const WINDOW: usize = 32;
/// The clock that is shown goes at most so much faster or slower than this one (ns per ns): it is never stepped.
const FASTEST: f64 = 500e-6;

/// An estimate of another computer's clock and of the way there.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// Newest last.
    window: VecDeque<RoundTrip>,
    /// As shown (ns), and when (ns of this clock).
    shown: Option<(f64, i64)>,
    /// The quickest of the first whole window, for the drift.
    first: Option<RoundTrip>,
}

#[derive(Clone, Copy, Debug)]
struct RoundTrip {
    at: i64,
    took: i64,
    ahead: f64,
}

impl Clock {
    /// Takes a round trip: sent here, received and sent back there, received here (ns, each of its own clock). One that goes back in
    /// time is not believed; returns whether it was.
    pub fn push(&mut self, [t0, t1, t2, t3]: [u64; 4]) -> bool {
        let [t0, t1, t2, t3] = [t0, t1, t2, t3].map(|t| i64::try_from(t).unwrap_or(i64::MAX));
        let took = t3.saturating_sub(t0).saturating_sub(t2.saturating_sub(t1));
        if t3 < t0 || t2 < t1 || took < 0 {
            return false;
        }
        let ahead = 0.5 * (t1.saturating_sub(t0) as f64 + t2.saturating_sub(t3) as f64);
        self.window.push_back(RoundTrip { at: t3, took, ahead });
        if self.window.len() > WINDOW {
            self.window.pop_front();
        }
        let Some(best) = self.best() else { return false };
        if self.window.len() == WINDOW {
            self.first.get_or_insert(best);
        }
        self.shown = Some(match self.shown {
            None => (best.ahead, t3),
            Some((shown, at)) => {
                let most = FASTEST * t3.saturating_sub(at).max(0) as f64;
                (shown + (best.ahead - shown).clamp(-most, most), t3)
            }
        });
        true
    }

    fn best(&self) -> Option<RoundTrip> {
        self.window.iter().copied().min_by_key(|trip| trip.took)
    }

    /// The quickest round trip of the last ones (ns); `None` before the first.
    pub fn round_trip_ns(&self) -> Option<u64> {
        self.best().map(|best| best.took.unsigned_abs())
    }

    /// How much the other clock is ahead (ns), as far as that is known: it is never stepped. `None` before the first round trip.
    pub fn ahead_ns(&self) -> Option<f64> {
        self.shown.map(|(shown, _)| shown)
    }

    /// How much faster the other clock goes (parts per million), by the first and the last window; zero until they are apart.
    pub fn drift_ppm(&self) -> f64 {
        let (Some(first), Some(last)) = (self.first, self.best()) else { return 0.0 };
        let between = last.at.saturating_sub(first.at);
        if between <= 0 { 0.0 } else { 1e6 * (last.ahead - first.ahead) / between as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// Round trips every 50 ms to a clock that is `ahead` and goes `drift` faster, by ways of 5 ms and up to 20 ms more.
    fn after(seconds: u64, ahead: f64, drift: f64) -> (Clock, Vec<f64>) {
        let (mut clock, mut shown) = (Clock::default(), Vec::new());
        for n in 0..20 * seconds {
            let way = |place| (5e6 + 20e6 * uniform(3, place).powi(2)) as u64;
            let t0 = n * 50_000_000;
            let there = |t: u64| (t as f64 * (1.0 + drift) + ahead) as u64;
            let (out, back) = (t0 + way(2 * n), t0 + way(2 * n) + 100_000 + way(2 * n + 1));
            assert!(clock.push([t0, there(out), there(out + 100_000), back]));
            shown.push(clock.ahead_ns().unwrap() - (back as f64 * drift + ahead));
        }
        (clock, shown)
    }

    #[test]
    fn the_other_clock_is_known_to_a_part_of_the_jitter_and_never_stepped() {
        let (clock, errors) = after(20, 3e9, 50e-6);
        let rtt = clock.round_trip_ns().unwrap();
        assert!((10_000_000..16_000_000).contains(&rtt), "{rtt}");
        assert!(errors.iter().skip(100).all(|error| error.abs() < 3e6), "{errors:?}");
        assert!((clock.drift_ppm() - 50.0).abs() < 200.0, "{}", clock.drift_ppm());
        assert!(errors.windows(2).all(|pair| (pair[1] - pair[0]).abs() < (FASTEST + 50e-6) * 95e6), "stepped");
    }

    #[test]
    fn a_round_trip_that_goes_back_in_time_is_not_believed() {
        let mut clock = Clock::default();
        assert!(!clock.push([10, 0, 0, 5]) && !clock.push([10, 9, 3, 20]) && !clock.push([0, 0, 50, 20]));
        assert!(clock.round_trip_ns().is_none());
        assert!(clock.push([5, u64::MAX - 1, u64::MAX, 9]) && clock.ahead_ns().unwrap() > 9e18);
    }
}
