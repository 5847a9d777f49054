//! The record structure of an MCAP file, read to the first damage.
//!
//! A file may end at any byte or hold wrong bytes: whatever is read before the damage is good, memory stays bounded by
//! [`ChunkHead::MAX_RECORD_BYTES`], and [`RecordStream::damage`] says where and what. Chunks are checked against their checksum
//! before anything of them is given out, except the last one of a cut file, which ends before its records do. What is
//! beside the chunks (metadata, attachments, the frame itself) has no checksum of its own that is checked before: the one
//! of the whole data section follows it, the one of the index ends the file, and a wrong bit anywhere is damage.

use std::io::{self, Read};
use std::path::Path;

use crc32fast::Hasher;
use mcap::records::op;

use super::chunk::{ChunkHead, ChunkRecords};
use crate::error::{Error, ErrorKind};
use crate::printable;

/// Bytes that a file may unpack to for each of its own, all chunks so far together; beyond [`UNPACKED_ANYHOW`].
const MOST_UNPACKED_PER_BYTE: u64 = 1000;
/// Bytes that any file may unpack to: two of the largest chunks.
const UNPACKED_ANYHOW: u64 = 2 * ChunkHead::MAX_RECORD_BYTES;

/// The records of a file one after the other, those inside chunks included.
#[derive(Debug)]
pub struct RecordStream<R> {
    source: R,
    /// Bytes read so far.
    offset: u64,
    record: Vec<u8>,
    chunk: Option<(ChunkRecords, u64)>,
    /// A file either keeps its messages in chunks or does not: one beside them is a wrong opcode.
    has_chunks: bool,
    /// Over all bytes of the section that is being read.
    checksum: Hasher,
    section: Section,
    /// Where the record of the file begins that was read last, and what it is.
    record_start: u64,
    record_opcode: u8,
    /// Bytes of the chunks so far, unpacked.
    unpacked: u64,
    /// Begins behind a damage: what it reads of the data is not all that their checksum is of.
    resumed: bool,
    damage: Option<String>,
    ended: bool,
}

/// One of the two parts of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// Everything that was logged.
    Data,
    /// The index behind the data.
    Index {
        /// True if the data has a checksum, which fits; false if it has none.
        data_has_checksum: bool,
    },
}

impl<R: Read> RecordStream<R> {
    /// Reads the leading magic.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the source cannot be read, [`ErrorKind::Log`] if it is no MCAP file; `place` names it.
    pub fn new(mut source: R, place: &str) -> Result<Self, Error> {
        let mut magic = [0; mcap::MAGIC.len()];
        match source.read_exact(&mut magic) {
            Err(e) if e.kind() != io::ErrorKind::UnexpectedEof => return Err(Error::io(Path::new(place), e)),
            Ok(()) if magic == mcap::MAGIC => {}
            _ => {
                let what = "no MCAP file: it does not begin with the MCAP magic";
                return Err(Error::new(ErrorKind::Log, what).at(place));
            }
        }
        let mut stream = Self::resume(source, magic.len() as u64, Section::Data, 0);
        stream.checksum.update(&magic);
        (stream.has_chunks, stream.resumed) = (false, false);
        Ok(stream)
    }

    /// A stream that goes on behind a damage: `source` is at `offset`, where a record of `section` begins; `unpacked` bytes
    /// of chunks were [unpacked](Self::unpacked) before.
    pub fn resume(source: R, offset: u64, section: Section, unpacked: u64) -> Self {
        Self {
            source,
            offset,
            record: Vec::new(),
            chunk: None,
            has_chunks: true,
            checksum: Hasher::new(),
            section,
            record_start: offset,
            record_opcode: 0,
            unpacked,
            resumed: true,
            damage: None,
            ended: false,
        }
    }

    /// The source, wherever it is now.
    pub fn into_source(self) -> R {
        self.source
    }

    /// The number of bytes read so far.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// The number of bytes that the chunks read so far came to once unpacked, by their own account.
    pub fn unpacked(&self) -> u64 {
        self.unpacked
    }

    /// The part of the file that is being read.
    pub fn section(&self) -> Section {
        self.section
    }

    /// The place of the record of the file that was read last, and its opcode: for records inside a chunk, the chunk's.
    pub fn record_start(&self) -> (u64, u8) {
        (self.record_start, self.record_opcode)
    }

    /// The place of the chunk that the last record was in, and its header; `None` for one that was in none.
    pub fn chunk(&self) -> Option<(u64, &ChunkHead)> {
        self.chunk.as_ref().map(|(chunk, start)| (*start, chunk.head()))
    }

    /// True once the data section has been read and its checksum fits; a file of another writer may have none.
    pub fn is_checksummed(&self) -> bool {
        self.damage.is_none() && self.section == Section::Index { data_has_checksum: true }
    }

    /// The first damage of the file, as far as it has been read, in one line.
    pub fn damage(&self) -> Option<&str> {
        self.damage.as_deref()
    }

    /// Ends the stream because of `what`. The first damage counts.
    pub fn stop(&mut self, what: String) {
        self.ended = true;
        self.chunk = None;
        // Names in it are another program's.
        self.damage.get_or_insert_with(|| printable(&what).into_owned());
    }

    /// The body of the record that [`read_next`](Self::read_next) found.
    pub fn body(&self) -> &[u8] {
        &self.record
    }

    /// Reads the next record and gives its opcode; `None` at the end of the file or of what is readable.
    pub fn read_next(&mut self) -> Option<u8> {
        loop {
            if let Some((chunk, start)) = &mut self.chunk {
                let start = *start;
                match chunk.read_next(&mut self.record) {
                    Ok(Some(opcode)) => return Some(opcode),
                    Ok(None) => self.chunk = None,
                    Err(_) if chunk.is_cut() => {
                        self.stop(format!("the log is cut off at byte {}, in the chunk at byte {start}", self.offset));
                    }
                    Err(e) => self.stop(format!("the chunk at byte {start} is damaged: {e}")),
                }
            }
            if self.ended {
                return None;
            }
            match self.read_record() {
                Ok(Some(opcode)) => return Some(opcode),
                Ok(None) => {}
                Err(what) => self.stop(what),
            }
        }
    }

    /// Reads one record of the file. `Ok(None)` if there is nothing in it to give out.
    fn read_record(&mut self) -> Result<Option<u8>, String> {
        let start = self.offset;
        let mut head = [0; 9];
        (self.record_start, self.record_opcode) = (start, 0);
        match self.fill(&mut head)? {
            0 => return Err(format!("the log ends without its index at byte {start}: the run was cut off")),
            9 => {}
            _ => return Err(format!("the log is cut off at byte {}", self.offset)),
        }
        let opcode = head[0];
        (self.record_start, self.record_opcode) = (start, opcode);
        let length = u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]);
        let cut = |offset: u64| format!("the log is cut off at byte {offset}, in the record at byte {start}");
        if opcode == op::DATA_END && self.section == Section::Data {
            return self.end_data(start, length).map(|()| None);
        }
        self.checksum.update(&head);
        match opcode {
            op::CHUNK | op::MESSAGE | op::METADATA | op::ATTACHMENT if self.section != Section::Data => {
                Err(format!("the log is damaged at byte {start}: a record of the data in the index"))
            }
            op::HEADER
            | op::SCHEMA
            | op::CHANNEL
            | op::CHUNK
            | op::MESSAGE
            | op::METADATA
            | op::ATTACHMENT
            | op::STATISTICS
            | op::CHUNK_INDEX
            | op::METADATA_INDEX
            | op::ATTACHMENT_INDEX => {
                if length > ChunkHead::MAX_RECORD_BYTES {
                    return Err(format!("the record at byte {start} is damaged: it claims {length} bytes"));
                }
                self.read_body(length)?;
                self.checksum.update(&self.record);
                let complete = self.record.len() as u64 == length;
                if opcode == op::MESSAGE && self.has_chunks {
                    return Err(format!("the log is damaged at byte {start}: a message outside of the chunks"));
                }
                if opcode == op::CHUNK {
                    self.has_chunks = true;
                    let chunk = self.open_chunk(length);
                    let chunk = chunk.map_err(|e| format!("the chunk at byte {start} is damaged: {e}"))?;
                    self.chunk = Some((chunk, start));
                    return Ok(None);
                }
                if complete { Ok(Some(opcode)) } else { Err(cut(self.offset)) }
            }
            op::FOOTER => self.end_index(start, length).map(|()| None),
            0 => Err(format!("the log is damaged at byte {start}: no record begins there")),
            _ => {
                let mut sink = Hashed(&mut self.checksum);
                let skipped = io::copy(&mut (&mut self.source).take(length), &mut sink);
                let skipped = skipped.map_err(|e| unreadable(self.offset, &e))?;
                self.offset += skipped;
                if skipped == length { Ok(None) } else { Err(cut(self.offset)) }
            }
        }
    }

    /// The chunk in the record just read, unless the file has unpacked to more than any log would.
    fn open_chunk(&mut self, length: u64) -> Result<ChunkRecords, String> {
        let body = std::mem::take(&mut self.record);
        let claimed = ChunkHead::of(&body, length, (body.len() as u64) < length)?.unpacked;
        let unpacked = self.unpacked.saturating_add(claimed);
        if unpacked > UNPACKED_ANYHOW + MOST_UNPACKED_PER_BYTE * self.offset {
            return Err(format!("with it {} bytes of log would unpack to {unpacked}", self.offset));
        }
        self.unpacked = unpacked;
        ChunkRecords::new(body, length)
    }

    /// Reads the rest of the record that ends the data, with the checksum of all bytes before it.
    fn end_data(&mut self, start: u64, length: u64) -> Result<(), String> {
        let computed = std::mem::take(&mut self.checksum).finalize();
        self.read_body(length.min(ChunkHead::MAX_RECORD_BYTES))?;
        let Ok(stored) = <[u8; 4]>::try_from(self.record.as_slice()) else {
            return Err(format!("the end of the data is damaged at byte {start}"));
        };
        let stored = u32::from_le_bytes(stored);
        self.section = Section::Index { data_has_checksum: stored != 0 && !self.resumed };
        // By the format, 0 says that the writer made none.
        if !self.resumed && stored != 0 && stored != computed {
            return Err(format!("the data before byte {start} does not fit its checksum: something in it is damaged"));
        }
        Ok(())
    }

    /// Reads the rest of the footer: the index with its checksum is whole and the file ends as it should.
    fn end_index(&mut self, start: u64, length: u64) -> Result<(), String> {
        self.ended = true;
        self.read_body(length.saturating_add(mcap::MAGIC.len() as u64).min(ChunkHead::MAX_RECORD_BYTES))?;
        let whole = length == 20 && self.record.len() == 28 && self.record.ends_with(mcap::MAGIC);
        let mut fits = || {
            let (offsets, rest) = self.record.split_at(16);
            self.checksum.update(offsets);
            let stored = u32::from_le_bytes([rest[0], rest[1], rest[2], rest[3]]);
            stored == 0 || stored == std::mem::take(&mut self.checksum).finalize()
        };
        if self.section != Section::Data && whole && fits() {
            Ok(())
        } else {
            Err(format!("the index of the log is damaged at byte {start}"))
        }
    }

    /// Reads `length` bytes, or what is left, as the record.
    fn read_body(&mut self, length: u64) -> Result<(), String> {
        self.record.clear();
        let read = (&mut self.source).take(length).read_to_end(&mut self.record);
        self.offset += read.map_err(|e| unreadable(self.offset, &e))? as u64;
        Ok(())
    }

    /// Fills `buffer` as far as the file goes.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, String> {
        let mut filled = 0;
        while filled < buffer.len() {
            match self.source.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(unreadable(self.offset, &e)),
            }
        }
        self.offset += filled as u64;
        Ok(filled)
    }
}

/// Skips bytes that count for the checksum.
struct Hashed<'a>(&'a mut Hasher);

impl io::Write for Hashed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn unreadable(offset: u64, error: &io::Error) -> String {
    format!("the log cannot be read past byte {offset}: {error}")
}
