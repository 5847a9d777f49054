//! Injected disturbances: virtual time makes a group late in a known way, so that its books can be checked.

use crate::accounting::timeline::{Wake, WokenBy};
use crate::group::group_run::GroupRun;
use crate::time::Nanos;

/// An injected disturbance of one release in virtual time; nothing goes wrong by default. See
/// [`RuntimeBuilder::disturb`](crate::RuntimeBuilder::disturb).
///
/// A group wakes when its release is due, or when its own work before is done if that is later, and `late_wake` after
/// that. It then works for `work`. The end of a release, and the time from which others see what it published, is the
/// later of this and the group's declared [latency](crate::RateGroup::latency), which by itself occupies nobody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Disturbance {
    /// The time for which the group sleeps on after it should have woken.
    pub late_wake: Nanos,
    /// The time for which the release keeps the group busy.
    pub work: Nanos,
    /// The delay, counted from the due time, with which the device of a [device-paced](crate::Release::DevicePaced)
    /// group delivers; without a meaning in others.
    pub stall: Nanos,
}

/// Says what goes wrong with the release of this number.
type Source = Box<dyn FnMut(u64) -> Disturbance + Send>;

/// What disturbs one group.
pub(crate) struct Disturb(Source);

impl Disturb {
    pub(crate) fn new(source: impl FnMut(u64) -> Disturbance + Send + 'static) -> Self {
        Self(Box::new(source))
    }
}

impl_debug!(Disturb);

/// Plans when a group of virtual time wakes next. Without a disturbance that is when its release is due.
#[derive(Debug)]
pub(crate) struct VirtualPace {
    disturb: Option<Disturb>,
    /// `Some` for a device-paced group.
    watchdog: Option<Nanos>,
    /// The watchdog has taken over.
    driving: bool,
    /// The device delivers nothing before this.
    silent_until: Nanos,
    next: Option<Planned>,
}

/// The next wake-up of a group, and whether its watchdog changes hands with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planned {
    pub(crate) wake: Wake,
    pub(crate) took_over: Option<bool>,
}

impl VirtualPace {
    /// The pace of `group`, with its first wake-up planned.
    pub(crate) fn new(group: &GroupRun, disturb: Option<Disturb>) -> Self {
        let mut pace =
            Self { disturb, watchdog: group.spec.watchdog(), driving: false, silent_until: Nanos::ZERO, next: None };
        pace.plan(group);
        pace
    }

    /// When the group wakes next; `None` after its last release.
    pub(crate) fn next(&self) -> Option<Nanos> {
        self.next.map(|planned| planned.wake.woke)
    }

    /// The wake-up itself.
    pub(crate) fn take(&mut self) -> Option<Planned> {
        self.next.take()
    }

    /// Plans the wake-up for the group's next release, unless that has been done.
    pub(crate) fn plan(&mut self, group: &GroupRun) {
        if self.next.is_none() {
            self.next = group.ledger.next_due().map(|due| self.planned(group, due));
        }
    }

    /// The group begins to wind down at `now`: the clock releases it from here on, and if it waits for its device, it
    /// does not wait any longer.
    pub(crate) fn wind_down(&mut self, group: &GroupRun, now: Nanos) {
        if self.watchdog.take().is_some()
            && let (Some(planned), Some(due)) = (&mut self.next, group.ledger.next_due())
            && planned.wake.ready > due.max(now)
        {
            let ready = due.max(now);
            let work = planned.wake.free.unwrap_or(planned.wake.woke).saturating_sub(planned.wake.woke);
            let woke = ready.max(group.ledger.free);
            *planned =
                Planned { wake: Wake { woke, by: WokenBy::Timer, ready, free: Some(woke + work) }, took_over: None };
        }
        self.plan(group);
    }

    fn planned(&mut self, group: &GroupRun, due: Nanos) -> Planned {
        let release = group.ledger.elapsed_periods();
        let disturbance = self.disturb.as_mut().map_or(Disturbance::default(), |disturb| (disturb.0)(release));
        let (by, ready, took_over) = self.ready(due, disturbance.stall);
        let woke = ready.max(group.ledger.free) + disturbance.late_wake;
        Planned { wake: Wake { woke, by, ready, free: Some(woke + disturbance.work) }, took_over }
    }

    /// What ends the wait for a release due at `due`, when it does, and whether that changes the watchdog's part.
    fn ready(&mut self, due: Nanos, stall: Nanos) -> (WokenBy, Nanos, Option<bool>) {
        let Some(watchdog) = self.watchdog else { return (WokenBy::Timer, due, None) };
        self.silent_until = self.silent_until.max(due + stall);
        let patience = if self.driving { due } else { due + watchdog };
        let delivered = self.silent_until <= patience;
        let took_over = (delivered == self.driving).then_some(!delivered);
        self.driving = !delivered;
        if delivered { (WokenBy::Frame, self.silent_until, took_over) } else { (WokenBy::Timer, patience, took_over) }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::accounting::ledger::Ledger;
    use crate::{Execution, RateGroup};

    const MS: u64 = 1_000_000;

    #[test]
    fn the_watchdog_takes_over_while_the_device_is_silent() {
        let spec = RateGroup::hz(1000).device_paced(Nanos(3 * MS));
        let ledger = Ledger::new(0, &spec, None);
        let group = GroupRun::new(Execution::Virtual, 0, spec, Vec::new(), None, ledger);
        let mut pace = VirtualPace::new(&group, None);
        let mut ready = |due: u64, stall: u64| {
            let (by, ready, took_over) = pace.ready(Nanos(due * MS), Nanos(stall * MS));
            (by, ready.0 / MS, took_over)
        };
        assert_eq!(ready(1, 0), (WokenBy::Frame, 1, None));
        // As long as the watchdog waits, a late frame is a frame
        assert_eq!(ready(2, 3), (WokenBy::Frame, 5, None));
        assert_eq!(ready(6, 9), (WokenBy::Timer, 9, Some(true)));
        assert_eq!(ready(10, 0), (WokenBy::Timer, 10, None));
        assert_eq!(ready(14, 0), (WokenBy::Timer, 14, None));
        assert_eq!(ready(15, 0), (WokenBy::Frame, 15, Some(false)));
        assert_eq!(ready(16, 0), (WokenBy::Frame, 16, None));
    }
}
