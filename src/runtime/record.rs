//! The 64-byte records that leave real-time threads: no pointers, no strings, nothing to format.

use super::actor::Mode;
use crate::time::Nanos;

/// What a [`Record`] is about. The runtime owns numbers below 16; programs number their own from 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Channel(pub u16);

impl Channel {
    /// One release of a rate group: see [`TickTiming`].
    pub const TICK: Self = Self(0);
    /// Something that happened once, `code` says what: see [`Event`].
    pub const EVENT: Self = Self(1);
    /// What a release saw through a port: see [`PortUse`](super::PortUse).
    pub const PORT: Self = Self(2);
    /// What each actor of a group took of one release: see [`ActorTimes`].
    pub const ACTORS: Self = Self(3);
    /// The first number that programs may use.
    pub const FIRST_USER: Self = Self(16);
}

/// One record: a stamp, what it is about, and six words whose meaning the channel defines.
///
/// # Real-time
/// A plain value: to make one, from any of the records here too, and to read it back is wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(64))]
pub struct Record {
    /// The scheduled time of the release that made it.
    pub stamp: Nanos,
    /// What the record is about.
    pub channel: Channel,
    /// A small number with a meaning of the channel's own (a mode, a cause, a group).
    pub code: u16,
    /// A larger number with a meaning of the channel's own (a node, a triangle, a version).
    pub index: u32,
    /// The payload: integers, or doubles by their bits ([`Record::with_floats`]).
    pub words: [u64; 6],
}

const _: () = assert!(size_of::<Record>() == 64);

impl Record {
    /// A record whose payload is six doubles, kept bit for bit.
    pub fn with_floats(stamp: Nanos, channel: Channel, code: u16, index: u32, floats: [f64; 6]) -> Self {
        Self { stamp, channel, code, index, words: floats.map(f64::to_bits) }
    }

    /// The payload as doubles.
    pub fn floats(&self) -> [f64; 6] {
        self.words.map(f64::from_bits)
    }
}

/// Why a period was skipped or a deadline missed.
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
    /// All of them, by number.
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
    /// When it was due.
    pub scheduled: Nanos,
    /// When the thread was running again after its wait.
    pub woke: Nanos,
    /// When the first actor's tick began.
    pub start: Nanos,
    /// When the last actor's work was done.
    pub end: Nanos,
    /// When it had to be done.
    pub deadline: Nanos,
    /// Periods skipped between the release before and this one.
    pub slips: u32,
    /// Why they were skipped or, without slips, why the deadline was missed.
    pub cause: SlipCause,
    /// Of the slips, those that the overrun policy gave up by itself: their cause is [`SlipCause::Policy`].
    pub given_up: u8,
    /// How much the release did.
    pub mode: Mode,
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
            mode: Mode::from_code((slips >> 48) as u8),
        })
    }
}

/// What each actor of a group took of one release: its share of the time from [`TickTiming::start`] to
/// [`TickTiming::end`], in the order of the actors.
///
/// Recorded on threads by groups with more than one actor; the parts add up to the whole.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActorTimes {
    /// The rate group, in the order the groups were added.
    pub group: u16,
    /// When the release was due.
    pub scheduled: Nanos,
    /// How many of the times are actors'.
    pub actors: u8,
    /// Each at most 4.29 s, the most that a record holds.
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

/// Something that happened once and that a reader of the log wants to know.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub stamp: Nanos,
    /// The rate group it happened in.
    pub group: u16,
    /// What: a number below 256 is the runtime's ([`Event::PANIC`]), others are the program's.
    pub code: u32,
    /// A number that belongs to it.
    pub detail: u64,
}

impl Event {
    /// An actor panicked; `detail` is its place in the group.
    pub const PANIC: u32 = 1;
    /// An actor reported a fault; `detail` is the code that it gave.
    pub const FAULT: u32 = 2;
    /// The overrun policy stopped the group; `detail` is the number of periods missed.
    pub const STOPPED: u32 = 3;
    /// The code of a group's degraded releases changed; `detail` is the code, [`Event::RECOVERED`] when there is none.
    pub const DEGRADED: u32 = 4;
    /// The overrun policy changed the group's [`Mode`]; `detail` is the number of periods skipped,
    /// [`Event::RECOVERED`] when the mode is normal again.
    pub const MODE: u32 = 5;
    /// The watchdog of a device-paced group took over; `detail` is the number of the release that was due,
    /// [`Event::RECOVERED`] when the device delivers again.
    pub const WATCHDOG: u32 = 6;
    /// A group that had failed was started again; `detail` counts its restarts.
    pub const RESTARTED: u32 = 7;
    /// A thread did not return from the release due at `stamp` and was left behind; `detail` is the time that it was
    /// given, in nanoseconds.
    pub const ABANDONED: u32 = 8;
    /// The group began to bring what it drives to rest; `detail` is the number of periods that it has.
    pub const WINDING_DOWN: u32 = 9;
    /// The detail of events about a state when it is normal again.
    pub const RECOVERED: u64 = u64::MAX;
}

impl From<Event> for Record {
    fn from(e: Event) -> Self {
        Self { stamp: e.stamp, channel: Channel::EVENT, code: e.group, index: e.code, words: [e.detail, 0, 0, 0, 0, 0] }
    }
}

impl Event {
    /// Reads the event back; `None` if the record is about something else.
    pub fn from_record(record: &Record) -> Option<Self> {
        (record.channel == Channel::EVENT).then_some(Self {
            stamp: record.stamp,
            group: record.code,
            code: record.index,
            detail: record.words[0],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            mode: Mode::Stopping,
        };
        for timing in [timing, TickTiming { given_up: 0, ..timing }, TickTiming { mode: Mode::Normal, ..timing }] {
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
