//! What has come over the link, until a bridge takes it.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpate::link::{LARGEST, Lane, Message};

/// Messages that wait at most, and their bytes: of a flood, the newest are lost.
const MOST_MESSAGES: usize = 4096;
const MOST_BYTES: usize = 3 * LARGEST;

/// Messages that have come and look like some: garbage is dropped before it is kept.
#[derive(Debug, Default)]
pub(crate) struct Inbox(Mutex<Held>);

#[derive(Debug, Default)]
struct Held {
    messages: VecDeque<Vec<u8>>,
    bytes: usize,
    heard: Option<Instant>,
    /// Local models that have come.
    models: usize,
    /// The bases have come that the session begins with.
    is_ready: bool,
    refused: u64,
}

impl Inbox {
    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps `message`, if it can be one.
    pub(crate) fn put(&self, message: &[u8]) {
        let glance = Message::glance(message);
        let mut held = self.held();
        let lane = match glance {
            Ok((lane, _)) => lane,
            Err(refused) => {
                held.refused += 1;
                if held.refused == 1 {
                    tracing::warn!("over the link came {refused}; more like it are counted and not told");
                }
                return;
            }
        };
        held.heard = Some(Instant::now());
        held.is_ready |= Message::is_ready(message);
        if held.messages.len() < MOST_MESSAGES && held.bytes + message.len() <= MOST_BYTES {
            held.models += usize::from(lane == Lane::Models);
            held.bytes += message.len();
            held.messages.push_back(message.to_vec());
        }
    }

    /// Puts the next message in place of `message`; false if there is none.
    pub(crate) fn take(&self, message: &mut Vec<u8>) -> bool {
        let mut held = self.held();
        let Some(next) = held.messages.pop_front() else { return false };
        held.bytes -= next.len();
        *message = next;
        true
    }

    /// Local models that have come.
    pub(crate) fn models(&self) -> usize {
        self.held().models
    }

    /// True if the bases have come that the session begins with.
    pub(crate) fn is_ready(&self) -> bool {
        self.held().is_ready
    }

    /// How long ago the last message came; `None` before the first.
    pub(crate) fn silent_for(&self) -> Option<Duration> {
        self.held().heard.map(|heard| heard.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use palpate::link::Header;

    use super::*;

    #[test]
    fn garbage_is_not_kept_and_a_flood_is_bounded() {
        let inbox = Inbox::default();
        (0..10_000_u32).for_each(|n| inbox.put(&n.to_le_bytes().repeat(n as usize % 50)));
        assert!(!inbox.take(&mut Vec::new()) && inbox.silent_for().is_none());
        let mut ping = Vec::new();
        Message::Ping.write(Header::default(), &mut ping);
        (0..2 * MOST_MESSAGES).for_each(|_| inbox.put(&ping));
        let mut taken = 0;
        while inbox.take(&mut ping) {
            taken += 1;
        }
        assert_eq!((taken, inbox.models(), inbox.held().bytes), (MOST_MESSAGES, 0, 0));
    }
}
