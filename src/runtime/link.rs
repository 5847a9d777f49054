//! A half of a port whose other half can be made anew while this one stays: how a restarted group is connected again.
//!
//! The surviving half belongs to a group that may be real-time, the fresh half is made by the supervisor. It travels
//! through a bounded channel that is only polled, and the half that it replaces travels back the same way, so that
//! nothing is freed where it is used.

use super::sync::{AtomicUsize, Ordering};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;

/// The surviving half, of type `H`.
#[derive(Debug)]
pub(super) struct Linked<H> {
    half: H,
    /// Deliveries taken so far.
    taken: usize,
    delivered: Arc<AtomicUsize>,
    inbox: Receiver<H>,
    outbox: Sender<H>,
}

/// The supervisor's end: delivers fresh halves.
#[derive(Debug)]
pub(super) struct Relink<H> {
    delivered: Arc<AtomicUsize>,
    inbox: Sender<H>,
    /// What was delivered and not taken is taken back from here.
    untaken: Receiver<H>,
    outbox: Receiver<H>,
}

/// Makes `half` replaceable.
pub(super) fn linked<H>(half: H) -> (Linked<H>, Relink<H>) {
    let delivered = Arc::new(AtomicUsize::new(0));
    let (inbox_sender, inbox) = bounded(1);
    // One delivery is under way at most, and every delivery empties the outbox first: two places are always enough.
    let (outbox, outbox_receiver) = bounded(2);
    let untaken = inbox.clone();
    (
        Linked { half, taken: 0, delivered: Arc::clone(&delivered), inbox, outbox },
        Relink { delivered, inbox: inbox_sender, untaken, outbox: outbox_receiver },
    )
}

impl<H> Linked<H> {
    /// The half in force: the one delivered last.
    ///
    /// # Real-time
    /// Wait-free but for a delivery, which comes once per restart: that call takes no lock and allocates nothing, but it
    /// spins while a second `deliver` is in the midst of taking back the first. Nobody ever parks on either channel.
    #[inline]
    pub(super) fn current(&mut self) -> &mut H {
        // Acquire: with the release in `deliver`, so that what was counted is in the inbox.
        let delivered = self.delivered.load(Ordering::Acquire);
        if delivered != self.taken {
            self.take_delivery(delivered);
        }
        &mut self.half
    }

    /// The half in use, without a look at the inbox.
    #[inline]
    pub(super) fn half(&self) -> &H {
        &self.half
    }

    /// As [`half`](Self::half), to change.
    #[inline]
    pub(super) fn half_mut(&mut self) -> &mut H {
        &mut self.half
    }

    #[cold]
    fn take_delivery(&mut self, delivered: usize) {
        self.taken = delivered;
        // Empty if the call before took it already, between its sending and its counting.
        if let Ok(fresh) = self.inbox.try_recv() {
            let old = std::mem::replace(&mut self.half, fresh);
            let _ = self.outbox.try_send(old);
        }
    }
}

impl<H> Relink<H> {
    /// Delivers `fresh`; what was delivered before and not taken is dropped, as are the halves that came back.
    pub(super) fn deliver(&self, fresh: H) {
        while self.outbox.try_recv().is_ok() {}
        while self.untaken.try_recv().is_ok() {}
        let _ = self.inbox.try_send(fresh);
        // Release: with the acquire in `current`.
        self.delivered.fetch_add(1, Ordering::Release);
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn the_newest_delivery_is_in_force_and_replaced_halves_come_back() {
        let (mut linked, relink) = linked(Arc::new(0));
        assert_eq!(**linked.current(), 0);
        relink.deliver(Arc::new(1));
        let newest = Arc::new(2);
        relink.deliver(Arc::clone(&newest));
        assert_eq!(**linked.half(), 0);
        assert_eq!(**linked.current(), 2);
        relink.deliver(Arc::new(3));
        assert_eq!(**linked.current(), 3);
        // Check that the replaced half is kept until the next delivery, not freed where it was used
        assert_eq!(Arc::strong_count(&newest), 2);
        relink.deliver(Arc::new(4));
        assert_eq!(Arc::strong_count(&newest), 1);
    }
}
