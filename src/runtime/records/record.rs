//! The 64-byte records that leave real-time threads: no pointers, no strings, nothing to format.

use crate::time::Nanos;

/// The channel of a [`Record`]: what it is about. The runtime owns numbers below 16; programs number their own from 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Channel(pub u16);

impl Channel {
    /// One release of a rate group: see [`TickTiming`](crate::TickTiming).
    pub const TICK: Self = Self(0);
    /// Something that happened once, `code` says what: see [`Event`].
    pub const EVENT: Self = Self(1);
    /// A use of a port by a release: see [`PortUse`](crate::PortUse).
    pub const PORT: Self = Self(2);
    /// The time that each actor of a group took of one release: see [`ActorTimes`](crate::ActorTimes).
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
    /// The channel: what the record is about.
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

/// Something that happened once and that a reader of the log wants to know.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// The time at which it happened.
    pub stamp: Nanos,
    /// The rate group it happened in.
    pub group: u16,
    /// The code of what happened: a number below 256 is the runtime's ([`Event::PANIC`]), others are the program's.
    pub code: u32,
    /// A number that belongs to the code.
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
    /// The overrun policy changed the group's [`GroupMode`](crate::GroupMode); `detail` is the number of periods skipped,
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
    /// The release due at `stamp` was overdue for `detail` nanoseconds and went on waiting, because its thread got too
    /// little of a processor.
    pub const STARVED: u32 = 10;
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
