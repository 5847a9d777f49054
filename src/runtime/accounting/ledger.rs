//! Slip accounting: which release runs next, which are skipped, and why. Pure arithmetic on times it is given.
//!
//! For every group `released + skipped = elapsed periods` holds exactly, and every skipped period has a cause.

use crate::accounting::overrun::{Decision, decide};
use crate::accounting::timeline::{Timeline, Wake, WokenBy};
use crate::actor::GroupMode;
use crate::primitives::histogram::Histogram;
use crate::rate_group::{OverrunPolicy, RateGroup};
use crate::records::timing::{RecordedRelease, SlipCause, SlipCounts, TickTiming};
use crate::reports::report::GroupReport;
use crate::time::Nanos;

/// The books of one group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ledger {
    group: u16,
    timeline: Timeline,
    policy: OverrunPolicy,
    period: Nanos,
    deadline: Nanos,
    next: u64,
    /// When the group could run again after its last work, and how long that work took.
    pub(crate) free: Nanos,
    previous_work: Nanos,
    /// Why the current release is late, if it is.
    lateness: SlipCause,
    /// Of the periods skipped before the current release, those that the policy gave up.
    given_up: u8,
    /// Releases in time that are missing until the mode is normal again; 0 if it is.
    recovering: u32,
    pub(crate) released: u64,
    pub(crate) skipped: SlipCounts,
    pub(crate) missed: SlipCounts,
    /// Releases with a degraded result.
    pub(crate) degraded: u64,
    /// Releases in [`GroupMode::Degraded`].
    in_degraded_mode: u64,
    /// How often the watchdog of a device-paced group took over.
    pub(crate) takeovers: u64,
    /// Set when the group has begun to come to rest: then nothing is due any more but that.
    pub(crate) winding_down: bool,
    /// Set while the group is down after a fault: what was due meanwhile is skipped because of it.
    pub(crate) down: bool,
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
            free: Nanos::ZERO,
            previous_work: Nanos::ZERO,
            lateness: SlipCause::LateWake,
            given_up: 0,
            recovering: 0,
            released: 0,
            skipped: SlipCounts::default(),
            missed: SlipCounts::default(),
            degraded: 0,
            in_degraded_mode: 0,
            takeovers: 0,
            winding_down: false,
            down: false,
        }
    }

    /// Releases `periods` more from `now` on, and then no others. What is overdue by then is skipped.
    pub(crate) fn wind_down(&mut self, now: Nanos, periods: u64) {
        self.winding_down = true;
        let first = self.timeline.unbounded().latest_due(self.next, now);
        self.timeline.end_before(first.saturating_add(periods));
        self.policy = OverrunPolicy::Skip;
        self.recovering = 0;
    }

    /// When the next release is due; `None` after the last.
    pub(crate) fn next_due(&self) -> Option<Nanos> {
        self.timeline.release(self.next)
    }

    /// When release `n` is due; of releases that have run, only of the last.
    pub(crate) fn due(&self, n: u64) -> Nanos {
        self.timeline.due(n)
    }

    /// The number of the next release, which is the number of periods dealt with.
    pub(crate) fn elapsed_periods(&self) -> u64 {
        self.next
    }

    /// From when on a device's frame runs the next release or a later one. An earlier one comes in a period that has
    /// had its release.
    pub(crate) fn next_frame_from(&self) -> Nanos {
        self.timeline.frames_from(self.next)
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
            missed_deadlines: self.missed.total(),
            misses: self.missed,
            degraded: self.degraded,
            in_degraded_mode: self.in_degraded_mode,
            watchdog_takeovers: self.takeovers,
            lateness: Histogram::default(),
            execution: Histogram::default(),
        }
    }

    /// How much the actors should do in the release that was decided on.
    pub(crate) fn mode(&self) -> GroupMode {
        if self.recovering > 0 { GroupMode::Degraded } else { GroupMode::Normal }
    }

    /// Decides what to do now that the wait for the next release is over, and books what is skipped.
    pub(crate) fn decide(&mut self, wake: &Wake) -> Decision {
        // What was due while it was down is skipped, whatever the policy: it is not an overrun, and nobody catches it
        // up.
        let policy = if self.down { OverrunPolicy::Skip } else { self.policy };
        self.lateness = self.blame(wake);
        self.given_up = 0;
        let latest = match wake.by {
            WokenBy::Timer => self.timeline.latest_due(self.next, wake.woke),
            WokenBy::Frame => self.timeline.of_frame(self.next, wake.woke),
        };
        let mut decision = decide(policy, self.next, latest);
        match &mut decision {
            Decision::Run { release, skipped } => {
                self.skipped.add(self.lateness, *skipped);
                if policy == OverrunPolicy::Rephase
                    && *skipped > 0
                    && let Some(rephased) = self.timeline.rephase(wake.woke)
                {
                    // Phases that add up to a period take the place of one: no backlog, the shift itself costs it.
                    let given_up = rephased - *release;
                    self.skipped.add(SlipCause::Policy, given_up);
                    self.given_up = u8::try_from(given_up).unwrap_or(u8::MAX);
                    *skipped += given_up;
                    *release = rephased;
                }
                if let OverrunPolicy::Degrade { recover_after } = policy
                    && *skipped > 0
                {
                    self.recovering = recover_after;
                }
                self.next = *release + 1;
            }
            Decision::Stop { skipped } => {
                // The last one is due just now and could run: the policy gives it up.
                self.skipped.add(self.lateness, *skipped - 1);
                self.skipped.add(SlipCause::Policy, 1);
                self.next += *skipped;
            }
        }
        decision
    }

    /// Books that a release is to run as it was recorded.
    pub(crate) fn book(&mut self, recorded: &RecordedRelease) {
        let RecordedRelease { tick, scheduled, slips, given_up, cause, mode } = *recorded;
        let own = u32::from(given_up).min(slips);
        self.lateness = cause;
        self.given_up = given_up;
        self.skipped.add(cause, (slips - own).into());
        self.skipped.add(SlipCause::Policy, own.into());
        self.recovering = (mode == GroupMode::Degraded).into();
        self.timeline.shift_to(tick, scheduled);
        self.next = tick + 1;
    }

    /// Why a release is late, if it is: it was down after a fault, or the group was free and the device had not
    /// delivered, or it was free and asleep, or its own work went on for more than a period, or else the reason that
    /// the release before was late already.
    fn blame(&mut self, wake: &Wake) -> SlipCause {
        if std::mem::take(&mut self.down) {
            return SlipCause::Fault;
        }
        let due = self.timeline.due(self.next);
        // A device without a buffer delivers up to a period after the work that kept its group from listening.
        let stalled = wake.ready > if self.free <= due { due } else { self.free + self.period };
        if stalled {
            SlipCause::StalledPeer
        } else if self.free <= due {
            SlipCause::LateWake
        } else if self.previous_work > self.period {
            SlipCause::LongTick
        } else {
            self.lateness
        }
    }

    /// Books a release that has run and returns its timing; `free` is when the group can run again.
    pub(crate) fn close(
        &mut self,
        release: u64,
        skipped: u64,
        [woke, start, end]: [Nanos; 3],
        free: Nanos,
    ) -> TickTiming {
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
            given_up: self.given_up,
            mode: self.mode(),
        };
        // Without lateness it would have met its deadline unless the work alone is longer than that.
        let blame = if work > self.deadline { SlipCause::LongTick } else { self.lateness };
        if skipped > 0 {
            timing.cause = self.lateness;
        } else if timing.missed() {
            timing.cause = blame;
        }
        self.missed.add(timing.cause, u64::from(timing.missed()));
        self.released += 1;
        self.free = free;
        self.previous_work = free.saturating_sub(woke);
        self.recover(&timing);
        if self.timeline.has_period(self.next) && self.next_due().is_none() {
            // A shifted grid has one release less than the nominal one has periods.
            self.skipped.add(SlipCause::Policy, 1);
            self.next += 1;
        }
        timing
    }

    /// Counts the releases in time after an overrun.
    fn recover(&mut self, timing: &TickTiming) {
        let OverrunPolicy::Degrade { recover_after } = self.policy else { return };
        self.in_degraded_mode += u64::from(timing.mode == GroupMode::Degraded);
        if timing.slips > 0 || timing.missed() {
            // Only an overrun degrades; a missed deadline puts the recovery off.
            self.recovering = if self.recovering > 0 { recover_after } else { 0 };
        } else {
            self.recovering = self.recovering.saturating_sub(1);
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::accounting::overrun::tests::policies;
    use crate::time::Rate;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    proptest! {
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
            let nominal = |n| Nanos(offset) + rate.release(n);
            let (mut now, mut last, mut stopped, mut in_time) = (Nanos::ZERO, None, false, u64::MAX);
            for (late, work) in jitter {
                let Some(due) = ledger.next_due() else { break };
                let woke = if now > due { now } else { due + Nanos(late * period / 1000) };
                // Independent of the books: every release due by now, up to the last one of the run.
                let due_by_now = (0..=80).filter(|&n| nominal(n) <= woke).count() as u64;
                match ledger.decide(&Wake::by_timer(due, woke)) {
                    Decision::Run { release, skipped } => {
                        now = woke + Nanos(work * period / 1000);
                        let timing = ledger.close(release, skipped, [woke, woke, now], now);
                        // Check that releases come in order, never early, and slips have a cause
                        prop_assert!(last.is_none_or(|last| release > last));
                        prop_assert!(timing.scheduled <= woke);
                        prop_assert_eq!(u64::from(timing.slips), skipped);
                        prop_assert_eq!(timing.cause != SlipCause::None, skipped > 0 || timing.missed());
                        if policy == OverrunPolicy::Rephase {
                            // Check that none is before the grid or after the end, and the next a period later
                            prop_assert!(timing.scheduled >= nominal(release) && timing.scheduled <= until);
                            prop_assert!(timing.scheduled <= nominal(release) + Nanos(period));
                            if skipped > 0 && woke <= until {
                                prop_assert_eq!(timing.scheduled, woke);
                                let next = ledger.next_due().map(|due| due.0 - woke.0);
                                prop_assert!(next.is_none_or(|next| next == period || next == period + 1));
                            }
                        } else {
                            prop_assert_eq!(timing.scheduled, nominal(release));
                            prop_assert_eq!(timing.given_up, 0);
                        }
                        if let OverrunPolicy::Degrade { recover_after } = policy {
                            // Check that the mode follows from slips and deadlines alone
                            let overrun = skipped > 0;
                            in_time = if overrun { 0 } else { in_time };
                            prop_assert_eq!(timing.mode == GroupMode::Degraded, in_time < u64::from(recover_after));
                            in_time = if !overrun && !timing.missed() {
                                in_time.saturating_add(1)
                            } else if timing.mode == GroupMode::Degraded { 0 } else { in_time };
                        } else {
                            prop_assert_eq!(timing.mode, GroupMode::Normal);
                        }
                        if matches!(policy, OverrunPolicy::Skip | OverrunPolicy::Degrade { .. }) {
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
                prop_assert!(last == Some(80) || policy == OverrunPolicy::Rephase);
            }
        }

        #[test]
        fn a_device_with_a_clock_of_its_own_loses_what_the_clocks_differ_by_and_no_more(
            per_mille in 980_u64..1020,
            first in 0..MS,
            jitter in prop::collection::vec(0..3 * MS / 10, 1..50),
        ) {
            const FRAMES: u64 = 2000;
            let mut ledger = Ledger::new(0, &RateGroup::hz(1000).device_paced(Nanos(50 * MS)), None);
            let mut left_out = 0;
            for n in 0..FRAMES {
                let at = Nanos(first + n * MS * 1000 / per_mille + jitter[n as usize % jitter.len()]);
                if at >= ledger.next_frame_from() {
                    release(&mut ledger, Wake::by_frame(at), at.0);
                } else {
                    left_out += 1;
                }
            }
            prop_assert_eq!(ledger.released + left_out, FRAMES);
            prop_assert_eq!(ledger.released + ledger.skipped.total(), ledger.elapsed_periods());
            // Check that a slower device makes the group skip, a faster one leave out, and neither does both for long
            let drift = (FRAMES * 1000 / per_mille).abs_diff(FRAMES);
            let (slow, fast) = if per_mille < 1000 { (drift + 2, 0) } else { (2, drift + 2) };
            prop_assert!(ledger.skipped.total() <= slow, "{} skipped", ledger.skipped.total());
            prop_assert!(left_out <= fast, "{left_out} left out");
        }
    }

    fn release(ledger: &mut Ledger, wake: Wake, end: u64) -> TickTiming {
        match ledger.decide(&wake) {
            Decision::Run { release, skipped } => {
                ledger.close(release, skipped, [wake.woke, wake.woke, Nanos(end)], Nanos(end))
            }
            Decision::Stop { .. } => panic!("no policy of this test stops"),
        }
    }

    fn run(ledger: &mut Ledger, woke: u64, end: u64) -> TickTiming {
        let due = ledger.next_due().unwrap();
        release(ledger, Wake::by_timer(due, Nanos(woke)), end)
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
        assert_eq!(ledger.missed.total(), 3);
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
    fn a_shifted_phase_keeps_a_period_of_distance_and_gives_up_what_it_adds_up_to() {
        let mut ledger = Ledger::new(0, &RateGroup::hz(1000).overrun(OverrunPolicy::Rephase), Some(Nanos(12 * MS)));
        run(&mut ledger, 0, 2 * MS + 600_000);
        // Due on the nominal grid at 2 ms, on the shifted one now.
        let shifted = run(&mut ledger, 2 * MS + 600_000, 2 * MS + 700_000);
        assert_eq!((shifted.tick, shifted.slips, shifted.cause), (2, 1, SlipCause::LongTick));
        assert_eq!((shifted.scheduled, shifted.given_up), (Nanos(2 * MS + 600_000), 0));
        assert_eq!(ledger.next_due(), Some(Nanos(3 * MS + 600_000)));
        run(&mut ledger, 3 * MS + 600_000, 5 * MS + 200_000);
        // No release but this one is due on the shifted grid: no overrun.
        let late = run(&mut ledger, 5 * MS + 200_000, 5 * MS + 300_000);
        assert_eq!((late.tick, late.slips, late.scheduled), (4, 0, Nanos(4 * MS + 600_000)));
        // At 7.1 ms releases 5 and 6 are due on the shifted grid, 7 on the nominal one.
        let wrapped = run(&mut ledger, 7 * MS + 100_000, 7 * MS + 200_000);
        assert_eq!((wrapped.tick, wrapped.slips, wrapped.cause), (7, 2, SlipCause::LateWake));
        assert_eq!((wrapped.given_up, wrapped.scheduled), (1, Nanos(7 * MS + 100_000)));
        for n in 8..=11 {
            run(&mut ledger, n * MS + 100_000, n * MS + 200_000);
        }
        // Period 12 begins with the end of the run; its shifted release would come after it.
        assert_eq!((ledger.next_due(), ledger.elapsed_periods(), ledger.released), (None, 13, 9));
        let slips = [SlipCause::LongTick, SlipCause::LateWake, SlipCause::Policy].map(|cause| ledger.skipped.of(cause));
        assert_eq!(slips, [1, 1, 2]);
    }

    #[test]
    fn a_group_degrades_at_an_overrun_and_recovers_after_releases_in_time() {
        let group = RateGroup::hz(1000).overrun(OverrunPolicy::Degrade { recover_after: 2 });
        let mut ledger = Ledger::new(0, &group, None);
        // A missed deadline alone is no overrun.
        let mut ends = vec![(0, 1_500_000), (1_500_000, 1_600_000)];
        // Releases 2 and 3 are lost, 5 is in time, 6 is not, 7 and 8 are.
        ends.extend([(4_100_000, 4_200_000), (5 * MS, 5_100_000), (6 * MS, 7_200_000), (7_200_000, 7_300_000)]);
        ends.extend([(8 * MS, 8_100_000), (9 * MS, 9_100_000)]);
        let timings: Vec<_> = ends.into_iter().map(|(woke, end)| run(&mut ledger, woke, end)).collect();
        let degraded: Vec<_> = timings.iter().filter(|t| t.mode == GroupMode::Degraded).map(|t| t.tick).collect();
        assert_eq!(degraded, [4, 5, 6, 7, 8]);
        assert_eq!((ledger.in_degraded_mode, ledger.mode()), (5, GroupMode::Normal));
    }

    #[test]
    fn periods_without_a_frame_are_blamed_on_the_device() {
        let mut ledger = Ledger::new(0, &RateGroup::hz(1000).device_paced(Nanos(50 * MS)), None);
        let frame = |at: u64| Wake::by_frame(Nanos(at));
        release(&mut ledger, frame(100_000), 300_000);
        // A frame that comes early runs the next release.
        let early = release(&mut ledger, frame(600_000), 800_000);
        assert_eq!((early.tick, early.slips, early.missed()), (1, 0, false));
        assert_eq!(ledger.next_frame_from(), Nanos(MS + MS / 8));
        let stalled = release(&mut ledger, frame(5 * MS + 400_000), 5 * MS + 500_000);
        assert_eq!((stalled.tick, stalled.slips, stalled.cause), (5, 3, SlipCause::StalledPeer));
        // A long tick is none of its faults, even if the frame comes up to a period later.
        release(&mut ledger, frame(6 * MS), 9 * MS + 100_000);
        let after = release(&mut ledger, frame(10 * MS), 10 * MS + 100_000);
        assert_eq!((after.tick, after.slips, after.cause), (10, 3, SlipCause::LongTick));
        // A device silent for longer than that is at fault again.
        release(&mut ledger, frame(11 * MS), 12 * MS + 300_000);
        let silent = release(&mut ledger, frame(20 * MS), 20 * MS + 100_000);
        assert_eq!((silent.tick, silent.slips, silent.cause), (20, 8, SlipCause::StalledPeer));
    }
}
