//! The flags that end a run, and the order in which things stop.
//!
//! Order: a stop is requested (by the program, by a signal, by a fault); every group that is no observer winds down if it
//! asked for that, ends after the release it is in and stops its actors; then every observer ticks once more, sees all
//! they left behind, and stops.

use crate::primitives::sync::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::Duration;

/// The time for which a stop waits while no group ends, beyond the longest [wind-down](crate::RateGroup::wind_down), before
/// it gives up on those still running.
pub const STOP_BOUND: Duration = Duration::from_secs(5);

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
pub struct StopHandle(pub(crate) Arc<Control>);

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

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;
    use crate::primitives::sync::{UnsafeCell, check};

    /// What a group has recorded: loom notices a read that is not ordered after the write.
    struct Recorded(UnsafeCell<u64>);

    // SAFETY: written by one thread; that it is read only afterwards is what the model checks.
    unsafe impl Sync for Recorded {}

    /// Two groups record something and end, one of them after a stop was requested; an observer waits for both.
    fn model(orderings: [Ordering; 2]) {
        check(move || {
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
