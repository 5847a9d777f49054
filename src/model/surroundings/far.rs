//! The part of a body that does not depend on a patch, linear around its rest state.

use super::coupling::Coupling;
use super::resting::RestingBody;
use crate::body::Restriction;
use crate::linear_algebra::{Matrix, SparseFactor, dissection, product_t, push_block};
use crate::{Mat3, Vec3};

/// Damping over stiffness may differ by this much from node to node and still count as proportional.
const PROPORTIONAL: f64 = 1e-9;

/// The movable nodes outside a patch, then the corners that a larger body follows beyond them, and what couples all of these.
#[derive(Debug)]
pub(super) struct Far {
    /// At rest (m).
    points: Vec<Vec3>,
    /// Their masses (kg).
    masses: Vec<f64>,
    /// Of each node of the body among them.
    place: Vec<Option<u32>>,
    /// Between places, the higher one first.
    couplings: Vec<((u32, u32), Coupling)>,
}

impl Far {
    /// All of `body`.
    pub(super) fn whole(body: &RestingBody) -> Self {
        Self::of(body, &[], body.couplings().to_vec())
    }

    /// What is outside `patch` (ids in increasing order), less the `restriction` to it.
    pub(super) fn new(body: &RestingBody, patch: &[u32], restriction: &Restriction) -> Self {
        Self::of(body, patch, body.couplings_without(patch, restriction))
    }

    fn of(body: &RestingBody, patch: &[u32], mut couplings: Vec<((u32, u32), Coupling)>) -> Self {
        let mut place = vec![None; body.rest().len()];
        let (mut points, mut masses) = (Vec::new(), Vec::new());
        for (node, &w) in body.inverse_masses().iter().enumerate() {
            if w > 0.0 && patch.binary_search(&(node as u32)).is_err() {
                place[node] = Some(points.len() as u32);
                points.push(body.rest()[node]);
                masses.push(1.0 / w);
            }
        }
        let at = |node: u32| place[node as usize].expect("it is far and can move");
        couplings.iter_mut().for_each(|((row, column), _)| (*row, *column) = (at(*row), at(*column)));
        if let Some(beyond) = body.beyond() {
            let corner = |corner: u32| points.len() as u32 + corner;
            couplings.extend(beyond.between.iter().map(|&((row, column), of)| ((corner(row), corner(column)), of)));
            couplings.extend(beyond.to_part.iter().map(|&((row, node), of)| ((corner(row), at(node)), of)));
            points.extend(&beyond.corners);
            masses.extend(&beyond.masses);
        }
        Self { points, masses, place, couplings }
    }

    /// Three for each node or corner.
    pub(super) fn unknowns(&self) -> usize {
        3 * self.points.len()
    }

    /// Pairs of nodes that answer to each other, and nodes to themselves.
    pub(super) fn pairs(&self) -> usize {
        self.couplings.len()
    }

    /// The unknowns of `nodes` (ids), three each.
    pub(super) fn unknowns_of(&self, nodes: &[u32]) -> Vec<usize> {
        let place = |&node: &u32| self.place[node as usize].expect("it is far and can move") as usize;
        nodes.iter().map(place).flat_map(|place| 3 * place..3 * place + 3).collect()
    }

    /// A unit force on each of `nodes` (ids) along each axis, as columns.
    pub(super) fn unit_forces(&self, nodes: &[u32]) -> Matrix {
        let mut forces = Matrix::zeros(self.unknowns(), 3 * nodes.len());
        self.unknowns_of(nodes).into_iter().enumerate().for_each(|(column, row)| forces[(row, column)] = 1.0);
        forces
    }

    /// Entries (row, column, value) of the lower triangle of s^2 M + s C + K.
    fn shifted(&self, s: f64) -> Vec<(usize, usize, f64)> {
        let mut entries = Vec::with_capacity(self.couplings.len() * 9 + self.unknowns());
        for (place, mass) in self.masses.iter().enumerate() {
            entries.extend((0..3).map(|axis| (3 * place + axis, 3 * place + axis, s * s * mass)));
        }
        for ((row, column), Coupling { stiffness, damping }) in &self.couplings {
            push_block(&mut entries, 3 * *row as usize, 3 * *column as usize, &(stiffness + damping * s));
        }
        entries
    }

    /// s^2 M + s C + K, factorised. `None` if nothing holds the body.
    pub(super) fn factorised(&self, s: f64) -> Option<SparseFactor> {
        // In an order of elimination with little fill, if the places of the nodes give one.
        let pairs =
            self.couplings.iter().map(|&((row, column), _)| [row, column]).filter(|[row, column]| row != column);
        SparseFactor::new(self.unknowns(), &self.shifted(s), dissection(&self.points, pairs).as_deref())
    }

    /// Multiplies each column of `columns` by M.
    pub(super) fn times_mass(&self, columns: &mut Matrix) {
        for mut column in columns.column_iter_mut() {
            for (x, mass) in column.as_mut_slice().as_chunks_mut::<3>().0.iter_mut().zip(&self.masses) {
                x.iter_mut().for_each(|x| *x *= mass);
            }
        }
    }

    /// Phi^T M Phi for the columns of `shapes`.
    pub(super) fn mass(&self, shapes: &Matrix) -> Matrix {
        let mut weighted = shapes.clone();
        self.times_mass(&mut weighted);
        product_t(shapes, &weighted)
    }

    /// -Phi^T K Phi and -Phi^T C Phi for the columns of `shapes`: what the states do to their own accelerations.
    pub(super) fn stiffness_and_damping(&self, shapes: &Matrix) -> (Matrix, Matrix) {
        // Row by row: a coupling answers to all columns at once.
        let rows = shapes.transpose();
        let of = |matrix: fn(&Coupling) -> &Mat3| {
            let mut answers = Matrix::zeros(rows.nrows(), rows.ncols());
            for ((row, column), coupling) in &self.couplings {
                let (block, row, column) = (matrix(coupling), 3 * *row as usize, 3 * *column as usize);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    answers.column_mut(row + i).axpy(-block[(i, j)], &rows.column(column + j), 1.0);
                    if row != column {
                        answers.column_mut(column + j).axpy(-block[(i, j)], &rows.column(row + i), 1.0);
                    }
                }
            }
            let projected = product_t(shapes, &answers.transpose());
            (&projected + projected.transpose()) * 0.5
        };
        let stiffness = of(|coupling| &coupling.stiffness);
        let damping = match self.proportional_damping() {
            Some(share) => &stiffness * share,
            None => of(|coupling| &coupling.damping),
        };
        (stiffness, damping)
    }

    /// False if its nodes hang on the patch alone, as around a patch that is nearly all of a small body.
    pub(super) fn is_held_together(&self) -> bool {
        !self.couplings.is_empty()
    }

    /// Damping over stiffness, if it is the same everywhere.
    pub(super) fn proportional_damping(&self) -> Option<f64> {
        let (mut product, mut square) = (0.0, 0.0);
        for (_, Coupling { stiffness, damping }) in &self.couplings {
            product += stiffness.dot(damping);
            square += stiffness.norm_squared();
        }
        let share = Some(product / square).filter(|share| share.is_finite())?;
        let is_proportional = |(_, Coupling { stiffness, damping }): &(_, Coupling)| {
            (damping - stiffness * share).amax() <= PROPORTIONAL * share * stiffness.amax()
        };
        self.couplings.iter().all(is_proportional).then_some(share)
    }
}
