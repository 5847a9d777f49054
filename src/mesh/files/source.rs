//! The bytes of a file and how far they have been read: words and numbers, as text or as binary.

use super::number::Number;
use crate::error::{MeshError, quoted};

/// How numbers stand in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The bytes of a file and how far they have been read. No count that the file gives reserves more memory than the rest of the
/// file could fill.
#[derive(Clone, Debug)]
pub struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    /// How the numbers stand that come next.
    pub encoding: Encoding,
}

impl<'a> Source<'a> {
    /// At the beginning of a file of text.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, encoding: Encoding::Text }
    }

    /// An error where the reading has come to.
    pub fn error(&self, message: impl std::fmt::Display) -> MeshError {
        match self.encoding {
            Encoding::Text => {
                let line = 1 + self.bytes[..self.at].iter().filter(|byte| **byte == b'\n').count();
                MeshError::new(format!("line {line}: {message}"))
            }
            _ => MeshError::new(format!("byte {}: {message}", self.at)),
        }
    }

    /// Bytes that are left.
    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word, which may be the last of its line; none at the end of the file.
    pub fn word(&mut self) -> Option<&'a str> {
        self.at += self.bytes[self.at..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        // What is no UTF-8 is no word that any format knows.
        (length > 0).then(|| std::str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}"))
    }

    /// The next word, without moving on.
    pub fn peek(&mut self) -> Option<&'a str> {
        let at = self.at;
        let word = self.word();
        self.at = at;
        word
    }

    /// The next word, of which there must be one: `what`.
    pub fn need(&mut self, what: &str) -> Result<&'a str, MeshError> {
        match self.word() {
            Some(word) => Ok(word),
            None => Err(self.error(format_args!("the file ends where {what} is needed"))),
        }
    }

    /// The next word as a number, whatever the encoding of the others: `what`.
    pub fn parse<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, MeshError> {
        let word = self.need(what)?;
        word.parse().map_err(|_| self.error(format_args!("{} is not {what}", quoted(word))))
    }

    /// The rest of the line, and on to the next one; none at the end of the file.
    pub fn line(&mut self) -> Option<String> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(String::from_utf8_lossy(&rest[..length]).trim().to_owned())
    }

    /// Moves past the next `mark`.
    pub fn skip_to(&mut self, mark: &str) -> Result<(), MeshError> {
        let found = self.bytes[self.at..].windows(mark.len()).position(|window| window == mark.as_bytes());
        match found {
            Some(before) => {
                self.at += before + mark.len();
                Ok(())
            }
            None => Err(self.error(format_args!("{} is missing: the file is damaged or cut off", quoted(mark)))),
        }
    }

    /// A whole number of this kind: `what`.
    pub fn integer(&mut self, kind: Number, what: &str) -> Result<i64, MeshError> {
        match self.encoding {
            Encoding::Text => self.parse(what),
            _ => Ok(self.integers(kind, 1, what)?[0]),
        }
    }

    /// A count of what follows: `what`.
    pub fn count(&mut self, kind: Number, what: &str) -> Result<usize, MeshError> {
        let count = self.integer(kind, what)?;
        usize::try_from(count).map_err(|_| self.error(format_args!("{count} is no {what}")))
    }

    /// Whole numbers of this kind: `what`.
    pub fn integers(&mut self, kind: Number, count: usize, what: &str) -> Result<Vec<i64>, MeshError> {
        self.numbers(kind, count, what, |bytes| kind.integer(bytes))
    }

    /// Numbers of this kind: `what`.
    pub fn floats(&mut self, kind: Number, count: usize, what: &str) -> Result<Vec<f64>, MeshError> {
        self.numbers(kind, count, what, |bytes| kind.float(bytes))
    }

    fn numbers<T: std::str::FromStr>(
        &mut self,
        kind: Number,
        count: usize,
        what: &str,
        of_bytes: impl Fn([u8; 8]) -> T,
    ) -> Result<Vec<T>, MeshError> {
        if self.encoding == Encoding::Text {
            // A digit and a space each.
            if count > self.left().div_ceil(2) {
                return Err(self.too_few(count, what));
            }
            return (0..count).map(|_| self.parse(what)).collect();
        }
        let bytes = count.checked_mul(kind.width()).filter(|bytes| *bytes <= self.left());
        let Some(bytes) = bytes else { return Err(self.too_few(count, what)) };
        let taken = &self.bytes[self.at..self.at + bytes];
        self.at += bytes;
        Ok(kind.split(taken, self.encoding == Encoding::BigEndian).map(of_bytes).collect())
    }

    fn too_few(&self, count: usize, what: &str) -> MeshError {
        self.error(format_args!("{count} times {what} should follow, the file ends before: it is damaged or cut off"))
    }
}
