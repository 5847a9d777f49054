//! The virtual executor: one thread, releases in the order (time, group), as fast as the machine allows.
//!
//! A release begins when it is scheduled and ends after the declared latency of its group; nothing is ever late, and two
//! runs of the same graph are bit-identical.

use super::panic_hook;
use super::release::GroupRun;
use super::report::RuntimeFault;
use super::restart::Restarter;
use super::supervisor::{Control, Message, Supervisor};
use crate::time::Nanos;
use std::sync::Arc;

/// A virtual run, standing still between two calls of [`advance`](Self::advance).
pub(crate) struct VirtualRun {
    /// `None` for groups that have ended.
    groups: Vec<Option<GroupRun>>,
    restarters: Vec<Option<Restarter>>,
    now: Nanos,
    /// Set once every group was told to stop.
    stopping: bool,
    control: Arc<Control>,
    pub(crate) supervisor: Supervisor,
}

impl VirtualRun {
    pub(crate) fn new(groups: Vec<GroupRun>, restarters: Vec<Option<Restarter>>, control: Arc<Control>) -> Self {
        panic_hook::install();
        let supervisor = Supervisor::new(groups.len());
        let groups = groups.into_iter().map(Some).collect();
        let mut run = Self { groups, restarters, now: Nanos::ZERO, stopping: false, control, supervisor };
        run.end_what_is_over();
        run
    }

    pub(crate) fn now(&self) -> Nanos {
        self.now
    }

    /// Executes `span` of virtual time, or up to the end of the run.
    pub(crate) fn advance(&mut self, span: Nanos) {
        let horizon = self.now + span;
        while !self.supervisor.all_ended() {
            if self.control.stop_requested() && !self.stopping {
                self.begin_stop();
                continue;
            }
            let Some((due, index)) = self.next() else { return self.end_all() };
            if due > horizon {
                self.now = horizon;
                return;
            }
            self.now = due;
            if let Some(group) = &mut self.groups[index] {
                let latency = group.spec.latency;
                if let Err(fault) = group.release(due, |scheduled| scheduled, |scheduled| scheduled + latency) {
                    self.answer(index, fault);
                }
            }
            self.end_what_is_over();
        }
    }

    /// Ends the run in order: groups that wind down do so, in virtual time.
    pub(crate) fn end_all(&mut self) {
        self.control.request_stop();
        if !self.stopping {
            self.advance(Nanos(u64::MAX));
        }
        self.indices(false).into_iter().for_each(|index| self.end(index));
        self.end_observers();
    }

    /// Groups that wind down go on, the others end.
    fn begin_stop(&mut self) {
        self.stopping = true;
        for index in self.indices(false) {
            if !self.groups[index].as_mut().is_some_and(GroupRun::begin_wind_down) {
                self.end(index);
            }
        }
        self.end_what_is_over();
    }

    /// Starts a group again that has failed, or stops the run.
    fn answer(&mut self, index: usize, fault: RuntimeFault) {
        let now = self.now;
        let restarter = self.restarters[index].as_mut().filter(|restarter| restarter.may_restart());
        let Some(restarter) = restarter.filter(|_| !self.stopping) else { return self.note(Err(fault)) };
        let Some(group) = self.groups[index].take() else { return };
        let books = group.ledger;
        // A fault in the stop of what has failed is its consequence.
        let (report, _) = group.finish(now);
        match restarter.again(fault.clone(), books, now) {
            Ok((group, _)) => self.groups[index] = Some(group),
            Err(error) => {
                let what = format!("{}; it could not be started again: {error}", fault.what);
                self.note(Err(RuntimeFault { what, ..fault }));
                self.supervisor.note(Message::Ended(index, Box::new(report)));
                self.control.group_ended();
            }
        }
    }

    /// Faults that were answered by a restart.
    pub(crate) fn restarts(&self) -> Vec<RuntimeFault> {
        self.restarters.iter().flatten().flat_map(|restarter| restarter.restarts.clone()).collect()
    }

    /// The next release; at equal times the group that was added first.
    fn next(&self) -> Option<(Nanos, usize)> {
        let due = |(index, group): (usize, &Option<GroupRun>)| Some((group.as_ref()?.ledger.next_due()?, index));
        self.groups.iter().enumerate().filter_map(due).min()
    }

    fn indices(&self, observer: bool) -> Vec<usize> {
        let is = |index: &usize| self.groups[*index].as_ref().is_some_and(|group| group.spec.observer == observer);
        (0..self.groups.len()).filter(is).collect()
    }

    fn end_what_is_over(&mut self) {
        // Asked after every release: no list is made here.
        for index in 0..self.groups.len() {
            let over = |group: &GroupRun| !group.spec.observer && group.ledger.next_due().is_none();
            if self.groups[index].as_ref().is_some_and(over) {
                let winds_down = |group: &mut GroupRun| group.spec.wind_down_at_end && group.begin_wind_down();
                if !self.groups[index].as_mut().is_some_and(winds_down) {
                    self.end(index);
                }
            }
        }
        if self.control.observers_may_end() {
            self.end_observers();
        }
    }

    fn end_observers(&mut self) {
        for index in self.indices(true) {
            let now = self.now;
            let result = self.groups[index].as_mut().map_or(Ok(()), |group| group.last_tick(now));
            self.note(result);
            self.end(index);
        }
    }

    fn end(&mut self, index: usize) {
        if let Some(group) = self.groups[index].take() {
            let observer = group.spec.observer;
            let (report, fault) = group.finish(self.now);
            self.note(fault.map_or(Ok(()), Err));
            self.supervisor.note(Message::Ended(index, Box::new(report)));
            if !observer {
                self.control.group_ended();
            }
        }
    }

    fn note(&mut self, result: Result<(), RuntimeFault>) {
        if let Err(fault) = result {
            self.supervisor.note(Message::Fault(fault));
            self.control.request_stop();
        }
    }
}
