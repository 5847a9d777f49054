//! Control, commands and events between threads, where the receiver polls.
//!
//! A bounded crossbeam channel without its blocking calls: a sender whose receiver is parked pays a mutex and a futex
//! to wake it, so a receiver that a real-time thread sends to must poll. A full mailbox drops and counts.

use super::sync::{AtomicU64, Ordering};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;

/// Makes a mailbox for up to `capacity` messages; it has any number of senders and one receiver.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn mailbox<T: Send>(capacity: usize) -> (MailSender<T>, MailReceiver<T>) {
    let (sender, receiver) = bounded(capacity.max(1));
    let dropped = Arc::new(AtomicU64::new(0));
    (MailSender { sender, dropped: Arc::clone(&dropped) }, MailReceiver { receiver, dropped })
}

/// Posts messages; see [`mailbox`].
#[derive(Debug)]
pub struct MailSender<T> {
    sender: Sender<T>,
    dropped: Arc<AtomicU64>,
}

impl<T> Clone for MailSender<T> {
    fn clone(&self) -> Self {
        Self { sender: self.sender.clone(), dropped: Arc::clone(&self.dropped) }
    }
}

impl<T> MailSender<T> {
    /// Posts a message; false if the mailbox is full or its receiver is gone: the message is then dropped and counted.
    ///
    /// # Real-time
    /// Lock-free, makes no system call because the receiver never parks; at a full mailbox it spins while the receiver
    /// is in the midst of a poll. A dropped message is freed here: send plain values from a real-time tick.
    pub fn try_send(&self, message: T) -> bool {
        let sent = self.sender.try_send(message).is_ok();
        if !sent {
            // Relaxed: a count that orders nothing.
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        sent
    }
}

/// Takes messages; see [`mailbox`].
#[derive(Debug)]
pub struct MailReceiver<T> {
    receiver: Receiver<T>,
    dropped: Arc<AtomicU64>,
}

impl<T> MailReceiver<T> {
    /// The oldest message, if there is one.
    ///
    /// # Real-time
    /// Takes no lock, makes no system call, allocates nothing. Not lock-free: it spins while the sender of the oldest
    /// message is in the midst of posting it. So a real-time tick polls only senders that it cannot keep from running.
    pub fn poll(&self) -> Option<T> {
        self.receiver.try_recv().ok()
    }

    /// Messages dropped so far.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_full_mailbox_drops_and_counts() {
        let (sender, receiver) = mailbox(2);
        assert!(sender.try_send(1) && sender.clone().try_send(2));
        assert!(!sender.try_send(3));
        assert_eq!((receiver.poll(), receiver.poll(), receiver.poll()), (Some(1), Some(2), None));
        assert_eq!(receiver.dropped(), 1);
    }
}
