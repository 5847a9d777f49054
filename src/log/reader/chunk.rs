//! The records inside one chunk, complete or cut.

use std::io::Read;

use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ruzstd::decoding::StreamingDecoder;

/// Bytes of the fixed part of a chunk's header before the name of its compression.
const NAME_LENGTH_AT: usize = 28;

/// Usual in logs of other programs; palpate's own are packed with lz4.
const ZSTD: &str = "zstd";

/// Unpacks one chunk record by record.
///
/// A chunk that is complete is verified before anything of it is given out; a cut one cannot be.
pub struct ChunkRecords {
    reader: LinearReader,
    /// The chunk as it would stand alone in a file, opcode and length included.
    bytes: Vec<u8>,
    fed: usize,
    cut: bool,
    head: ChunkHead,
}

/// The header of a chunk: its times, sizes, compression and checksum.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChunkHead {
    /// The log time of the earliest message (ns).
    pub first_time: u64,
    /// The log time of the latest message (ns).
    pub last_time: u64,
    /// The size of the records in it (bytes).
    pub unpacked: u64,
    /// The CRC-32 of the unpacked records; 0 if the writer made none.
    pub checksum: u32,
    /// The name of the compression: `lz4`, `zstd`, or empty for none.
    pub compression: String,
    /// The size of the chunk in the file, opcode and length included (bytes).
    pub length: u64,
    /// True if the file ends inside of the chunk: its checksum cannot be verified.
    pub is_cut: bool,
}

impl ChunkHead {
    /// The size of the largest record or unpacked chunk that is read (bytes).
    pub const MAX_RECORD_BYTES: u64 = 1 << 26;

    /// Reads the header in a record of `length` bytes that begins with `body`; an empty one if the file ends in it.
    ///
    /// # Errors
    /// If it is too short, or if its sizes contradict each other: the decoder trusts them.
    pub fn of(body: &[u8], length: u64, cut: bool) -> Result<Self, String> {
        let bytes = |at: usize, count: usize| body.get(at..at.checked_add(count)?);
        let word = |at: usize| Some(u64::from_le_bytes(bytes(at, 8)?.try_into().ok()?));
        let half = |at: usize| Some(u32::from_le_bytes(bytes(at, 4)?.try_into().ok()?));
        let header = || {
            let name_length = half(NAME_LENGTH_AT)? as usize;
            let name = bytes(NAME_LENGTH_AT + 4, name_length)?;
            let size_at = NAME_LENGTH_AT.checked_add(4)?.checked_add(name_length)?;
            let head = Self {
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
            None if cut => Ok(Self { is_cut: true, ..Self::default() }),
            None => Err("its header is too short".into()),
            Some((head, _, _)) if head.unpacked > ChunkHead::MAX_RECORD_BYTES => {
                Err(format!("it claims {} unpacked bytes", head.unpacked))
            }
            Some((_, packed, header)) if header.checked_add(packed) != Some(length) => {
                Err("its sizes contradict each other".into())
            }
            Some((head, _, _)) => Ok(head),
        }
    }

    /// True for a compression that can be unpacked.
    pub fn is_readable(&self) -> bool {
        matches!(self.compression.as_str(), "" | "lz4" | ZSTD)
    }
}

impl ChunkRecords {
    /// A chunk of which `body` is there and `length` bytes were announced.
    ///
    /// # Errors
    /// What is wrong with its header.
    pub fn new(body: Vec<u8>, length: u64) -> Result<Self, String> {
        let cut = (body.len() as u64) < length;
        let head = ChunkHead::of(&body, length, cut)?;
        if !head.is_readable() {
            return Err(format!(
                "it is packed with `{}`, which palpate does not read",
                head.compression.escape_default()
            ));
        }
        let (body, length) = if head.compression == ZSTD { unpacked_zstd(&body, &head)? } else { (body, length) };
        let mut options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(ChunkHead::MAX_RECORD_BYTES as usize);
        // Nothing of a chunk is given out before its checksum fits; a cut one cannot be checked.
        options.prevalidate_chunk_crcs = !cut;
        let mut bytes = vec![mcap::records::op::CHUNK];
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(&body);
        Ok(Self { reader: LinearReader::new_with_options(options), bytes, fed: 0, cut, head })
    }

    /// The header of the chunk.
    pub fn head(&self) -> &ChunkHead {
        &self.head
    }

    /// True if the file ends inside this chunk.
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// Puts the next record into `record` and gives its opcode; `None` after the last.
    ///
    /// # Errors
    /// What is wrong, or that a cut chunk goes no further.
    pub fn read_next(&mut self, record: &mut Vec<u8>) -> Result<Option<u8>, String> {
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

/// A chunk that is packed with zstd as one that is not, with the length it then has; of a cut one what the decoder lets go of
/// before the end, often nothing.
fn unpacked_zstd(body: &[u8], head: &ChunkHead) -> Result<(Vec<u8>, u64), String> {
    let records_at = NAME_LENGTH_AT + 4 + head.compression.len() + 8;
    let mut plain = body.get(..NAME_LENGTH_AT).map(<[u8]>::to_vec).unwrap_or_default();
    plain.extend_from_slice(&0_u32.to_le_bytes());
    plain.extend_from_slice(&head.unpacked.to_le_bytes());
    let header = plain.len() as u64;
    let packed = body.get(records_at..).unwrap_or_default();
    let wrong = |error: &dyn std::fmt::Display| Err(format!("it does not unpack: {error}"));
    let unpacked = match StreamingDecoder::new(packed) {
        Ok(decoder) => decoder.take(head.unpacked).read_to_end(&mut plain).map(drop),
        Err(_) if head.is_cut => Ok(()),
        Err(error) => return wrong(&error),
    };
    match unpacked {
        Err(error) if !head.is_cut => wrong(&error),
        _ => Ok((plain, header + head.unpacked)),
    }
}

impl std::fmt::Debug for ChunkRecords {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChunkRecords").field("head", &self.head).field("fed", &self.fed).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};

    /// A chunk with these records, packed with zstd.
    fn packed(records: &[u8], checksum: u32) -> Vec<u8> {
        let packed = compress_to_vec(records, CompressionLevel::Fastest);
        let mut body = vec![0; 16];
        body.extend_from_slice(&(records.len() as u64).to_le_bytes());
        body.extend_from_slice(&checksum.to_le_bytes());
        body.extend_from_slice(&4_u32.to_le_bytes());
        body.extend_from_slice(b"zstd");
        body.extend_from_slice(&(packed.len() as u64).to_le_bytes());
        body.extend_from_slice(&packed);
        body
    }

    #[test]
    fn what_is_packed_with_zstd_is_unpacked_and_checked() {
        // Messages of eight bytes.
        let one: Vec<u8> = [&[mcap::records::op::MESSAGE][..], &8_u64.to_le_bytes(), b"12345678"].concat();
        let records = one.repeat(100);
        let checksum = crc32fast::hash(&records);
        let body = packed(&records, checksum);
        let length = body.len() as u64;
        let mut chunk = ChunkRecords::new(body.clone(), length).unwrap();
        let mut record = Vec::new();
        for _ in 0..100 {
            assert_eq!(chunk.read_next(&mut record), Ok(Some(mcap::records::op::MESSAGE)));
            assert_eq!(record, b"12345678");
        }
        assert_eq!(chunk.read_next(&mut record), Ok(None));
        let mut wrong = ChunkRecords::new(packed(&records, checksum ^ 1), length).unwrap();
        assert!(wrong.read_next(&mut record).is_err());
        // Check that a wrong or missing byte is an error or the truth, never a panic
        for at in 0..body.len() {
            let mut wrong = body.clone();
            wrong[at] ^= 4;
            let read =
                |body: Vec<u8>, length| ChunkRecords::new(body, length).and_then(|mut c| c.read_next(&mut Vec::new()));
            let _ = (read(wrong, length), read(body[..at].to_vec(), length));
        }
    }
}
