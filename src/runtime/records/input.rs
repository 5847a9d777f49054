//! The record of a value that a release took from outside the graph: the value itself, which nobody could make again.

use crate::records::record::{Channel, Record};
use crate::time::Nanos;

/// A value from outside and the release that took it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct InputUse {
    /// The scheduled time of the release.
    pub(crate) time: Nanos,
    pub(crate) group: u16,
    pub(crate) port: u32,
    /// Counts the values of the port from 0, so that a missing one is noticed.
    pub(crate) sequence: u64,
    pub(crate) value: [u64; 5],
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
    pub(crate) fn from_record(record: &Record) -> Option<Self> {
        let [sequence, a, b, c, d, e] = record.words;
        let (time, group, port, value) = (record.stamp, record.code, record.index, [a, b, c, d, e]);
        (record.channel == Channel::INPUT).then_some(Self { time, group, port, sequence, value })
    }
}
