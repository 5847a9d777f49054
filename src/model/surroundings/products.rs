//! Products of a tall matrix with few columns, eight rows at once: what a reduced model costs in a tick.

use crate::body::kernel::{InstructionSet, LANES, Lane, Simd, Work};
use crate::linear_algebra::Matrix;

/// Eight numbers in one cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Line(Lane);

/// Columns of the same length, padded with zeros to whole lines.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    lines: Vec<Line>,
    /// Lines per column.
    height: usize,
    rows: usize,
    set: InstructionSet,
}

impl Columns {
    /// The columns of `matrix`.
    pub(super) fn new(matrix: &Matrix) -> Self {
        let (rows, height) = (matrix.nrows(), matrix.nrows().div_ceil(LANES));
        let mut lines = Vec::with_capacity(height * matrix.ncols());
        for column in matrix.column_iter() {
            lines.extend(column.as_slice().chunks(LANES).map(|chunk| {
                let mut line = Line([0.0; LANES]);
                line.0[..chunk.len()].copy_from_slice(chunk);
                line
            }));
        }
        Self { lines, height, rows, set: InstructionSet::detect() }
    }

    /// The columns as they were, without the padding.
    pub(super) fn to_matrix(&self) -> Matrix {
        let columns = self.lines.len() / self.height.max(1);
        let line = |row: usize, column: usize| &self.lines[column * self.height + row / LANES];
        Matrix::from_fn(self.rows, columns, |row, column| line(row, column).0[row % LANES])
    }

    /// out += A^T y for each column of A; `y` has a number per row.
    pub(super) fn project(&self, y: &[f64], out: &mut [f64]) {
        debug_assert!(y.len() == self.rows && out.len() * self.height == self.lines.len());
        self.set.run(Project { columns: self, y, out });
    }

    /// Adds A a to `x` and A b to `y`; they have a number per row, `a` and `b` one per column.
    pub(super) fn combine(&self, [a, b]: [&[f64]; 2], [x, y]: [&mut [f64]; 2]) {
        debug_assert!(x.len() == self.rows && y.len() == self.rows && a.len() * self.height == self.lines.len());
        self.set.run(Combine { columns: self, weights: [a, b], out: [x, y] });
    }
}

struct Project<'a> {
    columns: &'a Columns,
    y: &'a [f64],
    out: &'a mut [f64],
}

impl Work for Project<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { columns, y, out } = self;
        let (y, rest) = y.as_chunks::<LANES>();
        let mut last = [0.0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        let whole = columns.rows / LANES;
        for (out, column) in out.iter_mut().zip(columns.lines.chunks_exact(columns.height)) {
            // Four sums: an addition has to wait for the one before it.
            let mut sums = [s.splat(0.0); 4];
            let mut quads = column[..whole].chunks_exact(4);
            let mut line = 0;
            for quad in &mut quads {
                for n in 0..4 {
                    sums[n] = s.mul_add(s.load(&quad[n].0), s.load(&y[line + n]), sums[n]);
                }
                line += 4;
            }
            for shape in quads.remainder() {
                sums[0] = s.mul_add(s.load(&shape.0), s.load(&y[line]), sums[0]);
                line += 1;
            }
            if let Some(shape) = column.get(whole) {
                sums[1] = s.mul_add(s.load(&shape.0), s.load(&last), sums[1]);
            }
            let mut total = [0.0; LANES];
            s.store(s.add(s.add(sums[0], sums[1]), s.add(sums[2], sums[3])), &mut total);
            *out += (total[0] + total[4]) + (total[1] + total[5]) + ((total[2] + total[6]) + (total[3] + total[7]));
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
        let height = self.columns.height;
        for (line, (x, y)) in x.chunks_mut(LANES).zip(y.chunks_mut(LANES)).enumerate() {
            let (mut sum_a, mut sum_b) = (s.splat(0.0), s.splat(0.0));
            let mut at = line;
            for (&a, &b) in a.iter().zip(b) {
                let shape = s.load(&self.columns.lines[at].0);
                sum_a = s.mul_add(shape, s.splat(a), sum_a);
                sum_b = s.mul_add(shape, s.splat(b), sum_b);
                at += height;
            }
            let (mut of_a, mut of_b) = ([0.0; LANES], [0.0; LANES]);
            s.store(sum_a, &mut of_a);
            s.store(sum_b, &mut of_b);
            x.iter_mut().zip(&of_a).for_each(|(x, of_a)| *x += of_a);
            y.iter_mut().zip(&of_b).for_each(|(y, of_b)| *y += of_b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_plain_sums_for_every_instruction_set() {
        let number = |n: usize| (1.7 * n as f64).sin();
        for rows in [1, 7, 8, 9, 33, 76 * 3] {
            let states = 5;
            let matrix = Matrix::from_fn(rows, states, |row, state| number(state * rows + row));
            let y: Vec<f64> = (0..rows).map(|n| number(n + 1000)).collect();
            let weights: [Vec<f64>; 2] = [2000, 3000].map(|at| (0..states).map(|n| number(n + at)).collect());
            for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
                let columns = Columns { set, ..Columns::new(&matrix) };
                let mut out = vec![1.0; states];
                columns.project(&y, &mut out);
                for (state, out) in out.iter().enumerate() {
                    let expected: f64 = (0..rows).map(|row| matrix[(row, state)] * y[row]).sum();
                    assert!((out - 1.0 - expected).abs() < 1e-12, "{set:?}, {rows} rows");
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
