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
    /// A value that a release took from outside the graph, through a [parameter](crate::Parameter) or
    /// [commands](crate::Commands).
    pub const INPUT: Self = Self(4);
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
    /// The payload: integers, or doubles by their bits (`f64::to_bits`).
    pub words: [u64; 6],
}

const _: () = assert!(size_of::<Record>() == 64);

/// The kind of an [`Event`]: what happened. Its [`code`](Self::code) is the number in records and logs.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum EventCode {
    /// An actor panicked; `detail` is its place in the group.
    Panic,
    /// An actor reported a fault; `detail` is the code that it gave.
    Fault,
    /// The overrun policy stopped the group; `detail` is the number of periods missed.
    Stopped,
    /// The code of a group's degraded releases changed; `detail` is the code, [`Event::RECOVERED`] when there is none.
    Degraded,
    /// The overrun policy changed the group's [`GroupMode`](crate::GroupMode); `detail` is the number of periods skipped,
    /// [`Event::RECOVERED`] when the mode is normal again.
    Mode,
    /// The watchdog of a device-paced group took over; `detail` is the number of the release that was due,
    /// [`Event::RECOVERED`] when the device delivers again.
    Watchdog,
    /// A group that had failed was started again; `detail` counts its restarts.
    Restarted,
    /// A thread did not return from the release due at `stamp` and was left behind; `detail` is the time that it was
    /// given, in nanoseconds.
    Abandoned,
    /// The group began to bring what it drives to rest; `detail` is the number of periods that it has.
    WindingDown,
    /// The release due at `stamp` was overdue for `detail` nanoseconds and went on waiting, because its thread got too
    /// little of a processor.
    Starved,
    /// Something that the runtime does not know: a program's own from 256 on, or a newer version's.
    Other(u32),
}

impl EventCode {
    /// The number of the kind in records and logs: below 256 the runtime's, others are the program's.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn code(self) -> u32 {
        match self {
            Self::Panic => 1,
            Self::Fault => 2,
            Self::Stopped => 3,
            Self::Degraded => 4,
            Self::Mode => 5,
            Self::Watchdog => 6,
            Self::Restarted => 7,
            Self::Abandoned => 8,
            Self::WindingDown => 9,
            Self::Starved => 10,
            Self::Other(code) => code,
        }
    }
}

impl From<u32> for EventCode {
    fn from(code: u32) -> Self {
        match code {
            1 => Self::Panic,
            2 => Self::Fault,
            3 => Self::Stopped,
            4 => Self::Degraded,
            5 => Self::Mode,
            6 => Self::Watchdog,
            7 => Self::Restarted,
            8 => Self::Abandoned,
            9 => Self::WindingDown,
            10 => Self::Starved,
            other => Self::Other(other),
        }
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
    /// The kind of what happened.
    pub code: EventCode,
    /// A number that belongs to the code.
    pub detail: u64,
}

impl Event {
    /// The kind [`EventCode::Panic`].
    pub const PANIC: EventCode = EventCode::Panic;
    /// The kind [`EventCode::Fault`].
    pub const FAULT: EventCode = EventCode::Fault;
    /// The kind [`EventCode::Stopped`].
    pub const STOPPED: EventCode = EventCode::Stopped;
    /// The kind [`EventCode::Degraded`].
    pub const DEGRADED: EventCode = EventCode::Degraded;
    /// The kind [`EventCode::Mode`].
    pub const MODE: EventCode = EventCode::Mode;
    /// The kind [`EventCode::Watchdog`].
    pub const WATCHDOG: EventCode = EventCode::Watchdog;
    /// The kind [`EventCode::Restarted`].
    pub const RESTARTED: EventCode = EventCode::Restarted;
    /// The kind [`EventCode::Abandoned`].
    pub const ABANDONED: EventCode = EventCode::Abandoned;
    /// The kind [`EventCode::WindingDown`].
    pub const WINDING_DOWN: EventCode = EventCode::WindingDown;
    /// The kind [`EventCode::Starved`].
    pub const STARVED: EventCode = EventCode::Starved;
    /// The detail of events about a state when it is normal again.
    pub const RECOVERED: u64 = u64::MAX;
}

impl From<Event> for Record {
    fn from(e: Event) -> Self {
        Self {
            stamp: e.stamp,
            channel: Channel::EVENT,
            code: e.group,
            index: e.code.code(),
            words: [e.detail, 0, 0, 0, 0, 0],
        }
    }
}

impl Event {
    /// Reads the event back; `None` if the record is about something else.
    pub fn from_record(record: &Record) -> Option<Self> {
        (record.channel == Channel::EVENT).then_some(Self {
            stamp: record.stamp,
            group: record.code,
            code: record.index.into(),
            detail: record.words[0],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Check that the numbers in logs stay what they are.
    #[test]
    fn every_kind_of_event_keeps_its_number_through_a_record() {
        for code in (0..=300).chain([u32::MAX]) {
            let record =
                Record { index: code, ..Event { stamp: Nanos(1), group: 2, code: 0.into(), detail: 3 }.into() };
            let event = Event::from_record(&record).unwrap();
            assert_eq!((event.code.code(), Record::from(event)), (code, record));
            assert_eq!(matches!(event.code, EventCode::Other(_)), !(1..=10).contains(&code));
        }
        assert_eq!((Event::PANIC, Event::STARVED), (EventCode::from(1), EventCode::from(10)));
    }
}
