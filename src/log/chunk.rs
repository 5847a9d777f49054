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
    head: ChunkHead,
}

/// What the header of a chunk says of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ChunkHead {
    pub(super) first_time: u64,
    pub(super) last_time: u64,
    /// Unpacked [bytes].
    pub(super) unpacked: u64,
    /// Of what is unpacked; 0 if the writer made none.
    pub(super) checksum: u32,
    /// `lz4`, `zstd`, or empty for none.
    pub(super) compression: String,
    /// The whole record in the file, opcode and length included [bytes].
    pub(super) length: u64,
    /// The file ends inside of it: its checksum cannot be verified.
    pub(super) is_cut: bool,
}

impl ChunkRecords {
    /// A chunk of which `body` is there and `length` bytes were announced.
    ///
    /// # Errors
    /// What is wrong with its header.
    pub(super) fn new(body: Vec<u8>, length: u64) -> Result<Self, String> {
        let cut = (body.len() as u64) < length;
        let head = read_header(&body, length, cut)?;
        if !["", "lz4"].contains(&head.compression.as_str()) {
            return Err(format!(
                "it is packed with `{}`, which palpate does not read",
                head.compression.escape_default()
            ));
        }
        let mut options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(MAX_RECORD_BYTES as usize);
        // Nothing of a chunk is given out before its checksum fits; a cut one cannot be checked.
        options.prevalidate_chunk_crcs = !cut;
        let mut bytes = vec![mcap::records::op::CHUNK];
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(&body);
        Ok(Self { reader: LinearReader::new_with_options(options), bytes, fed: 0, cut, head })
    }

    pub(super) fn head(&self) -> &ChunkHead {
        &self.head
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

/// The header, or an empty one if the file ends in it. Refuses sizes that contradict each other: the decoder trusts them.
pub(super) fn read_header(body: &[u8], length: u64, cut: bool) -> Result<ChunkHead, String> {
    let bytes = |at: usize, count: usize| body.get(at..at.checked_add(count)?);
    let word = |at: usize| Some(u64::from_le_bytes(bytes(at, 8)?.try_into().ok()?));
    let half = |at: usize| Some(u32::from_le_bytes(bytes(at, 4)?.try_into().ok()?));
    let header = || {
        let name_length = half(NAME_LENGTH_AT)? as usize;
        let name = bytes(NAME_LENGTH_AT + 4, name_length)?;
        let size_at = NAME_LENGTH_AT.checked_add(4)?.checked_add(name_length)?;
        let head = ChunkHead {
            first_time: word(0)?,
            last_time: word(8)?,
            unpacked: word(16)?,
            checksum: half(24)?,
            compression: String::from_utf8_lossy(name).into_owned(),
            length: length.checked_add(9)?,
            is_cut: cut,
        };
        Some((head, word(size_at)?, (size_at as u64).checked_add(8)?))
    };
    match header() {
        None if cut => Ok(ChunkHead { is_cut: true, ..ChunkHead::default() }),
        None => Err("its header is too short".into()),
        Some((head, _, _)) if head.unpacked > MAX_RECORD_BYTES => {
            Err(format!("it claims {} unpacked bytes", head.unpacked))
        }
        Some((_, packed, header)) if header.checked_add(packed) != Some(length) => {
            Err("its sizes contradict each other".into())
        }
        Some((head, _, _)) => Ok(head),
    }
}
