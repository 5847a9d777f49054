//! The implicit step of a linear patch: stable whatever the stiffness and the damping.

use nalgebra::{DMatrix, DVector};

use super::tangent::{PatchTangent, flatten};
use crate::integrator::snap;
use crate::{Mat3, Vec3};

/// Backward Euler for a linear patch of n nodes: A (v+ - v) = d (f + d K v), A = M - d C - d^2 K, inverted once per resync.
///
/// Linear, so that one solution is exact; K and C need not be symmetric.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImplicitStep {
    /// A^-1 (1/kg), 3n x 3n.
    inverse: DMatrix<f64>,
    d: f64,
    /// Working memory, 3n each.
    forces: DVector<f64>,
    change: DVector<f64>,
}

impl ImplicitStep {
    /// For steps of `d` seconds of the patch with `tangent` and `inverse_masses` (1/kg, the first n are read; none is zero).
    /// Where A has no inverse the step gives what is not a number, as a patch that has diverged does.
    ///
    /// # Real-time
    /// For the global actor, at each resync: allocates, and works for about 18 n^3 multiply-adds.
    pub(crate) fn rebuild(&mut self, tangent: &PatchTangent, inverse_masses: &[f64], d: f64) {
        let n = 3 * tangent.nodes();
        let (k, c) = (tangent.matrix().columns(0, n), tangent.matrix().columns(n, n));
        let mut a = DMatrix::zeros(n, n);
        a.zip_zip_apply(&k, &c, |a, k, c| *a = -d * (c + d * k));
        for (place, w) in inverse_masses.iter().enumerate().take(tangent.nodes()) {
            for axis in 0..3 {
                a[(3 * place + axis, 3 * place + axis)] += 1.0 / w;
            }
        }
        self.inverse = a.lu().try_inverse().unwrap_or_else(|| DMatrix::from_element(n, n, f64::NAN));
        self.d = d;
        if self.forces.len() != n {
            self.forces = DVector::zeros(n);
            self.change = DVector::zeros(n);
        }
    }

    /// The step d (s).
    pub(crate) fn step(&self) -> f64 {
        self.d
    }

    /// v += A^-1 d f for the first n velocities; `forces` (N) are those at positions that have moved on with v for d.
    ///
    /// # Real-time
    /// Bounded, real-time safe: 9 n^2 multiply-adds.
    pub(crate) fn accelerate(&mut self, velocities: &mut [Vec3], forces: &[Vec3]) {
        flatten(forces, self.forces.as_mut_slice());
        self.change.gemv(self.d, &self.inverse, &self.forces, 0.0);
        for (v, change) in velocities.iter_mut().zip(self.change.as_slice().as_chunks::<3>().0) {
            *v = snap(*v + Vec3::from(*change));
        }
    }

    /// G A^-1 H^T (1/kg): how one mean of nodes answers to an impulse on another. Nodes that are not of the patch do not answer.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub(crate) fn coupling(&self, row: &[(u32, f64)], column: &[(u32, f64)]) -> Mat3 {
        let n = self.inverse.nrows() / 3;
        let mut coupling = Mat3::zeros();
        for &(from, wr) in row.iter().filter(|&&(node, _)| (node as usize) < n) {
            for &(to, wc) in column.iter().filter(|&&(node, _)| (node as usize) < n) {
                coupling += self.inverse.fixed_view::<3, 3>(3 * from as usize, 3 * to as usize) * (wr * wc);
            }
        }
        coupling
    }

    /// v -= A^-1 G^T J for the `impulse` J (N s) of a mean of `nodes` on the tool.
    ///
    /// # Real-time
    /// Bounded, real-time safe: 9 n multiply-adds for each of the nodes.
    pub(crate) fn push(&self, velocities: &mut [Vec3], nodes: &[(u32, f64)], impulse: Vec3) {
        let n = self.inverse.nrows() / 3;
        for &(node, w) in nodes.iter().filter(|&&(node, _)| (node as usize) < n) {
            for (place, v) in velocities.iter_mut().enumerate().take(n) {
                *v -= self.inverse.fixed_view::<3, 3>(3 * place, 3 * node as usize) * (impulse * w);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Drift, patch_of};
    use super::*;
    use crate::body::{Block, Body, State};
    use crate::mesh::Face;

    struct Patch {
        tangent: PatchTangent,
        inverse_masses: Vec<f64>,
        state: State,
        forces: Vec<Vec3>,
    }

    fn patch(stiffness: f64, zeta: f64) -> Patch {
        let builder = Block::builder([6; 3], [0.05; 3]).stiffness(stiffness).damping_ratio(zeta).node_mass(0.5e-3);
        let block = builder.fix(Face::ZMin).build().unwrap();
        let (nodes, tangent) = patch_of(&block, &State::at_rest(block.rest()));
        let rest: Vec<Vec3> = nodes.iter().map(|&node| block.rest()[node as usize]).collect();
        let inverse_masses = nodes.iter().map(|&node| block.inverse_masses()[node as usize]).collect();
        let mut state = State::at_rest(&rest);
        for (n, v) in state.velocities.iter_mut().enumerate() {
            let n = n as f64;
            *v = Vec3::new((5.0 * n).sin(), (7.0 * n).cos(), (11.0 * n).sin());
        }
        Patch { tangent, inverse_masses, forces: vec![Vec3::zeros(); rest.len()], state }
    }

    impl Patch {
        fn step(&mut self, system: &mut ImplicitStep) {
            let Self { tangent, state, forces, .. } = self;
            tangent.forces(&state.positions, &state.velocities, system.step(), Drift::default(), forces);
            system.accelerate(&mut state.velocities, forces);
            crate::integrator::advance(&mut state.positions, &state.velocities, system.step());
        }

        /// Kinetic and elastic energy (J): at rest there is no force, so -f.(x - x_0)/2 without velocities is the latter.
        fn energy(&mut self, rest: &[Vec3]) -> f64 {
            let Self { tangent, state, forces, inverse_masses } = self;
            let still = vec![Vec3::zeros(); rest.len()];
            tangent.forces(&state.positions, &still, 0.0, Drift::default(), forces);
            let nodes =
                state.positions.iter().zip(rest).zip(&*forces).zip(state.velocities.iter().zip(&*inverse_masses));
            nodes.map(|(((x, x0), f), (v, w))| 0.5 * (v.norm_squared() / w - f.dot(&(x - x0)))).sum()
        }
    }

    #[test]
    fn energy_never_grows_however_stiff_or_damped() {
        for (stiffness, zeta) in [(30.0, 0.0), (3000.0, 0.0), (3000.0, 1.0), (3e5, 0.1), (3e5, 2.0)] {
            let mut patch = patch(stiffness, zeta);
            let rest = patch.state.positions.clone();
            let mut system = ImplicitStep::default();
            system.rebuild(&patch.tangent, &patch.inverse_masses, 1e-3);
            let mut before = patch.energy(&rest);
            let first = before;
            for step in 0..500 {
                patch.step(&mut system);
                let after = patch.energy(&rest);
                // Below that is rounding of positions.
                assert!(
                    after <= before * (1.0 + 1e-12) + 1e-20 * first,
                    "k {stiffness}, zeta {zeta}, step {step}: {before} to {after}"
                );
                before = after;
            }
            assert!(before < 0.5 * first, "{before} of {first}");
        }
    }

    #[test]
    fn half_the_step_halves_the_error() {
        let end = |steps: u32| {
            let mut patch = patch(30.0, 0.3);
            let mut system = ImplicitStep::default();
            system.rebuild(&patch.tangent, &patch.inverse_masses, 2e-3 / f64::from(steps));
            (0..steps).for_each(|_| patch.step(&mut system));
            patch.state.positions
        };
        let exact = end(4096);
        let error = |steps: u32| {
            let end = end(steps);
            end.iter().zip(&exact).map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt()
        };
        let errors = [16, 32, 64].map(error);
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((0.8..1.25).contains(&order), "{errors:?}: order {order}");
        }
    }

    #[test]
    fn the_point_answers_to_an_impulse_as_its_compliance_says() {
        let mut patch = patch(3000.0, 1.0);
        let mut system = ImplicitStep::default();
        system.rebuild(&patch.tangent, &patch.inverse_masses, 1e-3);
        // The last is not of the patch.
        let nodes = [(3, 0.5), (8, 0.3), (patch.forces.len() as u32, 0.2)];
        let impulse = Vec3::new(1e-3, -2e-3, 3e-3);
        let before = patch.state.velocities.clone();
        system.push(&mut patch.state.velocities, &nodes, impulse);
        let change = |node: usize| patch.state.velocities[node] - before[node];
        let point = change(3) * 0.5 + change(8) * 0.3;
        assert!((point + system.coupling(&nodes, &nodes) * impulse).norm() < 1e-15);
        assert!(change(20).norm() > 0.0, "every node answers");
    }
}
