//! A basis as bytes, to be kept from run to run.

use super::basis::Basis;
use super::products::Columns;
use super::reduced::{Damping, Reduced};
use super::resting::digest;
use super::square::Square;
use crate::bytes::{BytesReader, BytesWriter};
use crate::linear_algebra::Matrix;

/// What the bytes begin with; its number changes with what follows.
const MAGIC: &[u8; 17] = b"palpate-basis-10\n";
const SUM: usize = size_of::<u64>();

impl Basis {
    /// All of it as bytes, with a checksum at the end. `key` comes first: what the basis was made of.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn to_bytes(&self, key: u64) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let mut to = BytesWriter(&mut bytes);
        to.u64(key);
        to.list(&self.patch, |to, &id| to.u32(id));
        write(&self.answers, &mut to);
        let sum = digest(to.0);
        to.u64(sum);
        bytes
    }

    /// Reads [`to_bytes`](Self::to_bytes) back; `None` if the bytes are damaged, of another version or of another `key`, or if one of its
    /// numbers is none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn from_bytes(bytes: &[u8], key: u64) -> Option<Self> {
        let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(SUM)?)?;
        if u64::from_le_bytes(sum.try_into().ok()?) != digest(body) {
            return None;
        }
        let mut from = BytesReader(body.strip_prefix(MAGIC)?);
        if from.u64()? != key {
            return None;
        }
        let mut patch = Vec::new();
        from.list(size_of::<u32>(), &mut patch, BytesReader::u32)?;
        let answers = read(&mut from)?;
        from.0.is_empty().then_some(Self { patch, answers })
    }
}

fn write(model: &Reduced, to: &mut BytesWriter<'_>) {
    let shapes = model.shapes.to_matrix();
    to.u32(shapes.nrows() as u32);
    // They are singles that were made from less.
    to.list(shapes.as_slice(), |to, &number| to.f32(number as f32));
    write_numbers(to, &model.stiffness);
    match &model.damping {
        Damping::Diagonal(damping) => {
            to.u8(0);
            write_numbers(to, damping);
        }
        Damping::Full(damping) => {
            to.u8(1);
            to.list(damping.to_matrix().as_slice(), |to, &number| to.f32(number as f32));
        }
    }
}

fn read(from: &mut BytesReader<'_>) -> Option<Reduced> {
    let (rows, shapes) = (from.u32()? as usize, read_singles(from)?);
    // Without a ring there are none.
    if !shapes.len().is_multiple_of(rows) {
        return None;
    }
    let states = shapes.len().checked_div(rows).unwrap_or(0);
    let shapes = Columns::new(&Matrix::from_vec(rows, states, shapes));
    let stiffness = read_numbers(from)?;
    let damping = match from.u8()? {
        0 => Damping::Diagonal(read_numbers(from)?),
        1 => {
            let (states, damping) = (stiffness.len(), read_singles(from)?);
            let is_whole = damping.len() == states * states;
            Damping::Full(is_whole.then(|| Square::new(states, |row, column| damping[column * states + row]))?)
        }
        _ => return None,
    };
    Some(Reduced { states: stiffness.len(), shapes, stiffness, damping })
}

fn write_numbers(to: &mut BytesWriter<'_>, numbers: &[f64]) {
    to.list(numbers, |to, &number| to.f64(number));
}

fn read_singles(from: &mut BytesReader<'_>) -> Option<Vec<f64>> {
    let mut singles = Vec::new();
    from.list(size_of::<f32>(), &mut singles, |from| from.f32().map(f64::from))?;
    Some(singles)
}

fn read_numbers(from: &mut BytesReader<'_>) -> Option<Vec<f64>> {
    let mut numbers = Vec::new();
    from.list(size_of::<f64>(), &mut numbers, BytesReader::f64)?;
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::super::RestingBody;
    use super::*;
    use crate::body::{Block, Body};
    use crate::mesh::Face;

    #[test]
    fn a_basis_comes_back_whole_and_a_damaged_one_not_at_all() {
        let block = Block::builder([5; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let resting = RestingBody::new(&block).unwrap();
        let mut patch = Vec::new();
        block.patch(&[block.surface().triangles.len() as u32 - 5], [2, 2, 1], &mut patch);
        let basis = Basis::compute(&resting, &patch, 20).unwrap().unwrap();
        let bytes = basis.to_bytes(7);
        assert_eq!(Basis::from_bytes(&bytes, 7).as_ref(), Some(&basis));
        assert_eq!(Basis::from_bytes(&bytes, 8), None, "another key");
        for at in (0..bytes.len()).step_by(997) {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0x10;
            assert_eq!(Basis::from_bytes(&wrong, 7), None, "byte {at}");
            assert_eq!(Basis::from_bytes(&bytes[..at], 7), None, "cut at {at}");
        }
        // Check what somebody may send who knows the checksum
        let mut endless = basis.clone();
        endless.answers.stiffness[3] = f64::NAN;
        assert_eq!(Basis::from_bytes(&endless.to_bytes(7), 7), None);
        let mut longer = bytes[..bytes.len() - SUM].to_vec();
        longer.extend([0; 8]);
        longer.extend(digest(&longer).to_le_bytes());
        assert_eq!(Basis::from_bytes(&longer, 7), None);
    }
}
