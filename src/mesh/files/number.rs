//! Kinds of numbers in binary files.

/// A kind of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
}

impl Number {
    /// Bytes of one.
    pub fn width(self) -> usize {
        match self {
            Self::Int8 | Self::UInt8 => 1,
            Self::Int16 | Self::UInt16 => 2,
            Self::Int32 | Self::UInt32 | Self::Float32 => 4,
            Self::Int64 | Self::UInt64 | Self::Float64 => 8,
        }
    }

    /// True if it is a whole number.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::Float32 | Self::Float64)
    }

    /// A whole number from its bytes, the least first. One of 64 bits without sign beyond the range becomes negative, as no
    /// count and no index is.
    pub fn integer(self, bytes: [u8; 8]) -> i64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::Int8 => i64::from(a as i8),
            Self::UInt8 => i64::from(a),
            Self::Int16 => i64::from(i16::from_le_bytes([a, b])),
            Self::UInt16 => i64::from(u16::from_le_bytes([a, b])),
            Self::Int32 => i64::from(i32::from_le_bytes([a, b, c, d])),
            Self::UInt32 => i64::from(u32::from_le_bytes([a, b, c, d])),
            Self::Int64 | Self::UInt64 => i64::from_le_bytes(bytes),
            Self::Float32 | Self::Float64 => self.float(bytes) as i64,
        }
    }

    /// A number from its bytes, the least first.
    pub fn float(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::Float32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::Float64 => f64::from_le_bytes(bytes),
            _ => self.integer(bytes) as f64,
        }
    }

    /// The numbers in `bytes`, each with the least of its bytes first.
    pub fn split(self, bytes: &[u8], is_big_endian: bool) -> impl Iterator<Item = [u8; 8]> + '_ {
        bytes.chunks_exact(self.width()).map(move |number| {
            let mut least_first = [0; 8];
            least_first[..number.len()].copy_from_slice(number);
            if is_big_endian {
                least_first[..number.len()].reverse();
            }
            least_first
        })
    }
}
