//! The virtual executor: one thread, releases in the order (time, group), as fast as the machine allows.
//!
//! A release begins when it is scheduled and ends after the declared latency of its group; nothing is ever late but by a
//! [disturbance](crate::Disturbance), and two runs of the same graph are bit-identical. A
//! [re-execution](crate::Recording) runs the recorded releases instead, and observers along with them.

use crate::executor::disturbance::{Disturb, VirtualPace};
use crate::executor::schedule::Schedule;
use crate::group::group_run::{AfterFault, GroupRun};
use crate::group::panic_hook;
use crate::primitives::histogram::Histogram;
use crate::records::timing::RecordedRelease;
use crate::reexecution::replay::{Reexecution, Step};
use crate::reports::report::RuntimeFault;
use crate::supervision::restart::Restarter;
use crate::supervision::stop::Control;
use crate::supervision::supervisor::{Failure, Message, Supervisor};
use crate::system::stopwatch::Stopwatch;
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
    /// How each group wakes.
    paces: Vec<VirtualPace>,
    /// When, in order.
    schedule: Schedule,
    /// What the releases of each group cost; empty if nobody asked.
    stopwatches: Vec<Stopwatch>,
    /// Virtual time executed so far.
    pub(crate) now: Nanos,
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
        disturbances: Vec<Option<Disturb>>,
        reexecution: Option<Reexecution>,
        control: Arc<Control>,
        measures_cost: bool,
    ) -> Self {
        panic_hook::install();
        let supervisor = Supervisor::new(groups.len());
        let paces = groups.iter().zip(disturbances).map(|(group, disturb)| VirtualPace::new(group, disturb)).collect();
        let stopwatches = groups.iter().filter(|_| measures_cost).map(|_| Stopwatch::new()).collect();
        let schedule = Schedule::new(groups.len());
        let groups: Vec<_> = groups.into_iter().map(Some).collect();
        let mut run = Self {
            groups,
            restarters,
            paces,
            schedule,
            stopwatches,
            now: Nanos::ZERO,
            stopping: false,
            reexecution,
            control,
            supervisor,
        };
        run.end_all_that_is_over();
        run
    }

    /// What the releases of each group cost; empty if that is not measured.
    pub(crate) fn costs(&self) -> impl Iterator<Item = Histogram> {
        self.stopwatches.iter().map(|stopwatch| stopwatch.reader().snapshot())
    }

    /// Executes `span` of virtual time, or up to the end of the run.
    pub(crate) fn advance(&mut self, span: Nanos) {
        let horizon = self.now + span;
        while !self.supervisor.all_ended() {
            if self.control.stop_requested() && !self.stopping {
                self.begin_stop();
                continue;
            }
            let Some(Next { due, index, recorded }) = self.next() else {
                return if self.stopping { self.end_the_rest() } else { self.end_all() };
            };
            if due > horizon {
                self.now = horizon;
                return;
            }
            // What is re-executed late was due before.
            self.now = self.now.max(due);
            let result = match recorded {
                Some(release) => self.rerun(index, &release),
                None => self.release(index),
            };
            if let Err(fault) = result {
                self.answer(index, fault);
            }
            self.end_if_over(index);
            self.end_observers_in_time();
        }
    }

    /// Ends the run in order: groups that wind down do so, in virtual time, also those that have begun.
    pub(crate) fn end_all(&mut self) {
        self.control.request_stop();
        self.advance(Nanos(u64::MAX));
        self.end_the_rest();
    }

    /// Ends what is not released any more.
    fn end_the_rest(&mut self) {
        self.indices(false).into_iter().for_each(|index| self.end(index));
        self.end_observers();
    }

    /// The next release that the schedule plans for a group.
    fn release(&mut self, index: usize) -> Result<(), RuntimeFault> {
        let (Some(group), Some(planned)) = (&mut self.groups[index], self.paces[index].take()) else { return Ok(()) };
        planned.took_over.into_iter().for_each(|took_over| group.note_watchdog(took_over));
        let (latency, wake) = (group.spec.latency, planned.wake);
        let end = |scheduled: Nanos| (scheduled + latency).max(wake.free.unwrap_or(wake.woke));
        let stopwatch = self.stopwatches.get_mut(index);
        let result = Stopwatch::around(stopwatch, || group.release(wake, |_| wake.woke, end));
        self.paces[index].plan(group);
        result
    }

    /// The next recorded release of a group.
    fn rerun(&mut self, index: usize, release: &RecordedRelease) -> Result<(), RuntimeFault> {
        let (Some(group), Some(script)) = (&mut self.groups[index], &mut self.reexecution) else { return Ok(()) };
        Stopwatch::around(self.stopwatches.get_mut(index), || group.rerun(release))?;
        script.done(index, group)
    }

    /// Groups that wind down go on, the others end. In a re-execution all of them do: how a run wound down was
    /// recorded.
    fn begin_stop(&mut self) {
        self.stopping = true;
        let repeats = self.reexecution.is_some();
        for index in self.indices(false) {
            let winds_down = self.groups[index].as_ref().is_some_and(|group| group.ledger.winding_down);
            if repeats || !(winds_down || self.begin_wind_down(index)) {
                self.end(index);
            }
        }
        self.end_all_that_is_over();
    }

    fn begin_wind_down(&mut self, index: usize) -> bool {
        let Some(group) = self.groups[index].as_mut().filter(|group| !group.ledger.winding_down) else { return false };
        let begun = group.begin_wind_down(self.now);
        if begun {
            self.paces[index].wind_down(group, self.now);
        }
        begun
    }

    /// Starts a group again that has failed, or stops the run.
    fn answer(&mut self, index: usize, fault: RuntimeFault) {
        let Some(group) = &mut self.groups[index] else { return };
        let observer = group.spec.observer;
        if self.reexecution.is_some() && !observer {
            // What ran after a fault, by actors made anew or without the one that failed, is not repeated: it ends here.
            return self.note(observer, fault);
        }
        let restartable = self.restarters[index].as_ref().is_some_and(Restarter::may_restart);
        match group.after_fault(self.now, restartable, self.control.stop_requested()) {
            AfterFault::Restart => self.restart(index, fault),
            AfterFault::GoOn => {
                self.paces[index].wind_down(group, self.now);
                self.note(observer, fault);
            }
            AfterFault::End => {
                self.note(observer, fault);
                if observer {
                    // It ends after the others, however it fares.
                    self.paces[index].take();
                } else {
                    self.end(index);
                }
            }
        }
    }

    fn restart(&mut self, index: usize, fault: RuntimeFault) {
        let now = self.now;
        let (Some(group), Some(restarter)) = (self.groups[index].take(), &mut self.restarters[index]) else { return };
        let books = group.ledger;
        // A fault in the stop of what has failed is its consequence.
        let (report, _) = group.finish(now);
        match restarter.again(&fault, books, now) {
            Ok((group, _)) => {
                self.paces[index].plan(&group);
                self.groups[index] = Some(group);
                self.supervisor.restarts.push(fault);
            }
            Err(error) => {
                let failure = Failure { group: index, incarnation: 0, fault, report, books };
                self.supervisor.note(Message::NotRestarted(Box::new(failure.not_answered(&error))));
                self.control.request_stop();
                self.control.group_ended();
            }
        }
    }

    /// The next release; at equal times the group that was added first. `None` if there is none any more.
    fn next(&mut self) -> Option<Next> {
        let Some(script) = &self.reexecution else {
            return self.schedule.first().map(|(due, index)| Next { due, index, recorded: None });
        };
        match script.next(&self.groups) {
            Step::Run(index, release) => {
                let observer = self.next_observer();
                let recorded = Next { due: release.scheduled, index, recorded: Some(release) };
                Some(observer.filter(|observer| observer.due < recorded.due).unwrap_or(recorded))
            }
            Step::Stuck(fault) => {
                self.note(false, fault);
                None
            }
            Step::Over => None,
        }
    }

    /// The next wake-up by schedule of an observer.
    fn next_observer(&self) -> Option<Next> {
        let groups = self.groups.iter().enumerate();
        let due = |(index, group): (usize, &Option<GroupRun>)| {
            group.as_ref().filter(|group| group.spec.observer)?;
            Some((self.paces[index].next()?, index))
        };
        groups.filter_map(due).min().map(|(due, index)| Next { due, index, recorded: None })
    }

    fn indices(&self, observer: bool) -> Vec<usize> {
        let is = |index: &usize| self.groups[*index].as_ref().is_some_and(|group| group.spec.observer == observer);
        (0..self.groups.len()).filter(is).collect()
    }

    fn end_all_that_is_over(&mut self) {
        (0..self.groups.len()).for_each(|index| self.end_if_over(index));
        self.end_observers_in_time();
    }

    /// Asked after every release, of the group that was released: what it did may have ended that one alone.
    fn end_if_over(&mut self, index: usize) {
        let over = |group: &GroupRun| {
            let scripted = self.reexecution.as_ref();
            !group.spec.observer
                && scripted.map_or_else(|| group.ledger.next_due().is_none(), |script| script.is_over(index))
        };
        if self.groups[index].as_ref().is_some_and(over) {
            let asks = self.groups[index].as_ref().is_some_and(|group| group.spec.wind_down_at_end);
            if !asks || !self.begin_wind_down(index) {
                self.end(index);
            }
        }
        let wakes = self.groups[index].as_ref().and_then(|_| self.paces[index].next());
        self.schedule.put(index, wakes);
    }

    fn end_observers_in_time(&mut self) {
        if self.control.observers_may_end() {
            self.end_observers();
        }
    }

    fn end_observers(&mut self) {
        for index in self.indices(true) {
            let now = self.now;
            if let Some(Err(fault)) = self.groups[index].as_mut().map(|group| group.last_tick(now)) {
                self.note(true, fault);
            }
            self.end(index);
        }
    }

    fn end(&mut self, index: usize) {
        if let Some(group) = self.groups[index].take() {
            let observer = group.spec.observer;
            let (report, fault) = group.finish(self.now);
            if let Some(fault) = fault {
                self.note(observer, fault);
            }
            self.supervisor.note(Message::Ended(index, Box::new(report)));
            if !observer {
                self.control.group_ended();
            }
        }
    }

    /// Notes a fault, which stops the run unless it is that of an observer.
    fn note(&mut self, observer: bool, fault: RuntimeFault) {
        if observer {
            return self.supervisor.note(Message::ObserverFault(fault));
        }
        self.supervisor.note(Message::Fault(fault));
        self.control.request_stop();
    }
}
