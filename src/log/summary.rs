//! The index at the end of an MCAP file, without reading what is before it.

use std::io::{Read, Seek, SeekFrom};

use mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use super::framing::MAX_RECORD_BYTES;

/// The index of a file; `None` if there is none or it cannot be read.
pub(super) fn read_summary(source: &mut (impl Read + Seek)) -> Option<mcap::Summary> {
    let size = source.seek(SeekFrom::End(0)).ok()?;
    let options =
        SummaryReaderOptions::default().with_file_size(size).with_record_length_limit(MAX_RECORD_BYTES as usize);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            SummaryReadEvent::ReadRequest(wanted) => {
                let count = source.read(reader.insert(wanted)).ok()?;
                reader.notify_read(count);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(source.seek(to).ok()?),
        }
    }
    reader.finish()
}

/// The body of the record at `offset`, if it has this opcode.
pub(super) fn record_at(source: &mut (impl Read + Seek), offset: u64, opcode: u8) -> Option<Vec<u8>> {
    source.seek(SeekFrom::Start(offset)).ok()?;
    let mut head = [0; 9];
    source.read_exact(&mut head).ok()?;
    let length = u64::from_le_bytes(head[1..].try_into().ok()?);
    if head[0] != opcode || length > MAX_RECORD_BYTES {
        return None;
    }
    let mut body = Vec::new();
    source.by_ref().take(length).read_to_end(&mut body).ok()?;
    (body.len() as u64 == length).then_some(body)
}
