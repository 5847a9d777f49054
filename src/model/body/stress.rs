//! Stress: what the parts of a body around a node carry, and the one number that is shown of it.

use super::Spring;
use crate::{Mat3, Vec3};

/// The equivalent stress of von Mises (Pa) of a stress tensor (Pa): sqrt(3/2 s : s) of its deviator s. It is what shears, in one number:
/// that of a bar under tension is the tension, an even pressure has none.
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn von_mises(stress: &Mat3) -> f64 {
    let deviator = stress - Mat3::identity() * (stress.trace() / 3.0);
    (1.5 * deviator.norm_squared()).sqrt()
}

/// The virial stress (Pa) at a node with `springs`, each with the way to its other end (m), in `volume` (m^3): half of each spring's
/// tension times its way, by the volume. What dampers carry is left out.
pub(super) fn virial(springs: impl Iterator<Item = (Spring, Vec3)>, volume: f64) -> Mat3 {
    let still = Vec3::zeros();
    springs.fold(Mat3::zeros(), |sum, (spring, along)| sum + spring.force(along, still) * along.transpose())
        / (2.0 * volume)
}

/// The volume (m^3) inside a closed surface with `triangles` of nodes at `places` (m).
pub(super) fn enclosed(places: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let of = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|node| places[node as usize]);
        a.dot(&b.cross(&c)) / 6.0
    };
    triangles.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, Body, Shape, State, Tetrahedra, Tissue, Where};
    use crate::mesh::{Lattice, TetrahedralMesh};

    /// The same stretch of every node.
    fn stretched(body: &dyn Body, gradient: Mat3) -> State {
        State::at_rest(&body.rest().iter().map(|x| gradient * x).collect::<Vec<_>>())
    }

    #[test]
    fn tension_is_its_own_equivalent_and_pressure_has_none() {
        let tension = Mat3::from_diagonal(&Vec3::new(3e3, 0.0, 0.0));
        assert!((von_mises(&tension) - 3e3).abs() < 1e-9);
        assert!(von_mises(&(Mat3::identity() * -5e3)) < 1e-9);
        let shear = Mat3::new(0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        assert!((von_mises(&shear) - 2.0 * 3.0_f64.sqrt()).abs() < 1e-12);
    }

    /// Check against the continuum that springs in all directions are on the mean: nu = 1/4, and mu the sum of k L^2 over a cell, by 15.
    #[test]
    fn the_virial_of_a_stretched_lattice_is_the_stress_of_its_continuum() {
        let block = Block::builder([7; 3], [0.06; 3]).stiffness(30.0).build().unwrap();
        let (strain, nodes) = (1e-4, Lattice { nodes: [7; 3] });
        let state = stretched(&block, Mat3::from_diagonal(&Vec3::new(1.0 + strain, 1.0, 1.0)));
        // 3 edges, 6 diagonals of faces, 4 of the cell.
        let mu = 30.0 / 0.01 * f64::from(3 + 6 * 2 + 4 * 3) / 15.0;
        // Uniaxial strain, averaged over directions: mu = lambda. Along an axis a cubic lattice is stiffer than its mean.
        let inner = block.stress(&state, nodes.id([3, 3, 3])).unwrap();
        let ratio = inner.trace() / (5.0 * mu * strain);
        assert!((ratio - 1.0).abs() < 0.01, "the trace is that of any axis: {ratio}, mu {mu}");
        // A node of the surface has half of a cell, and all of its springs within the surface.
        let node = nodes.id([3, 3, 6]);
        let mut sum = Mat3::zeros();
        for (i, j, spring) in block.springs().into_iter().filter(|&(i, j, _)| i == node || j == node) {
            let along = state.positions[j as usize] - state.positions[i as usize];
            let pull = spring.stiffness * (along.norm() - spring.rest_length);
            sum += along * along.transpose() * (pull / along.norm() / 0.01_f64.powi(3));
        }
        let surface = block.stress(&state, node).unwrap();
        assert!((surface - sum).norm() < 1e-9 * sum.norm(), "{surface} {sum}");
    }

    #[test]
    fn elements_under_shear_carry_mu_times_it() {
        let points = [[0.0; 3], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]].map(Vec3::from).to_vec();
        let mesh = TetrahedralMesh { points, tetrahedra: vec![[0, 1, 2, 3]], groups: vec![] };
        let bottom = Where::Shape(Shape::Layer { axis: 2, from: 0.0, to: 0.001 });
        let body = Tetrahedra::builder(mesh).tissue(Tissue::LIVER).fix(bottom).build().unwrap();
        let mut gradient = Mat3::identity();
        gradient[(0, 2)] = 1e-4;
        let stress = body.stress(&stretched(&body, gradient), 3).unwrap();
        let mu = Tissue::LIVER.young_modulus / (2.0 * (1.0 + Tissue::LIVER.poisson_ratio));
        let expected = 3.0_f64.sqrt() * mu * 1e-4;
        assert!((von_mises(&stress) / expected - 1.0).abs() < 1e-3, "{} {expected}", von_mises(&stress));
        // Turned as a whole it carries nothing.
        let turn = *crate::Turn::from_euler_angles(0.3, -0.2, 0.5).to_rotation_matrix().matrix();
        assert!(von_mises(&body.stress(&stretched(&body, turn), 3).unwrap()) < 1e-9 * mu);
    }
}
