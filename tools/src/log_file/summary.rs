//! The index at the end of an MCAP file, without reading what is before it.

use std::io::{Read, Seek, SeekFrom};

use mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use palpate::log::file::{ChunkHead, RecordStream, Section};

/// What follows the start of the index in the footer and is under its checksum, the checksum itself, and the magic (bytes).
const FOOTER_END: u64 = 8 + 4 + mcap::MAGIC.len() as u64;

/// The index of a file; `None` if there is none, if it cannot be read or if it does not fit its checksum.
pub(super) fn read_summary(source: &mut (impl Read + Seek)) -> Option<mcap::Summary> {
    let size = source.seek(SeekFrom::End(0)).ok()?;
    if !is_sound(source, size)? {
        return None;
    }
    let options = SummaryReaderOptions::default()
        .with_file_size(size)
        .with_record_length_limit(ChunkHead::MAX_RECORD_BYTES as usize);
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

/// False if the index is damaged or holds what belongs to the data; `None` if it cannot be read.
fn is_sound(source: &mut (impl Read + Seek), size: u64) -> Option<bool> {
    source.seek(SeekFrom::Start(size.checked_sub(FOOTER_END + 8)?)).ok()?;
    let mut start = [0; 8];
    source.read_exact(&mut start).ok()?;
    let start = u64::from_le_bytes(start);
    if start == 0 {
        return Some(true);
    }
    source.seek(SeekFrom::Start(start)).ok()?;
    let mut records = RecordStream::resume(source, start, Section::Index { data_has_checksum: false }, 0);
    while records.read_next().is_some() {}
    Some(records.damage().is_none())
}

/// The body of the record at `offset`, if it has this opcode.
pub(super) fn record_at(source: &mut (impl Read + Seek), offset: u64, opcode: u8) -> Option<Vec<u8>> {
    source.seek(SeekFrom::Start(offset)).ok()?;
    let mut head = [0; 9];
    source.read_exact(&mut head).ok()?;
    let length = u64::from_le_bytes(head[1..].try_into().ok()?);
    if head[0] != opcode || length > ChunkHead::MAX_RECORD_BYTES {
        return None;
    }
    let mut body = Vec::new();
    source.by_ref().take(length).read_to_end(&mut body).ok()?;
    (body.len() as u64 == length).then_some(body)
}
