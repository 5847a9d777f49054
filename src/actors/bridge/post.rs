//! What both bridges have in common: numbered messages out, believed ones in.

use crate::link::{Header, Lane, Message, Refused, Transport};
use crate::runtime::Nanos;

/// The messages that have come, by number: none is taken twice, whoever sends it again.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// The lowest and the highest, once there is one.
    span: Option<[u64; 2]>,
    /// A bit for each of the last 128: the lowest is that of the highest.
    last: u128,
    unique: u64,
}

impl Seen {
    /// True if `number` has come before, or is so old that nobody knows.
    fn has(&self, number: u64) -> bool {
        let Some([_, highest]) = self.span.filter(|[_, highest]| number <= *highest) else { return false };
        let bit = Self::bit(highest - number);
        bit == 0 || self.last & bit != 0
    }

    /// True if `number` has not come before, and is not so old that nobody knows.
    fn accept(&mut self, number: u64) -> bool {
        if self.has(number) {
            return false;
        }
        let [first, highest] = self.span.unwrap_or([number; 2]);
        if number > highest {
            let newer = u32::try_from(number - highest).unwrap_or(u32::MAX);
            self.last = self.last.checked_shl(newer).unwrap_or(0);
        }
        let span = [first.min(number), highest.max(number)];
        self.last |= Self::bit(span[1] - number);
        self.span = Some(span);
        self.unique += 1;
        true
    }

    /// That of a number so much below the highest; none if it is too far below.
    fn bit(below: u64) -> u128 {
        u32::try_from(below).ok().and_then(|below| 1_u128.checked_shl(below)).unwrap_or(0)
    }

    fn missing(&self) -> u64 {
        self.span.map_or(0, |[first, highest]| (highest - first).saturating_add(1).saturating_sub(self.unique))
    }
}

/// A transport, and the epoch that messages belong to.
#[derive(Debug)]
pub(super) struct Post {
    transport: Box<dyn Transport>,
    pub(super) epoch: u64,
    /// Of each lane, so that none is too old for what has overtaken it in another one.
    numbers: [u64; Lane::COUNT],
    seen: [Seen; Lane::COUNT],
    /// What was not believed, by how often.
    refused: u64,
    /// Working memory.
    bytes: Vec<u8>,
}

impl Post {
    pub(super) fn new(transport: Box<dyn Transport>) -> Self {
        let (numbers, seen) = Default::default();
        Self { transport, epoch: super::FIRST_EPOCH, numbers, seen, refused: 0, bytes: Vec::new() }
    }

    /// Sends what `write` makes of a header and a buffer.
    pub(super) fn send_with(&mut self, lane: Lane, now: Nanos, write: impl FnOnce(Header, &mut Vec<u8>)) {
        let number = &mut self.numbers[lane as usize];
        *number += 1;
        write(Header { epoch: self.epoch, number: *number, sent: now }, &mut self.bytes);
        self.transport.send(lane, &self.bytes, now);
    }

    pub(super) fn send(&mut self, lane: Lane, now: Nanos, message: &Message) {
        self.send_with(lane, now, |header, bytes| message.write(header, bytes));
    }

    /// The next message that has come and belongs to this epoch or, if `follows`, to a newer one, which is this epoch from now on. What is
    /// no message is counted and told once; what came before is dropped.
    pub(super) fn receive(&mut self, now: Nanos, follows: bool) -> Option<(Header, Message)> {
        while self.transport.receive(now, &mut self.bytes) {
            let read = match Message::glance(&self.bytes) {
                // A model is not read again for having come by another line too.
                Ok((lane, header)) if self.has(lane, header) => continue,
                Ok((lane, _)) => Message::read(&self.bytes).map(|(header, message)| (lane, header, message)),
                Err(refused) => Err(refused),
            };
            let (lane, header, message) = match read {
                Ok(read) => read,
                Err(refused) => {
                    self.refuse(refused);
                    continue;
                }
            };
            if follows && header.epoch > self.epoch {
                self.begin_epoch(header.epoch);
            }
            if header.epoch == self.epoch && self.seen[lane as usize].accept(header.number) {
                return Some((header, message));
            }
        }
        None
    }

    /// True if it has come before, or belongs to what is over.
    fn has(&self, lane: Lane, header: Header) -> bool {
        header.epoch < self.epoch || (header.epoch == self.epoch && self.seen[lane as usize].has(header.number))
    }

    /// From now on messages belong to `epoch`.
    pub(super) fn begin_epoch(&mut self, epoch: u64) {
        (self.epoch, self.seen) = (epoch, Default::default());
    }

    /// How many messages were sent; of this epoch, how many came and how many have not.
    pub(super) fn counts(&self) -> [u64; 3] {
        let of = |count: fn(&Seen) -> u64| self.seen.iter().map(count).sum();
        [self.numbers.iter().sum(), of(|seen| seen.unique), of(Seen::missing)]
    }

    fn refuse(&mut self, refused: Refused) {
        self.refused += 1;
        if self.refused == 1 {
            tracing::warn!("over the link came {refused}; more like it are counted and not told");
        }
    }

    /// Counts the peers.
    pub(super) fn peer(&mut self) -> u64 {
        self.transport.peer()
    }

    /// Everything that was sent until now has arrived.
    pub(super) fn begin(&mut self) {
        self.transport.begin();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Conditions, VirtualLink};
    use crate::model::body::Stiffness;

    #[test]
    fn no_number_is_accepted_twice_and_what_has_not_come_is_counted() {
        let mut seen = Seen::default();
        let accepted: Vec<bool> = [10, 12, 11, 12, 10, 9, 300, 172, 173, 173].map(|n| seen.accept(n)).into();
        assert_eq!(accepted, [true, true, true, false, false, true, true, false, true, false]);
        assert_eq!((seen.unique, seen.missing()), (6, 300 - 9 + 1 - 6));
        assert!(seen.accept(u64::MAX) && !seen.accept(u64::MAX));
    }

    #[test]
    fn what_is_no_message_or_of_an_older_epoch_or_came_before_is_dropped() {
        let [here, mut stranger] = VirtualLink::ends(Conditions::default());
        let mut post = Post::new(Box::new(here));
        let mut send = |epoch, number| {
            let mut bytes = Vec::new();
            Message::Ping.write(Header { epoch, number, sent: Nanos::ZERO }, &mut bytes);
            stranger.send(Lane::Urgent, &bytes, Nanos::ZERO);
            stranger.send(Lane::Urgent, b"GET / HTTP/1.1", Nanos::ZERO);
        };
        [(1, 1), (1, 1), (0, 2), (3, 7), (1, 3), (3, 7)].into_iter().for_each(|(epoch, number)| send(epoch, number));
        let came = std::iter::from_fn(|| post.receive(Nanos::ZERO, true));
        assert_eq!(came.map(|(header, _)| (header.epoch, header.number)).collect::<Vec<_>>(), [(1, 1), (3, 7)]);
        assert_eq!((post.epoch, post.refused), (3, 6));
        // A repeat is dropped by its beginning: what follows is not even looked at.
        let mut repeat = Vec::new();
        Message::Ping.write(Header { epoch: 3, number: 7, sent: Nanos::ZERO }, &mut repeat);
        stranger.send(Lane::Urgent, &[&repeat[..], &[0]].concat(), Nanos::ZERO);
        assert!(post.receive(Nanos::ZERO, true).is_none());
        assert_eq!(post.refused, 6);
    }

    #[test]
    fn what_is_large_is_taken_however_many_small_ones_overtake_it() {
        let [here, mut there] = VirtualLink::ends(Conditions::default());
        let mut post = Post::new(Box::new(here));
        let send = |there: &mut dyn Transport, message: &Message, number| {
            let mut bytes = Vec::new();
            message.write(Header { epoch: 1, number, sent: Nanos::ZERO }, &mut bytes);
            there.send(Lane::Urgent, &bytes, Nanos::ZERO);
        };
        (2..=1_001).for_each(|number| send(&mut there, &Message::Ping, number));
        let surface = Message::Surface { time: Nanos::ZERO, stiffness: Stiffness::default(), places: vec![[0.0; 3]] };
        send(&mut there, &surface, 1);
        send(&mut there, &Message::Ping, 1);
        let came: Vec<_> = std::iter::from_fn(|| post.receive(Nanos::ZERO, true)).collect();
        assert_eq!(came.len(), 1_001, "the last of the small ones is too old");
        assert!(matches!(came[1_000].1, Message::Surface { .. }));
        assert_eq!(post.counts(), [0, 1_001, 0]);
    }
}
