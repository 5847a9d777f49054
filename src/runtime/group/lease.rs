//! Who keeps the books of a group: its thread, until the supervisor revokes its lease on them.

use crate::primitives::sync::{AtomicU8, Ordering};

/// The group's thread is somewhere else: in its actors or asleep.
const OPEN: u8 = 0;
/// The thread is writing a release into the books.
const BOOKING: u8 = 1;
/// Its place is taken: what it still does counts for nothing.
const REVOKED: u8 = 2;

/// Decides between a thread that comes back late and the supervisor that gives it up: a release is booked by the one or
/// skipped by the other, never both.
#[derive(Debug)]
pub(crate) struct Lease(AtomicU8);

impl Default for Lease {
    fn default() -> Self {
        Self(AtomicU8::new(OPEN))
    }
}

impl Lease {
    /// The thread is about to book a release; false if its lease was revoked.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn begin_booking(&self) -> bool {
        self.0.compare_exchange(OPEN, BOOKING, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }

    /// The release is booked and the books are published.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn end_booking(&self) {
        // Release: with the acquire in `revoke`, so that who takes over reads the last books.
        self.0.store(OPEN, Ordering::Release);
    }

    /// Takes the books away from the thread; false if it is booking just now, and so has come back.
    pub(crate) fn revoke(&self) -> bool {
        self.0.compare_exchange(OPEN, REVOKED, Ordering::Acquire, Ordering::Relaxed).is_ok()
    }

    /// True once the lease was revoked.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn is_revoked(&self) -> bool {
        // Relaxed: no data depends on it.
        self.0.load(Ordering::Relaxed) == REVOKED
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;
    use crate::primitives::sync::UnsafeCell;
    use std::sync::Arc;

    struct Books(UnsafeCell<u64>);
    // SAFETY: written while booking and read after a revocation; that these exclude each other is what the model checks.
    unsafe impl Sync for Books {}

    #[test]
    fn loom_a_revocation_never_meets_a_booking_and_reads_the_last_books() {
        loom::model(|| {
            let shared = Arc::new((Lease::default(), Books(UnsafeCell::new(0))));
            let own = Arc::clone(&shared);
            let thread = loom::thread::spawn(move || {
                let (lease, books) = &*own;
                let mut booked = 0;
                for release in 1..=2 {
                    if lease.begin_booking() {
                        // SAFETY: see above.
                        books.0.with_mut(|cell| unsafe { *cell = release });
                        lease.end_booking();
                        booked = release;
                    }
                }
                booked
            });
            let (lease, books) = &*shared;
            // SAFETY: see above.
            let taken = lease.revoke().then(|| books.0.with(|cell| unsafe { *cell }));
            let booked = thread.join().unwrap();
            assert!(taken.is_none_or(|taken| taken == booked));
        });
    }
}
