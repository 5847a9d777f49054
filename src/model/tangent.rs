//! The dense linear model of a patch: force at the resync and its answer to displacements and velocities.

use nalgebra::{DMatrix, DVector};

use super::Vec3;
use super::body::{Body, State};

/// Force on the n nodes of a patch as a linear function of their motion, surroundings fixed.
///
/// f = f_0 + K (x - x_0) + C (v - v_0), with f_0 the force at (x_0, v_0) while every node outside stands still.
#[derive(Clone, Debug, Default)]
pub struct PatchTangent {
    /// f_0 (N), 3n.
    force: DVector<f64>,
    /// [K | C], 3n x 6n: one product per step reads one matrix.
    matrix: DMatrix<f64>,
    /// [x - x_0; v - v_0], 6n.
    deviation: DVector<f64>,
    /// x_0 (m) and v_0 (m/s), n each.
    origin: State,
    node_forces: Vec<Vec3>,
    /// Working memory of [`forces`](Self::forces), 3n.
    product: DVector<f64>,
}

impl PatchTangent {
    /// Linearises `body` at `state` for the rows of `nodes`; `place` finds a node's place in `nodes`. The negative
    /// geometric stiffness of compressed springs is left out.
    ///
    /// # Real-time
    /// For the global actor: allocates when the number of nodes is not that of the call before.
    pub fn rebuild(&mut self, body: &dyn Body, state: &State, nodes: &[u32], place: &dyn Fn(u32) -> Option<usize>) {
        let n = nodes.len();
        if self.force.len() != 3 * n {
            self.force = DVector::zeros(3 * n);
            self.matrix = DMatrix::zeros(3 * n, 6 * n);
            self.deviation = DVector::zeros(6 * n);
            self.product = DVector::zeros(3 * n);
        }
        self.matrix.fill(0.0);
        self.node_forces.resize(n, Vec3::zeros());
        body.node_forces(state, nodes, &mut self.node_forces);
        for (force, node) in self.force.as_mut_slice().as_chunks_mut::<3>().0.iter_mut().zip(&self.node_forces) {
            *force = (*node).into();
        }
        let (force, matrix) = (&mut self.force, &mut self.matrix);
        body.tangent(state, nodes, true, &mut |block| {
            let Some(row) = place(block.row).map(|row| 3 * row) else { return };
            match place(block.column) {
                None => {
                    // Forces are linear in the velocities: outside nodes that stand still take their share back.
                    let mut rows = force.fixed_rows_mut::<3>(row);
                    rows -= block.velocity * state.velocities[block.column as usize];
                }
                Some(column) => {
                    let column = 3 * column;
                    let mut position = matrix.fixed_view_mut::<3, 3>(row, column);
                    position += block.position;
                    let mut velocity = matrix.fixed_view_mut::<3, 3>(row, 3 * n + column);
                    velocity += block.velocity;
                }
            }
        });
        self.origin.positions.clear();
        self.origin.positions.extend(nodes.iter().map(|&node| state.positions[node as usize]));
        self.origin.velocities.clear();
        self.origin.velocities.extend(nodes.iter().map(|&node| state.velocities[node as usize]));
    }

    /// Writes the force on each patch node (N) for the given positions and velocities (the first n of each are read).
    ///
    /// # Real-time
    /// Bounded, real-time safe: 18 n^2 multiply-adds.
    pub fn forces(&mut self, positions: &[Vec3], velocities: &[Vec3], forces: &mut [Vec3]) {
        let n = self.origin.positions.len();
        let (by_position, by_velocity) = self.deviation.as_mut_slice().split_at_mut(3 * n);
        write_deviation(by_position, positions, &self.origin.positions);
        write_deviation(by_velocity, velocities, &self.origin.velocities);
        self.product.copy_from(&self.force);
        self.product.gemv(1.0, &self.matrix, &self.deviation, 1.0);
        for (force, product) in forces.iter_mut().zip(self.product.as_slice().as_chunks::<3>().0) {
            *force = Vec3::from(*product);
        }
    }

    /// Number of patch nodes n.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn nodes(&self) -> usize {
        self.origin.positions.len()
    }
}

fn write_deviation(deviation: &mut [f64], now: &[Vec3], origin: &[Vec3]) {
    for ((deviation, now), origin) in deviation.as_chunks_mut::<3>().0.iter_mut().zip(now).zip(origin) {
        *deviation = (now - origin).into();
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::Block;
    use super::super::mesh::Face;
    use super::*;

    #[test]
    fn the_patch_force_is_exact_at_the_origin_and_linear_around_it() {
        let mut block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let mut state = State::at_rest(block.rest());
        for (n, (x, v)) in state.positions.iter_mut().zip(&mut state.velocities).enumerate() {
            let n = n as f64;
            *x += Vec3::new(n.sin(), (2.0 * n).cos(), (3.0 * n).sin()) * 1e-3 + Vec3::z() * (0.1 * x.z);
            *v = Vec3::new((5.0 * n).sin(), (7.0 * n).cos(), (11.0 * n).sin()) * 0.1;
        }
        let mut nodes = Vec::new();
        block.patch(&[block.surface().triangles.len() as u32 - 5], [4, 4, 2], &mut nodes);
        let place = |node: u32| nodes.iter().position(|&other| other == node);
        let mut tangent = PatchTangent::default();
        tangent.rebuild(&block, &state, &nodes, &place);

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
        tangent.forces(&patch(&frozen.positions), &patch(&frozen.velocities), &mut linear);
        assert!(nodes.iter().zip(&linear).all(|(&node, f)| (exact[node as usize] - f).norm() < 1e-13));

        let error = |scale: f64, linear: &mut [Vec3], tangent: &mut PatchTangent, block: &mut Block| {
            let mut moved = frozen.clone();
            for &node in &nodes {
                moved.velocities[node as usize] += Vec3::new(0.3, -0.2, 0.1) * scale;
            }
            tangent.forces(&patch(&moved.positions), &patch(&moved.velocities), linear);
            let mut exact = vec![Vec3::zeros(); state.positions.len()];
            block.forces(&moved, &mut exact);
            nodes.iter().zip(&*linear).map(|(&node, f)| (exact[node as usize] - f).norm()).fold(0.0, f64::max)
        };
        // Forces are linear in the velocities: the model is exact for any of them.
        assert!(error(1.0, &mut linear, &mut tangent, &mut block) < 1e-12);
    }
}
