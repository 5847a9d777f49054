//! Products of a tall matrix with few columns: what a reduced model costs in a tick. All of the matrix is read twice in each step, so
//! that what counts is how much memory it takes, and that it is read from one end to the other.

use crate::body::kernel::{InstructionSet, LANES, Simd, Singles, Work};
use crate::linear_algebra::Matrix;

/// Lines in a tile, and the rows of a line.
const LINES: usize = 2;
const LINE: usize = 4 * LANES;
const TILE: usize = LINES * LINE;
/// Eights of singles that a tile makes.
const PIECES: usize = TILE / (2 * LANES);

/// What is smaller than this counts as nothing: products of such numbers are a hundred times slower than others.
const NOTHING: f32 = 1.0 / (1_u64 << 63) as f32;

/// So many rows of one column, each number in sixteen bits (the upper half of a single: to 0.4 % of itself). Shapes of reduced
/// surroundings are exact to some per cent of what they correct. Each word has the row of its place in its lower half, and
/// the one 16 rows further on in its upper half.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Tile([[u32; 2 * LANES]; LINES]);

/// Columns of the same length, padded with zeros to whole tiles: those of the first rows, column by column, then of the next.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    tiles: Vec<Tile>,
    columns: usize,
    rows: usize,
    set: InstructionSet,
}

/// Working memory of products.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// A number per row, padded to whole tiles: the padding of what is projected stays zero.
    given: Vec<[Singles; PIECES]>,
    found: Vec<[Singles; PIECES]>,
    /// Sixteen sums per column.
    sums: Vec<Singles>,
    /// A number per column.
    weights: Vec<f32>,
}

impl Columns {
    /// The columns of `matrix`, rounded.
    pub(super) fn new(matrix: &Matrix) -> Self {
        let (rows, columns) = matrix.shape();
        let entry = |row: usize, column: usize| if row < rows { matrix[(row, column)] as f32 } else { 0.0 };
        let tile = |first: usize, column: usize| {
            let word = |row: usize| word(entry(row, column), entry(row + 2 * LANES, column));
            let line = |line: usize| std::array::from_fn(|lane| word(first + line * LINE + lane));
            Tile(std::array::from_fn(line))
        };
        let tiles = (0..rows).step_by(TILE).flat_map(|first| (0..columns).map(move |column| (first, column)));
        Self {
            tiles: tiles.map(|(first, column)| tile(first, column)).collect(),
            columns,
            rows,
            set: InstructionSet::detect(),
        }
    }

    /// Rows and columns.
    pub(super) fn shape(&self) -> (usize, usize) {
        (self.rows, self.columns)
    }

    /// The columns as they are rounded, without the padding.
    pub(super) fn to_matrix(&self) -> Matrix {
        let entry = |row: usize, column: usize| {
            let Tile(lines) = &self.tiles[row / TILE * self.columns + column];
            let word = lines[row % TILE / LINE][row % (2 * LANES)];
            f32::from_bits(if row % LINE < 2 * LANES { word << 16 } else { word })
        };
        Matrix::from_fn(self.rows, self.columns, |row, column| f64::from(entry(row, column)))
    }

    /// Working memory for products with it.
    pub(super) fn scratch(&self) -> Scratch {
        let rows = vec![[[0.0; 2 * LANES]; PIECES]; self.rows.div_ceil(TILE)];
        Scratch {
            given: rows.clone(),
            found: rows,
            sums: vec![[0.0; 2 * LANES]; self.columns],
            weights: vec![0.0; self.columns],
        }
    }

    /// out = A^T y; `y` has a number per row, `out` one per column.
    pub(super) fn project(&self, y: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        assert!(y.len() == self.rows && out.len() == self.columns);
        let Scratch { given, sums, .. } = scratch;
        given.as_flattened_mut().as_flattened_mut().iter_mut().zip(y).for_each(|(single, &y)| *single = rounded(y));
        self.set.run(Project { columns: self, y: given, sums });
        for (out, sum) in out.iter_mut().zip(&*sums) {
            let halves: [f64; LANES] = std::array::from_fn(|n| f64::from(sum[n]) + f64::from(sum[n + LANES]));
            let [a, b, c, d, e, f, g, h] = halves;
            *out = ((a + e) + (b + f)) + ((c + g) + (d + h));
        }
    }

    /// out = A weights; `out` has a number per row, `weights` one per column.
    pub(super) fn combine(&self, weights: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        assert!(out.len() == self.rows && weights.len() == self.columns);
        let Scratch { found, weights: singles, .. } = scratch;
        singles.iter_mut().zip(weights).for_each(|(single, &weight)| *single = rounded(weight));
        self.set.run(Combine { columns: self, weights: singles, out: found });
        out.iter_mut().zip(found.as_flattened().as_flattened()).for_each(|(out, &single)| *out = f64::from(single));
    }

    /// All columns of `TILE` rows after the other.
    #[inline(always)]
    fn by_rows(&self) -> impl Iterator<Item = &[Tile]> {
        self.tiles.chunks_exact(self.columns.max(1))
    }
}

/// Two numbers in one word. The word as a single is the upper one: it is rounded so that with what the lower one adds it comes
/// nearest to the number.
fn word(lower: f32, upper: f32) -> u32 {
    let low = if lower.abs() < NOTHING { 0 } else { (lower.to_bits() + 0x8000) >> 16 };
    // Never nothing, as the lower one would be left; but next to it.
    let size = upper.abs().max(NOTHING).to_bits();
    let sign = upper.to_bits() & 1 << 31;
    sign | ((size + 0x8000 - low) >> 16) << 16 | low
}

/// As a single, or nothing.
#[inline(always)]
pub(super) fn rounded(x: f64) -> f32 {
    // Written so that what is no number stays none.
    if x.abs() < f64::from(NOTHING) { 0.0 } else { x as f32 }
}

struct Project<'a> {
    columns: &'a Columns,
    y: &'a [[Singles; PIECES]],
    sums: &'a mut [Singles],
}

impl Work for Project<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { columns, y, sums } = self;
        sums.fill([0.0; 2 * LANES]);
        for (tiles, y) in columns.by_rows().zip(y) {
            let mut factors = [s.splat_single(0.0); PIECES];
            for piece in 0..PIECES {
                factors[piece] = s.load_singles(&y[piece]);
            }
            for (Tile(lines), sum) in tiles.iter().zip(&mut *sums) {
                let mut total = s.load_singles(sum);
                for line in 0..LINES {
                    let [lower, upper] = s.load_halves(&lines[line]);
                    total = s.mul_add_single(lower, factors[2 * line], total);
                    total = s.mul_add_single(upper, factors[2 * line + 1], total);
                }
                s.store_singles(total, sum);
            }
        }
    }
}

struct Combine<'a> {
    columns: &'a Columns,
    weights: &'a [f32],
    out: &'a mut [[Singles; PIECES]],
}

impl Work for Combine<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { columns, weights, out } = self;
        for (tiles, out) in columns.by_rows().zip(out) {
            // Two sums for every row, of every other column: additions of one would wait for each other.
            let mut sums = [[s.splat_single(0.0); PIECES]; 2];
            for (tiles, weights) in tiles.chunks(2).zip(weights.chunks(2)) {
                for (n, (Tile(lines), &weight)) in tiles.iter().zip(weights).enumerate() {
                    let weight = s.splat_single(weight);
                    for line in 0..LINES {
                        let [lower, upper] = s.load_halves(&lines[line]);
                        sums[n][2 * line] = s.mul_add_single(lower, weight, sums[n][2 * line]);
                        sums[n][2 * line + 1] = s.mul_add_single(upper, weight, sums[n][2 * line + 1]);
                    }
                }
            }
            let one = s.splat_single(1.0);
            for piece in 0..PIECES {
                s.store_singles(s.mul_add_single(sums[0][piece], one, sums[1][piece]), &mut out[piece]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(n: usize) -> f64 {
        (1.7 * n as f64).sin()
    }

    #[test]
    fn products_agree_with_plain_sums_for_every_instruction_set() {
        for rows in [1, 15, 16, 17, 31, 32, 33, 64, 65, 76 * 3] {
            for states in [1, 4, 5] {
                let matrix = Matrix::from_fn(rows, states, |row, state| number(state * rows + row));
                let y: Vec<f64> = (0..rows).map(|n| number(n + 1000)).collect();
                let weights: Vec<f64> = (0..states).map(|n| number(n + 2000)).collect();
                for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
                    let columns = Columns { set, ..Columns::new(&matrix) };
                    let (rounded, mut scratch) = (columns.to_matrix(), columns.scratch());
                    let mut out = vec![1.0; states];
                    columns.project(&y, &mut scratch, &mut out);
                    for (state, out) in out.iter().enumerate() {
                        let expected: f64 = (0..rows).map(|row| rounded[(row, state)] * y[row]).sum();
                        assert!((out - expected).abs() < 1e-5, "{set:?}, {rows} rows");
                    }
                    let mut out = vec![1.0; rows];
                    columns.combine(&weights, &mut scratch, &mut out);
                    for (row, out) in out.iter().enumerate() {
                        let expected: f64 = (0..states).map(|state| rounded[(row, state)] * weights[state]).sum();
                        assert!((out - expected).abs() < 1e-6, "{set:?}, {rows} rows");
                    }
                }
            }
        }
    }

    #[test]
    fn numbers_are_rounded_by_at_most_a_part_in_256_once_and_zeros_are_next_to_nothing() {
        let of = |n: usize| if n.is_multiple_of(7) { 0.0 } else { number(n) * 10_f64.powi((n % 13) as i32 - 6) };
        let matrix = Matrix::from_fn(100, 3, |row, column| of(100 * column + row));
        let columns = Columns::new(&matrix);
        let rounded = columns.to_matrix();
        for (rounded, exact) in rounded.iter().zip(matrix.iter()) {
            assert!((rounded - exact).abs() <= exact.abs() / 255.0 + 1e-18, "{exact} {rounded}");
            assert!(*rounded == 0.0 || (*rounded as f32).is_normal());
        }
        assert_eq!(Columns::new(&rounded), columns);
    }

    #[test]
    fn what_is_no_number_does_not_vanish() {
        let columns = Columns::new(&Matrix::from_element(3, 2, 1.0));
        let (mut scratch, mut out) = (columns.scratch(), [0.0; 2]);
        columns.project(&[0.0, f64::NAN, 0.0], &mut scratch, &mut out);
        assert!(out.iter().all(|x| x.is_nan()));
    }
}
