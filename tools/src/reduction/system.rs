//! A linear mechanical system with sparse matrices, and what goes in and comes out.

use std::collections::HashMap;

use palpate::model::ModelError;

use super::linalg::{Matrix, SparseFactor, product_t, side_by_side, span};

/// How far damping may be from alpha M + beta K, entry by entry and relative to its largest, to count as proportional.
const PROPORTIONAL: f64 = 1e-9;

/// The ports of a system of n coordinates, what goes into it and what comes out: y = D u + P^T x + V^T x', with B u on the right-hand side.
#[derive(Clone, Debug, PartialEq)]
pub struct Ports {
    /// B, n x m.
    pub input: Matrix,
    /// P, n x p.
    pub position: Matrix,
    /// V, n x p.
    pub velocity: Matrix,
    /// D, p x m.
    pub direct: Matrix,
}

impl Ports {
    /// Forces along the columns of `directions` (n x m) go in, displacements along them come out: a compliance.
    pub fn compliance(directions: Matrix) -> Self {
        let (n, m) = directions.shape();
        Self {
            position: directions.clone(),
            input: directions,
            velocity: Matrix::zeros(n, m),
            direct: Matrix::zeros(m, m),
        }
    }

    /// Displacements of held coordinates go in, the forces that hold them come out: y = K_ii u + K_if x + C_if x' and
    /// -K_fi u on the right-hand side, the reading of the paper's section 2 that its tables follow. `stiffness` is K_fi and
    /// `damping` C_fi (n x m), `direct` K_ii (m x m).
    pub fn held(stiffness: Matrix, damping: Matrix, direct: Matrix) -> Self {
        Self { input: -&stiffness, position: stiffness, velocity: damping, direct }
    }

    /// The ports of coordinates z with x = T z, for the columns of `basis` T.
    pub(super) fn project(&self, basis: &Matrix) -> Self {
        self.each(|matrix| product_t(basis, matrix))
    }

    /// The ports with `of` done to B, P and V.
    fn each(&self, of: impl Fn(&Matrix) -> Matrix) -> Self {
        let [input, position, velocity] = [&self.input, &self.position, &self.velocity].map(of);
        Self { input, position, velocity, direct: self.direct.clone() }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.input.ncols()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.position.ncols()
    }

    /// Every direction in which something goes in or comes out, as orthonormal columns.
    pub(super) fn directions(&self) -> Matrix {
        let all = side_by_side(&[&self.input, &self.position, &self.velocity]);
        span(&all, 1e-9)
    }
}

/// C = alpha M + beta K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rayleigh {
    /// alpha (1/s).
    pub mass: f64,
    /// beta (s).
    pub stiffness: f64,
}

/// M x'' + C x' + K x = B u with symmetric sparse M, C and K, and y as [`Ports`] say. K has the sign of a stiffness: it is
/// positive definite where the body is held.
#[derive(Clone, Debug)]
pub struct SecondOrder {
    n: usize,
    /// The lower triangle, each place once.
    entries: Vec<Entry>,
    /// The order in which the coordinates are eliminated, if a good one is known.
    order: Option<Vec<usize>>,
    /// The ports of the system.
    pub ports: Ports,
}

/// A row, a column, and what M, C and K have there.
type Entry = ((usize, usize), [f64; 3]);

/// The place of a matrix in an [`Entry`].
const MASS: usize = 0;
const DAMPING: usize = 1;
const STIFFNESS: usize = 2;

/// Collects the entries of the three matrices; those of the same place are added.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    at: HashMap<(usize, usize), usize>,
    entries: Vec<Entry>,
}

impl Assembly {
    /// Adds to the entries of M, C and K at a row and a column; those above the diagonal are left out.
    pub(super) fn add(&mut self, row: usize, column: usize, values: [f64; 3]) {
        if row < column {
            return;
        }
        let place = *self.at.entry((row, column)).or_insert_with(|| {
            self.entries.push(((row, column), [0.0; 3]));
            self.entries.len() - 1
        });
        for (sum, value) in self.entries[place].1.iter_mut().zip(values) {
            *sum += value;
        }
    }

    /// Rows and columns that have entries.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> + Clone {
        self.entries.iter().map(|&(place, _)| place)
    }

    pub(super) fn build(self, n: usize, ports: Ports) -> SecondOrder {
        SecondOrder { n, entries: self.entries, order: None, ports }
    }
}

impl SecondOrder {
    /// A system of `n` coordinates from the entries (row, column, value) of the lower triangles of M, C and K; entries of the
    /// same place are added, those above the diagonal left out.
    ///
    /// # Errors
    /// If an entry lies outside, a number is not finite, or the ports belong to another number of coordinates.
    #[cfg(test)]
    pub fn new(
        n: usize,
        mass: &[(usize, usize, f64)],
        damping: &[(usize, usize, f64)],
        stiffness: &[(usize, usize, f64)],
        ports: Ports,
    ) -> Result<Self, ModelError> {
        check(n, &ports)?;
        let refuse = |message: &str| Err(ModelError::new(format!("a linear system: {message}")));
        let mut assembly = Assembly::default();
        for (which, entries) in [mass, damping, stiffness].into_iter().enumerate() {
            for &(row, column, value) in entries {
                if row >= n || column >= n {
                    return refuse("an entry lies outside of the matrix");
                }
                if !value.is_finite() {
                    return refuse("an entry is not finite");
                }
                let mut values = [0.0; 3];
                values[which] = value;
                assembly.add(row, column, values);
            }
        }
        Ok(assembly.build(n, ports))
    }

    /// Number of coordinates n; the order, the number of states, is 2 n.
    pub fn coordinates(&self) -> usize {
        self.n
    }

    /// Number of states: positions and velocities.
    pub fn order(&self) -> usize {
        2 * self.n
    }

    fn dense(&self, which: usize) -> Matrix {
        let mut out = Matrix::zeros(self.n, self.n);
        for &((row, column), values) in &self.entries {
            out[(row, column)] = values[which];
            out[(column, row)] = values[which];
        }
        out
    }

    /// M, n x n.
    pub fn mass(&self) -> Matrix {
        self.dense(MASS)
    }

    /// C, n x n.
    pub fn damping(&self) -> Matrix {
        self.dense(DAMPING)
    }

    /// K, n x n.
    pub fn stiffness(&self) -> Matrix {
        self.dense(STIFFNESS)
    }

    /// The diagonal of M if there is nothing else in it.
    pub(super) fn lumped_mass(&self) -> Option<Vec<f64>> {
        let mut diagonal = vec![0.0; self.n];
        for &((row, column), values) in &self.entries {
            match row == column {
                true => diagonal[row] = values[MASS],
                false if values[MASS] != 0.0 => return None,
                false => {}
            }
        }
        Some(diagonal)
    }

    fn times(&self, which: usize, columns: &Matrix) -> Matrix {
        // Eight columns at once, side by side: an entry is read once for all of them.
        const WIDE: usize = 8;
        let mut out = Matrix::zeros(self.n, columns.ncols());
        let (mut from, mut to) = (vec![[0.0; WIDE]; self.n], vec![[0.0; WIDE]; self.n]);
        for first in (0..columns.ncols()).step_by(WIDE) {
            let count = WIDE.min(columns.ncols() - first);
            for lane in 0..count {
                let column = columns.column(first + lane);
                from.iter_mut().zip(column.iter()).for_each(|(from, x)| from[lane] = *x);
            }
            to.fill([0.0; WIDE]);
            for &((row, column), values) in &self.entries {
                let value = values[which];
                if value == 0.0 {
                    continue;
                }
                for lane in 0..WIDE {
                    to[row][lane] += value * from[column][lane];
                }
                if row != column {
                    for lane in 0..WIDE {
                        to[column][lane] += value * from[row][lane];
                    }
                }
            }
            for lane in 0..count {
                let mut column = out.column_mut(first + lane);
                column.iter_mut().zip(&to).for_each(|(out, to)| *out = to[lane]);
            }
        }
        out
    }

    /// M X for the columns of X.
    pub fn times_mass(&self, columns: &Matrix) -> Matrix {
        self.times(MASS, columns)
    }

    /// C X for the columns of X.
    pub fn times_damping(&self, columns: &Matrix) -> Matrix {
        self.times(DAMPING, columns)
    }

    /// K X for the columns of X.
    pub fn times_stiffness(&self, columns: &Matrix) -> Matrix {
        self.times(STIFFNESS, columns)
    }

    /// The factorised s^2 M + s C + K at a real s (rad/s).
    ///
    /// # Errors
    /// If it is not positive definite: nothing holds the body.
    pub(super) fn factorised(&self, s: f64) -> Result<SparseFactor, ModelError> {
        let sum = |&((row, column), [m, c, k]): &Entry| (row, column, s * s * m + s * c + k);
        let entries: Vec<_> = self.entries.iter().map(sum).collect();
        SparseFactor::new(self.n, &entries, self.order.as_deref()).ok_or_else(not_held)
    }

    /// A^-1 X for the columns of X and A = s^2 M + s C + K at a real s (rad/s).
    ///
    /// # Errors
    /// If A is not positive definite: nothing holds the body.
    pub fn solve(&self, s: f64, columns: Matrix) -> Result<Matrix, ModelError> {
        Ok(self.factorised(s)?.solve(columns))
    }

    /// alpha and beta, if C = alpha M + beta K.
    pub fn rayleigh(&self) -> Option<Rayleigh> {
        let entries = || self.entries.iter().map(|&(place, [m, c, k])| (place, m, c, k));
        let coupling = entries().filter(|&((row, column), m, ..)| row != column && m == 0.0);
        let (mass, stiffness) = match coupling.max_by(|a, b| a.3.abs().total_cmp(&b.3.abs())).filter(|at| at.3 != 0.0) {
            // Where there is stiffness alone, beta is known to the last bit.
            Some((_, _, c, k)) => {
                let stiffness = c / k;
                let first = entries().find(|&((row, column), m, ..)| row == column && m > 0.0)?;
                ((first.2 - stiffness * first.3) / first.1, stiffness)
            }
            None => least_squares(entries().map(|(_, m, c, k)| [m, c, k]))?,
        };
        let scale = entries().fold(0.0_f64, |largest, (.., c, k)| largest.max(c.abs()).max((stiffness * k).abs()));
        // What rounding leaves of a difference of equal numbers.
        let heaviest = entries().fold(0.0_f64, |largest, (_, m, ..)| largest.max(m.abs()));
        let mass = if (mass * heaviest).abs() <= PROPORTIONAL * scale { 0.0 } else { mass };
        let is_proportional =
            entries().all(|(_, m, c, k)| (c - mass * m - stiffness * k).abs() <= PROPORTIONAL * scale);
        is_proportional.then_some(Rayleigh { mass, stiffness })
    }

    /// A frequency that is typical of the system (rad/s): sqrt(k/m) in the paper's meshes, from the diagonals of K and M.
    pub fn typical_frequency(&self) -> f64 {
        0.5 * (self.trace(STIFFNESS) / self.trace(MASS)).sqrt()
    }

    fn trace(&self, which: usize) -> f64 {
        self.entries.iter().filter(|((row, column), _)| row == column).map(|(_, values)| values[which]).sum()
    }

    /// trace C / trace K (s).
    pub(super) fn damping_over_stiffness(&self) -> f64 {
        self.trace(DAMPING) / self.trace(STIFFNESS)
    }

    /// The system, to be factorised in the given order of its coordinates.
    pub(super) fn eliminated_in(self, order: Option<Vec<usize>>) -> Self {
        Self { order, ..self }
    }

    /// The system with other ports.
    ///
    /// # Errors
    /// If they do not have a row for each coordinate.
    pub fn with_ports(&self, ports: Ports) -> Result<Self, ModelError> {
        check(self.n, &ports)?;
        Ok(Self { ports, ..self.clone() })
    }

    /// The system of the coordinates in `kept` (in increasing order) while all others are held.
    pub fn part(&self, kept: &[usize]) -> Self {
        let mut place = vec![None; self.n];
        kept.iter().enumerate().for_each(|(new, &old)| place[old] = Some(new));
        let entry = |&((row, column), values): &Entry| Some(((place[row]?, place[column]?), values));
        Self {
            n: kept.len(),
            entries: self.entries.iter().filter_map(entry).collect(),
            order: self.order.as_ref().map(|order| order.iter().filter_map(|&at| place[at]).collect()),
            ports: self.ports.each(|matrix| matrix.select_rows(kept)),
        }
    }
}

/// Refuses ports of another number of coordinates.
fn check(n: usize, ports: &Ports) -> Result<(), ModelError> {
    let fits = [&ports.input, &ports.position, &ports.velocity].iter().all(|matrix| matrix.nrows() == n);
    let error = || ModelError::new("a linear system: the ports must have a row for each coordinate");
    fits.then_some(()).ok_or_else(error)
}

/// alpha and beta that make alpha m + beta k nearest to c over all rows of m, c and k.
fn least_squares(rows: impl Iterator<Item = [f64; 3]>) -> Option<(f64, f64)> {
    let (mut mm, mut mk, mut kk, mut mc, mut kc) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [m, c, k] in rows {
        (mm, mk, kk) = (mm + m * m, mk + m * k, kk + k * k);
        (mc, kc) = (mc + m * c, kc + k * c);
    }
    let determinant = mm * kk - mk * mk;
    if determinant <= 1e-12 * mm * kk {
        // K is a multiple of M: either says the same.
        return (kk > 0.0).then(|| (0.0, kc / kk));
    }
    Some(((mc * kk - kc * mk) / determinant, (kc * mm - mc * mk) / determinant))
}

pub(super) fn not_held() -> ModelError {
    ModelError::of("body.block.fixed", "nothing holds the body, it has no response at rest")
}
