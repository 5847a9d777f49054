//! What is to go over the link, until the network takes it: a thread for each lane, so that none waits for another.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use palpate::link::Lane;
use palpate::{Error, ErrorKind};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

/// Stack of a thread that sends. The usual 2 MB would be locked in memory with the rest of a haptic process, for each line and lane.
const STACK: usize = 512 << 10;

/// Messages of a lane that wait at most: of more, the oldest is dropped.
const MOST_WAITING: usize = 256;

/// How the lanes go, the most urgent first, and whether by all lines or once.
///
/// A blocking message can stall a dropping one of its own priority (zenoh issue 2584), so each lane has a priority and a thread of its own.
/// Ticks that cannot go at once are worth nothing a moment later. Everything else goes at the pace of the line; dropped half way, as
/// zenoh does with what takes longer than 50 ms, it would never arrive over a slow one.
const LANES: [(&str, Priority, CongestionControl); Lane::COUNT] = [
    ("once/urgent", Priority::RealTime, CongestionControl::Drop),
    ("all/model", Priority::InteractiveHigh, CongestionControl::Block),
    ("once/bulk", Priority::DataLow, CongestionControl::Block),
    ("once/pictures", Priority::Background, CongestionControl::Block),
];

/// The sending half of a line; its threads end when it is dropped.
#[derive(Debug)]
pub(crate) struct Outbox {
    lanes: [Arc<Queue>; Lane::COUNT],
}

#[derive(Debug, Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    messages: VecDeque<ZBytes>,
    is_over: bool,
}

impl Outbox {
    /// Sends over `session`, under names that begin with `prefix`.
    ///
    /// # Errors
    /// If zenoh or the system refuses.
    pub(crate) fn new(session: &zenoh::Session, prefix: &str) -> Result<Self, Error> {
        let outbox = Self { lanes: Default::default() };
        for (queue, (name, priority, congestion)) in outbox.lanes.iter().zip(LANES) {
            let publisher = session.declare_publisher(format!("{prefix}/{name}"));
            let publisher = publisher.priority(priority).congestion_control(congestion).express(true).wait();
            let publisher = publisher.map_err(|error| Error::new(ErrorKind::Runtime, format!("zenoh: {error}")))?;
            let queue = Arc::clone(queue);
            let thread = std::thread::Builder::new().name(format!("link {name}")).stack_size(STACK);
            let started = thread.spawn(move || queue.send(&publisher));
            started.map_err(|error| Error::new(ErrorKind::Runtime, format!("no thread for the link: {error}")))?;
        }
        Ok(outbox)
    }

    /// Hands over a message; never waits for the network.
    pub(crate) fn put(&self, lane: Lane, message: ZBytes) {
        self.lanes[lane as usize].put(lane, message);
    }
}

impl Drop for Outbox {
    fn drop(&mut self) {
        for queue in &self.lanes {
            queue.waiting().is_over = true;
            queue.changed.notify_all();
        }
    }
}

impl Queue {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, lane: Lane, message: ZBytes) {
        let mut waiting = self.waiting();
        if lane.keeps_the_newest() {
            waiting.messages.clear();
        }
        if waiting.messages.len() >= MOST_WAITING {
            waiting.messages.pop_front();
        }
        waiting.messages.push_back(message);
        drop(waiting);
        self.changed.notify_one();
    }

    /// Waits for the next message; `None` when it is over.
    fn next(&self) -> Option<ZBytes> {
        let mut waiting = self.waiting();
        loop {
            if waiting.is_over {
                return None;
            }
            if let Some(message) = waiting.messages.pop_front() {
                return Some(message);
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn send(&self, publisher: &Publisher<'_>) {
        while let Some(message) = self.next() {
            // A line that is down loses what is sent; whoever keeps it knows.
            let _ = publisher.put(message).wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_waiting_models_only_the_newest_go_and_of_ticks_the_newest_ones() {
        let queue = Queue::default();
        (0..5_u8).for_each(|n| queue.put(Lane::Models, vec![n].into()));
        assert_eq!(queue.next(), Some(vec![4].into()));
        (0..MOST_WAITING + 3).for_each(|n| queue.put(Lane::Urgent, n.to_le_bytes().into()));
        assert_eq!(queue.next(), Some(3_usize.to_le_bytes().into()));
        queue.waiting().is_over = true;
        assert_eq!(queue.next(), None);
    }
}
