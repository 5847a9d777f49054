//! The linear model of a patch: force at the resync and its answer to displacements and velocities, of the patch and
//! of what surrounds it.

use nalgebra::{DMatrix, DVector};

use super::blocks::Blocks;
use crate::body::{Body, State};
use crate::integrator::{Spectrum, largest_eigenvalue};
use crate::linear_algebra::cholesky;
use crate::{Mat3, Vec3};

/// The share of a matrix's largest number that may be missing to definiteness.
const ROUNDING: f64 = 1e-9;

/// Force on the n nodes of a patch as a linear function of their motion and of the time that their surroundings move on.
///
/// f = f_0 + K (x - x_0) + C (v - v_0) + C_B v_B + t K_B v_B, with f_0 the force at (x_0, v_0) while every node outside
/// stands still, and v_B the velocities of these nodes at the resync.
#[derive(Clone, Debug, Default)]
pub(crate) struct PatchTangent {
    /// f_0 (N), 3n.
    force: DVector<f64>,
    /// C_B v_B (N), 3n.
    dragged: DVector<f64>,
    /// K_B v_B (N/s), 3n.
    drift: DVector<f64>,
    /// [K | C], 3n x 6n: one product per step reads one matrix.
    matrix: DMatrix<f64>,
    /// What of it is not zero, if that is not most of it.
    blocks: Blocks,
    /// [x - x_0; v - v_0], 6n.
    deviation: DVector<f64>,
    /// x_0 (m) and v_0 (m/s), n each.
    origin: State,
    node_forces: Vec<Vec3>,
    /// Working memory of [`forces`](Self::forces), 3n.
    product: DVector<f64>,
}

/// What the nodes outside have done since the resync.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Drift {
    /// For how long they have moved on with their velocity at the resync (s).
    pub(crate) time: f64,
    /// True while they still do.
    pub(crate) is_moving: bool,
}

/// How much of the coupling of a patch node (first) to a node outside (second) answers to the patch's motion, both by
/// global id; 1 is all of it.
pub(crate) type Share<'a> = &'a dyn Fn(u32, u32) -> f64;

impl PatchTangent {
    /// Linearises `body` at `state` for the rows of `nodes`; `place` finds a node's place in `nodes`. The negative
    /// geometric stiffness of compressed springs is left out. `share` weakens couplings to the outside; the force at the
    /// resync is not changed by it.
    ///
    /// # Real-time
    /// For the global actor: allocates when the number of nodes is not that of the call before.
    pub(crate) fn rebuild(
        &mut self,
        body: &dyn Body,
        state: &State,
        nodes: &[u32],
        place: &dyn Fn(u32) -> Option<usize>,
        share: Share<'_>,
    ) {
        let n = nodes.len();
        if self.force.len() != 3 * n {
            for vector in [&mut self.force, &mut self.dragged, &mut self.drift, &mut self.product] {
                *vector = DVector::zeros(3 * n);
            }
            self.matrix = DMatrix::zeros(3 * n, 6 * n);
            self.deviation = DVector::zeros(6 * n);
        }
        self.matrix.fill(0.0);
        self.dragged.fill(0.0);
        self.drift.fill(0.0);
        self.node_forces.resize(n, Vec3::zeros());
        body.node_forces(state, nodes, &mut self.node_forces);
        flatten(&self.node_forces, self.force.as_mut_slice());
        let Self { force, dragged, drift, matrix, .. } = self;
        let mut add = |row: usize, column: usize, position: Mat3, velocity: Mat3| {
            let mut place = matrix.fixed_view_mut::<3, 3>(row, column);
            place += position;
            let mut place = matrix.fixed_view_mut::<3, 3>(row, 3 * n + column);
            place += velocity;
        };
        body.tangent(state, nodes, true, &mut |block| {
            let Some(row) = place(block.row).map(|row| 3 * row) else { return };
            match place(block.column) {
                None => {
                    let outside = state.velocities[block.column as usize];
                    // Forces are linear in the velocities: outside nodes that stand still take their share back.
                    let taken = block.velocity * outside;
                    let mut rows = force.fixed_rows_mut::<3>(row);
                    rows -= taken;
                    let mut rows = dragged.fixed_rows_mut::<3>(row);
                    rows += taken;
                    let share = share(block.row, block.column);
                    let mut rows = drift.fixed_rows_mut::<3>(row);
                    rows += block.position * outside * share;
                    if share != 1.0 {
                        // Moving both nodes alike changes no force: the diagonal holds the opposite of this coupling.
                        add(row, row, block.position * (1.0 - share), block.velocity * (1.0 - share));
                    }
                }
                Some(column) => add(row, 3 * column, block.position, block.velocity),
            }
        });
        self.blocks.take(&self.matrix);
        self.origin.positions.clear();
        self.origin.positions.extend(nodes.iter().map(|&node| state.positions[node as usize]));
        self.origin.velocities.clear();
        self.origin.velocities.extend(nodes.iter().map(|&node| state.velocities[node as usize]));
    }

    /// Adds `share` of `stiffness` (N/m, 3n x 3n, a derivative of the force as K is) to K.
    ///
    /// # Real-time
    /// For the global actor: bounded.
    pub(crate) fn add_stiffness(&mut self, stiffness: &DMatrix<f64>, share: f64) {
        let n = self.force.len();
        if stiffness.shape() == (n, n) {
            let mut position = self.matrix.columns_mut(0, n);
            position += stiffness * share;
            self.blocks.fill();
        }
    }

    /// Writes the force on each patch node (N) for the given positions and velocities (the first n of each are read), with
    /// positions that move on with their velocity for `ahead` seconds, and surroundings that have done `drift` by then.
    ///
    /// # Real-time
    /// Bounded, real-time safe: 18 multiply-adds for each pair of nodes that are coupled, at most 18 n^2.
    pub(crate) fn forces(
        &mut self,
        positions: &[Vec3],
        velocities: &[Vec3],
        ahead: f64,
        drift: Drift,
        forces: &mut [Vec3],
    ) {
        let n = self.origin.positions.len();
        let (by_position, by_velocity) = self.deviation.as_mut_slice().split_at_mut(3 * n);
        let nodes = positions.iter().zip(velocities).zip(&self.origin.positions);
        for (deviation, ((x, v), x0)) in by_position.as_chunks_mut::<3>().0.iter_mut().zip(nodes) {
            *deviation = (x + v * ahead - x0).into();
        }
        let nodes = velocities.iter().zip(&self.origin.velocities);
        for (deviation, (v, v0)) in by_velocity.as_chunks_mut::<3>().0.iter_mut().zip(nodes) {
            *deviation = (v - v0).into();
        }
        self.product.copy_from(&self.force);
        if drift.is_moving {
            self.product += &self.dragged;
        }
        if drift.time > 0.0 {
            self.product.axpy(drift.time, &self.drift, 1.0);
        }
        self.blocks.add_product(&self.matrix, 0, &self.deviation, &mut self.product);
        unflatten(self.product.as_slice(), forces);
    }

    /// The largest eigenvalues of K and C with these masses (1/kg, the first n are read): what an explicit step of this patch
    /// can be. Found up to a percent.
    ///
    /// # Real-time
    /// For the global actor: allocates; bounded, usually some 30 products with K and with C.
    pub(crate) fn spectrum(&self, inverse_masses: &[f64]) -> Spectrum {
        let n = self.nodes();
        let (mut direction, mut product) = (DVector::zeros(3 * n), DVector::zeros(3 * n));
        let mut largest = |first: usize| {
            largest_eigenvalue(inverse_masses[..n].to_vec(), 1e-3, |from, to| {
                flatten(from, direction.as_mut_slice());
                product.fill(0.0);
                self.blocks.add_product(&self.matrix, first, &direction, &mut product);
                unflatten(product.as_slice(), to);
            })
        };
        Spectrum { stiffness: largest(0), damping: largest(3 * n) }
    }

    /// True if K draws every displacement back and C slows every motion: both negative definite but for rounding.
    ///
    /// # Real-time
    /// For the global actor: allocates; bounded, some 20 n^3 multiply-adds.
    pub(crate) fn is_stable(&self) -> bool {
        let n = self.force.len();
        [0, n].into_iter().all(|first| {
            let matrix = self.matrix.columns(first, n);
            let mut positive = (matrix + matrix.transpose()) * -0.5;
            // What does not move at all, such as without damping, is no fault.
            let shift = ROUNDING * positive.amax() + f64::MIN_POSITIVE;
            (0..n).for_each(|at| positive[(at, at)] += shift);
            cholesky(&positive).is_some()
        })
    }

    /// K and C side by side (N/m, N s/m), 3n x 6n.
    pub(crate) fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Number of patch nodes n.
    pub(crate) fn nodes(&self) -> usize {
        self.origin.positions.len()
    }
}

/// Writes the numbers of `vectors` one after the other, as far as both reach.
pub(super) fn flatten(vectors: &[Vec3], to: &mut [f64]) {
    to.as_chunks_mut::<3>().0.iter_mut().zip(vectors).for_each(|(to, vector)| *to = (*vector).into());
}

fn unflatten(from: &[f64], vectors: &mut [Vec3]) {
    vectors.iter_mut().zip(from.as_chunks::<3>().0).for_each(|(vector, from)| *vector = Vec3::from(*from));
}

#[cfg(test)]
mod tests {
    use super::super::patch_of;
    use super::*;
    use crate::body::Block;
    use crate::mesh::Face;

    #[test]
    fn the_patch_force_is_exact_at_the_origin_and_linear_around_it() {
        let mut block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let mut state = State::at_rest(block.rest());
        for (n, (x, v)) in state.positions.iter_mut().zip(&mut state.velocities).enumerate() {
            let n = n as f64;
            *x += Vec3::new(n.sin(), (2.0 * n).cos(), (3.0 * n).sin()) * 1e-3 + Vec3::z() * (0.1 * x.z);
            *v = Vec3::new((5.0 * n).sin(), (7.0 * n).cos(), (11.0 * n).sin()) * 0.1;
        }
        let (nodes, mut tangent) = patch_of(&block, &state);
        let place = |node: u32| nodes.iter().position(|&other| other == node);

        // The body with everything outside the patch standing still is what the linear model stands for.
        let mut frozen = state.clone();
        for (node, v) in frozen.velocities.iter_mut().enumerate() {
            if place(node as u32).is_none() {
                *v = Vec3::zeros();
            }
        }
        let patch = |all: &[Vec3]| nodes.iter().map(|&node| all[node as usize]).collect::<Vec<_>>();
        let mut exact = vec![Vec3::zeros(); state.positions.len()];
        let mut linear = vec![Vec3::zeros(); nodes.len()];
        block.forces(&frozen, &mut exact);
        let still = Drift::default();
        tangent.forces(&patch(&frozen.positions), &patch(&frozen.velocities), 0.0, still, &mut linear);
        assert!(nodes.iter().zip(&linear).all(|(&node, f)| (exact[node as usize] - f).norm() < 1e-13));

        let error = |scale: f64, linear: &mut [Vec3], tangent: &mut PatchTangent, block: &mut Block| {
            let mut moved = frozen.clone();
            for &node in &nodes {
                moved.velocities[node as usize] += Vec3::new(0.3, -0.2, 0.1) * scale;
            }
            tangent.forces(&patch(&moved.positions), &patch(&moved.velocities), 0.0, still, linear);
            let mut exact = vec![Vec3::zeros(); state.positions.len()];
            block.forces(&moved, &mut exact);
            nodes.iter().zip(&*linear).map(|(&node, f)| (exact[node as usize] - f).norm()).fold(0.0, f64::max)
        };
        // Forces are linear in the velocities: the model is exact for any of them.
        assert!(error(1.0, &mut linear, &mut tangent, &mut block) < 1e-12);
    }

    #[test]
    fn surroundings_that_move_on_give_the_force_that_they_give_in_the_body() {
        let mut block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let mut state = State::at_rest(block.rest());
        for (n, v) in state.velocities.iter_mut().enumerate() {
            let n = n as f64;
            *v = Vec3::new((5.0 * n).sin(), (7.0 * n).cos(), (11.0 * n).sin()) * 1e-3;
        }
        let (nodes, mut tangent) = patch_of(&block, &state);
        let place = |node: u32| nodes.iter().position(|&other| other == node);
        let time = 1e-3;
        let mut later = state.clone();
        for (node, (x, v)) in later.positions.iter_mut().zip(&later.velocities).enumerate() {
            if place(node as u32).is_none() && block.inverse_masses()[node] > 0.0 {
                *x += v * time;
            }
        }
        let patch = |all: &[Vec3]| nodes.iter().map(|&node| all[node as usize]).collect::<Vec<_>>();
        let (mut exact, mut linear) = (vec![Vec3::zeros(); state.positions.len()], vec![Vec3::zeros(); nodes.len()]);
        block.forces(&later, &mut exact);
        let drift = Drift { time, is_moving: true };
        tangent.forces(&patch(&state.positions), &patch(&state.velocities), 0.0, drift, &mut linear);
        let largest = patch(&exact).iter().map(Vec3::norm).fold(0.0, f64::max);
        let error = patch(&exact).iter().zip(&linear).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(error < 1e-3 * largest && largest > 1e-6, "{error} of {largest}");
        // Without their motion it is another force.
        tangent.forces(&patch(&state.positions), &patch(&state.velocities), 0.0, Drift::default(), &mut linear);
        let error = patch(&exact).iter().zip(&linear).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(error > 0.05 * largest, "{error} of {largest}");
    }
}
