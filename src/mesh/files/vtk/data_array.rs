//! The numbers of a VTU file: as text, in base 64, or appended, whole or in compressed blocks.

use std::cell::Cell;

use roxmltree::Node;

use crate::error::{MeshError, quoted};
use crate::files::base64;
use crate::files::number::Number;

/// Most numbers of all arrays of a file: a small one may unpack to any size, and several arrays may be the same data.
pub const MOST_NUMBERS: usize = 1 << 27;

/// How the arrays of a file stand in it.
pub struct Arrays<'a> {
    pub is_big_endian: bool,
    /// Kind of the counts in front of binary data.
    pub header: Number,
    pub is_compressed: bool,
    /// What is appended, behind its underscore; raw if true, else base 64.
    pub appended: Option<(&'a [u8], bool)>,
    /// So many numbers may still be read.
    pub room: Cell<usize>,
}

impl Arrays<'_> {
    /// The numbers of an array as they are needed.
    pub fn read<T: std::str::FromStr>(
        &self,
        array: Node,
        of_bytes: impl Fn(Number, [u8; 8]) -> T,
    ) -> Result<Vec<T>, MeshError> {
        let name = array.attribute("Name").unwrap_or("without a name");
        let refuse = |what: String| MeshError::new(format!("array {}: {what}", quoted(name)));
        let kind = kind(array).ok_or_else(|| refuse("its numbers are of no known type".to_owned()))?;
        let text = array.text().unwrap_or("");
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let number = |word: &str| word.parse().map_err(|_| refuse(format!("{} is no number", quoted(word))));
                return text.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.unpacked(text.as_bytes(), false),
            "appended" => {
                let offset = array.attribute("offset").and_then(|offset| offset.trim().parse().ok());
                let (data, is_raw) = self.appended.ok_or_else(|| refuse("nothing is appended".to_owned()))?;
                let data = offset.and_then(|offset: usize| data.get(offset..));
                self.unpacked(data.ok_or_else(|| refuse("its offset is beyond the file".to_owned()))?, is_raw)
            }
            other => return Err(refuse(format!("format {} is not known", quoted(other)))),
        };
        let bytes = bytes.ok_or_else(|| refuse("its binary data are damaged, cut off or too many".to_owned()))?;
        let room = self.room.get().checked_sub(bytes.len() / kind.width());
        self.room.set(room.ok_or_else(|| refuse(format!("the arrays have more than {MOST_NUMBERS} numbers in all")))?);
        Ok(kind.split(&bytes, self.is_big_endian).map(|number| of_bytes(kind, number)).collect())
    }

    /// The bytes of an array that begin with `data`.
    fn unpacked(&self, data: &[u8], is_raw: bool) -> Option<Vec<u8>> {
        let start = |length: usize| -> Option<Vec<u8>> {
            let start = if is_raw { data.get(..length)?.to_vec() } else { base64::decode(data, length)? };
            (start.len() == length).then_some(start)
        };
        let (width, most) = (self.header.width(), 8 * self.room.get());
        let counts = |bytes: &[u8]| -> Option<Vec<usize>> {
            let counts = self.header.split(bytes, self.is_big_endian);
            counts.map(|count| usize::try_from(self.header.integer(count)).ok().filter(|n| *n <= most)).collect()
        };
        let first = counts(&start(width)?)?[0];
        if !self.is_compressed {
            // No more than what there is in either encoding.
            return (first <= data.len()).then(|| start(width + first)).flatten().map(|all| all[width..].to_vec());
        }
        // Number of blocks, bytes of each and of the last unpacked, bytes of each packed.
        if first > data.len() / width {
            return None;
        }
        let header = (3 + first) * width;
        let counts = counts(&start(header)?)?;
        let (block, packed) = (counts[1], &counts[3..]);
        let all: usize = packed.iter().sum();
        if all > data.len() {
            return None;
        }
        let data = start(header + all)?;
        let mut rest = &data[header..];
        let mut bytes = Vec::new();
        for &packed in packed {
            let (this, after) = rest.split_at_checked(packed)?;
            bytes.extend(
                miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(this, block.min(most - bytes.len())).ok()?,
            );
            rest = after;
        }
        Some(bytes)
    }
}

/// The kind of an array's numbers.
pub fn kind(array: Node) -> Option<Number> {
    Some(match array.attribute("type")? {
        "Int8" => Number::Int8,
        "UInt8" => Number::UInt8,
        "Int16" => Number::Int16,
        "UInt16" => Number::UInt16,
        "Int32" => Number::Int32,
        "UInt32" => Number::UInt32,
        "Int64" => Number::Int64,
        "UInt64" => Number::UInt64,
        "Float32" => Number::Float32,
        "Float64" => Number::Float64,
        _ => return None,
    })
}
