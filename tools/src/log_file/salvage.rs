//! Every readable record of a damaged file: behind each damage it goes on with the next chunk whose checksum fits.
//!
//! Nothing is given out that could not be verified where the format has a checksum for it; only the last chunk of a cut
//! file, which ends before its records do, cannot be checked.

use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::op;

use palpate::Error;
use palpate::log::file::{ChunkHead, ChunkRecords, RecordStream, Section};

/// How much is looked at at once in the search for a chunk (bytes).
const WINDOW_BYTES: usize = 1 << 20;
/// Opcode, length and the longest header of a chunk that is looked for.
const HEAD_BYTES: usize = 9 + 28 + 4 + 4 + 8;

/// A stretch of the file that gave nothing more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Its first byte: the record that is damaged.
    pub from: u64,
    /// Where reading went on, or the end of the file.
    pub to: u64,
    /// What is wrong, in one line.
    pub what: String,
}

/// The next thing that was found.
#[derive(Debug)]
pub(super) enum Found<'a, R> {
    /// A record with this opcode; its body is in the stream.
    Record(u8, &'a RecordStream<R>),
    Damage(Damage),
}

/// Reads a file to its end, whatever lies between.
pub(super) struct Salvage<R> {
    /// Gone when nothing more can be read.
    stream: Option<RecordStream<R>>,
    length: u64,
    damaged: bool,
    /// Bytes that were read and unpacked in the search for a chunk that fits.
    searched: u64,
}

impl<R: Read + Seek> Salvage<R> {
    /// Reads the leading magic.
    ///
    /// # Errors
    /// If the source cannot be read, or is no MCAP file; `place` names it.
    pub(super) fn new(mut source: R, place: &str) -> Result<Self, Error> {
        let length = source.seek(SeekFrom::End(0)).and_then(|length| source.rewind().map(|()| length));
        let length = length.map_err(|e| Error::io(Path::new(place), e))?;
        Ok(Self { stream: Some(RecordStream::new(source, place)?), length, damaged: false, searched: 0 })
    }

    /// The size of the file (bytes).
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// True if all of the data was read and fits its checksum.
    pub(super) fn is_checksummed(&self) -> bool {
        !self.damaged && self.stream.as_ref().is_some_and(RecordStream::is_checksummed)
    }

    /// The next record or damage; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Option<Found<'_, R>> {
        if let Some(opcode) = self.stream.as_mut()?.read_next() {
            return Some(Found::Record(opcode, self.stream.as_ref()?));
        }
        let stream = self.stream.as_ref()?;
        let mut what = stream.damage()?.to_owned();
        self.damaged = true;
        let (start, opcode) = stream.record_start();
        let (section, end, unpacked) = (stream.section(), stream.offset(), stream.unpacked());
        let mut source = self.stream.take().map(RecordStream::into_source)?;
        // A source that cannot be read further has nothing more to give.
        let next = self.resume_at(&mut source, start, opcode, section, end).ok().flatten();
        let next = next.filter(|at| source.seek(SeekFrom::Start(*at)).is_ok());
        if next.is_none() && self.searched > most_searched(self.length) {
            what += "; it holds more false beginnings of chunks than are looked at";
        }
        self.stream = next.map(|at| RecordStream::resume(source, at, section, unpacked));
        Some(Found::Damage(Damage { from: start, to: next.unwrap_or(self.length), what }))
    }

    /// Where to go on after a damage in the record at `start`, of which `end` is where reading stopped.
    fn resume_at(
        &mut self,
        source: &mut R,
        start: u64,
        opcode: u8,
        section: Section,
        end: u64,
    ) -> io::Result<Option<u64>> {
        if section != Section::Data {
            // The data does not fit its checksum, but its end was read: the index follows. Within it, nothing does.
            return Ok((opcode == op::DATA_END).then_some(end));
        }
        if opcode == op::CHUNK && follow(source, end, self.length)? {
            return Ok(Some(end));
        }
        self.search(source, start + 1)
    }

    /// The next chunk at `from` or later whose checksum fits.
    fn search(&mut self, source: &mut R, mut from: u64) -> io::Result<Option<u64>> {
        let mut window = Vec::new();
        while from + (HEAD_BYTES as u64) < self.length {
            source.seek(SeekFrom::Start(from))?;
            window.clear();
            source.by_ref().take((WINDOW_BYTES + HEAD_BYTES) as u64).read_to_end(&mut window)?;
            for at in 0..window.len().min(WINDOW_BYTES) {
                let place = from + at as u64;
                let Some(cost) = self.cost_of(&window[at..], place) else { continue };
                // Heads within heads would have the rest of the file read for each of them.
                self.searched += cost;
                if self.searched > most_searched(self.length) {
                    return Ok(None);
                }
                if fits(source, place)? {
                    return Ok(Some(place));
                }
            }
            from += WINDOW_BYTES as u64;
        }
        Ok(None)
    }

    /// The bytes to be read and unpacked if `bytes`, from `place` on, may be the head of a whole chunk with a checksum.
    fn cost_of(&self, bytes: &[u8], place: u64) -> Option<u64> {
        let length = length_in(bytes).filter(|_| bytes[0] == op::CHUNK)?;
        let head = &bytes[9..bytes.len().min(HEAD_BYTES)];
        if length > ChunkHead::MAX_RECORD_BYTES || place + 9 + length > self.length {
            return None;
        }
        let head = ChunkHead::of(head, length, false).ok()?;
        (head.is_readable() && head.checksum != 0).then_some(length + head.unpacked)
    }
}

/// The most that is read and unpacked in searches through a file of `length` bytes: twice the largest chunk, and for each
/// byte as much as no log that is merely damaged takes.
fn most_searched(length: u64) -> u64 {
    4 * ChunkHead::MAX_RECORD_BYTES + 64 * length
}

/// True if there is a chunk at `place` that fits its checksum.
fn fits<R: Read + Seek>(source: &mut R, place: u64) -> io::Result<bool> {
    source.seek(SeekFrom::Start(place))?;
    let mut head = [0; 9];
    source.read_exact(&mut head)?;
    let Some(length) = length_in(&head) else { return Ok(false) };
    let mut body = Vec::new();
    source.by_ref().take(length).read_to_end(&mut body)?;
    let Ok(mut chunk) = ChunkRecords::new(body, length) else { return Ok(false) };
    let mut record = Vec::new();
    Ok(matches!(chunk.read_next(&mut record), Ok(Some(_))))
}

fn length_in(head: &[u8]) -> Option<u64> {
    Some(u64::from_le_bytes(head.get(1..9)?.try_into().ok()?))
}

/// True if what is at `at` looks like the records that follow a chunk: two in a row, or the end of the file.
fn follow<R: Read + Seek>(source: &mut R, mut at: u64, length: u64) -> io::Result<bool> {
    for record in 0..2 {
        if at + 9 > length {
            // A chunk that claims to be the last thing in the file may be wrong in that.
            return Ok(record > 0);
        }
        source.seek(SeekFrom::Start(at))?;
        let mut head = [0; 9];
        source.read_exact(&mut head)?;
        let body = length_in(&head).unwrap_or(u64::MAX);
        let is_known = (op::SCHEMA..=op::DATA_END).contains(&head[0]);
        if !is_known || body > ChunkHead::MAX_RECORD_BYTES || at + 9 + body > length {
            return Ok(false);
        }
        at += 9 + body;
    }
    Ok(true)
}
