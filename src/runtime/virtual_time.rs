//! The virtual executor: one thread, releases in the order (time, group), as fast as the machine allows.
//!
//! A release begins when it is scheduled and ends after the declared latency of its group; nothing is ever late but by a
//! [disturbance](super::Disturbance), and two runs of the same graph are bit-identical.

use super::disturbance::VirtualPace;
use super::release::GroupRun;
use super::report::RuntimeFault;
use super::supervisor::{Control, Message, Supervisor};
use crate::time::Nanos;
use std::sync::Arc;

/// A virtual run, standing still between two calls of [`advance`](Self::advance).
pub(crate) struct VirtualRun {
    /// `None` for groups that have ended.
    groups: Vec<Option<GroupRun>>,
    /// When each group wakes next.
    paces: Vec<VirtualPace>,
    now: Nanos,
    control: Arc<Control>,
    pub(crate) supervisor: Supervisor,
}

impl VirtualRun {
    pub(crate) fn new(mut groups: Vec<GroupRun>, control: Arc<Control>) -> Self {
        let supervisor = Supervisor::new(groups.len());
        let paces = groups.iter_mut().map(VirtualPace::new).collect();
        let groups = groups.into_iter().map(Some).collect();
        let mut run = Self { groups, paces, now: Nanos::ZERO, control, supervisor };
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
            if self.control.stop_requested() {
                return self.end_all();
            }
            let Some((due, index)) = self.next() else { return self.end_all() };
            if due > horizon {
                self.now = horizon;
                return;
            }
            self.now = due;
            if let (Some(group), Some(planned)) = (&mut self.groups[index], self.paces[index].take()) {
                planned.took_over.into_iter().for_each(|took_over| group.note_watchdog(took_over));
                let (latency, wake) = (group.spec.latency, planned.wake);
                let end = |scheduled: Nanos| (scheduled + latency).max(wake.free.unwrap_or(wake.woke));
                let result = group.release(wake, |_| wake.woke, end);
                self.paces[index].plan(group);
                self.note(result);
            }
            self.end_what_is_over();
        }
    }

    /// Ends the run in order.
    pub(crate) fn end_all(&mut self) {
        self.control.request_stop();
        for index in self.indices(false) {
            self.end(index);
        }
        self.end_observers();
    }

    /// The next wake-up; at equal times the group that was added first.
    fn next(&self) -> Option<(Nanos, usize)> {
        let woke = |(index, group): (usize, &Option<GroupRun>)| {
            group.as_ref().and_then(|_| Some((self.paces[index].next()?, index)))
        };
        self.groups.iter().enumerate().filter_map(woke).min()
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
                self.end(index);
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
