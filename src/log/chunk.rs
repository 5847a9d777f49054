//! The records inside one chunk, complete or cut.

use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::framing::MAX_RECORD_BYTES;

/// Bytes of the fixed part of a chunk's header before the name of its compression.
const NAME_LENGTH_AT: usize = 28;

/// Unpacks one chunk record by record.
pub(super) struct ChunkRecords {
    reader: LinearReader,
    /// The chunk as it would stand alone in a file, opcode and length included.
    bytes: Vec<u8>,
    fed: usize,
    cut: bool,
}

impl ChunkRecords {
    /// A chunk of which `body` is there and `length` bytes were announced.
    ///
    /// # Errors
    /// What is wrong with its header.
    pub(super) fn new(body: Vec<u8>, length: u64) -> Result<Self, String> {
        let cut = (body.len() as u64) < length;
        check_header(&body, length, cut)?;
        let mut options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(MAX_RECORD_BYTES as usize);
        // Nothing of a chunk is given out before its checksum fits; a cut one cannot be checked.
        options.prevalidate_chunk_crcs = !cut;
        let mut bytes = vec![mcap::records::op::CHUNK];
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(&body);
        Ok(Self { reader: LinearReader::new_with_options(options), bytes, fed: 0, cut })
    }

    /// True if the file ends inside this chunk.
    pub(super) fn is_cut(&self) -> bool {
        self.cut
    }

    /// Puts the next record into `record` and gives its opcode; `None` after the last.
    ///
    /// # Errors
    /// What is wrong, or that a cut chunk goes no further.
    pub(super) fn next(&mut self, record: &mut Vec<u8>) -> Result<Option<u8>, String> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Err(e)) => return Err(e.to_string()),
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    record.clear();
                    record.extend_from_slice(data);
                    return Ok(Some(opcode));
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let count = wanted.min(self.bytes.len() - self.fed);
                    let next = &self.bytes[self.fed..self.fed + count];
                    self.reader
                        .insert(count)
                        .get_mut(..count)
                        .expect("insert gives what was asked")
                        .copy_from_slice(next);
                    self.reader.notify_read(count);
                    self.fed += count;
                }
            }
        }
    }
}

/// Refuses sizes that contradict each other: the decoder trusts them.
fn check_header(body: &[u8], length: u64, cut: bool) -> Result<(), String> {
    let bytes = |at: usize, count: usize| body.get(at..at.checked_add(count)?);
    let word = |at: usize| Some(u64::from_le_bytes(bytes(at, 8)?.try_into().ok()?));
    let header = || {
        let name_length = u32::from_le_bytes(bytes(NAME_LENGTH_AT, 4)?.try_into().ok()?) as usize;
        let size_at = NAME_LENGTH_AT.checked_add(4)?.checked_add(name_length)?;
        Some((word(16)?, word(size_at)?, (size_at as u64).checked_add(8)?))
    };
    match header() {
        None if cut => Ok(()),
        None => Err("its header is too short".into()),
        Some((unpacked, _, _)) if unpacked > MAX_RECORD_BYTES => Err(format!("it claims {unpacked} unpacked bytes")),
        Some((_, packed, header)) if header.checked_add(packed) != Some(length) => {
            Err("its sizes contradict each other".into())
        }
        Some(_) => Ok(()),
    }
}
