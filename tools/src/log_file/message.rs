//! A message as it is in the file, of whatever program.

use mcap::records::MessageHeader;

use palpate::log::reader::MESSAGE_HEADER_BYTES;

/// The header and the data of the message in `body`; `None` if that is too short.
pub(super) fn message(body: &[u8]) -> Option<(MessageHeader, &[u8])> {
    let (header, data) = body.split_at_checked(MESSAGE_HEADER_BYTES)?;
    let word = |at: usize| Some(u64::from_le_bytes(header.get(at..at + 8)?.try_into().ok()?));
    let header = MessageHeader {
        channel_id: u16::from_le_bytes(header.get(0..2)?.try_into().ok()?),
        sequence: u32::from_le_bytes(header.get(2..6)?.try_into().ok()?),
        log_time: word(6)?,
        publish_time: word(14)?,
    };
    Some((header, data))
}

/// First and last of the times seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span(pub(super) Option<(u64, u64)>);

impl Span {
    pub(super) fn push(&mut self, time: u64) {
        let (first, last) = self.0.unwrap_or((time, time));
        self.0 = Some((first.min(time), last.max(time)));
    }
}
