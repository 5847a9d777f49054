//! How a release kept time: its timing, why it was late, and what each of its actors took.

use crate::actor::GroupMode;
use crate::records::record::{Channel, Record};
use crate::time::Nanos;

/// The cause of a slip: why a period was skipped or a deadline missed.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum SlipCause {
    /// Nothing slipped.
    #[default]
    None = 0,
    /// The thread was woken too late: the operating system or another thread had the core.
    LateWake = 1,
    /// The group's own work took longer than its period allows.
    LongTick = 2,
    /// The group waited for another group or for a device that did not deliver.
    StalledPeer = 3,
    /// The overrun policy gave the period up.
    Policy = 4,
    /// The group had failed and was not yet started again.
    Fault = 5,
}

impl SlipCause {
    /// All causes, by number.
    pub const ALL: [Self; 6] =
        [Self::None, Self::LateWake, Self::LongTick, Self::StalledPeer, Self::Policy, Self::Fault];

    /// The cause with this number; unknown numbers read as [`SlipCause::None`].
    pub fn from_code(code: u8) -> Self {
        Self::ALL.get(usize::from(code)).copied().unwrap_or_default()
    }

    /// A short name for tables and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::LateWake => "late wake",
            Self::LongTick => "long tick",
            Self::StalledPeer => "stalled peer",
            Self::Policy => "policy",
            Self::Fault => "fault",
        }
    }
}

/// Counts of slips, or of missed deadlines, by cause.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlipCounts([u64; SlipCause::ALL.len()]);

impl SlipCounts {
    /// Adds `count` to what was counted for `cause`.
    pub fn add(&mut self, cause: SlipCause, count: u64) {
        self.0[cause as usize] += count;
    }

    /// The count of one cause; [`SlipCause::None`] counts those that no cause was recorded for.
    pub fn of(&self, cause: SlipCause) -> u64 {
        self.0[cause as usize]
    }

    /// Every cause with its count, those without a recorded cause last.
    pub fn iter(&self) -> impl Iterator<Item = (SlipCause, u64)> {
        SlipCause::ALL[1..].iter().chain(&SlipCause::ALL[..1]).map(|&cause| (cause, self.of(cause)))
    }

    /// The sum of all causes.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// The timing of one release. All times count from the start of the run.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickTiming {
    /// The rate group, in the order the groups were added.
    pub group: u16,
    /// The number of the release, counting skipped ones: release n is due at n periods.
    pub tick: u64,
    /// The time at which the release was due.
    pub scheduled: Nanos,
    /// The time at which the thread was running again after its wait.
    pub woke: Nanos,
    /// The time at which the first actor's tick began.
    pub start: Nanos,
    /// The time at which the last actor's work was done.
    pub end: Nanos,
    /// The deadline: the time by which the work had to be done.
    pub deadline: Nanos,
    /// Periods skipped between the release before and this one.
    pub slips: u32,
    /// The cause of the slips or, without slips, of the missed deadline.
    pub cause: SlipCause,
    /// Slips that the overrun policy gave up by itself, a part of `slips`: their cause is [`SlipCause::Policy`].
    pub given_up: u8,
    /// The mode in which the release ran.
    pub mode: GroupMode,
}

impl TickTiming {
    /// True when the work ended after the deadline.
    pub fn missed(&self) -> bool {
        self.end > self.deadline
    }

    /// The skipped periods by cause, counts of zero among them.
    pub fn slips_by_cause(&self) -> [(SlipCause, u32); 2] {
        let given_up = self.slips.min(self.given_up.into());
        [(self.cause, self.slips - given_up), (SlipCause::Policy, given_up)]
    }
}

impl From<TickTiming> for Record {
    fn from(t: TickTiming) -> Self {
        let how = (t.mode as u64) << 48 | u64::from(t.given_up) << 40;
        let slips = how | u64::from(t.slips) << 8 | t.cause as u64;
        Self {
            stamp: t.scheduled,
            channel: Channel::TICK,
            code: t.group,
            index: 0,
            words: [t.tick, t.woke.0, t.start.0, t.end.0, t.deadline.0, slips],
        }
    }
}

impl TickTiming {
    /// Reads the timing back; `None` if the record is about something else.
    pub fn from_record(record: &Record) -> Option<Self> {
        if record.channel != Channel::TICK {
            return None;
        }
        let [tick, woke, start, end, deadline, slips] = record.words;
        Some(Self {
            group: record.code,
            tick,
            scheduled: record.stamp,
            woke: Nanos(woke),
            start: Nanos(start),
            end: Nanos(end),
            deadline: Nanos(deadline),
            slips: (slips >> 8) as u32,
            cause: SlipCause::from_code(slips as u8),
            given_up: (slips >> 40) as u8,
            mode: GroupMode::from_code((slips >> 48) as u8),
        })
    }
}

/// The times that the actors of a group took of one release: the share of each of the time from [`TickTiming::start`]
/// to [`TickTiming::end`], in the order of the actors.
///
/// Recorded on threads by groups with more than one actor; the parts add up to the whole.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActorTimes {
    /// The rate group, in the order the groups were added.
    pub group: u16,
    /// The time at which the release was due.
    pub scheduled: Nanos,
    /// The number of actors, and so of times that mean something.
    pub actors: u8,
    /// The time of each actor, at most 4.29 s, the most that a record holds.
    pub spent: [Nanos; Self::MAX],
}

impl ActorTimes {
    /// The most actors that are told apart; what further ones take counts for the last.
    pub const MAX: usize = 12;

    /// The times of the actors there are.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn spent(&self) -> &[Nanos] {
        &self.spent[..usize::from(self.actors).min(Self::MAX)]
    }

    /// Reads the times back; `None` if the record is about something else.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn from_record(record: &Record) -> Option<Self> {
        let spent = |i: usize| Nanos(record.words[i / 2] >> (32 * (i % 2)) & u64::from(u32::MAX));
        (record.channel == Channel::ACTORS).then(|| Self {
            group: record.code,
            scheduled: record.stamp,
            actors: u8::try_from(record.index).unwrap_or(u8::MAX),
            spent: std::array::from_fn(spent),
        })
    }
}

impl From<ActorTimes> for Record {
    fn from(t: ActorTimes) -> Self {
        let half = |i: usize| u64::from(u32::try_from(t.spent[i].0).unwrap_or(u32::MAX));
        Self {
            stamp: t.scheduled,
            channel: Channel::ACTORS,
            code: t.group,
            index: t.actors.into(),
            words: std::array::from_fn(|word| half(2 * word) | half(2 * word + 1) << 32),
        }
    }
}

/// A release as it ran.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordedRelease {
    pub(crate) tick: u64,
    pub(crate) scheduled: Nanos,
    pub(crate) slips: u32,
    pub(crate) given_up: u8,
    pub(crate) cause: SlipCause,
    pub(crate) mode: GroupMode,
}

impl From<&TickTiming> for RecordedRelease {
    fn from(timing: &TickTiming) -> Self {
        Self {
            tick: timing.tick,
            scheduled: timing.scheduled,
            slips: timing.slips,
            given_up: timing.given_up,
            cause: timing.cause,
            mode: timing.mode,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::record::Event;

    #[test]
    fn timing_survives_the_trip_through_a_record() {
        let timing = TickTiming {
            group: 3,
            tick: u64::MAX,
            scheduled: Nanos(1),
            woke: Nanos(2),
            start: Nanos(3),
            end: Nanos(4),
            deadline: Nanos(5),
            slips: u32::MAX,
            cause: SlipCause::Policy,
            given_up: u8::MAX,
            mode: GroupMode::Stopping,
        };
        for timing in [timing, TickTiming { given_up: 0, ..timing }, TickTiming { mode: GroupMode::Normal, ..timing }] {
            assert_eq!(TickTiming::from_record(&timing.into()), Some(timing));
            assert_eq!(Event::from_record(&timing.into()), None);
        }
    }

    #[test]
    fn slips_that_the_policy_gave_up_are_told_from_the_others() {
        let timing = TickTiming { slips: 4, cause: SlipCause::LongTick, given_up: 1, ..TickTiming::default() };
        assert_eq!(timing.slips_by_cause(), [(SlipCause::LongTick, 3), (SlipCause::Policy, 1)]);
    }

    #[test]
    fn the_times_of_actors_survive_the_trip_through_a_record() {
        let spent = std::array::from_fn(|i| Nanos([0, 1, u64::from(u32::MAX), 7][i % 4]));
        let times = ActorTimes { group: 2, scheduled: Nanos(5), actors: 12, spent };
        assert_eq!(ActorTimes::from_record(&times.into()), Some(times));
        let long = ActorTimes { spent: [Nanos(u64::MAX); 12], actors: 1, ..times };
        assert_eq!(ActorTimes::from_record(&long.into()).unwrap().spent(), [Nanos(u32::MAX.into())]);
        assert_eq!(TickTiming::from_record(&times.into()), None);
    }
}
