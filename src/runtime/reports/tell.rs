//! What a run tells the program's own subscriber as it happens: misses, slips, restarts and faults, as events of
//! `tracing`. They are made of what the groups show and report anyway: on threads by a thread of their own, in virtual
//! time by the thread that lets the run go on.

use crate::records::timing::{SlipCause, SlipCounts};
use crate::reports::live::LiveReader;
use crate::reports::report::RuntimeFault;
use crate::supervision::supervisor::Supervisor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};
use tracing::dispatcher::{Dispatch, get_default, with_default};
use tracing::{Level, enabled, error, warn};

/// Between two events of one group and cause at least: what happened meanwhile is in its count.
const EVERY: Duration = Duration::from_millis(100);

/// Collects what is new since it collected last. Telling is left to [`News::tell`]: a subscriber may block, panic, or ask
/// the run, so no lock of the run is held then.
#[derive(Debug)]
pub(crate) struct Teller {
    /// The subscriber of the thread that started the run; also where another thread tells.
    to: Dispatch,
    heard: bool,
    groups: Vec<Told>,
    restarts: usize,
    fault: bool,
    observer_fault: bool,
    last: Option<Instant>,
}

#[derive(Debug)]
struct Told {
    shown: LiveReader,
    slips: SlipCounts,
    misses: SlipCounts,
}

/// What is to be told, in order.
#[must_use]
pub(crate) struct News {
    to: Dispatch,
    events: Vec<Event>,
}

enum Event {
    Slip(Lost),
    Miss(Lost),
    Restart(RuntimeFault),
    /// With what stops because of it.
    Fault(RuntimeFault, &'static str),
}

/// Periods or deadlines that a group lost by one cause.
struct Lost {
    group: String,
    cause: &'static str,
    count: u64,
    total: u64,
}

impl Teller {
    pub(crate) fn new(groups: &[LiveReader], warnings: &[String]) -> Self {
        let told =
            |shown: &LiveReader| Told { shown: shown.clone(), slips: Default::default(), misses: Default::default() };
        let (to, groups) = (get_default(Dispatch::clone), groups.iter().map(told).collect());
        for warning in warnings {
            warn!(target: "palpate_runtime::graph", "{warning}");
        }
        let heard = with_default(&to, || {
            // Of every kind of event: a subscriber may want one of them only.
            enabled!(target: "palpate_runtime::slip", Level::WARN)
                || enabled!(target: "palpate_runtime::miss", Level::WARN)
                || enabled!(target: "palpate_runtime::restart", Level::WARN)
                || enabled!(target: "palpate_runtime::fault", Level::ERROR)
        });
        Self { to, heard, groups, restarts: 0, fault: false, observer_fault: false, last: None }
    }

    /// True if somebody listens.
    pub(crate) fn is_heard(&self) -> bool {
        self.heard
    }

    /// Faults and restarts at once, slips and misses now and then; all that is left at the `end`.
    pub(crate) fn news(&mut self, supervisor: &Supervisor, end: bool) -> News {
        let mut events = Vec::new();
        if end || self.last.is_none_or(|last| last.elapsed() > EVERY) {
            self.last = Some(Instant::now());
            self.groups.iter_mut().for_each(|group| group.news(&mut events));
        }
        events.extend(supervisor.restarts[self.restarts..].iter().cloned().map(Event::Restart));
        self.restarts = supervisor.restarts.len();
        if let Some(fault) = supervisor.observer_fault().filter(|_| !self.observer_fault) {
            self.observer_fault = true;
            events.push(Event::Fault(fault.clone(), "the observer stops"));
        }
        if let Some(fault) = supervisor.stopping_fault().filter(|_| !self.fault) {
            self.fault = true;
            events.push(Event::Fault(fault.clone(), "the run stops"));
        }
        News { to: self.to.clone(), events }
    }
}

impl Told {
    fn news(&mut self, events: &mut Vec<Event>) {
        let (slips, misses) = self.shown.counts();
        let lost = |(cause, count, total)| Lost { group: self.shown.name().to_owned(), cause, count, total };
        events.extend(new(&slips, &self.slips).map(lost).map(Event::Slip));
        events.extend(new(&misses, &self.misses).map(lost).map(Event::Miss));
        (self.slips, self.misses) = (slips, misses);
    }
}

impl News {
    /// Calls the subscriber, without any lock. A subscriber that panics loses that event and harms nobody.
    pub(crate) fn tell(self) {
        for event in &self.events {
            let _ = catch_unwind(AssertUnwindSafe(|| with_default(&self.to, || event.tell())));
        }
    }
}

impl Event {
    fn tell(&self) {
        match self {
            Self::Slip(Lost { group, cause, count, total }) => {
                warn!(target: "palpate_runtime::slip", group, cause, count, total, "periods skipped");
            }
            Self::Miss(Lost { group, cause, count, total }) => {
                warn!(target: "palpate_runtime::miss", group, cause, count, total, "deadlines missed");
            }
            Self::Restart(RuntimeFault { group, actor, at, what, .. }) => {
                warn!(target: "palpate_runtime::restart", group, actor, at_s = at.as_secs_f64(), cause = what, "started again");
            }
            Self::Fault(RuntimeFault { group, actor, at, what, .. }, stops) => {
                error!(target: "palpate_runtime::fault", group, actor, at_s = at.as_secs_f64(), cause = what, "{stops}");
            }
        }
    }
}

/// For each cause that has more now: its name, how many more, how many in all.
fn new(now: &SlipCounts, before: &SlipCounts) -> impl Iterator<Item = (&'static str, u64, u64)> {
    let of = |cause: SlipCause| (cause.name(), now.of(cause).saturating_sub(before.of(cause)), now.of(cause));
    SlipCause::ALL.map(of).into_iter().filter(|(_, count, _)| *count > 0)
}
