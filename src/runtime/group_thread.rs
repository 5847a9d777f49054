//! The thread of one rate group: it waits, releases, and goes on, winds down or ends after a fault.
//!
//! After warm-up the loop allocates nothing, takes no lock and makes no system call but its sleep.

use super::mailbox::MailSender;
use super::os;
use super::pace::Pace;
use super::release::{AfterFault, GroupRun};
use super::report::RuntimeFault;
use super::supervisor::{Control, Failure, Message};
use super::tenure::Tenure;
use super::wait::Waiter;
use super::wake::Wake;
use crate::time::Nanos;
use std::sync::Arc;
use std::time::Duration;

/// How often an observer that has ended looks whether the others have.
const POLL: Duration = Duration::from_millis(2);

/// What a group's thread has to do with.
pub(super) struct GroupThread {
    pub(super) group: GroupRun,
    /// Time zero of the run, of the monotonic clock.
    pub(super) base_ns: u64,
    pub(super) incarnation: usize,
    /// A fault is for the supervisor to answer, who starts the group again.
    pub(super) restartable: bool,
    /// The supervisor looks at its books, and dismisses a thread that does not return.
    pub(super) watched: bool,
    pub(super) tenure: Arc<Tenure>,
    pub(super) control: Arc<Control>,
    pub(super) post: MailSender<Message>,
}

impl GroupThread {
    /// Runs the group to its end on the calling thread.
    pub(super) fn run(mut self, mut waiter: Waiter) {
        if self.watched {
            self.group.book_under(Arc::clone(&self.tenure));
        }
        let base_ns = self.base_ns;
        self.group.time_actors(move || since(base_ns));
        let failed = self.release_all(&mut waiter);
        if self.tenure.is_dismissed() {
            // Its place is taken: it says nothing any more, and its actors go with it.
            return;
        }
        self.end(failed);
    }

    /// Runs release after release; the fault if the supervisor is to answer it.
    fn release_all(&mut self, waiter: &mut Waiter) -> Option<RuntimeFault> {
        let Self { group, base_ns, tenure, control, post, .. } = self;
        let base_ns = *base_ns;
        let observer = group.spec.observer;
        let now = || since(base_ns);
        let mut pace = Pace::new(group);
        loop {
            let Some(due) = group.ledger.next_due() else {
                if group.spec.wind_down_at_end && group.begin_wind_down(now()) {
                    continue;
                }
                return None;
            };
            let winding_down = group.is_winding_down();
            let leave = || match observer {
                true => control.observers_may_end(),
                false => !winding_down && control.stop_requested() || tenure.is_dismissed(),
            };
            let mut sleep =
                |until: Nanos| waiter.until(base_ns + until.0, leave).map(|woke_ns| Nanos(woke_ns - base_ns));
            let wake = match &mut pace {
                None => Ok(sleep(due).map(|woke| Wake::by_timer(due, woke))),
                Some(pace) => pace.wait(group, due, now, |until| sleep(until).is_some()),
            };
            if tenure.is_dismissed() {
                return None;
            }
            let result = match wake {
                Ok(Some(wake)) => group.release(wake, |_| now(), |_| now()),
                Ok(None) if group.begin_wind_down(now()) => continue,
                Ok(None) => return None,
                Err(fault) => Err(fault),
            };
            let Err(fault) = result else { continue };
            match group.after_fault(now(), self.restartable, control.stop_requested()) {
                AfterFault::Restart => return Some(fault),
                AfterFault::GoOn => post_fault(post, control, fault),
                AfterFault::End if observer => {
                    // It costs what it would have observed and nothing else.
                    post.try_send(Message::Fault(fault));
                    return None;
                }
                AfterFault::End => {
                    post_fault(post, control, fault);
                    return None;
                }
            }
        }
    }

    fn end(self, failed: Option<RuntimeFault>) {
        let Self { mut group, control, post, base_ns, incarnation, .. } = self;
        let (control, post) = (&*control, &post);
        let index = usize::from(group.index);
        let observer = group.spec.observer;
        if observer {
            while !control.observers_may_end() {
                std::thread::sleep(POLL);
            }
            if let Err(fault) = group.last_tick(since(base_ns)) {
                post_fault(post, control, fault);
            }
        }
        let books = group.ledger;
        let (report, fault) = group.finish(since(base_ns));
        if let Some(fault) = failed {
            post.try_send(Message::Failed(Box::new(Failure { group: index, incarnation, fault, report, books })));
            return;
        }
        if let Some(fault) = fault {
            post_fault(post, control, fault);
        }
        if !observer {
            control.group_ended();
        }
        post.try_send(Message::Ended(index, Box::new(report)));
    }
}

fn post_fault(post: &MailSender<Message>, control: &Control, fault: RuntimeFault) {
    post.try_send(Message::Fault(fault));
    control.request_stop();
}

/// The time since the start of the run.
pub(super) fn since(base_ns: u64) -> Nanos {
    Nanos(os::monotonic().saturating_sub(base_ns))
}
