//! What the groups tell the supervisor, and who is still running and what went wrong first by its books.

use crate::accounting::ledger::Ledger;
use crate::primitives::exchange::ExchangeReader;
use crate::reports::report::{GroupReport, RuntimeFault};
use crate::supervision::restart::Restarter;
use crate::system::grant::GroupGrant;
use crate::system::os::ThreadProbe;
use std::fmt;

/// What group threads tell the supervisor.
#[derive(Debug)]
pub(crate) enum Message {
    /// Something fatal happened; a stop is already requested.
    Fault(RuntimeFault),
    /// An observer failed: it costs what it would have observed and nothing else.
    ObserverFault(RuntimeFault),
    /// The group with this number has ended, its actors are gone.
    Ended(usize, Box<GroupReport>),
    /// The actors of the restartable group with this number failed, said by this one of its threads, and are about to stop:
    /// that may hang.
    Failing(usize, usize, RuntimeFault),
    /// The actors of a restartable group failed and are gone; nobody has been told to stop.
    Failed(Box<Failure>),
    /// They could not be made or started again.
    NotRestarted(Box<Failure>),
    /// They were, and go on.
    Restarted(Box<Restarted>),
}

/// A restartable group after a fault.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub(crate) group: usize,
    /// Which of its threads says so, counting from 0: one that was left behind has nothing to say any more.
    pub(crate) incarnation: usize,
    pub(crate) fault: RuntimeFault,
    /// The group's sums, should it not be started again.
    pub(crate) report: GroupReport,
    /// Its books, should it be.
    pub(crate) books: Ledger,
}

impl Failure {
    /// The same when a restart failed too.
    pub(crate) fn not_answered(self, why: &dyn fmt::Display) -> Self {
        let what = format!("{}; it could not be started again: {why}", self.fault.what);
        Self { fault: RuntimeFault { what, ..self.fault }, ..self }
    }
}

/// A replacement has begun: what the supervisor needs to watch it.
#[derive(Debug)]
pub(crate) struct Restarted {
    pub(crate) group: usize,
    pub(crate) restarter: Restarter,
    pub(crate) books: ExchangeReader<Ledger>,
    pub(crate) failure: Box<Failure>,
    pub(crate) grant: GroupGrant,
    pub(crate) probe: ThreadProbe,
}

/// Collects what the groups report.
#[derive(Debug)]
pub(crate) struct Supervisor {
    reports: Vec<Option<GroupReport>>,
    ended: usize,
    fault: Option<RuntimeFault>,
    observer_fault: Option<RuntimeFault>,
    /// Faults that were answered by a restart.
    pub(crate) restarts: Vec<RuntimeFault>,
}

impl Supervisor {
    pub(crate) fn new(groups: usize) -> Self {
        Self { reports: vec![None; groups], ended: 0, fault: None, observer_fault: None, restarts: Vec::new() }
    }

    pub(crate) fn note(&mut self, message: Message) {
        match message {
            Message::Fault(fault) => {
                // What follows a fault is often its consequence: the first one is the one to report.
                self.fault.get_or_insert(fault);
            }
            Message::ObserverFault(fault) => {
                self.observer_fault.get_or_insert(fault);
            }
            Message::Ended(group, report) => self.end(group, *report),
            Message::Failed(failure) | Message::NotRestarted(failure) => {
                self.fault.get_or_insert(failure.fault);
                self.end(failure.group, failure.report);
            }
            // Nothing has ended.
            Message::Failing(..) | Message::Restarted(_) => {}
        }
    }

    fn end(&mut self, group: usize, report: GroupReport) {
        self.ended += usize::from(self.reports[group].replace(report).is_none());
    }

    /// The first fault, that of an observer only if there is no other.
    pub(crate) fn fault(&self) -> Option<&RuntimeFault> {
        self.stopping_fault().or(self.observer_fault())
    }

    /// The first fault that stopped the run.
    pub(crate) fn stopping_fault(&self) -> Option<&RuntimeFault> {
        self.fault.as_ref()
    }

    /// The first fault of an observer.
    pub(crate) fn observer_fault(&self) -> Option<&RuntimeFault> {
        self.observer_fault.as_ref()
    }

    /// How many groups have ended. Asked after every release of virtual time.
    pub(crate) fn ended(&self) -> usize {
        self.ended
    }

    pub(crate) fn has_ended(&self, group: usize) -> bool {
        self.reports[group].is_some()
    }

    pub(crate) fn all_ended(&self) -> bool {
        self.ended() == self.reports.len()
    }

    /// The reports of the groups that ended, and the [fault](Self::fault).
    pub(crate) fn results(&self) -> (Vec<GroupReport>, Option<RuntimeFault>) {
        (self.reports.iter().flatten().cloned().collect(), self.fault().cloned())
    }
}
