//! Numbers as bytes that go to another computer, and back from bytes that anybody may have sent.
//!
//! Little-endian. Whoever reads believes no count before there are bytes for it: what is asked of memory is bounded by what came.

use crate::{Pose, Vec3, turn_of, wxyz};

/// How far from one the length of a turn may be.
const UPRIGHT: f64 = 1e-6;

/// Appends numbers to bytes.
///
/// # Real-time
/// Not for a tick: allocates.
#[derive(Debug)]
pub struct BytesWriter<'a>(pub &'a mut Vec<u8>);

impl BytesWriter<'_> {
    /// One byte.
    pub fn u8(&mut self, number: u8) {
        self.0.push(number);
    }

    /// Two bytes.
    pub fn u16(&mut self, number: u16) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    /// Four bytes.
    pub fn u32(&mut self, number: u32) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    /// Eight bytes.
    pub fn u64(&mut self, number: u64) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    /// A number to the last bit.
    pub fn f64(&mut self, number: f64) {
        self.u64(number.to_bits());
    }

    /// A number in single precision.
    pub fn f32(&mut self, number: f32) {
        self.u32(number.to_bits());
    }

    /// A vector to the last bit.
    pub fn vector(&mut self, vector: &Vec3) {
        vector.iter().for_each(|&component| self.f64(component));
    }

    /// A pose to the last bit.
    pub fn pose(&mut self, pose: &Pose) {
        self.vector(&pose.position);
        wxyz(&pose.orientation).iter().for_each(|&part| self.f64(part));
    }

    /// A number in as few bytes as it needs: seven bits each (LEB128).
    pub fn varint(&mut self, mut number: u32) {
        while number >= 0x80 {
            self.u8(number as u8 | 0x80);
            number >>= 7;
        }
        self.u8(number as u8);
    }

    /// A count, then so many things.
    pub fn list<T>(&mut self, items: &[T], mut put: impl FnMut(&mut Self, &T)) {
        self.u32(u32::try_from(items.len()).unwrap_or(u32::MAX));
        items.iter().for_each(|item| put(self, item));
    }
}

/// Takes numbers from bytes; `None` where there are none left.
///
/// # Real-time
/// Not for a tick: lists allocate.
#[derive(Clone, Copy, Debug)]
pub struct BytesReader<'a>(pub &'a [u8]);

impl<'a> BytesReader<'a> {
    /// So many bytes as they are.
    pub fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(bytes)
    }

    /// One byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.bytes(1).map(|bytes| bytes[0])
    }

    /// Two bytes.
    pub fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.bytes(2)?.try_into().ok()?))
    }

    /// Four bytes.
    pub fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.bytes(4)?.try_into().ok()?))
    }

    /// Eight bytes.
    pub fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.bytes(8)?.try_into().ok()?))
    }

    /// A number that is finite.
    pub fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits).filter(|number| number.is_finite())
    }

    /// A number in single precision that is finite.
    pub fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits).filter(|number| number.is_finite())
    }

    /// A vector whose components are finite.
    pub fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.f64()?, self.f64()?, self.f64()?))
    }

    /// A pose whose numbers are finite and whose turn turns.
    pub fn pose(&mut self) -> Option<Pose> {
        let position = self.vector()?;
        let orientation = turn_of([self.f64()?, self.f64()?, self.f64()?, self.f64()?]);
        ((orientation.norm() - 1.0).abs() <= UPRIGHT).then_some(Pose { position, orientation })
    }

    /// What [`BytesWriter::varint`] wrote.
    pub fn varint(&mut self) -> Option<u32> {
        let mut number = 0;
        for shift in (0..32).step_by(7) {
            let byte = self.u8()?;
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// A count of things of at least `size` bytes each, and these in place of `items`; `None` if there are not so many bytes.
    pub fn list<T>(
        &mut self,
        size: usize,
        items: &mut Vec<T>,
        mut take: impl FnMut(&mut Self) -> Option<T>,
    ) -> Option<()> {
        let count = self.u32()? as usize;
        items.clear();
        if count.checked_mul(size)? > self.0.len() {
            return None;
        }
        items.reserve(count);
        for _ in 0..count {
            items.push(take(self)?);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_without_its_bytes_asks_for_no_memory() {
        let mut bytes = Vec::new();
        BytesWriter(&mut bytes).u32(u32::MAX);
        bytes.extend([1; 64]);
        let mut numbers = Vec::new();
        assert_eq!(BytesReader(&bytes).list(8, &mut numbers, BytesReader::u64), None);
        assert_eq!(numbers.capacity(), 0);
    }

    #[test]
    fn numbers_come_back_to_the_last_bit_and_what_is_none_does_not() {
        let mut bytes = Vec::new();
        let mut to = BytesWriter(&mut bytes);
        to.list(&[-0.0, 1e-300, f64::MAX], |to, &number| to.f64(number));
        to.f64(f64::NAN);
        let mut from = BytesReader(&bytes);
        let mut numbers = Vec::new();
        from.list(8, &mut numbers, BytesReader::f64).unwrap();
        assert_eq!(numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), [-0.0, 1e-300, f64::MAX].map(f64::to_bits));
        assert_eq!((from.f64(), from.u8()), (None, None));
    }

    #[test]
    fn numbers_in_few_bytes_come_back_and_one_without_an_end_is_none() {
        let numbers = [0, 1, 127, 128, 16_383, 16_384, u32::MAX - 1, u32::MAX];
        let mut bytes = Vec::new();
        numbers.iter().for_each(|&number| BytesWriter(&mut bytes).varint(number));
        let mut from = BytesReader(&bytes);
        assert!(numbers.iter().all(|&number| from.varint() == Some(number)));
        assert_eq!((from.varint(), BytesReader(&[0xff; 9]).varint()), (None, None));
    }
}
