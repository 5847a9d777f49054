//! Time as the runtime counts it: integer nanoseconds and rational rates, so that nothing drifts.

use std::fmt;
use std::time::Duration;

/// Nanoseconds since the start of a run, or between two of its moments.
///
/// ```
/// use palpate_runtime::Nanos;
///
/// let tick = Nanos::from_secs_f64(0.003);
/// assert_eq!(tick + Nanos(500), Nanos(3_000_500));
/// assert_eq!(tick - Nanos::from_millis(1), Nanos::from_millis(2));
/// assert_eq!((tick.as_secs_f64(), Nanos(1).saturating_sub(tick)), (0.003, Nanos::ZERO));
/// assert_eq!(Nanos(1_500).to_string(), "1.5 us");
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Nanos(pub u64);

impl Nanos {
    /// The start of the run.
    pub const ZERO: Self = Self(0);

    /// Nanoseconds of a duration; saturates after 584 years.
    pub fn from_duration(duration: Duration) -> Self {
        Self(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX))
    }

    /// Nanoseconds of so many milliseconds; saturates after 584 years.
    pub const fn from_millis(milliseconds: u64) -> Self {
        Self(milliseconds.saturating_mul(1_000_000))
    }

    /// Nanoseconds of a time in seconds, rounded to the nearest; negative and NaN give zero.
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as u64)
    }

    /// The time in seconds, correctly rounded: 3 ms is the double nearest to 0.003.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// The time as a standard duration.
    pub fn to_duration(self) -> Duration {
        Duration::from_nanos(self.0)
    }

    /// The difference `self - other`, or zero.
    #[must_use]
    pub fn saturating_sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl std::ops::Add for Nanos {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

/// # Panics
/// If the difference is negative, as [`Duration`] does; [`saturating_sub`](Nanos::saturating_sub) gives zero.
impl std::ops::Sub for Nanos {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.checked_sub(other.0).expect("a time minus a later one"))
    }
}

/// Every digit, in the largest unit of which it is at least one: `135 us`, `33.333333 ms`.
impl fmt::Display for Nanos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (unit, name) = match self.0 {
            0..1_000 => (1, "ns"),
            1_000..1_000_000 => (1_000, "us"),
            1_000_000..1_000_000_000 => (1_000_000, "ms"),
            _ => (1_000_000_000, "s"),
        };
        let (whole, part) = (self.0 / unit, self.0 % unit);
        if part == 0 {
            return write!(f, "{whole} {name}");
        }
        let digits = unit.ilog10() as usize;
        write!(f, "{whole}.{} {name}", format!("{part:0digits$}").trim_end_matches('0'))
    }
}

/// A rate as a fraction: `releases` per `seconds`. 30 Hz is exact, and release n falls on `n * seconds / releases`.
///
/// ```
/// use palpate_runtime::Rate;
///
/// let [global, haptic] = [30, 1000].map(Rate::hz);
/// let resyncs = [0, 1, 2, 3].map(|n| haptic.last_release(global.release(n)));
/// assert_eq!(resyncs, [0, 33, 66, 100]); // nothing drifts: 33 or 34 ticks apart
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    releases: u32,
    seconds: u32,
}

impl Rate {
    /// A rate of `hz` releases per second.
    ///
    /// # Panics
    /// If `hz` is zero.
    pub const fn hz(hz: u32) -> Self {
        Self::new(hz, 1)
    }

    /// A rate of `releases` per `seconds`.
    ///
    /// # Panics
    /// If either is zero.
    pub const fn new(releases: u32, seconds: u32) -> Self {
        assert!(releases > 0 && seconds > 0, "a rate needs a positive numerator and denominator");
        Self { releases, seconds }
    }

    /// The fraction with denominator 1, 10, ... 10^6 that is `hz`. `None` outside 0.001 Hz to 1 MHz, and for a rate that no such
    /// fraction of 32-bit numbers is, as one with more than six decimals: 1/3 Hz is [`Rate::new(1, 3)`](Self::new).
    pub fn from_hz(hz: f64) -> Option<Self> {
        if !(1e-3..=1e6).contains(&hz) {
            return None;
        }
        [1_u32, 10, 100, 1_000, 10_000, 100_000, 1_000_000]
            .into_iter()
            .filter(|&seconds| hz * f64::from(seconds) <= f64::from(u32::MAX))
            .map(|seconds| ((hz * f64::from(seconds)).round(), seconds))
            .find(|&(releases, seconds)| releases >= 1.0 && (releases / f64::from(seconds) - hz).abs() <= 1e-12 * hz)
            .map(|(releases, seconds)| Self::new(releases as u32, seconds))
    }

    /// The rate as the two numbers that it was made of: releases, per this many seconds.
    pub fn as_fraction(self) -> (u32, u32) {
        (self.releases, self.seconds)
    }

    /// The rate in hertz.
    pub fn as_hz(self) -> f64 {
        f64::from(self.releases) / f64::from(self.seconds)
    }

    /// The period in seconds.
    pub fn period_s(self) -> f64 {
        f64::from(self.seconds) / f64::from(self.releases)
    }

    /// The period, rounded down to a nanosecond; use [`release`](Self::release) for times.
    pub fn period(self) -> Nanos {
        self.release(1)
    }

    /// The time of release `n`, rounded down to a nanosecond. Never accumulates an error.
    pub fn release(self, n: u64) -> Nanos {
        let time = u128::from(n) * u128::from(self.seconds) * 1_000_000_000 / u128::from(self.releases);
        Nanos(u64::try_from(time).unwrap_or(u64::MAX))
    }

    /// The latest release at or before `time`: the largest n with `release(n) <= time`.
    pub fn last_release(self, time: Nanos) -> u64 {
        let periods = (u128::from(time.0) + 1) * u128::from(self.releases);
        // release(n) <= t  <=>  n * s * 1e9 / r < t + 1  <=>  n < (t + 1) r / (s 1e9)
        let n = periods.div_ceil(u128::from(self.seconds) * 1_000_000_000);
        u64::try_from(n.saturating_sub(1)).unwrap_or(u64::MAX)
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} Hz", self.as_hz())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_hertz_resyncs_are_33_or_34_haptic_ticks_apart() {
        let (global, haptic) = (Rate::hz(30), Rate::hz(1000));
        let ticks: Vec<u64> = (0..4).map(|k| haptic.last_release(global.release(k))).collect();
        assert_eq!(ticks, [0, 33, 66, 100]);
    }

    #[test]
    fn last_release_inverts_release() {
        for rate in [Rate::hz(30), Rate::hz(1000), Rate::new(2997, 100), Rate::new(1, 7)] {
            for n in [0, 1, 2, 3, 29, 30, 31, 999, 123_456_789] {
                let time = rate.release(n);
                assert_eq!(rate.last_release(time), n, "{rate} {n}");
                if n > 0 {
                    assert_eq!(rate.last_release(Nanos(time.0 - 1)), n - 1, "{rate} {n}");
                }
            }
        }
    }

    #[test]
    fn rates_from_floats_are_exact_fractions() {
        assert_eq!(Rate::from_hz(30.0), Some(Rate::hz(30)));
        assert_eq!(Rate::from_hz(29.97), Some(Rate::new(2997, 100)));
        assert_eq!(Rate::from_hz(f64::NAN), None);
        assert_eq!(Rate::from_hz(-1.0), None);
        assert_eq!(Rate::from_hz(0.0), None);
    }
}
