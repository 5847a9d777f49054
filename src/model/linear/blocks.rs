//! The 3 x 3 blocks of a matrix that are not zero: a node answers to its neighbours, not to all nodes of its patch.

use nalgebra::{DMatrix, DVector};

/// Above this share of blocks that are not zero the whole matrix is the quicker one.
const DENSE: f64 = 0.5;

/// Blocks by columns of three, from the first to the last, and in them by rows of three.
///
/// A product adds up in the order in which that of the whole matrix does, but for its zeros: it is the same to the last bit.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Of each column of blocks the end of its part of the others.
    ends: Vec<u32>,
    rows: Vec<u32>,
    /// By columns.
    numbers: Vec<[f64; 9]>,
}

impl Blocks {
    /// Takes those of `matrix`; none if most are not zero.
    pub(super) fn take(&mut self, matrix: &DMatrix<f64>) {
        let (rows, columns) = (matrix.nrows() / 3, matrix.ncols() / 3);
        let most = (DENSE * (rows * columns) as f64) as usize;
        self.fill();
        if rows == 0 {
            return;
        }
        for columns in matrix.as_slice().chunks_exact(9 * rows) {
            let (first, others) = columns.split_at(3 * rows);
            let (second, third) = others.split_at(3 * rows);
            let parts = first.as_chunks::<3>().0.iter().zip(second.as_chunks::<3>().0).zip(third.as_chunks::<3>().0);
            for (row, (([a, b, c], [d, e, f]), [g, h, i])) in parts.enumerate() {
                let block = [*a, *b, *c, *d, *e, *f, *g, *h, *i];
                if block != [0.0; 9] {
                    self.rows.push(row as u32);
                    self.numbers.push(block);
                }
            }
            self.ends.push(self.rows.len() as u32);
            if self.rows.len() > most {
                return self.fill();
            }
        }
    }

    /// Has none any more: most of the matrix is not zero.
    pub(super) fn fill(&mut self) {
        self.ends.clear();
        self.rows.clear();
        self.numbers.clear();
    }

    /// Adds the product of the columns of `matrix`, whose blocks these are, from `first` on, as many as `by` has numbers, with `by`.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub(super) fn add_product(&self, matrix: &DMatrix<f64>, first: usize, by: &DVector<f64>, to: &mut DVector<f64>) {
        if self.ends.is_empty() {
            return to.gemv(1.0, &matrix.columns(first, by.len()), by, 1.0);
        }
        let (first, by, to) = (first / 3, by.as_slice(), to.as_mut_slice());
        let (by, to) = (by.as_chunks::<3>().0, to.as_chunks_mut::<3>().0);
        let mut begin = if first == 0 { 0 } else { self.ends[first - 1] as usize };
        for (&end, &[x, y, z]) in self.ends[first..].iter().zip(by) {
            let part = begin..end as usize;
            begin = part.end;
            for (&row, [a, b, c, d, e, f, g, h, i]) in self.rows[part.clone()].iter().zip(&self.numbers[part]) {
                let [p, q, r] = &mut to[row as usize];
                *p = *p + a * x + d * y + g * z;
                *q = *q + b * x + e * y + h * z;
                *r = *r + c * x + f * y + i * z;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(n: usize) -> f64 {
        (1.7 * n as f64).sin()
    }

    #[test]
    fn a_product_of_the_blocks_is_that_of_the_matrix_to_the_last_bit() {
        let mut matrix = DMatrix::zeros(15, 30);
        for (n, (row, column)) in
            [(0, 0), (2, 0), (1, 1), (4, 3), (0, 5), (3, 9), (4, 9), (1, 7)].into_iter().enumerate()
        {
            let block = DMatrix::from_fn(3, 3, |i, j| some(9 * n + 3 * i + j));
            matrix.view_mut((3 * row, 3 * column), (3, 3)).copy_from(&block);
        }
        let mut blocks = Blocks::default();
        blocks.take(&matrix);
        assert_eq!(blocks.numbers.len(), 8);
        // All of it, and the second half alone.
        for (first, count) in [(0, 30), (15, 15)] {
            let by = DVector::from_fn(count, |i, _| some(i + 100));
            let begin = DVector::from_fn(15, |i, _| some(i + 200));
            let (mut whole, mut parts) = (begin.clone(), begin);
            whole.gemv(1.0, &matrix.columns(first, count), &by, 1.0);
            blocks.add_product(&matrix, first, &by, &mut parts);
            assert_eq!(whole, parts);
        }
    }

    #[test]
    fn a_matrix_that_is_full_is_multiplied_as_it_is() {
        let (matrix, by, mut to) =
            (DMatrix::from_element(6, 12, 2.0), DVector::from_element(6, 1.0), DVector::zeros(6));
        let mut blocks = Blocks::default();
        blocks.take(&matrix);
        blocks.add_product(&matrix, 6, &by, &mut to);
        assert_eq!((blocks.numbers.len(), to), (0, DVector::from_element(6, 12.0)));
    }
}
