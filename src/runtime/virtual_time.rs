//! The virtual executor: one thread, releases in the order (time, group), as fast as the machine allows.
//!
//! A release begins when it is scheduled and ends after the declared latency of its group; nothing is ever late, and two
//! runs of the same graph are bit-identical. A [re-execution](super::Recording) runs the recorded releases instead, and
//! observers along with them.

use super::panic_hook;
use super::recording::RecordedRelease;
use super::reexecution::{Reexecution, Step};
use super::release::GroupRun;
use super::report::RuntimeFault;
use super::restart::Restarter;
use super::supervisor::{Control, Message, Supervisor};
use crate::time::Nanos;
use std::sync::Arc;

/// The release that runs next.
struct Next {
    due: Nanos,
    index: usize,
    /// Its record, in a re-execution.
    recorded: Option<RecordedRelease>,
}

/// A virtual run, standing still between two calls of [`advance`](Self::advance).
pub(crate) struct VirtualRun {
    /// `None` for groups that have ended.
    groups: Vec<Option<GroupRun>>,
    restarters: Vec<Option<Restarter>>,
    now: Nanos,
    /// Set once every group was told to stop.
    stopping: bool,
    reexecution: Option<Reexecution>,
    control: Arc<Control>,
    pub(crate) supervisor: Supervisor,
}

impl VirtualRun {
    pub(crate) fn new(
        groups: Vec<GroupRun>,
        restarters: Vec<Option<Restarter>>,
        reexecution: Option<Reexecution>,
        control: Arc<Control>,
    ) -> Self {
        panic_hook::install();
        let supervisor = Supervisor::new(groups.len());
        let groups = groups.into_iter().map(Some).collect();
        let mut run = Self { groups, restarters, now: Nanos::ZERO, stopping: false, reexecution, control, supervisor };
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
            let Some(Next { due, index, recorded }) = self.next() else { return self.end_all() };
            if due > horizon {
                self.now = horizon;
                return;
            }
            // What is re-executed late was due before.
            self.now = self.now.max(due);
            if let Some(group) = &mut self.groups[index] {
                let latency = group.spec.latency;
                let result = match (&recorded, &mut self.reexecution) {
                    (Some(release), Some(script)) => group.rerun(release).and_then(|()| script.done(index, group)),
                    _ => group.release(due, |scheduled| scheduled, |scheduled| scheduled + latency),
                };
                if let Err(fault) = result {
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

    /// Groups that wind down go on, the others end. In a re-execution all of them do: how a run wound down was recorded.
    fn begin_stop(&mut self) {
        self.stopping = true;
        let repeats = self.reexecution.is_some();
        for index in self.indices(false) {
            if repeats || !self.groups[index].as_mut().is_some_and(GroupRun::begin_wind_down) {
                self.end(index);
            }
        }
        self.end_what_is_over();
    }

    /// Starts a group again that has failed, or stops the run.
    fn answer(&mut self, index: usize, fault: RuntimeFault) {
        let now = self.now;
        let restarter = self.restarters[index].as_mut().filter(|restarter| restarter.may_restart());
        let Some(restarter) = restarter.filter(|_| !self.stopping && self.reexecution.is_none()) else {
            return self.note(Err(fault));
        };
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

    /// The next release; at equal times the group that was added first. `None` if there is none any more.
    fn next(&mut self) -> Option<Next> {
        let Some(script) = &self.reexecution else {
            return self.next_due(|_| true);
        };
        match script.next(&self.groups) {
            Step::Run(index, release) => {
                let observer = self.next_due(|group| group.spec.observer);
                let recorded = Next { due: release.scheduled, index, recorded: Some(release) };
                Some(observer.filter(|observer| observer.due < recorded.due).unwrap_or(recorded))
            }
            Step::Stuck(fault) => {
                self.note(Err(fault));
                None
            }
            Step::Over => None,
        }
    }

    /// The next release by schedule among the groups that are asked for.
    fn next_due(&self, is_asked: impl Fn(&GroupRun) -> bool) -> Option<Next> {
        let groups = self.groups.iter().enumerate();
        let due = |(index, group): (usize, &Option<GroupRun>)| {
            let group = group.as_ref().filter(|group| is_asked(group))?;
            Some((group.ledger.next_due()?, index))
        };
        groups.filter_map(due).min().map(|(due, index)| Next { due, index, recorded: None })
    }

    fn indices(&self, observer: bool) -> Vec<usize> {
        let is = |index: &usize| self.groups[*index].as_ref().is_some_and(|group| group.spec.observer == observer);
        (0..self.groups.len()).filter(is).collect()
    }

    fn end_what_is_over(&mut self) {
        // Asked after every release: no list is made here.
        for index in 0..self.groups.len() {
            let over = |group: &GroupRun| {
                let scripted = self.reexecution.as_ref();
                !group.spec.observer
                    && scripted.map_or_else(|| group.ledger.next_due().is_none(), |script| script.is_over(index))
            };
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
