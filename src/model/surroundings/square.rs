//! Products of a square matrix with a vector, sixteen rows at once.

use super::products::rounded;
use crate::body::kernel::{InstructionSet, LANES, Simd, Singles, Work};
use crate::linear_algebra::Matrix;

/// Rows at once.
const LINE: usize = 2 * LANES;
/// Sixteens of rows that are summed in registers.
const PIECES: usize = 4;

/// A square matrix in singles, padded with zeros to whole pieces of rows: those of the first rows, column by column, then of the next.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Square {
    pieces: Vec<[Singles; PIECES]>,
    size: usize,
    set: InstructionSet,
}

/// Working memory of products.
#[derive(Clone, Debug, Default)]
pub(super) struct SquareScratch {
    given: Vec<f32>,
    found: Vec<[Singles; PIECES]>,
}

impl Square {
    /// Of `size` rows and columns, the rounded entry of row and column each.
    pub(super) fn new(size: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let padded = |row: usize, column: usize| if row < size { rounded(entry(row, column)) } else { 0.0 };
        let piece = |first: usize, column: usize| -> [Singles; PIECES] {
            std::array::from_fn(|n| std::array::from_fn(|lane| padded(first + n * LINE + lane, column)))
        };
        let firsts = (0..size).step_by(PIECES * LINE);
        let pieces = firsts.flat_map(|first| (0..size).map(move |column| (first, column)));
        Self {
            pieces: pieces.map(|(first, column)| piece(first, column)).collect(),
            size,
            set: InstructionSet::detect(),
        }
    }

    /// The number of its rows.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// Its entries as they are rounded.
    pub(super) fn to_matrix(&self) -> Matrix {
        Matrix::from_fn(self.size, self.size, |row, column| {
            let piece = &self.pieces[row / (PIECES * LINE) * self.size + column];
            f64::from(piece.as_flattened()[row % (PIECES * LINE)])
        })
    }

    /// Working memory for products with it.
    pub(super) fn scratch(&self) -> SquareScratch {
        let rows = self.size.div_ceil(PIECES * LINE);
        SquareScratch { given: vec![0.0; self.size], found: vec![[[0.0; LINE]; PIECES]; rows] }
    }

    /// out = A x.
    pub(super) fn times(&self, x: &[f64], scratch: &mut SquareScratch, out: &mut [f64]) {
        assert!(x.len() == self.size && out.len() == self.size);
        let SquareScratch { given, found } = scratch;
        given.iter_mut().zip(x).for_each(|(single, &x)| *single = rounded(x));
        self.set.run(Times { square: self, x: given, out: found });
        out.iter_mut().zip(found.as_flattened().as_flattened()).for_each(|(out, &single)| *out = f64::from(single));
    }
}

struct Times<'a> {
    square: &'a Square,
    x: &'a [f32],
    out: &'a mut [[Singles; PIECES]],
}

impl Work for Times<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { square, x, out } = self;
        for (columns, out) in square.pieces.chunks_exact(square.size.max(1)).zip(out) {
            let mut sums = [s.splat_single(0.0); PIECES];
            for (column, &x) in columns.iter().zip(x) {
                let x = s.splat_single(x);
                for piece in 0..PIECES {
                    sums[piece] = s.mul_add_single(s.load_singles(&column[piece]), x, sums[piece]);
                }
            }
            for piece in 0..PIECES {
                s.store_singles(sums[piece], &mut out[piece]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_plain_sums_for_every_instruction_set() {
        for size in [0, 1, 15, 16, 64, 65, 130] {
            let of = |row: usize, column: usize| (1.7 * (row * size + column) as f64).sin();
            let x: Vec<f64> = (0..size).map(|n| (0.3 * n as f64).cos()).collect();
            for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
                let square = Square { set, ..Square::new(size, of) };
                let mut out = vec![1.0; size];
                square.times(&x, &mut square.scratch(), &mut out);
                for (row, out) in out.iter().enumerate() {
                    let expected: f64 = (0..size).map(|column| of(row, column) * x[column]).sum();
                    assert!((out - expected).abs() < 2e-5, "{set:?}, {size} rows");
                }
                assert_eq!(Square { set, ..Square::new(size, |i, j| square.to_matrix()[(i, j)]) }, square);
            }
        }
    }
}
