//! What a run tells the program's own subscriber as it happens: misses, slips, restarts and faults, as events of
//! `tracing`. Only the supervising thread makes them, from what the groups show and report anyway.

use crate::records::timing::{SlipCause, SlipCounts};
use crate::reports::live::LiveReader;
use crate::reports::report::RuntimeFault;
use crate::supervision::supervisor::Supervisor;
use std::time::{Duration, Instant};
use tracing::dispatcher::{Dispatch, get_default, with_default};
use tracing::{error, warn};

/// Between two events of one group and cause at least: what happened meanwhile is in its count.
const EVERY: Duration = Duration::from_millis(100);

/// Tells what is new since it told last.
#[derive(Debug)]
pub(crate) struct Teller {
    /// The subscriber of the thread that started the run; also where another thread supervises it.
    to: Dispatch,
    groups: Vec<Told>,
    restarts: usize,
    fault: bool,
    last: Option<Instant>,
}

#[derive(Debug)]
struct Told {
    shown: LiveReader,
    slips: SlipCounts,
    misses: SlipCounts,
}

impl Teller {
    pub(crate) fn new(groups: &[LiveReader], warnings: &[String]) -> Self {
        let told =
            |shown: &LiveReader| Told { shown: shown.clone(), slips: Default::default(), misses: Default::default() };
        let (to, groups) = (get_default(Dispatch::clone), groups.iter().map(told).collect());
        for warning in warnings {
            warn!(target: "palpate_runtime::graph", "{warning}");
        }
        Self { to, groups, restarts: 0, fault: false, last: None }
    }

    /// True if somebody listens.
    pub(crate) fn is_heard(&self) -> bool {
        with_default(&self.to, || tracing::enabled!(target: "palpate_runtime::slip", tracing::Level::WARN))
    }

    /// Tells of faults and restarts at once, of slips and misses now and then; of all that is left at the `end`.
    pub(crate) fn tell(&mut self, supervisor: &Supervisor, end: bool) {
        let Self { to, groups, restarts, fault, last } = self;
        with_default(to, || {
            if end || last.is_none_or(|last| last.elapsed() > EVERY) {
                *last = Some(Instant::now());
                groups.iter_mut().for_each(Told::tell);
            }
            for fault in &supervisor.restarts[*restarts..] {
                let RuntimeFault { group, actor, at, what, .. } = fault;
                warn!(target: "palpate_runtime::restart", group, actor, at_s = at.as_secs_f64(), cause = what, "started again");
            }
            *restarts = supervisor.restarts.len();
            if let Some(RuntimeFault { group, actor, at, what, .. }) = supervisor.fault().filter(|_| !*fault) {
                *fault = true;
                error!(target: "palpate_runtime::fault", group, actor, at_s = at.as_secs_f64(), cause = what, "the run stops");
            }
        });
    }
}

impl Told {
    fn tell(&mut self) {
        let (slips, misses) = self.shown.counts();
        let group = self.shown.name();
        for (cause, count, total) in new(&slips, &self.slips) {
            warn!(target: "palpate_runtime::slip", group, cause, count, total, "periods skipped");
        }
        for (cause, count, total) in new(&misses, &self.misses) {
            warn!(target: "palpate_runtime::miss", group, cause, count, total, "deadlines missed");
        }
        (self.slips, self.misses) = (slips, misses);
    }
}

/// For each cause that has more now: its name, how many more, how many in all.
fn new(now: &SlipCounts, before: &SlipCounts) -> impl Iterator<Item = (&'static str, u64, u64)> {
    let of = |cause: SlipCause| (cause.name(), now.of(cause).saturating_sub(before.of(cause)), now.of(cause));
    SlipCause::ALL.map(of).into_iter().filter(|(_, count, _)| *count > 0)
}
