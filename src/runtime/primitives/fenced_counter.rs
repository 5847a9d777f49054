//! FencedCounter for what one writer after another makes: they go on through every writer, and a writer whose place was taken
//! gets no more of them.
//!
//! Each writer counts in an atomic of its own, and whoever takes its place closes that one with the same instruction that
//! reads how far it came. What has a number is therefore numbered before the fence, by every thread's reckoning; there is
//! no moment in between in which a fenced writer could still set a count back.

use crate::primitives::sync::{AtomicU64, Ordering};
use std::sync::Arc;

/// Set in a count that is closed.
const FENCED: u64 = 1 << 63;

/// The numbers of one writer, from 1 on. Clones are the same writer.
#[derive(Clone, Debug)]
pub(crate) struct FencedCounter(Arc<AtomicU64>);

impl Default for FencedCounter {
    fn default() -> Self {
        Self::after(0)
    }
}

impl FencedCounter {
    fn after(last: u64) -> Self {
        Self(Arc::new(AtomicU64::new(last)))
    }

    /// The next number; `None` if another writer has taken this one's place.
    ///
    /// # Real-time
    /// Wait-free (one atomic addition), real-time safe.
    #[inline]
    pub(crate) fn next(&self) -> Option<u64> {
        // Relaxed: only the order of the operations on this one count matters, and every atomic has one. What is
        // numbered travels by other means, which bring their own ordering. Additions after the fence are read by
        // nobody.
        let last = self.0.fetch_add(1, Ordering::Relaxed);
        (last & FENCED == 0).then_some(last + 1)
    }

    /// The last number given, up to the fence.
    pub(crate) fn last(&self) -> u64 {
        // A fenced writer's own additions are in it: its count is nobody else's concern.
        self.0.load(Ordering::Relaxed) & !FENCED
    }

    /// Fences the writer and gives its numbers to another, which is the one to fence next.
    pub(crate) fn succeed(&mut self) -> Self {
        // Relaxed: as in `next`.
        let last = self.0.fetch_or(FENCED, Ordering::Relaxed) & !FENCED;
        *self = Self::after(last);
        self.clone()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_on_through_every_writer_and_a_fenced_one_gets_none() {
        let mut port = FencedCounter::default();
        let first = port.succeed();
        assert_eq!((first.next(), first.next(), first.last()), (Some(1), Some(2), 2));
        let second = port.succeed();
        assert_eq!((first.next(), second.next(), first.next(), second.next()), (None, Some(3), None, Some(4)));
        assert_eq!(second.last(), 4);
    }

    #[test]
    fn no_number_is_given_twice_or_left_out_however_the_fence_falls() {
        for _ in 0..200 {
            let mut port = FencedCounter::default();
            let first = port.succeed();
            let thread = std::thread::spawn(move || std::iter::from_fn(|| first.next()).last().unwrap_or(0));
            std::thread::yield_now();
            let second = port.succeed();
            let next = second.next().unwrap();
            // Check that the replacement begins behind the last number that the fenced writer ever got
            assert_eq!(next, thread.join().unwrap() + 1);
        }
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;

    #[test]
    fn loom_a_fenced_writer_never_numbers_beside_its_successor() {
        loom::model(|| {
            let mut port = FencedCounter::default();
            let first = port.succeed();
            let thread = loom::thread::spawn(move || (0..2).filter_map(|_| first.next()).collect::<Vec<_>>());
            let second = port.succeed();
            let next = second.next().unwrap();
            let given = thread.join().unwrap();
            assert_eq!(given, (1..next).collect::<Vec<_>>());
        });
    }
}
