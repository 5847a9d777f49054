//! Who is still running, what went wrong first, and in which order things stop.
//!
//! Order: a stop is requested (by the program, by a signal, by a fault); every group that is no observer winds down if it
//! asked for that, ends after the release it is in and stops its actors; then every observer ticks once more, sees all
//! they left behind, and stops.

use super::deadline::Ledger;
use super::report::{GroupReport, RuntimeFault};
use super::successor::Restarted;
use super::sync::{AtomicBool, AtomicUsize, Ordering};
use std::fmt;
use std::sync::Arc;

/// Flags that all threads of a run share.
#[derive(Debug)]
pub(crate) struct Control {
    stop: AtomicBool,
    /// Groups that are no observers and have not ended.
    active: AtomicUsize,
    /// Set when a group is given up, so that observers no longer wait for it.
    abandoned: AtomicBool,
    /// Of the end of a group and of the look at it; loom's tests weaken them to see that they notice.
    #[cfg(all(test, loom))]
    orderings: [Ordering; 2],
}

impl Control {
    pub(crate) fn new(active: usize) -> Arc<Self> {
        Arc::new(Self::of(active))
    }

    fn of(active: usize) -> Self {
        Self {
            stop: AtomicBool::new(false),
            active: AtomicUsize::new(active),
            abandoned: AtomicBool::new(false),
            #[cfg(all(test, loom))]
            orderings: [Ordering::Release, Ordering::Acquire],
        }
    }

    fn release(&self) -> Ordering {
        #[cfg(all(test, loom))]
        return self.orderings[0];
        #[cfg(not(all(test, loom)))]
        Ordering::Release
    }

    fn acquire(&self) -> Ordering {
        #[cfg(all(test, loom))]
        return self.orderings[1];
        #[cfg(not(all(test, loom)))]
        Ordering::Acquire
    }

    pub(crate) fn request_stop(&self) {
        // Relaxed, here and where it is read: it says only that it is time to go; data travels by other ways.
        self.stop.store(true, Ordering::Relaxed);
    }

    pub(crate) fn stop_requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Called once by each group that is no observer, when its actors are gone.
    pub(crate) fn group_ended(&self) {
        // Release: with the acquire in `observers_may_end`, so that an observer's last tick sees all that was recorded.
        self.active.fetch_sub(1, self.release());
    }

    /// Lets the observers end although a group has not; true if that was already so.
    pub(crate) fn abandon(&self) -> bool {
        self.abandoned.swap(true, Ordering::Relaxed)
    }

    pub(crate) fn observers_may_end(&self) -> bool {
        // Acquire: with the release in `group_ended`; the subtractions are one release sequence.
        self.active.load(self.acquire()) == 0 || self.abandoned.load(Ordering::Relaxed)
    }
}

/// Asks a run to stop, from any thread, also from one that handles signals.
#[derive(Clone, Debug)]
pub struct StopHandle(pub(super) Arc<Control>);

impl StopHandle {
    /// Asks every group to end after the release it is in. Returns at once.
    ///
    /// # Real-time
    /// Wait-free, real-time safe, async-signal-safe.
    pub fn request(&self) {
        self.0.request_stop();
    }

    /// True once a stop was requested, by a program or by a fault.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn requested(&self) -> bool {
        self.0.stop_requested()
    }
}

/// What group threads tell the supervisor.
#[derive(Debug)]
pub(crate) enum Message {
    /// Something fatal happened; a stop is already requested, unless it was in an observer.
    Fault(RuntimeFault),
    /// The group with this number has ended, its actors are gone.
    Ended(usize, Box<GroupReport>),
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

/// Collects what the groups report.
#[derive(Debug)]
pub(crate) struct Supervisor {
    reports: Vec<Option<GroupReport>>,
    fault: Option<RuntimeFault>,
}

impl Supervisor {
    pub(crate) fn new(groups: usize) -> Self {
        Self { reports: vec![None; groups], fault: None }
    }

    pub(crate) fn note(&mut self, message: Message) {
        match message {
            Message::Fault(fault) => {
                // What follows a fault is often its consequence: the first one is the one to report.
                self.fault.get_or_insert(fault);
            }
            Message::Ended(group, report) => self.reports[group] = Some(*report),
            Message::Failed(failure) | Message::NotRestarted(failure) => {
                self.fault.get_or_insert(failure.fault);
                self.reports[failure.group] = Some(failure.report);
            }
            // Nothing has ended.
            Message::Restarted(_) => {}
        }
    }

    pub(crate) fn ended(&self) -> usize {
        self.reports.iter().flatten().count()
    }

    pub(crate) fn has_ended(&self, group: usize) -> bool {
        self.reports[group].is_some()
    }

    pub(crate) fn all_ended(&self) -> bool {
        self.ended() == self.reports.len()
    }

    /// The reports of the groups that ended, and the first fault.
    pub(crate) fn results(&self) -> (Vec<GroupReport>, Option<RuntimeFault>) {
        (self.reports.iter().flatten().cloned().collect(), self.fault.clone())
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::super::sync::UnsafeCell;
    use super::*;

    /// What a group has recorded: loom notices a read that is not ordered after the write.
    struct Recorded(UnsafeCell<u64>);

    // SAFETY: written by one thread; that it is read only afterwards is what the model checks.
    unsafe impl Sync for Recorded {}

    /// Two groups record something and end, one of them after a stop was requested; an observer waits for both.
    fn model(orderings: [Ordering; 2]) {
        let mut builder = loom::model::Builder::new();
        // Bounded preemptions keep the model small; known bugs of lock-free code need two or three.
        builder.preemption_bound = Some(3);
        builder.check(move || {
            let control = Arc::new(Control { orderings, ..Control::of(2) });
            let recorded = Arc::new([(); 2].map(|()| Recorded(UnsafeCell::new(0))));
            let group = |index: usize, waits: bool| {
                let (control, recorded) = (Arc::clone(&control), Arc::clone(&recorded));
                loom::thread::spawn(move || {
                    while waits && !control.stop_requested() {
                        loom::thread::yield_now();
                    }
                    // SAFETY: this thread alone writes it.
                    recorded[index].0.with_mut(|cell| unsafe { *cell = 7 });
                    control.group_ended();
                })
            };
            let threads = [group(0, true), group(1, false)];
            control.request_stop();
            while !control.observers_may_end() {
                loom::thread::yield_now();
            }
            for cell in recorded.iter() {
                // SAFETY: both groups have ended, which is what the model checks.
                assert_eq!(cell.0.with(|cell| unsafe { *cell }), 7);
            }
            threads.into_iter().for_each(|thread| thread.join().unwrap());
        });
    }

    #[test]
    fn loom_a_stop_reaches_every_group_and_observers_see_all_that_was_recorded() {
        model([Ordering::Release, Ordering::Acquire]);
    }

    #[test]
    #[should_panic(expected = "Causality violation")]
    fn loom_catches_an_end_that_releases_nothing() {
        model([Ordering::Relaxed, Ordering::Acquire]);
    }

    #[test]
    #[should_panic(expected = "Causality violation")]
    fn loom_catches_an_observer_that_acquires_nothing() {
        model([Ordering::Release, Ordering::Relaxed]);
    }
}
