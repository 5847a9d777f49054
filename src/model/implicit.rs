//! The implicit step of a linear patch: stable whatever the stiffness and the damping.

use nalgebra::{DMatrix, DVector};

use super::integrator::snap;
use super::tangent::PatchTangent;
use super::{Mat3, Vec3};

/// Backward Euler for a linear patch of n nodes: A (v+ - v) = d (f + d K v), A = M - d C - d^2 K, inverted once per resync.
///
/// Linear, so that one solution is exact; K and C need not be symmetric.
#[derive(Clone, Debug, Default)]
pub struct ImplicitStep {
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
    pub fn rebuild(&mut self, tangent: &PatchTangent, inverse_masses: &[f64], d: f64) {
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
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn step(&self) -> f64 {
        self.d
    }

    /// v += A^-1 d f for the first n velocities; `forces` (N) are those at positions that have moved on with v for d.
    ///
    /// # Real-time
    /// Bounded, real-time safe: 9 n^2 multiply-adds.
    pub fn accelerate(&mut self, velocities: &mut [Vec3], forces: &[Vec3]) {
        for (to, from) in self.forces.as_mut_slice().as_chunks_mut::<3>().0.iter_mut().zip(forces) {
            *to = (*from).into();
        }
        self.change.gemv(self.d, &self.inverse, &self.forces, 0.0);
        for (v, change) in velocities.iter_mut().zip(self.change.as_slice().as_chunks::<3>().0) {
            *v = snap(*v + Vec3::from(*change));
        }
    }

    /// W = G A^-1 G^T (1/kg): how the point at `weights` of three nodes answers to an impulse on it. Nodes that are not of
    /// the patch do not answer.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn compliance(&self, nodes: &[usize; 3], weights: &[f64; 3]) -> Mat3 {
        let mut compliance = Mat3::zeros();
        for (row, wr) in self.of_patch(nodes, weights) {
            for (column, wc) in self.of_patch(nodes, weights) {
                compliance += self.inverse.fixed_view::<3, 3>(3 * row, 3 * column) * (wr * wc);
            }
        }
        compliance
    }

    /// v -= A^-1 G^T J for the `impulse` J (N s) of the point at `weights` of three nodes on the tool.
    ///
    /// # Real-time
    /// Bounded, real-time safe: 27 n multiply-adds.
    pub fn push(&self, velocities: &mut [Vec3], nodes: &[usize; 3], weights: &[f64; 3], impulse: Vec3) {
        for (node, w) in self.of_patch(nodes, weights) {
            for (place, v) in velocities.iter_mut().enumerate().take(self.inverse.nrows() / 3) {
                *v -= self.inverse.fixed_view::<3, 3>(3 * place, 3 * node) * (impulse * w);
            }
        }
    }

    fn of_patch<'a>(&self, nodes: &'a [usize; 3], weights: &'a [f64; 3]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let n = self.inverse.nrows() / 3;
        nodes.iter().copied().zip(weights.iter().copied()).filter(move |&(node, _)| node < n)
    }
}
