//! A linear mechanical system with sparse matrices, and what goes in and comes out.

use std::collections::HashMap;

use nalgebra::Complex;

use palpate::model::sparse::SparseFactor;
use super::linalg::{CMatrix, Matrix};
use palpate::{Error, ErrorKind};

/// How far damping may be from alpha M + beta K, entry by entry and relative to its largest, to count as proportional.
const PROPORTIONAL: f64 = 1e-9;

/// What goes into a system of n coordinates and what comes out: y = D u + P^T x + V^T x', with B u on the right-hand side.
///
/// # Real-time
/// Not real-time safe: allocates. For the analysis of a scene, not for its run.
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
        let project = |matrix: &Matrix| super::linalg::product_t(basis, matrix);
        Self {
            input: project(&self.input),
            position: project(&self.position),
            velocity: project(&self.velocity),
            direct: self.direct.clone(),
        }
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
        let all = super::linalg::side_by_side(&[&self.input, &self.position, &self.velocity]);
        super::linalg::span(&all, 1e-9)
    }
}

/// C = alpha M + beta K.
///
/// # Real-time
/// A plain value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rayleigh {
    /// alpha (1/s).
    pub mass: f64,
    /// beta (s).
    pub stiffness: f64,
}

/// M x'' + C x' + K x = B u with symmetric sparse M, C and K, and y as [`Ports`] say. K has the sign of a stiffness: it is
/// positive definite where the body is held.
///
/// # Real-time
/// Not real-time safe: allocates. For the analysis of a scene, not for its run.
#[derive(Clone, Debug)]
pub struct SecondOrder {
    n: usize,
    /// Rows and columns of the lower triangle, each place once.
    places: Vec<(usize, usize)>,
    mass: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
    /// The order in which the coordinates are eliminated, if a good one is known.
    order: Option<Vec<usize>>,
    /// What goes in and comes out.
    pub ports: Ports,
}

/// Collects the entries of the three matrices; those of the same place are added.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    at: HashMap<(usize, usize), usize>,
    places: Vec<(usize, usize)>,
    values: Vec<[f64; 3]>,
}

impl Assembly {
    /// Adds to the entries of M, C and K at a row and a column; those above the diagonal are left out.
    pub(super) fn add(&mut self, row: usize, column: usize, [mass, damping, stiffness]: [f64; 3]) {
        if row < column {
            return;
        }
        let Self { at, places, values } = self;
        let place = *at.entry((row, column)).or_insert_with(|| {
            places.push((row, column));
            values.push([0.0; 3]);
            places.len() - 1
        });
        for (sum, value) in values[place].iter_mut().zip([mass, damping, stiffness]) {
            *sum += value;
        }
    }

    /// Rows and columns that have entries.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        self.places.iter().copied()
    }

    pub(super) fn build(self, n: usize, ports: Ports) -> SecondOrder {
        let of = |which: usize| self.values.iter().map(|values| values[which]).collect();
        SecondOrder { n, mass: of(0), damping: of(1), stiffness: of(2), places: self.places, order: None, ports }
    }
}

impl SecondOrder {
    /// A system of `n` coordinates from the entries (row, column, value) of the lower triangles of M, C and K; entries of the
    /// same place are added, those above the diagonal left out.
    ///
    /// # Errors
    /// If an entry lies outside, a number is not finite, or the ports belong to another number of coordinates.
    pub fn new(
        n: usize,
        mass: &[(usize, usize, f64)],
        damping: &[(usize, usize, f64)],
        stiffness: &[(usize, usize, f64)],
        ports: Ports,
    ) -> Result<Self, Error> {
        let refuse = |message: &str| Err(Error::new(ErrorKind::Usage, format!("a linear system: {message}")));
        if [&ports.input, &ports.position, &ports.velocity].iter().any(|matrix| matrix.nrows() != n) {
            return refuse("the ports must have a row for each coordinate");
        }
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

    fn dense_of(&self, values: &[f64]) -> Matrix {
        let mut out = Matrix::zeros(self.n, self.n);
        for (&(row, column), &value) in self.places.iter().zip(values) {
            out[(row, column)] = value;
            out[(column, row)] = value;
        }
        out
    }

    /// M, n x n.
    pub fn mass(&self) -> Matrix {
        self.dense_of(&self.mass)
    }

    /// C, n x n.
    pub fn damping(&self) -> Matrix {
        self.dense_of(&self.damping)
    }

    /// K, n x n.
    pub fn stiffness(&self) -> Matrix {
        self.dense_of(&self.stiffness)
    }

    /// The diagonal of M if there is nothing else in it.
    pub(super) fn lumped_mass(&self) -> Option<Vec<f64>> {
        let mut diagonal = vec![0.0; self.n];
        for (&(row, column), &value) in self.places.iter().zip(&self.mass) {
            match row == column {
                true => diagonal[row] = value,
                false if value != 0.0 => return None,
                false => {}
            }
        }
        Some(diagonal)
    }

    fn times(&self, values: &[f64], columns: &Matrix) -> Matrix {
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
            for (&(row, column), &value) in self.places.iter().zip(values) {
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
        self.times(&self.mass, columns)
    }

    /// C X for the columns of X.
    pub fn times_damping(&self, columns: &Matrix) -> Matrix {
        self.times(&self.damping, columns)
    }

    /// K X for the columns of X.
    pub fn times_stiffness(&self, columns: &Matrix) -> Matrix {
        self.times(&self.stiffness, columns)
    }

    /// The factorised s^2 M + s C + K at a real s (rad/s).
    ///
    /// # Errors
    /// If it is not positive definite: nothing holds the body.
    pub(super) fn factorised(&self, s: f64) -> Result<SparseFactor, Error> {
        let values = self.mass.iter().zip(&self.damping).zip(&self.stiffness);
        let entries: Vec<_> = self
            .places
            .iter()
            .zip(values)
            .map(|(&(row, column), ((m, c), k))| (row, column, s * s * m + s * c + k))
            .collect();
        let factor = match &self.order {
            Some(order) => SparseFactor::new_ordered(self.n, &entries, order),
            None => SparseFactor::new(self.n, &entries),
        };
        factor.ok_or_else(not_held)
    }

    /// A^-1 X for the columns of X and A = s^2 M + s C + K at a real s (rad/s).
    ///
    /// # Errors
    /// If A is not positive definite: nothing holds the body.
    pub fn solve(&self, s: f64, columns: Matrix) -> Result<Matrix, Error> {
        Ok(solved(&self.factorised(s)?, columns))
    }

    /// alpha and beta, if C = alpha M + beta K.
    pub fn rayleigh(&self) -> Option<Rayleigh> {
        let rows = self.places.iter().zip(self.mass.iter().zip(&self.damping).zip(&self.stiffness));
        let entries = || rows.clone().map(|(&place, ((&m, &c), &k))| (place, m, c, k));
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

    /// s^2 M + s C + K at a complex s, n x n.
    pub fn dynamic_stiffness(&self, s: Complex<f64>) -> CMatrix {
        let mut out = CMatrix::zeros(self.n, self.n);
        let values = self.mass.iter().zip(&self.damping).zip(&self.stiffness);
        for (&(row, column), ((&m, &c), &k)) in self.places.iter().zip(values) {
            let value = s * s * m + s * c + k;
            out[(row, column)] = value;
            out[(column, row)] = value;
        }
        out
    }

    /// A frequency that is typical of the system (rad/s): sqrt(k/m) in the paper's meshes, from the diagonals of K and M.
    pub fn typical_frequency(&self) -> f64 {
        0.5 * (self.trace(&self.stiffness) / self.trace(&self.mass)).sqrt()
    }

    fn trace(&self, values: &[f64]) -> f64 {
        self.places.iter().zip(values).filter(|((row, column), _)| row == column).map(|(_, value)| value).sum()
    }

    pub(super) fn damping_trace(&self) -> f64 {
        self.trace(&self.damping)
    }

    pub(super) fn stiffness_trace(&self) -> f64 {
        self.trace(&self.stiffness)
    }

    /// The same, factorised in the given order of its coordinates.
    pub(super) fn eliminated_in(self, order: Option<Vec<usize>>) -> Self {
        Self { order, ..self }
    }

    /// The same system with other ports.
    ///
    /// # Errors
    /// If they do not have a row for each coordinate.
    pub fn with_ports(&self, ports: Ports) -> Result<Self, Error> {
        if [&ports.input, &ports.position, &ports.velocity].iter().any(|matrix| matrix.nrows() != self.n) {
            return Err(Error::new(ErrorKind::Usage, "a linear system: the ports must have a row for each coordinate"));
        }
        Ok(Self { ports, ..self.clone() })
    }

    /// The system of the coordinates in `kept` (in increasing order) while all others are held.
    pub fn part(&self, kept: &[usize]) -> Self {
        let mut place = vec![None; self.n];
        kept.iter().enumerate().for_each(|(new, &old)| place[old] = Some(new));
        let mut part = Self {
            n: kept.len(),
            places: Vec::new(),
            mass: Vec::new(),
            damping: Vec::new(),
            stiffness: Vec::new(),
            order: self.order.as_ref().map(|order| order.iter().filter_map(|&at| place[at]).collect()),
            ports: Ports {
                input: self.ports.input.select_rows(kept),
                position: self.ports.position.select_rows(kept),
                velocity: self.ports.velocity.select_rows(kept),
                direct: self.ports.direct.clone(),
            },
        };
        for (entry, &(row, column)) in self.places.iter().enumerate() {
            if let (Some(row), Some(column)) = (place[row], place[column]) {
                part.places.push((row, column));
                part.mass.push(self.mass[entry]);
                part.damping.push(self.damping[entry]);
                part.stiffness.push(self.stiffness[entry]);
            }
        }
        part
    }
}

/// A^-1 X for the columns of X.
pub(super) fn solved(factor: &SparseFactor, mut columns: Matrix) -> Matrix {
    factor.solve(columns.as_mut_slice());
    columns
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

pub(super) fn not_held() -> Error {
    Error::new(ErrorKind::Scene, "nothing holds the body, it has no response at rest").at("body.block.fixed")
}
