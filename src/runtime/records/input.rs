//! The record of a value that a release took from outside the graph: the value itself, which nobody could make again.

use crate::records::record::{Channel, Record};
use crate::time::Nanos;

/// A value from outside and the release that took it: of a [`Parameter`](crate::Parameter) or of [`Commands`](crate::Commands).
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputUse {
    /// The scheduled time of the release.
    pub time: Nanos,
    /// The rate group of the release.
    pub group: u16,
    /// The number of the port, in the order in which the builder made them.
    pub port: u32,
    /// Counts the values of the port from 0, so that a missing one is noticed.
    pub sequence: u64,
    /// The value as words, see [`InputValue`](crate::InputValue).
    pub value: [u64; 5],
}

impl From<InputUse> for Record {
    fn from(r: InputUse) -> Self {
        let [a, b, c, d, e] = r.value;
        let words = [r.sequence, a, b, c, d, e];
        Self { stamp: r.time, channel: Channel::INPUT, code: r.group, index: r.port, words }
    }
}

impl InputUse {
    /// Reads the value back; `None` if the record is about something else.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn from_record(record: &Record) -> Option<Self> {
        let [sequence, a, b, c, d, e] = record.words;
        let (time, group, port, value) = (record.stamp, record.code, record.index, [a, b, c, d, e]);
        (record.channel == Channel::INPUT).then_some(Self { time, group, port, sequence, value })
    }
}
