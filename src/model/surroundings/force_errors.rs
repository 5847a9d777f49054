//! How far the linear force at a contact is off when the surroundings of a patch answer in few states: for every number of states,
//! in one pass.

use super::far::Far;
use super::near::Near;
use super::resting::RestingBody;
use crate::Mat3;
use crate::body::Restriction;
use crate::linear_algebra::{Matrix, eliminate};

/// Real frequencies (1/s) at which the force is compared, evenly on a logarithmic scale. What the tool does differently from
/// its forecast grows from nothing within one to three periods of the global model, as e^(s t) does at the first; at the last
/// the masses of the patch alone resist, and nothing around it matters.
const FREQUENCIES: [f64; 4] = [60.0, 129.3, 278.5, 600.0];

/// The linear body at rest: the patch with its near springs, and surroundings in nested spaces of states.
///
/// Against an imposed motion q e^(s t) of a touched node the tool feels Z(s) q, Z = (G D(s)^-1 G^T)^-1, D = s^2 M + s C + K and G
/// the node's rows. Surroundings in the first r of R states are a Galerkin projection of the same body, so that their D_r is
/// the leading part of D_R: one elimination of D_R with G^T beside it gives every G D_r^-1 G^T as a partial sum. For a real s
/// they grow with r towards that of the body itself, which one factorisation of it gives: the error is exact, not bounded,
/// and falls with r.
#[derive(Debug)]
pub(super) struct Contacts {
    near: Near,
    /// Patch and surroundings as one.
    body: Far,
    mass: Matrix,
    damping: Matrix,
    stiffness: Matrix,
    states: usize,
}

impl Contacts {
    /// Of the `restriction` of `body` to a patch of so many nodes, with surroundings `far` in the span of the columns of
    /// `states`.
    pub(super) fn new(
        body: &RestingBody,
        (restriction, patch): (&Restriction, usize),
        far: &Far,
        states: &Matrix,
    ) -> Self {
        let near = Near::new(restriction, patch);
        let ring = restriction.ring(patch);
        let (count, on_ring) = (states.ncols(), states.select_rows(&far.unknowns_of(ring)));
        let (k, c) = far.stiffness_and_damping(states);
        Self {
            mass: near.beside(&near.mass, &on_ring, &far.mass(states), 1.0),
            damping: near.beside(&near.damping, &on_ring, &c, -1.0),
            stiffness: near.beside(&near.stiffness, &on_ring, &k, -1.0),
            states: count,
            body: Far::whole(body),
            near,
        }
    }

    /// The relative error of Z by the number of states, from 1 on: the root of its mean square over the frequencies, at the
    /// worst of the pressed nodes. `None` if the numbers do not allow it.
    pub(super) fn errors(&self) -> Option<Vec<f64>> {
        // Of each pressed node by states.
        let mut squares = vec![vec![0.0; self.states]; self.near.pressed.len()];
        for s in FREQUENCIES {
            let exact = self.exact(s)?;
            for ((squares, of_node), exact) in squares.iter_mut().zip(self.compliances(s)?).zip(exact) {
                let exact = exact.try_inverse()?;
                for (square, compliance) in squares.iter_mut().zip(of_node) {
                    *square += ((compliance.try_inverse()? - exact).norm() / exact.norm()).powi(2);
                }
            }
        }
        let worst = |r: usize| squares.iter().map(|squares| squares[r]).fold(0.0, f64::max);
        Some((0..self.states).map(|r| (worst(r) / FREQUENCIES.len() as f64).sqrt()).collect())
    }

    /// G D(s)^-1 G^T of the body itself, for each pressed node.
    fn exact(&self, s: f64) -> Option<Vec<Mat3>> {
        let nodes: Vec<u32> = self.near.pressed.iter().map(|pressed| pressed.node).collect();
        let answers = self.body.factorised(s)?.solve(self.body.unit_forces(&nodes));
        let rows = self.body.unknowns_of(&nodes);
        let entry = |node: usize, row: usize, column: usize| answers[(rows[3 * node + row], 3 * node + column)];
        Some((0..nodes.len()).map(|node| Mat3::from_fn(|row, column| entry(node, row, column))).collect())
    }

    /// G D_r(s)^-1 G^T for each pressed node, by r from 1 on.
    fn compliances(&self, s: f64) -> Option<Vec<Vec<Mat3>>> {
        let (columns, patch, pressed) = (self.mass.ncols(), self.near.patch, &self.near.pressed);
        let mut bordered = Matrix::zeros(columns + 3 * pressed.len(), columns);
        for column in 0..columns {
            for row in column..columns {
                let at = (row, column);
                bordered[at] = s * (s * self.mass[at] + self.damping[at]) + self.stiffness[at];
            }
        }
        for at in 0..3 * pressed.len() {
            bordered[(columns + at, pressed[at / 3].coordinate + at % 3)] = 1.0;
        }
        eliminate(&mut bordered)?;
        let of_node = |node: usize| {
            let (mut sum, mut sums) = (Mat3::zeros(), Vec::with_capacity(self.states));
            for (column, bordered) in bordered.column_iter().enumerate() {
                let part = bordered.fixed_rows::<3>(columns + 3 * node);
                sum += Mat3::from_fn(|i, j| part[i] * part[j] * bordered[column]);
                if column >= patch {
                    sums.push(sum);
                }
            }
            sums
        };
        Some((0..pressed.len()).map(of_node).collect())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Matrix3};

    use super::super::uneven::uneven;
    use super::super::{Basis, Reduction, RestingBody};
    use super::FREQUENCIES;
    use crate::Vec3;
    use crate::body::{Body, SpringNetwork};

    /// Adds the springs that `is_one_of` picks to s^2 M + s C + K over all coordinates.
    fn add_springs(d: &mut DMatrix<f64>, body: &SpringNetwork, s: f64, is_one_of: impl Fn([u32; 2]) -> bool) {
        for &(i, j, spring) in body.springs().iter().filter(|(i, j, _)| is_one_of([*i, *j])) {
            let along: Vec3 = body.rest()[j as usize] - body.rest()[i as usize];
            let u = along.normalize();
            let block = u * u.transpose() * (spring.stiffness + s * spring.damping);
            for (a, b, sign) in [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)] {
                let [a, b] = [a, b].map(|end: usize| 3 * [i, j][end] as usize);
                let mut part = d.fixed_view_mut::<3, 3>(a, b);
                part += block * sign;
            }
        }
    }

    /// The stiffness of `node` against being moved as e^(s t), by a dense inverse over the coordinates of `kept`.
    fn impedance(d: &DMatrix<f64>, kept: &[usize], node: u32) -> Matrix3<f64> {
        let inverse = d.select_rows(kept).select_columns(kept).try_inverse().unwrap();
        let at = kept.iter().position(|&row| row == 3 * node as usize).unwrap();
        inverse.fixed_view::<3, 3>(at, at).try_inverse().unwrap()
    }

    /// The relative error at `node` of the patch in the states of `basis`, by dense matrices of all coordinates and states.
    fn dense_error(body: &SpringNetwork, patch: &[u32], basis: &Basis, node: u32) -> f64 {
        let nodes = body.rest().len();
        let restriction = body.restriction(patch).unwrap();
        let ring = restriction.ring(patch.len());
        let movable = |node: &u32| body.inverse_masses()[*node as usize] > 0.0;
        let coordinates = |node: u32| (0..3).map(move |axis| 3 * node as usize + axis);
        let is_near = |nodes: [u32; 2]| nodes.iter().any(|node| patch.contains(node));
        let mut square = 0.0;
        for s in FREQUENCIES {
            let mut whole = DMatrix::zeros(3 * nodes, 3 * nodes);
            add_springs(&mut whole, body, s, |_| true);
            for node in (0..nodes as u32).filter(movable) {
                coordinates(node).for_each(|at| whole[(at, at)] += s * s / body.inverse_masses()[node as usize]);
            }
            let free: Vec<usize> = (0..nodes as u32).filter(movable).flat_map(coordinates).collect();
            let exact = impedance(&whole, &free, node);

            // Near springs and the patch's masses; the ring's coordinates are then replaced by those of the states.
            let mut near = DMatrix::zeros(3 * nodes, 3 * nodes);
            add_springs(&mut near, body, s, is_near);
            for &node in patch.iter().filter(|node| movable(node)) {
                coordinates(node).for_each(|at| near[(at, at)] += s * s / body.inverse_masses()[node as usize]);
            }
            let on_patch: Vec<usize> = patch.iter().copied().filter(movable).flat_map(coordinates).collect();
            let on_ring: Vec<usize> = ring.iter().copied().flat_map(coordinates).collect();
            let (p, r) = (on_patch.len(), basis.states());
            let shapes = basis.answers.shapes.to_matrix();
            let mut to_all = DMatrix::zeros(3 * nodes, p + r);
            on_patch.iter().enumerate().for_each(|(column, &at)| to_all[(at, column)] = 1.0);
            for (row, &at) in on_ring.iter().enumerate() {
                (0..r).for_each(|state| to_all[(at, p + state)] = shapes[(row, state)]);
            }
            let mut reduced = to_all.transpose() * near * to_all;
            let damping = basis.answers.damping.to_matrix();
            for state in 0..r {
                reduced[(p + state, p + state)] += s * s - basis.answers.stiffness[state];
                (0..r).for_each(|other| reduced[(p + state, p + other)] -= s * damping[(state, other)]);
            }
            let inverse = reduced.try_inverse().unwrap();
            let at = on_patch.iter().position(|&row| row == 3 * node as usize).unwrap();
            let ours = inverse.fixed_view::<3, 3>(at, at).try_inverse().unwrap();
            square += ((ours - exact).norm() / exact.norm()).powi(2);
        }
        (square / FREQUENCIES.len() as f64).sqrt()
    }

    #[test]
    fn the_errors_are_those_that_dense_matrices_give_for_uneven_bodies_and_fall_with_the_states() {
        let mut seed = 7;
        for _ in 0..3 {
            let (body, patch) = uneven(&mut seed);
            let resting = RestingBody::new(&body).unwrap();
            let by_states = Reduction::force_errors(&resting, &patch, 50).unwrap();
            assert!(by_states.windows(2).all(|pair| pair[0] >= pair[1] * (1.0 - 1e-6)), "{by_states:?}");
            for states in [3, 10, 25] {
                let basis = Basis::compute(&resting, &patch, states).unwrap().unwrap();
                let pressed = super::Near::new(&body.restriction(&patch).unwrap(), patch.len()).pressed;
                let errors = pressed.iter().map(|pressed| dense_error(&body, &patch, &basis, pressed.node));
                let worst = errors.fold(0.0, f64::max);
                let error = by_states[states - 1];
                // It is that of the shapes before they are rounded to 16 bits, which changes forces by less than 0.005 %.
                assert!((error - worst).abs() < 1e-4 * worst + 5e-5, "{states} states: {error} against {worst}");
            }
        }
    }
}
