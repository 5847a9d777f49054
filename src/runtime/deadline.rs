//! Slip accounting: which release runs next, which are skipped, and why. Pure arithmetic on times it is given.
//!
//! For every group `released + skipped = elapsed periods` holds exactly, and every skipped period has a cause.

use super::actor::Mode;
use super::rate_group::{OverrunPolicy, RateGroup};
use super::record::{SlipCause, TickTiming};
use super::report::GroupReport;
use crate::time::{Nanos, Rate};

/// When the releases of a group are due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timeline {
    rate: Rate,
    offset: Nanos,
    /// The number of releases; the last is `count - 1`.
    count: u64,
}

impl Timeline {
    /// The releases of `group` that are due at or before `until`.
    pub(crate) fn new(group: &RateGroup, until: Option<Nanos>) -> Self {
        let count = match until {
            None => u64::MAX,
            Some(until) if until < group.offset => 0,
            Some(until) => group.rate.last_release(until.saturating_sub(group.offset)).saturating_add(1),
        };
        Self { rate: group.rate, offset: group.offset, count }
    }

    /// When release `n` is due: integers from the start of the run, no drift.
    pub(crate) fn due(&self, n: u64) -> Nanos {
        self.offset + self.rate.release(n)
    }

    /// The latest release due at `now`, but at least `next`, which the caller has waited for.
    fn latest_due(&self, next: u64, now: Nanos) -> u64 {
        self.rate.last_release(now.saturating_sub(self.offset)).min(self.count - 1).max(next)
    }
}

/// What to do after the wait for release `next`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    /// Run this release; the ones from `next` up to it, `skipped` in number, are given up.
    Run { release: u64, skipped: u64 },
    /// Give up all releases that are due, `skipped` in number, and stop.
    Stop { skipped: u64 },
}

/// Decides what to do when `next` is to run and `latest >= next` is the latest release due.
pub(crate) fn decide(policy: OverrunPolicy, next: u64, latest: u64) -> Decision {
    let backlog = latest - next;
    match policy {
        OverrunPolicy::Skip => Decision::Run { release: latest, skipped: backlog },
        OverrunPolicy::CatchUp { max } => {
            let skipped = backlog.saturating_sub(u64::from(max));
            Decision::Run { release: next + skipped, skipped }
        }
        OverrunPolicy::Stop if backlog == 0 => Decision::Run { release: latest, skipped: 0 },
        OverrunPolicy::Stop => Decision::Stop { skipped: backlog + 1 },
    }
}

/// Skipped periods by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlipCounts([u64; SlipCause::ALL.len()]);

impl SlipCounts {
    /// Periods skipped for this cause.
    pub fn of(&self, cause: SlipCause) -> u64 {
        self.0[cause as usize]
    }

    /// Periods skipped for any cause.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    fn add(&mut self, cause: SlipCause, periods: u64) {
        self.0[cause as usize] += periods;
    }
}

/// The books of one group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ledger {
    group: u16,
    timeline: Timeline,
    policy: OverrunPolicy,
    period: Nanos,
    deadline: Nanos,
    next: u64,
    previous_end: Nanos,
    previous_work: Nanos,
    /// Why the current release is late, if it is.
    lateness: SlipCause,
    pub(crate) released: u64,
    pub(crate) skipped: SlipCounts,
    pub(crate) missed: u64,
    /// Releases with a degraded result.
    pub(crate) degraded: u64,
    /// Set while the group is down after a fault.
    down: bool,
}

impl Ledger {
    pub(crate) fn new(group: u16, spec: &RateGroup, until: Option<Nanos>) -> Self {
        Self {
            group,
            timeline: Timeline::new(spec, until),
            policy: spec.overrun,
            period: spec.rate.period(),
            deadline: spec.relative_deadline(),
            next: 0,
            previous_end: Nanos::ZERO,
            previous_work: Nanos::ZERO,
            lateness: SlipCause::LateWake,
            released: 0,
            skipped: SlipCounts::default(),
            missed: 0,
            degraded: 0,
            down: false,
        }
    }

    /// Goes on with the books of a group that failed: what was due since is skipped because of the fault.
    pub(crate) fn resume(&mut self) {
        self.down = true;
    }

    /// Releases `periods` more, however late they are, and then no others.
    pub(crate) fn end_after(&mut self, periods: u64) {
        self.timeline.count = self.next.saturating_add(periods);
        self.policy = OverrunPolicy::Skip;
    }

    /// When the next release is due; `None` after the last.
    pub(crate) fn next_due(&self) -> Option<Nanos> {
        (self.next < self.timeline.count).then(|| self.timeline.due(self.next))
    }

    /// When release `n` is due.
    pub(crate) fn due(&self, n: u64) -> Nanos {
        self.timeline.due(n)
    }

    /// The number of the next release, which is the number of periods dealt with.
    pub(crate) fn elapsed_periods(&self) -> u64 {
        self.next
    }

    /// The sums.
    pub(crate) fn report(&self, spec: &RateGroup) -> GroupReport {
        GroupReport {
            name: spec.name.clone(),
            rate: spec.rate,
            released: self.released,
            skipped: self.skipped.total(),
            slips: self.skipped,
            elapsed_periods: self.elapsed_periods(),
            missed_deadlines: self.missed,
            degraded: self.degraded,
        }
    }

    /// Decides what to do now that the wait for the next release is over, and books what is skipped.
    pub(crate) fn decide(&mut self, woke: Nanos) -> Decision {
        // Late because it was asleep, because its own work went on for more than a period, or else for the reason that
        // the release before was late already.
        if std::mem::take(&mut self.down) {
            self.lateness = SlipCause::Fault;
        } else if self.previous_end <= self.timeline.due(self.next) {
            self.lateness = SlipCause::LateWake;
        } else if self.previous_work > self.period {
            self.lateness = SlipCause::LongTick;
        }
        let decision = decide(self.policy, self.next, self.timeline.latest_due(self.next, woke));
        match decision {
            Decision::Run { release, skipped } => {
                self.skipped.add(self.lateness, skipped);
                self.next = release + 1;
            }
            Decision::Stop { skipped } => {
                // The last one is due just now and could run: the policy gives it up.
                self.skipped.add(self.lateness, skipped - 1);
                self.skipped.add(SlipCause::Policy, 1);
                self.next += skipped;
            }
        }
        decision
    }

    /// Books that release `release` is to run after `skipped` periods, as it was recorded.
    pub(crate) fn book(&mut self, release: u64, skipped: u64, cause: SlipCause) {
        self.lateness = cause;
        self.skipped.add(cause, skipped);
        self.next = release + 1;
    }

    /// Books a release that has run and returns its timing.
    pub(crate) fn close(&mut self, release: u64, skipped: u64, [woke, start, end]: [Nanos; 3]) -> TickTiming {
        let scheduled = self.timeline.due(release);
        let work = end.saturating_sub(woke);
        let mut timing = TickTiming {
            group: self.group,
            tick: release,
            scheduled,
            woke,
            start,
            end,
            deadline: scheduled + self.deadline,
            slips: u32::try_from(skipped).unwrap_or(u32::MAX),
            cause: SlipCause::None,
            mode: Mode::default(),
        };
        // Without lateness it would have met its deadline unless the work alone is longer than that.
        let blame = if work > self.deadline { SlipCause::LongTick } else { self.lateness };
        if skipped > 0 {
            timing.cause = self.lateness;
        } else if timing.missed() {
            timing.cause = blame;
        }
        self.missed += u64::from(timing.missed());
        self.released += 1;
        self.previous_end = end;
        self.previous_work = work;
        timing
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    fn policies() -> impl Strategy<Value = OverrunPolicy> {
        prop_oneof![
            Just(OverrunPolicy::Skip),
            (1_u32..5).prop_map(|max| OverrunPolicy::CatchUp { max }),
            Just(OverrunPolicy::Stop)
        ]
    }

    proptest! {
        #[test]
        fn a_decision_accounts_for_every_period(policy in policies(), next in 0_u64..1 << 60, backlog in 0_u64..1000) {
            let latest = next + backlog;
            match decide(policy, next, latest) {
                Decision::Run { release, skipped } => {
                    // Check that skipped and run are exactly the periods next..=release, and nothing in the future
                    prop_assert_eq!(next + skipped, release);
                    prop_assert!(release <= latest);
                    let waiting = latest - release;
                    match policy {
                        OverrunPolicy::Skip => prop_assert_eq!(waiting, 0),
                        OverrunPolicy::CatchUp { max } => prop_assert!(
                            waiting <= u64::from(max) && (skipped == 0 || waiting == u64::from(max))
                        ),
                        OverrunPolicy::Stop => prop_assert_eq!(backlog, 0),
                    }
                }
                Decision::Stop { skipped } => {
                    prop_assert_eq!(policy, OverrunPolicy::Stop);
                    prop_assert!(backlog > 0);
                    prop_assert_eq!(skipped, backlog + 1);
                }
            }
        }

        #[test]
        fn released_plus_skipped_is_elapsed_under_any_jitter(
            policy in policies(),
            rate in prop_oneof![Just(Rate::hz(1000)), Just(Rate::hz(30)), Just(Rate::new(2997, 100))],
            offset in 0_u64..5 * MS,
            // Lateness of the wake-up and length of the work, in thousandths of a period, mostly short.
            jitter in prop::collection::vec((prop_oneof![4 => 0_u64..200, 1 => 0_u64..4000], prop_oneof![4 => 0_u64..900, 1 => 0_u64..5000]), 1..100),
        ) {
            let until = Nanos(offset) + rate.release(80);
            let group = RateGroup::new(rate).offset(Nanos(offset)).overrun(policy);
            let mut ledger = Ledger::new(0, &group, Some(until));
            let period = rate.period().0;
            let (mut now, mut last, mut stopped) = (Nanos::ZERO, None, false);
            for (late, work) in jitter {
                let Some(due) = ledger.next_due() else { break };
                let woke = if now > due { now } else { due + Nanos(late * period / 1000) };
                // Independent of the books: every release due by now, up to the last one of the run.
                let due_by_now = (0..=80).filter(|&n| Nanos(offset) + rate.release(n) <= woke).count() as u64;
                match ledger.decide(woke) {
                    Decision::Run { release, skipped } => {
                        now = woke + Nanos(work * period / 1000);
                        let timing = ledger.close(release, skipped, [woke, woke, now]);
                        // Check that releases come in order, on the grid, never early, and slips have a cause
                        prop_assert!(last.is_none_or(|last| release > last));
                        prop_assert_eq!(timing.scheduled, Nanos(offset) + rate.release(release));
                        prop_assert!(timing.scheduled <= woke);
                        prop_assert_eq!(u64::from(timing.slips), skipped);
                        prop_assert_eq!(timing.cause != SlipCause::None, skipped > 0 || timing.missed());
                        if policy == OverrunPolicy::Skip {
                            prop_assert_eq!(ledger.elapsed_periods(), due_by_now);
                        }
                        last = Some(release);
                    }
                    Decision::Stop { .. } => {
                        prop_assert_eq!(ledger.elapsed_periods(), due_by_now);
                        stopped = true;
                    }
                }
                prop_assert_eq!(ledger.released + ledger.skipped.total(), ledger.elapsed_periods());
                if stopped { break; }
            }
            if !stopped && ledger.next_due().is_none() {
                prop_assert_eq!(ledger.elapsed_periods(), 81);
                prop_assert_eq!(last, Some(80));
            }
        }
    }

    fn run(ledger: &mut Ledger, woke: u64, end: u64) -> TickTiming {
        match ledger.decide(Nanos(woke)) {
            Decision::Run { release, skipped } => ledger.close(release, skipped, [woke, woke, end].map(Nanos)),
            Decision::Stop { .. } => panic!("no policy of this test stops"),
        }
    }

    #[test]
    fn a_late_wake_is_told_from_a_long_tick() {
        let mut ledger = Ledger::new(0, &RateGroup::hz(1000), None);
        let on_time = run(&mut ledger, 0, MS / 2);
        assert_eq!((on_time.slips, on_time.cause), (0, SlipCause::None));
        // Asleep until 3.2 ms: releases 1 and 2 are lost to a late wake.
        let woke_late = run(&mut ledger, 3 * MS + MS / 5, 3 * MS + MS / 2);
        assert_eq!((woke_late.tick, woke_late.slips, woke_late.cause), (3, 2, SlipCause::LateWake));
        // Release 4 works for 2.6 ms: it misses its deadline by itself and costs release 5.
        let long = run(&mut ledger, 4 * MS, 6 * MS + 3 * MS / 5);
        assert_eq!((long.tick, long.slips, long.cause), (4, 0, SlipCause::LongTick));
        let after = run(&mut ledger, 6 * MS + 3 * MS / 5, 6 * MS + 4 * MS / 5);
        assert_eq!((after.tick, after.slips, after.cause), (6, 1, SlipCause::LongTick));
        // Release 7 wakes 0.8 ms late and has only 0.2 ms left.
        let squeezed = run(&mut ledger, 7 * MS + 4 * MS / 5, 8 * MS + MS / 10);
        assert_eq!((squeezed.slips, squeezed.cause), (0, SlipCause::LateWake));
        // Release 8 is late only because release 7 was: the cause is carried on.
        let carried = run(&mut ledger, 8 * MS + MS / 10, 9 * MS + MS / 20);
        assert_eq!((carried.slips, carried.cause), (0, SlipCause::LateWake));
        assert_eq!(ledger.skipped.of(SlipCause::LateWake), 2);
        assert_eq!(ledger.skipped.of(SlipCause::LongTick), 1);
        assert_eq!(ledger.missed, 3);
    }

    #[test]
    fn catching_up_runs_late_releases_back_to_back() {
        let group = RateGroup::hz(1000).overrun(OverrunPolicy::CatchUp { max: 2 });
        let mut ledger = Ledger::new(0, &group, None);
        run(&mut ledger, 0, 5 * MS + MS / 2);
        // Releases 1 to 5 are due, two may wait behind the one that runs.
        let timings: Vec<_> = (0..3).map(|k| run(&mut ledger, 5 * MS + MS / 2 + k, 5 * MS + MS / 2 + k + 1)).collect();
        assert_eq!(timings.iter().map(|t| (t.tick, t.slips)).collect::<Vec<_>>(), [(3, 2), (4, 0), (5, 0)]);
        assert!(timings.iter().all(|t| t.cause == SlipCause::LongTick || !t.missed()));
        assert_eq!(ledger.released + ledger.skipped.total(), 6);
    }

    #[test]
    fn nothing_is_released_when_the_offset_is_past_the_end() {
        let ledger = Ledger::new(0, &RateGroup::hz(1000).offset(Nanos(5 * MS)), Some(Nanos(4 * MS)));
        assert_eq!(ledger.next_due(), None);
    }
}
