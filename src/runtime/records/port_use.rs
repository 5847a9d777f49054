//! The record of what a release saw through a port from another group: with these, a run can be repeated.

use crate::records::record::{Channel, Record};
use crate::time::Nanos;

/// The kind of a [`PortUse`]: what a release did with a port.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum PortUseKind {
    /// A reader took a newer value; the count is its version.
    #[default]
    Took = 0,
    /// More samples of a queue were visible than before; the count is the number of the newest: attempts to send are
    /// numbered from 1, those that found the queue full too.
    Saw = 1,
    /// A sample found its queue full; the count is the number of the attempt.
    Dropped = 2,
}

impl PortUseKind {
    /// The kind with this number; `None` for numbers of a newer version.
    pub fn from_code(code: u32) -> Option<Self> {
        [Self::Took, Self::Saw, Self::Dropped].get(code as usize).copied()
    }

    /// A short name for tables and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Took => "took",
            Self::Saw => "saw",
            Self::Dropped => "dropped",
        }
    }
}

/// One use of a port that decides what a release computes and that no order within a group fixes.
///
/// What stays within a group needs no record: its actors run in a fixed order.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PortUse {
    /// The scheduled time of the release.
    pub time: Nanos,
    /// The rate group of the release.
    pub group: u16,
    /// The number of the port, in the order in which the builder made them.
    pub port: u32,
    /// The kind of the use.
    pub kind: PortUseKind,
    /// The number of the release.
    pub tick: u64,
    /// A version or the number of an attempt, see [`PortUseKind`].
    pub count: u64,
    /// FencedCounter the uses of one kind of one port from 0, so that a missing one is noticed.
    pub sequence: u64,
}

impl From<PortUse> for Record {
    fn from(r: PortUse) -> Self {
        let words = [r.tick, r.count, r.sequence, r.kind as u64, 0, 0];
        Self { stamp: r.time, channel: Channel::PORT, code: r.group, index: r.port, words }
    }
}

impl PortUse {
    /// Reads the use back; `None` if the record is about something else.
    pub fn from_record(record: &Record) -> Option<Self> {
        if record.channel != Channel::PORT {
            return None;
        }
        let [tick, count, sequence, kind, ..] = record.words;
        let kind = PortUseKind::from_code(u32::try_from(kind).ok()?)?;
        Some(Self { time: record.stamp, group: record.code, port: record.index, kind, tick, count, sequence })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Event;

    #[test]
    fn a_use_survives_the_trip_through_a_record() {
        for kind in [PortUseKind::Took, PortUseKind::Saw, PortUseKind::Dropped] {
            let used =
                PortUse { time: Nanos(7), group: 3, port: 9, kind, tick: u64::MAX, count: 1 << 40, sequence: 1 << 50 };
            assert_eq!(PortUse::from_record(&used.into()), Some(used));
            assert_eq!(Event::from_record(&used.into()), None);
        }
    }
}
