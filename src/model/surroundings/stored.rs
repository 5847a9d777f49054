//! A basis as bytes, to be kept from run to run.

use super::accuracy::Estimate;
use super::basis::Basis;
use super::products::Columns;
use super::reduced::{Damping, Reduced};
use super::resting::digest;
use crate::linear_algebra::Matrix;

/// What the bytes begin with; its number changes with what follows.
const MAGIC: &[u8; 16] = b"palpate-basis-5\n";
const WORD: usize = size_of::<u64>();

impl Basis {
    /// All of it as bytes, with a checksum at the end. `key` comes first: what the basis was made of.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn to_bytes(&self, key: u64) -> Vec<u8> {
        let mut out = Writer(MAGIC.to_vec());
        out.word(key);
        out.ids(&self.patch);
        out.reduced(&self.answers);
        out.numbers(&self.estimate.map(|estimate| estimate.linear_pct).into_iter().collect::<Vec<_>>());
        let sum = digest(&out.0);
        out.word(sum);
        out.0
    }

    /// Reads [`to_bytes`](Self::to_bytes) back; `None` if the bytes are damaged, of another version or of another `key`.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn from_bytes(bytes: &[u8], key: u64) -> Option<Self> {
        let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(WORD)?)?;
        if u64::from_le_bytes(sum.try_into().ok()?) != digest(body) {
            return None;
        }
        let mut from = Reader(body.strip_prefix(MAGIC)?);
        if from.word()? != key {
            return None;
        }
        let (patch, answers) = (from.ids()?, from.reduced()?);
        let estimate = from.numbers()?.first().map(|&linear_pct| Estimate { linear_pct });
        Some(Self { patch, answers, estimate })
    }
}

struct Writer(Vec<u8>);

impl Writer {
    fn word(&mut self, word: u64) {
        self.0.extend_from_slice(&word.to_le_bytes());
    }

    fn ids(&mut self, ids: &[u32]) {
        self.word(ids.len() as u64);
        ids.iter().for_each(|&id| self.word(id.into()));
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.word(numbers.len() as u64);
        numbers.iter().for_each(|x| self.word(x.to_bits()));
    }

    fn columns(&mut self, columns: &Columns) {
        let matrix = columns.to_matrix();
        self.word(matrix.nrows() as u64);
        self.numbers(matrix.as_slice());
    }

    fn reduced(&mut self, model: &Reduced) {
        self.columns(&model.shapes);
        self.numbers(&model.stiffness);
        match &model.damping {
            Damping::Diagonal(damping) => {
                self.word(0);
                self.numbers(damping);
            }
            Damping::Full(damping) => {
                self.word(1);
                self.numbers(damping);
            }
        }
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn word(&mut self) -> Option<u64> {
        let (word, rest) = self.0.split_at_checked(WORD)?;
        self.0 = rest;
        Some(u64::from_le_bytes(word.try_into().ok()?))
    }

    fn words(&mut self) -> Option<impl Iterator<Item = u64> + use<>> {
        let count = usize::try_from(self.word()?).ok()?;
        let (words, rest) = self.0.split_at_checked(count.checked_mul(WORD)?)?;
        self.0 = rest;
        let word = |bytes: &[u8]| u64::from_le_bytes(bytes.try_into().unwrap_or_default());
        Some(words.chunks_exact(WORD).map(word).collect::<Vec<_>>().into_iter())
    }

    fn ids(&mut self) -> Option<Vec<u32>> {
        self.words()?.map(|word| u32::try_from(word).ok()).collect()
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        Some(self.words()?.map(f64::from_bits).collect())
    }

    fn columns(&mut self) -> Option<Columns> {
        let rows = usize::try_from(self.word()?).ok()?;
        let numbers = self.numbers()?;
        let is_matrix = rows > 0 && numbers.len().is_multiple_of(rows);
        is_matrix.then(|| Columns::new(&Matrix::from_vec(rows, numbers.len() / rows, numbers)))
    }

    fn reduced(&mut self) -> Option<Reduced> {
        let (shapes, stiffness) = (self.columns()?, self.numbers()?);
        let damping = match self.word()? {
            0 => Damping::Diagonal(self.numbers()?),
            1 => Damping::Full(self.numbers()?),
            _ => return None,
        };
        Some(Reduced { states: stiffness.len(), shapes, stiffness, damping })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{RestingBody, Size};
    use super::*;
    use crate::body::{Block, Body};
    use crate::mesh::Face;

    #[test]
    fn a_basis_comes_back_whole_and_a_damaged_one_not_at_all() {
        let block = Block::builder([5; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let resting = RestingBody::new(&block).unwrap();
        let mut patch = Vec::new();
        block.patch(&[block.surface().triangles.len() as u32 - 5], [2, 2, 1], &mut patch);
        let basis = Basis::compute(&resting, &patch, Size::ErrorPct(2.0)).unwrap().unwrap();
        assert!(basis.estimate().is_some());
        let bytes = basis.to_bytes(7);
        assert_eq!(Basis::from_bytes(&bytes, 7).as_ref(), Some(&basis));
        assert_eq!(Basis::from_bytes(&bytes, 8), None, "another key");
        for at in (0..bytes.len()).step_by(997) {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0x10;
            assert_eq!(Basis::from_bytes(&wrong, 7), None, "byte {at}");
            assert_eq!(Basis::from_bytes(&bytes[..at], 7), None, "cut at {at}");
        }
    }
}
