//! The thread of one rate group: it waits, releases, and goes on, winds down or ends after a fault.
//!
//! Of a [hosted](crate::Release::Hosted) group that thread is one of the program's, which comes for a release at a time.
//!
//! After warm-up the loop allocates nothing, takes no lock and makes no system call but its sleep.

use crate::accounting::timeline::Wake;
use crate::executor::beginning::{Beginning, since};
use crate::executor::device_wait::DeviceWait;
use crate::group::group_run::{AfterFault, GroupRun};
use crate::group::lease::Lease;
use crate::group::panic_hook::guarded;
use crate::reports::report::RuntimeFault;
use crate::supervision::restart::Restarter;
use crate::supervision::stop::Control;
use crate::supervision::supervisor::{Failure, Message, Restarted};
use crate::system::grant::set_up_thread;
use crate::system::wait::Waiter;
use crate::time::Nanos;
use crossbeam_channel::Sender;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// How often an observer that has ended looks whether the others have.
const POLL: Duration = Duration::from_millis(2);

/// How often a group of this period that waits for time zero looks: it loses at most an eighth of its first period, as much
/// as a host may come early.
fn looks_every(period: Nanos) -> Duration {
    (period.to_duration() / 8).min(POLL)
}

/// What the thread of a group shares with the supervisor.
pub(crate) struct Link {
    pub(crate) beginning: Arc<Beginning>,
    /// Counts the threads that the group has had, from 0.
    pub(crate) incarnation: usize,
    pub(crate) lease: Arc<Lease>,
    pub(crate) control: Arc<Control>,
    /// Without a bound, so that nothing is lost: an end that does not arrive is one that a stop waits for. A fault
    /// allocates its text anyway, and what a group can say is bounded by its actors and its periods of wind-down.
    pub(crate) post: Sender<Message>,
}

/// The thread of a group and what it needs.
pub(crate) struct GroupThread {
    pub(crate) group: GroupRun,
    /// A fault is for the supervisor to answer, who starts the group again.
    pub(crate) restartable: bool,
    /// The supervisor looks at its books, and revokes the lease of a thread that does not return.
    pub(crate) watched: bool,
    pub(crate) link: Link,
}

impl GroupThread {
    /// Runs the group to its end on the calling thread.
    pub(crate) fn run(mut self, mut waiter: Waiter) {
        if self.watched {
            self.group.lease = Some(Arc::clone(&self.link.lease));
        }
        let failed = match self.link.begun(looks_every(self.group.spec.rate.period())) {
            Some(base_ns) => {
                self.group.time_actors(move || since(base_ns));
                self.release_all(base_ns, &mut waiter)
            }
            None => None,
        };
        // Of a group that ends nobody can take the place any more; one that failed may still hang in its stop.
        let lease = &self.link.lease;
        let is_replaced = if failed.is_none() { !lease.begin_booking() } else { lease.is_revoked() };
        if is_replaced {
            // Its place is taken: it says nothing any more, and its actors go with it.
            return;
        }
        self.end(failed);
    }

    /// Runs release after release; the fault if the supervisor is to answer it.
    fn release_all(&mut self, base_ns: u64, waiter: &mut Waiter) -> Option<RuntimeFault> {
        let now = || since(base_ns);
        let mut pace = DeviceWait::new(&self.group);
        loop {
            let Self { group, link, .. } = self;
            let Link { lease, control, .. } = &*link;
            let observer = group.spec.observer;
            let due = next_due(group, now)?;
            let winding_down = group.ledger.winding_down;
            let leave = || match observer {
                true => control.observers_may_end(),
                false => !winding_down && control.stop_requested() || lease.is_revoked(),
            };
            let mut sleep =
                |until: Nanos| waiter.until(base_ns + until.0, leave).map(|woke_ns| Nanos(woke_ns - base_ns));
            let wake = match &mut pace {
                None => Ok(sleep(due).map(|woke| Wake::by_timer(due, woke))),
                Some(pace) => pace.wait(group, due, now, |until| sleep(until).is_some()),
            };
            if lease.is_revoked() {
                return None;
            }
            let result = match wake {
                Ok(Some(wake)) => group.release(wake, |_| now(), |_| now()),
                Ok(None) if group.begin_wind_down(now()) => continue,
                Ok(None) => return None,
                Err(fault) => Err(fault),
            };
            if let Err(fault) = result
                && let ControlFlow::Break(failed) = self.after(fault, now())
            {
                return failed;
            }
        }
    }

    /// What becomes of the group after a fault: it goes on, or it ends, with the fault if the supervisor is to answer that.
    pub(crate) fn after(&mut self, fault: RuntimeFault, now: Nanos) -> ControlFlow<Option<RuntimeFault>> {
        let Self { group, link, .. } = self;
        let next = group.after_fault(now, self.restartable, link.control.stop_requested());
        if next == AfterFault::Restart {
            return ControlFlow::Break(Some(fault));
        }
        link.post_fault(group.spec.observer, fault);
        if next == AfterFault::GoOn { ControlFlow::Continue(()) } else { ControlFlow::Break(None) }
    }

    /// Stops the actors and tells the supervisor how it went.
    pub(crate) fn end(self, failed: Option<RuntimeFault>) {
        let Self { mut group, link, .. } = self;
        let Link { beginning, incarnation, control, post, .. } = &link;
        let index = usize::from(group.index);
        let observer = group.spec.observer;
        if observer {
            while !control.observers_may_end() {
                std::thread::sleep(POLL);
            }
            if let Err(fault) = group.last_tick(beginning.elapsed()) {
                link.post_fault(observer, fault);
            }
        }
        let books = group.ledger;
        if let Some(fault) = &failed {
            let _ = post.send(Message::Failing(index, *incarnation, fault.clone()));
        }
        let (report, fault) = group.finish(beginning.elapsed());
        if let Some(fault) = failed {
            let failure = Failure { group: index, incarnation: *incarnation, fault, report, books };
            let _ = post.send(Message::Failed(Box::new(failure)));
            return;
        }
        if let Some(fault) = fault {
            link.post_fault(observer, fault);
        }
        if !observer {
            control.group_ended();
        }
        let _ = post.send(Message::Ended(index, Box::new(report)));
    }
}

/// When the next release of `group` is due, one of its wind-down too; `None` if it has none.
pub(crate) fn next_due(group: &mut GroupRun, now: impl Fn() -> Nanos) -> Option<Nanos> {
    group.ledger.next_due().or_else(|| {
        let winds_down = group.spec.wind_down_at_end && group.begin_wind_down(now());
        winds_down.then(|| group.ledger.next_due()).flatten()
    })
}

impl Link {
    /// Waits for time zero, which a host may let wait for itself; `None` if the run is stopped before.
    fn begun(&self, looks_every: Duration) -> Option<u64> {
        loop {
            if let Some(base_ns) = self.beginning.get() {
                return Some(base_ns);
            }
            if self.control.stop_requested() {
                return None;
            }
            std::thread::sleep(looks_every);
        }
    }

    /// Tells a fault, which stops the run unless it is that of an observer.
    fn post_fault(&self, observer: bool, fault: RuntimeFault) {
        let _ = self.post.send(if observer { Message::ObserverFault(fault) } else { Message::Fault(fault) });
        if !observer {
            self.control.request_stop();
        }
    }

    /// Starts the thread that takes the place of one that failed: it makes the actors anew and goes on with the group.
    /// Nobody waits for it, however long that takes.
    ///
    /// # Errors
    /// The failure, with what the system said, if it gives no thread.
    pub(crate) fn replace(self, restarter: Restarter, failure: Box<Failure>) -> Result<JoinHandle<()>, Box<Failure>> {
        let unanswered = failure.clone();
        let thread = restarter.spec.thread();
        let run = move || self.run_again(restarter, failure);
        thread.spawn(run).map_err(|error| Box::new(unanswered.not_answered(&error)))
    }

    fn run_again(self, mut restarter: Restarter, failure: Box<Failure>) {
        match restarter.again(&failure.fault, failure.books, self.beginning.elapsed()) {
            Ok((group, books)) => {
                // The actors were started without it, like those before them.
                let granted = set_up_thread(&group.spec);
                let restartable = restarter.may_restart();
                let (group_number, grant, probe) = (failure.group, granted.group, granted.probe);
                let begun = Restarted { group: group_number, restarter, books, failure, grant, probe };
                let _ = self.post.send(Message::Restarted(Box::new(begun)));
                GroupThread { group, restartable, watched: true, link: self }.run(granted.waiter);
            }
            Err(error) => {
                // What an actor's own error says of itself is its code too.
                let why = guarded(|| error.to_string()).unwrap_or_else(|text| format!("its error panicked: {text}"));
                let _ = self.post.send(Message::NotRestarted(Box::new(failure.not_answered(&why))));
            }
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_group_that_waits_for_time_zero_sees_it_within_a_part_of_its_first_period() {
        for hz in [1, 60, 500, 1_000, 10_000, 100_000] {
            let period = crate::Rate::hz(hz).period();
            let every = looks_every(period);
            assert!(!every.is_zero() && every * 8 <= period.to_duration() && every <= POLL, "{hz} Hz: {every:?}");
        }
    }
}
