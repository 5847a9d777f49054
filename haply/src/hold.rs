//! The force that is held, and until when, on the client's own clock.

use std::time::{Duration, Instant};

use palpate::devices::ForceCommand;
use palpate::runtime::Nanos;

/// One command between two writes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    command: ForceCommand,
    /// When it ends, as reckoned when it came: a clock of reads that stands still does not prolong it.
    end: Option<Instant>,
    /// The scheduled time of the last read, and when that was: between reads time goes on all the same.
    read: (Nanos, Instant),
}

impl Hold {
    pub(crate) fn new(now: Instant) -> Self {
        Self { command: ForceCommand::ZERO, end: None, read: (Nanos::ZERO, now) }
    }

    /// A read for `time` began at `now`.
    pub(crate) fn saw(&mut self, time: Nanos, now: Instant) {
        self.read = (time, now);
    }

    pub(crate) fn set(&mut self, command: ForceCommand) {
        let (time, at) = self.read;
        self.end = at.checked_add(Duration::from_nanos(command.expires.saturating_sub(time).0));
        self.command = command;
    }

    /// The force now (N): zero from the expiry on.
    pub(crate) fn force(&mut self, now: Instant) -> [f64; 3] {
        if self.command.expires <= self.read.0 || self.end.is_some_and(|end| now >= end) {
            self.command = ForceCommand::ZERO;
        }
        self.command.force.into()
    }

    /// When the force ends; `None` if it has no end.
    pub(crate) fn ends(&self) -> Option<Instant> {
        self.end
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::model::Vec3;

    const MS: Nanos = Nanos(1_000_000);

    fn held(expires: Nanos) -> (Hold, Instant) {
        let now = Instant::now();
        let mut hold = Hold::new(now);
        hold.saw(MS, now);
        hold.set(ForceCommand::until(Vec3::x(), expires));
        (hold, now)
    }

    #[test]
    fn a_force_ends_by_either_clock_and_does_not_come_back() {
        // Nobody reads on: the client's own clock
        let (mut hold, now) = held(Nanos(3 * MS.0));
        assert_eq!(hold.force(now + Duration::from_micros(1999)), [1.0, 0.0, 0.0]);
        assert_eq!(hold.force(now + Duration::from_millis(2)), [0.0; 3]);
        hold.saw(MS, now);
        assert_eq!(hold.force(now + Duration::from_millis(2)), [0.0; 3]);
        // Reads whose time stands still
        let (mut hold, now) = held(Nanos(3 * MS.0));
        hold.saw(MS, now + Duration::from_millis(1));
        assert_eq!(hold.force(now + Duration::from_millis(2)), [0.0; 3]);
        // Reads that go faster than the clock
        let (mut hold, now) = held(Nanos(3 * MS.0));
        hold.saw(Nanos(3 * MS.0 - 1), now);
        assert_eq!(hold.force(now), [1.0, 0.0, 0.0]);
        hold.saw(Nanos(3 * MS.0), now);
        assert_eq!(hold.force(now), [0.0; 3]);
    }

    #[test]
    fn a_force_that_has_expired_never_begins_and_one_without_an_end_stays() {
        let (mut hold, now) = held(MS);
        assert_eq!(hold.force(now), [0.0; 3]);
        let (mut hold, now) = held(Nanos(u64::MAX));
        assert_eq!(hold.force(now + Duration::from_secs(3600)), [1.0, 0.0, 0.0]);
    }
}
