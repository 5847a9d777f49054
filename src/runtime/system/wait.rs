//! How a group's thread waits for its next release: it sleeps, or it sleeps until a little before and spins the rest.
//!
//! A sleep ends late by what the kernel needs to bring the thread back, some microseconds to some tens of them. Spinning
//! through that time hides it and costs a share of the core, so the margin before the release at which the sleep is to
//! end is learnt from how late the sleeps really end: [`AdaptiveMargin`].

use crate::rate_group::Wait;
use crate::system::os;
use crate::time::Nanos;
use std::fmt;

/// A slow group looks at the stop flag this often; longer than the period of 30 Hz, which so keeps its one sleep.
const SLICE_NS: u64 = 50_000_000;

/// The margin of a sleep-then-spin wait: a high quantile of how late sleeps end, and a guard.
///
/// A sleep that ends later than the estimate raises it by [`UP_NS`](Self::UP_NS), any other lowers it by
/// [`DOWN_NS`](Self::DOWN_NS); the steps balance where one sleep in a thousand ends later, so the estimate is the 99.9
/// % quantile. A step does not depend on how far off the sleep was: a stall of the machine for 20 ms moves the margin
/// no further than one for 100 us, and a second later it is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AdaptiveMargin {
    estimate_ns: u64,
    ceiling_ns: u64,
}

impl AdaptiveMargin {
    /// Seven late wakes are learnt from the floor to the ceiling.
    const UP_NS: u64 = 19_980;
    /// 20 us per second at 1 kHz. Its share of both steps is the fraction of sleeps that end later than the estimate.
    const DOWN_NS: u64 = 20;
    /// What comes after the sleep has ended: a look at the stop flag and at the clock.
    const GUARD_NS: u64 = 2_000;
    /// No sleep ends earlier than this after its time.
    const FLOOR_NS: u64 = 5_000;
    /// More than this buys little: what still ends later is a stall that no margin covers.
    const CEILING_NS: u64 = 135_000;
    /// At most this percentage of the period is spun away,
    const PERIOD_PERCENT: u64 = 15;
    /// unless that is less than a wake-up takes: a margin below it covers nothing, and every sleep ends late.
    const WAKE_NS: u64 = 50_000;
    /// A short sleep is left in each period even so. Where the kernel takes a real-time thread that never sleeps from
    /// its core for 50 ms of each second, it costs less than that.
    const MOST_PERCENT: u64 = 90;

    /// For releases `period` apart. It begins with the largest margin and learns how much less will do.
    pub(crate) fn new(period: Nanos) -> Self {
        let share = |percent| period.0 / 100 * percent;
        let wake = Self::WAKE_NS.min(share(Self::MOST_PERCENT));
        let ceiling_ns = Self::CEILING_NS.min(share(Self::PERIOD_PERCENT)).max(wake);
        Self { estimate_ns: ceiling_ns, ceiling_ns }
    }

    /// Whether a sleep can end before the release that follows a period later: above 20 kHz none does.
    pub(crate) fn covers(period: Nanos) -> bool {
        period.0 >= Self::WAKE_NS
    }

    /// Learns from a sleep that ended `lateness_ns` after its time.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub(crate) fn learn(&mut self, lateness_ns: u64) {
        self.estimate_ns = if lateness_ns > self.estimate_ns {
            (self.estimate_ns + Self::UP_NS).min(self.ceiling_ns)
        } else {
            self.estimate_ns.saturating_sub(Self::DOWN_NS).max(Self::FLOOR_NS.min(self.ceiling_ns))
        };
    }

    /// How long before the release the sleep is to end.
    #[inline]
    pub(crate) fn margin_ns(&self) -> u64 {
        (self.estimate_ns + Self::GUARD_NS).min(self.ceiling_ns)
    }
}

/// What a waiter does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Strategy {
    Sleep,
    Fixed(u64),
    Adaptive(AdaptiveMargin),
    Spin,
}

/// Waits for the releases of one group, in the way that was asked for as far as its policy allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Waiter(Strategy);

impl Waiter {
    /// Spinning without a real-time policy only takes time from the threads that one waits for, so then it sleeps.
    pub(crate) fn new(wait: Wait, realtime: bool, period: Nanos) -> Self {
        Self(match wait {
            Wait::Auto if realtime && !AdaptiveMargin::covers(period) => Strategy::Spin,
            Wait::Auto if realtime => Strategy::Adaptive(AdaptiveMargin::new(period)),
            Wait::SleepSpin { margin } if realtime => Strategy::Fixed(margin.0),
            Wait::Spin if realtime => Strategy::Spin,
            Wait::Auto | Wait::Sleep | Wait::SleepSpin { .. } | Wait::Spin => Strategy::Sleep,
        })
    }

    /// Waits until the clock has reached `due_ns` and returns what it showed then; `None` if `leave` said that it is
    /// time to leave instead.
    ///
    /// # Real-time
    /// Sleeps, and makes no other system call.
    pub(crate) fn until(&mut self, due_ns: u64, leave: impl Fn() -> bool) -> Option<u64> {
        let margin_ns = match &self.0 {
            Strategy::Sleep => 0,
            Strategy::Fixed(margin_ns) => *margin_ns,
            Strategy::Adaptive(margin) => margin.margin_ns(),
            Strategy::Spin => u64::MAX,
        };
        let wake_ns = due_ns.saturating_sub(margin_ns);
        let mut slept = false;
        loop {
            if leave() {
                return None;
            }
            let now_ns = os::monotonic();
            if slept && now_ns >= wake_ns {
                if let Strategy::Adaptive(margin) = &mut self.0 {
                    margin.learn(now_ns - wake_ns);
                }
                slept = false;
            }
            if now_ns >= due_ns {
                return Some(now_ns);
            }
            if now_ns < wake_ns {
                os::sleep_until(wake_ns.min(now_ns + SLICE_NS));
                slept = true;
            } else {
                std::hint::spin_loop();
            }
        }
    }
}

impl fmt::Display for Waiter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Strategy::Sleep => f.write_str("sleep"),
            Strategy::Fixed(margin_ns) => write!(f, "sleep, then spin {}", Nanos(*margin_ns)),
            Strategy::Adaptive(margin) => {
                write!(f, "sleep, then spin, margin adapts (at most {})", Nanos(margin.ceiling_ns))
            }
            Strategy::Spin => f.write_str("spin"),
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::cell::Cell;

    const MS: u64 = 1_000_000;
    const US: u64 = 1_000;

    fn at_1_khz() -> AdaptiveMargin {
        AdaptiveMargin::new(Nanos(MS))
    }

    /// At 1 kHz, after so long on a machine where every sleep ends `lateness_ns` late.
    fn settled(lateness_ns: u64) -> AdaptiveMargin {
        let mut margin = at_1_khz();
        (0..100_000).for_each(|_| margin.learn(lateness_ns));
        margin
    }

    proptest! {
        #[test]
        fn the_margin_stays_in_its_bounds_whatever_the_sleeps_do(
            period_us in 1_u64..1_000_000,
            lateness in prop::collection::vec(prop_oneof![0_u64..50_000, 0_u64..50_000_000, Just(u64::MAX)], 0..2000),
        ) {
            let mut margin = AdaptiveMargin::new(Nanos(period_us * US));
            for late in lateness {
                let before = margin.margin_ns();
                margin.learn(late);
                prop_assert!(margin.margin_ns() * 100 <= (period_us * US * 15).max((period_us * US * 90).min(5_000 * US)));
                prop_assert!(margin.margin_ns() <= 135 * US);
                // Check that it moves towards what it saw, and by one bounded step
                if late > before {
                    prop_assert!(margin.margin_ns() >= before && margin.margin_ns() <= before + 20 * US);
                }
            }
        }

        #[test]
        fn a_rise_is_learnt_within_a_few_late_wakes_and_forgotten_slowly(from_us in 5_u64..40, to_us in 40_u64..110) {
            let mut margin = settled(from_us * US);
            let late_wakes = (1..).find(|_| { margin.learn(to_us * US); margin.margin_ns() >= to_us * US }).unwrap();
            prop_assert!(late_wakes <= 6, "{late_wakes} late wakes");
            // Check that a second of better sleeps takes back no more than 20 us
            let covered = margin.margin_ns();
            (0..1000).for_each(|_| margin.learn(from_us * US));
            prop_assert!(covered - margin.margin_ns() <= 20 * US);
        }

        #[test]
        fn steady_sleeps_are_covered_with_little_to_spare(late_us in 0_u64..90) {
            let margin = settled(late_us * US);
            prop_assert!(margin.margin_ns() >= late_us * US);
            prop_assert!(margin.margin_ns() <= (late_us * US).max(AdaptiveMargin::FLOOR_NS) + 22 * US);
        }
    }

    #[test]
    fn one_stall_of_the_machine_does_not_peg_it() {
        let mut margin = settled(10 * US);
        let calm = margin.margin_ns();
        margin.learn(20 * MS);
        assert!(margin.margin_ns() <= calm + 20 * US);
        // Check that it is forgotten after a second at 1 kHz
        (0..1001).for_each(|_| margin.learn(10 * US));
        assert!(margin.margin_ns() <= calm);
    }

    #[test]
    fn one_sleep_in_a_thousand_ends_later_than_the_estimate() {
        let mut margin = at_1_khz();
        let (mut later, mut state) = (0_u32, 1_u64);
        const SLEEPS: u32 = 1_000_000;
        for k in 0..SLEEPS + 10_000 {
            // Lateness spread evenly over 10 to 90 us, by a linear congruential generator (Knuth's constants).
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let lateness = 10 * US + (state >> 33) % (80 * US);
            // The start is left out: it comes from the ceiling.
            later += u32::from(k >= 10_000 && lateness > margin.estimate_ns);
            margin.learn(lateness);
        }
        let fraction = f64::from(later) / f64::from(SLEEPS);
        assert!((0.000_9..0.001_1).contains(&fraction), "{fraction}");
    }

    #[test]
    fn without_a_real_time_policy_every_wait_sleeps() {
        for wait in [Wait::Auto, Wait::Sleep, Wait::SleepSpin { margin: Nanos(50 * US) }, Wait::Spin] {
            assert_eq!(Waiter::new(wait, false, Nanos(MS)).to_string(), "sleep");
        }
    }

    #[test]
    fn what_was_granted_is_told_with_its_bound() {
        let told = |wait, period| Waiter::new(wait, true, Nanos(period)).to_string();
        assert_eq!(told(Wait::Auto, MS), "sleep, then spin, margin adapts (at most 135 us)");
        // Check that a period of which 15 % are less than a wake-up takes gets that, and no sleep if it is shorter
        assert_eq!(told(Wait::Auto, MS / 2), "sleep, then spin, margin adapts (at most 75 us)");
        assert_eq!(told(Wait::Auto, MS / 5), "sleep, then spin, margin adapts (at most 50 us)");
        assert_eq!(told(Wait::Auto, MS / 20), "sleep, then spin, margin adapts (at most 45 us)");
        assert_eq!(told(Wait::Auto, MS / 50), "spin");
        assert_eq!(told(Wait::SleepSpin { margin: Nanos(50 * US) }, MS), "sleep, then spin 50 us");
        assert_eq!(told(Wait::Spin, MS), "spin");
        assert_eq!(told(Wait::Sleep, MS), "sleep");
    }

    #[test]
    fn no_wait_ends_before_its_time() {
        for wait in [Wait::Auto, Wait::Sleep, Wait::SleepSpin { margin: Nanos(50 * US) }, Wait::Spin] {
            let mut waiter = Waiter::new(wait, true, Nanos(MS));
            for _ in 0..5 {
                let due = os::monotonic() + 300 * US;
                let woke = waiter.until(due, || false);
                assert!(woke.is_some_and(|woke| (due..=os::monotonic()).contains(&woke)), "{wait:?}");
            }
        }
    }

    #[test]
    fn a_wait_of_an_hour_ends_when_it_is_time_to_leave() {
        for wait in [Wait::Auto, Wait::Spin] {
            let looks = Cell::new(0);
            let leave = || looks.replace(looks.get() + 1) == 2;
            // Check that a sleep is cut into slices in which the flag is looked at
            assert_eq!(Waiter::new(wait, true, Nanos(MS)).until(os::monotonic() + 3_600_000 * MS, leave), None);
            assert_eq!(looks.get(), 3);
        }
    }

    #[test]
    fn only_the_sleep_that_ends_before_the_release_teaches_the_margin() {
        let mut waiter = Waiter::new(Wait::Auto, true, Nanos(MS));
        let fresh = waiter;
        // Check that a release already due, which needs no sleep, teaches nothing
        assert!(waiter.until(os::monotonic(), || false).is_some());
        assert_eq!(waiter, fresh);
        // Check that a sleep teaches something: the margin starts at its ceiling, so on any machine it is lower after a
        // sleep in time, and no later than 100 sleeps one is in time
        let learnt = (0..100).any(|_| waiter.until(os::monotonic() + MS / 2, || false).is_some() && waiter != fresh);
        assert!(learnt);
    }
}
