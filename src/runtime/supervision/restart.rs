//! Restarting a group whose actors failed, in place of stopping the whole run.

use crate::accounting::ledger::Ledger;
use crate::actor::Actor;
use crate::error::{ActorError, GraphError, GraphErrorKind};
use crate::executor::Execution;
use crate::group::group_run::GroupRun;
use crate::group::panic_hook::{guarded, place as panicked_at};
use crate::ports::restartable::RecorderPort;
use crate::primitives::exchange::{ExchangeReader, exchange};
use crate::rate_group::RateGroup;
use crate::records::record::{Event, EventCode};
use crate::records::recorder::Recorder;
use crate::reports::live::LiveReader;
use crate::reports::report::RuntimeFault;
use crate::time::Nanos;

/// Makes the actors of a group anew, with fresh halves of their ports.
pub(crate) type Factory = Box<dyn FnMut() -> Result<Vec<Box<dyn Actor>>, ActorError> + Send>;

/// The restart policy of a group: when and how often it is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Restart {
    /// The number of restarts in one run; the fault after the last of them stops the run.
    pub at_most: u32,
    /// The time after which a release counts as hung, on threads: one that is overdue and has computed for this long, or
    /// has waited this long for something else than a processor, counts as one that never returns. Its thread is left
    /// behind with its ports, and a new one is started. One that gets no processor is late and not hung. Virtual time
    /// cannot see either.
    pub hung_after: Nanos,
}

impl Default for Restart {
    /// Three restarts; hung after two seconds.
    fn default() -> Self {
        Self { at_most: 3, hung_after: Nanos(2_000_000_000) }
    }
}

/// What it takes to start a group again.
pub(crate) struct Restarter {
    pub(crate) policy: Restart,
    pub(crate) factory: Factory,
    pub(crate) execution: Execution,
    pub(crate) index: u16,
    pub(crate) spec: RateGroup,
    pub(crate) until: Option<Nanos>,
    pub(crate) records: Option<RecorderPort>,
    /// Events of the supervisor about this group.
    pub(crate) events: Option<Recorder>,
    /// What the group shows of itself, once it was made.
    pub(crate) shown: Option<LiveReader>,
    /// Restarts so far.
    pub(crate) restarts: u32,
}

impl Restarter {
    /// The group as it is when the run starts.
    pub(crate) fn first(&mut self) -> Result<(GroupRun, ExchangeReader<Ledger>), GraphError> {
        let ledger = Ledger::new(self.index, &self.spec, self.until);
        self.make(ledger)
    }

    pub(crate) fn may_restart(&self) -> bool {
        self.restarts < self.policy.at_most
    }

    /// Makes the group again after `fault`, with the books of the one before, and starts its actors at `now`.
    ///
    /// # Errors
    /// What the factory or a start says; the group then stays down.
    pub(crate) fn again(
        &mut self,
        fault: &RuntimeFault,
        mut ledger: Ledger,
        now: Nanos,
    ) -> Result<(GroupRun, ExchangeReader<Ledger>), GraphError> {
        ledger.down = true;
        let (mut group, books) = self.make(ledger).map_err(|error| error.at(format!("restart after {fault}")))?;
        group.start_at(now).inspect_err(|_| group.undo_start())?;
        self.restarts += 1;
        self.event(now, Event::RESTARTED, self.restarts.into());
        Ok((group, books))
    }

    /// Notes that a thread was left behind in the release due at `at`.
    pub(crate) fn abandoned(&mut self, at: Nanos) {
        self.event(at, Event::ABANDONED, self.policy.hung_after.0);
    }

    /// Notes that the release due at `at` gets too little of a processor.
    pub(crate) fn starved(&mut self, at: Nanos) {
        self.event(at, Event::STARVED, self.policy.hung_after.0);
    }

    fn make(&mut self, ledger: Ledger) -> Result<(GroupRun, ExchangeReader<Ledger>), GraphError> {
        // Unwind safe: a factory that panicked is not asked again in this restart, and says itself what it can do
        // after.
        let made = guarded(&mut self.factory);
        let place = || format!("rate group `{}`, factory", self.spec.name);
        let panicked = |text: String| {
            GraphError::new(GraphErrorKind::Actor, format!("panicked{}: {text}", panicked_at())).at(place())
        };
        let actors = made.map_err(panicked)?.map_err(GraphError::from_actor)?;
        let recorder = self.records.as_ref().map(RecorderPort::recorder);
        let (writer, reader) = exchange(|| ledger);
        let mut group = GroupRun::new(self.execution, self.index, self.spec.clone(), actors, recorder, ledger);
        group.books = Some(writer);
        match &self.shown {
            Some(shown) => group.show_on(shown.clone()),
            None => self.shown = Some(group.shown.clone()),
        }
        Ok((group, reader))
    }

    fn event(&mut self, stamp: Nanos, code: EventCode, detail: u64) {
        if let Some(events) = &mut self.events {
            events.push(Event { stamp, group: self.index, code, detail });
        }
    }
}

impl_debug!(Restarter, "policy": |own| own.policy);
