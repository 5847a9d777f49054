//! Products of a tall matrix with few columns: what a reduced model costs in a tick. All of the matrix is read twice in each step, so
//! that what counts is how much memory it takes, and that it is read from one end to the other.

use crate::body::kernel::{InstructionSet, LANES, Lane, Simd, Work};
use crate::linear_algebra::Matrix;

/// Lines of eight rows in a tile.
const LINES: usize = 4;
const TILE: usize = LINES * LANES;

/// So many rows of one column, in single precision: shapes of reduced surroundings are exact to some per cent, and half as much
/// memory is read. All sums are in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Tile([[f32; LANES]; LINES]);

/// Columns of the same length, padded with zeros to whole tiles: those of the first rows, column by column, then of the next.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    tiles: Vec<Tile>,
    columns: usize,
    rows: usize,
    set: InstructionSet,
}

impl Columns {
    /// The columns of `matrix`, rounded to single precision.
    pub(super) fn new(matrix: &Matrix) -> Self {
        let (rows, columns) = matrix.shape();
        let entry = |row: usize, column: usize| if row < rows { matrix[(row, column)] as f32 } else { 0.0 };
        let tile = |first: usize, column: usize| {
            let line = |line: usize| std::array::from_fn(|lane| entry(first + line * LANES + lane, column));
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

    /// The columns without the padding.
    pub(super) fn to_matrix(&self) -> Matrix {
        let tile = |row: usize, column: usize| &self.tiles[row / TILE * self.columns + column].0;
        let entry = |row: usize, column: usize| tile(row, column)[row % TILE / LANES][row % LANES];
        Matrix::from_fn(self.rows, self.columns, |row, column| f64::from(entry(row, column)))
    }

    /// out = A^T y for each column of A; `y` has a number per row, `sums` and `out` one per column.
    pub(super) fn project(&self, y: &[f64], sums: &mut [Lane], out: &mut [f64]) {
        debug_assert!(y.len() == self.rows && sums.len() == self.columns && out.len() == self.columns);
        self.set.run(Project { columns: self, y, sums, out });
    }

    /// Adds A a to `x` and A b to `y`; they have a number per row, `a` and `b` one per column.
    pub(super) fn combine(&self, [a, b]: [&[f64]; 2], [x, y]: [&mut [f64]; 2]) {
        debug_assert!(x.len() == self.rows && y.len() == self.rows && a.len() == self.columns);
        self.set.run(Combine { columns: self, weights: [a, b], out: [x, y] });
    }

    /// All columns of `TILE` rows after the other.
    #[inline(always)]
    fn by_rows(&self) -> impl Iterator<Item = &[Tile]> {
        self.tiles.chunks_exact(self.columns.max(1))
    }
}

struct Project<'a> {
    columns: &'a Columns,
    y: &'a [f64],
    sums: &'a mut [Lane],
    out: &'a mut [f64],
}

impl Work for Project<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { columns, y, sums, out } = self;
        sums.fill([0.0; LANES]);
        for (tiles, y) in columns.by_rows().zip(y.chunks(TILE)) {
            let mut lines = [[0.0; LANES]; LINES];
            lines.as_flattened_mut()[..y.len()].copy_from_slice(y);
            let mut y = [s.splat(0.0); LINES];
            for line in 0..LINES {
                y[line] = s.load(&lines[line]);
            }
            for (Tile(tile), sum) in tiles.iter().zip(&mut *sums) {
                let mut total = s.load(sum);
                for line in 0..LINES {
                    total = s.mul_add(s.load_single(&tile[line]), y[line], total);
                }
                s.store(total, sum);
            }
        }
        for (out, sum) in out.iter_mut().zip(&*sums) {
            *out = (sum[0] + sum[4]) + (sum[1] + sum[5]) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
        }
    }
}

struct Combine<'a> {
    columns: &'a Columns,
    weights: [&'a [f64]; 2],
    out: [&'a mut [f64]; 2],
}

impl Work for Combine<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let [a, b] = self.weights;
        let [x, y] = self.out;
        for (tiles, (x, y)) in self.columns.by_rows().zip(x.chunks_mut(TILE).zip(y.chunks_mut(TILE))) {
            let (mut of_a, mut of_b) = ([s.splat(0.0); LINES], [s.splat(0.0); LINES]);
            for (Tile(tile), (&a, &b)) in tiles.iter().zip(a.iter().zip(b)) {
                let (a, b) = (s.splat(a), s.splat(b));
                for line in 0..LINES {
                    let shape = s.load_single(&tile[line]);
                    of_a[line] = s.mul_add(shape, a, of_a[line]);
                    of_b[line] = s.mul_add(shape, b, of_b[line]);
                }
            }
            let mut sums = [[[0.0; LANES]; LINES]; 2];
            for line in 0..LINES {
                s.store(of_a[line], &mut sums[0][line]);
                s.store(of_b[line], &mut sums[1][line]);
            }
            x.iter_mut().zip(sums[0].as_flattened()).for_each(|(x, of_a)| *x += of_a);
            y.iter_mut().zip(sums[1].as_flattened()).for_each(|(y, of_b)| *y += of_b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_plain_sums_for_every_instruction_set() {
        let number = |n: usize| (1.7 * n as f64).sin();
        for rows in [1, 7, 8, 9, 31, 32, 33, 76 * 3] {
            let states = 5;
            // Numbers that single precision has.
            let matrix = Matrix::from_fn(rows, states, |row, state| f64::from(number(state * rows + row) as f32));
            let y: Vec<f64> = (0..rows).map(|n| number(n + 1000)).collect();
            let weights: [Vec<f64>; 2] = [2000, 3000].map(|at| (0..states).map(|n| number(n + at)).collect());
            for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
                let columns = Columns { set, ..Columns::new(&matrix) };
                assert_eq!(columns.to_matrix(), matrix);
                let (mut out, mut sums) = (vec![1.0; states], vec![[1.0; LANES]; states]);
                columns.project(&y, &mut sums, &mut out);
                for (state, out) in out.iter().enumerate() {
                    let expected: f64 = (0..rows).map(|row| matrix[(row, state)] * y[row]).sum();
                    assert!((out - expected).abs() < 1e-12, "{set:?}, {rows} rows");
                }
                let mut sums = [vec![1.0; rows], vec![2.0; rows]];
                let [x, v] = &mut sums;
                columns.combine([&weights[0], &weights[1]], [x, v]);
                for row in 0..rows {
                    for (n, sums) in sums.iter().enumerate() {
                        let at = |state: usize| matrix[(row, state)] * weights[n][state];
                        let expected = (0..states).map(at).sum::<f64>() + 1.0 + n as f64;
                        assert!((sums[row] - expected).abs() < 1e-12, "{set:?}, {rows} rows");
                    }
                }
            }
        }
    }
}
