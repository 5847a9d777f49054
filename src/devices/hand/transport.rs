//! The way of a command to the motors: a delay with jitter, in order.

use std::collections::VecDeque;

use crate::devices::ForceCommand;
use crate::random::uniform;
use crate::runtime::Nanos;

/// Commands on their way at most: a delay of 100 ms at 10 kHz.
const ROOM: usize = 1024;

/// Commands on their way.
#[derive(Clone, Debug)]
pub(super) struct Transport {
    delay: Nanos,
    jitter_s: f64,
    seed: u64,
    /// With the time of arrival; those never fall.
    pending: VecDeque<(Nanos, ForceCommand)>,
}

impl Transport {
    pub(super) fn new(delay: Nanos, jitter_s: f64, seed: u64) -> Self {
        Self { delay, jitter_s, seed, pending: VecDeque::with_capacity(ROOM) }
    }

    /// Sends `command` at `now`.
    pub(super) fn send(&mut self, now: Nanos, command: ForceCommand) {
        let jitter = Nanos::from_secs_f64(self.jitter_s * uniform(self.seed, now.0));
        let earliest = self.pending.back().map_or(Nanos::ZERO, |(arrival, _)| *arrival);
        let arrival = (now + self.delay + jitter).max(earliest);
        if self.pending.len() == ROOM {
            // The newest counts, and nothing is allocated.
            self.pending.pop_back();
        }
        self.pending.push_back((arrival, command));
    }

    /// When the next command arrives.
    pub(super) fn next_arrival(&self) -> Option<Nanos> {
        self.pending.front().map(|(arrival, _)| *arrival)
    }

    /// The newest command that has arrived by `time`, if any has come since the last call.
    pub(super) fn arrived(&mut self, time: Nanos) -> Option<ForceCommand> {
        let mut newest = None;
        while let Some((_, command)) = self.pending.pop_front_if(|(arrival, _)| *arrival <= time) {
            newest = Some(command);
        }
        newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Vec3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn commands_arrive_in_order_within_delay_and_jitter(
            delay_ms in 0..20_u64, jitter_ms in 0..20_u64, seed: u64, gaps in prop::collection::vec(0..5_u64, 1..100),
        ) {
            const MS: u64 = 1_000_000;
            let mut transport = Transport::new(Nanos(delay_ms * MS), jitter_ms as f64 * 1e-3, seed);
            let mut sent = Nanos::ZERO;
            let mut last = Nanos::ZERO;
            for gap in gaps {
                sent = sent + Nanos(gap * MS);
                transport.send(sent, ForceCommand::ZERO);
                let (arrival, _) = transport.pending.back().copied().unwrap();
                prop_assert!(arrival >= last && arrival >= sent + Nanos(delay_ms * MS));
                prop_assert!(arrival <= sent + Nanos((delay_ms + jitter_ms) * MS));
                last = arrival;
            }
        }
    }

    // Check that a queue that is full keeps its order and its newest command, in the memory that it has.
    #[test]
    fn a_full_transport_keeps_the_newest_command() {
        let mut transport = Transport::new(Nanos(10), 0.0, 0);
        let capacity = transport.pending.capacity();
        for n in 0..3 * ROOM as u64 {
            transport.send(Nanos(n), ForceCommand::until(Vec3::repeat(n as f64), Nanos(u64::MAX)));
        }
        assert_eq!(transport.pending.capacity(), capacity);
        assert_eq!(transport.arrived(Nanos(u64::MAX)).unwrap().force.x, 3.0 * ROOM as f64 - 1.0);
        assert_eq!(transport.next_arrival(), None);
    }
}
