//! Which commands have no reply yet, whether replies can be relied on, and how much of a force may be exerted.
//!
//! A pure function of what happened when. A reply that is missing for more than two ticks makes the force zero at once. It
//! comes back when [`RELIABLE`] replies in a row were in time, and then slowly, over [`RAMP`].

use std::time::{Duration, Instant};

/// Commands without a reply at most, one more per missed tick.
const MOST_WAITING: usize = 4;

/// More for the zeros that say that it is over: of a missing reply, of an expiry, of the watch.
const SLOTS: usize = MOST_WAITING + 3;

/// Ticks that a reply may take. Half a tick more than two, so that a look which is itself a little early or late does not decide.
const LATE_TICKS: f64 = 2.5;

/// Replies in time, in a row, after which a service is relied on.
const RELIABLE: u32 = 20;

/// From nothing to the whole force.
const RAMP: Duration = Duration::from_millis(100);

/// A command without a reply for this long means that the connection is of no use.
const SILENT: Duration = Duration::from_millis(250);

/// So many late replies without a row of good ones mean the same.
const TOO_MANY_LATE: u32 = 50;

/// The state of the exchange of commands and replies over one connection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pulse {
    late: Duration,
    /// When the commands without a reply were sent, oldest first.
    sent: [Option<Instant>; SLOTS],
    in_time: u32,
    late_replies: u32,
    /// A reply was missing for too long, and that has not been made up for.
    is_stale: bool,
    /// The reply to the oldest command is missing for too long.
    is_oldest_late: bool,
    /// When the force was asked for last, while it is allowed.
    ramped: Option<Instant>,
    gain: f64,
    round_trip: Option<Duration>,
}

impl Pulse {
    pub(crate) fn new(period: Duration) -> Self {
        Self { late: period.mul_f64(LATE_TICKS), ..Self::default() }
    }

    /// Commands without a reply.
    pub(crate) fn waiting(&self) -> usize {
        self.sent.iter().flatten().count()
    }

    /// There is room for another command: one per tick, and none on top of those that a late service still has to answer.
    pub(crate) fn may_send(&self) -> bool {
        if self.is_stale { self.waiting() == 0 } else { self.waiting() < MOST_WAITING }
    }

    /// A command was sent.
    pub(crate) fn sent(&mut self, now: Instant) {
        if let Some(free) = self.sent.iter_mut().find(|sent| sent.is_none()) {
            *free = Some(now);
        }
    }

    /// A reply has come; it answers the oldest command.
    pub(crate) fn replied(&mut self, now: Instant) {
        let Some(sent) = self.sent[0].take() else { return };
        self.sent.rotate_left(1);
        self.round_trip = Some(now.saturating_duration_since(sent));
        // Late is what a look has missed: a late look at a reply that came in time is no fault of the service.
        if std::mem::take(&mut self.is_oldest_late) {
            self.in_time = 0;
            self.late_replies += 1;
            return;
        }
        self.in_time = self.in_time.saturating_add(1);
        if self.in_time >= RELIABLE {
            (self.is_stale, self.late_replies) = (false, 0);
        }
    }

    /// True when the reply to the oldest command has just become too late: the force has to go now.
    pub(crate) fn turns_stale(&mut self, now: Instant) -> bool {
        let is_late = self.sent[0].is_some_and(|sent| now.saturating_duration_since(sent) > self.late);
        if is_late {
            self.in_time = 0;
        }
        self.is_oldest_late = is_late;
        is_late && !std::mem::replace(&mut self.is_stale, true)
    }

    /// The reply is missing, or late ones have not been made up for.
    pub(crate) fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// The connection is of no use any more.
    pub(crate) fn is_hopeless(&self, now: Instant) -> bool {
        let is_silent = self.sent[0].is_some_and(|sent| now.saturating_duration_since(sent) > SILENT);
        is_silent || self.late_replies >= TOO_MANY_LATE
    }

    /// The share of the force that may be exerted now; `is_allowed` says whether anything else speaks against it.
    pub(crate) fn gain(&mut self, is_allowed: bool, now: Instant) -> f64 {
        if !is_allowed || self.is_stale || self.in_time < RELIABLE {
            (self.gain, self.ramped) = (0.0, None);
            return 0.0;
        }
        // A long time without a command moves the ramp no further than two late ones would.
        let passed = self.ramped.map_or(Duration::ZERO, |last| now.saturating_duration_since(last).min(self.late));
        self.ramped = Some(now);
        self.gain = (self.gain + passed.as_secs_f64() / RAMP.as_secs_f64()).min(1.0);
        self.gain
    }

    /// From the last command that was answered to the look that found its reply.
    pub(crate) fn round_trip(&self) -> Option<Duration> {
        self.round_trip
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// A pulse after `ticks` ticks with replies in time, and the time of the next tick.
    fn healthy(ticks: u32) -> (Pulse, Instant) {
        let (mut pulse, begun) = (Pulse::new(MS), Instant::now());
        for tick in 0..ticks {
            let now = begun + MS * tick;
            pulse.sent(now);
            assert!(!pulse.turns_stale(now + MS / 2));
            pulse.replied(now + MS / 2);
            pulse.gain(true, now + MS / 2);
        }
        (pulse, begun + MS * ticks)
    }

    #[test]
    fn the_force_comes_after_twenty_replies_and_then_slowly() {
        let (mut pulse, now) = healthy(19);
        assert_eq!(pulse.gain(true, now), 0.0);
        let (mut pulse, now) = healthy(70);
        let gain = pulse.gain(true, now);
        assert!((0.45..0.55).contains(&gain), "{gain}");
        let (mut pulse, now) = healthy(200);
        assert_eq!(pulse.gain(true, now), 1.0);
        // Check that whatever else stops the force stops it at once, and that it comes back as slowly
        assert_eq!(pulse.gain(false, now), 0.0);
        assert_eq!(pulse.gain(true, now + MS), 0.0);
        assert!(pulse.gain(true, now + 2 * MS) <= 0.011);
    }

    #[test]
    fn a_reply_that_is_missing_for_more_than_two_ticks_makes_the_force_zero() {
        let (mut pulse, now) = healthy(200);
        for tick in 0..3 {
            assert!(!pulse.turns_stale(now + MS * tick), "{tick}");
            assert_eq!(pulse.gain(true, now + MS * tick), 1.0, "{tick}");
            pulse.sent(now + MS * tick);
        }
        assert!(pulse.turns_stale(now + MS * 3));
        assert_eq!((pulse.gain(true, now + MS * 3), pulse.waiting()), (0.0, 3));
        // Check that it says so once, sends nothing on top and gives up in the end
        assert!(!pulse.turns_stale(now + MS * 4) && !pulse.may_send());
        assert!(!pulse.is_hopeless(now + MS * 250) && pulse.is_hopeless(now + MS * 251));
    }

    #[test]
    fn a_service_that_is_always_late_is_given_up_and_one_that_recovers_is_relied_on_again() {
        let (mut pulse, mut now) = healthy(200);
        for _ in 0..50 {
            assert!(!pulse.is_hopeless(now));
            pulse.sent(now);
            now += 5 * MS;
            pulse.turns_stale(now);
            pulse.replied(now);
            assert_eq!(pulse.gain(true, now), 0.0);
        }
        assert!(pulse.is_hopeless(now));

        let (mut pulse, mut now) = healthy(200);
        pulse.sent(now);
        assert!(pulse.turns_stale(now + 5 * MS));
        pulse.replied(now + 5 * MS);
        for reply in 0..25 {
            assert_eq!(pulse.gain(true, now) > 0.0, reply > 20, "{reply}");
            pulse.sent(now);
            pulse.replied(now + MS / 10);
            now += MS;
        }
        assert!(!pulse.is_stale());
    }

    #[test]
    fn a_look_that_comes_late_at_replies_that_were_there_changes_nothing() {
        let (mut pulse, now) = healthy(200);
        pulse.sent(now);
        // The thread lost its core for 50 ms; the reply is found by its first look.
        pulse.replied(now + 50 * MS);
        assert!(!pulse.turns_stale(now + 50 * MS));
        assert_eq!(pulse.gain(true, now + 50 * MS), 1.0);
    }
}
