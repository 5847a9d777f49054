//! How stiff a half space of springs is against what is pressed into it.

use std::f64::consts::{PI, TAU};

use crate::{Mat3, Vec3};

/// Directions along the surface, and turns around each of them, over which means are taken.
const DIRECTIONS: usize = 16;
const TURNS: usize = 32;

/// The direction of a spring and what it adds to the stiffness of the continuum: k L^2 by volume (Pa).
pub(super) type Pull = (Vec3, f64);

/// The contact modulus (Pa) of a half space with that `normal`, made of springs that are `pulls`: what E / (1 - nu^2) is where all directions
/// are alike.
///
/// A force F along the normal n moves the surface at a distance r by F n . Q(t)^-1 n / (2 pi r), with t the direction there, Q the mean of
/// (mm) - (ms) (ss)^-1 (sm) over all perpendicular m and s in the plane across t, and (ab)_jk = a_i C_ijkl b_l (Barnett and Lothe 1975); a round tool
/// feels the mean over t (Vlassak and Nix 1993). The normal is an axis.
pub(super) fn contact_modulus(pulls: &[Pull], normal: Vec3) -> f64 {
    let product = |a: Vec3, b: Vec3| -> Mat3 {
        pulls
            .iter()
            .map(|(along, stiffness)| along * along.transpose() * (stiffness * a.dot(along) * b.dot(along)))
            .sum()
    };
    // At right angles to the normal, and to what is at right angles to both.
    let first = normal.yzx();
    let second = normal.cross(&first);
    let answers = (0..DIRECTIONS).map(|n| {
        let angle = PI * n as f64 / DIRECTIONS as f64;
        let side = second * angle.cos() - first * angle.sin();
        let across = |turn: f64| {
            let (m, s) = (side * turn.cos() + normal * turn.sin(), normal * turn.cos() - side * turn.sin());
            let solved = product(s, s).try_inverse().map_or(Mat3::zeros(), |inverse| inverse * product(s, m));
            product(m, m) - product(m, s) * solved
        };
        let sum: Mat3 = (0..TURNS).map(|n| across(TAU * n as f64 / (2 * TURNS) as f64)).sum();
        (sum / TURNS as f64).try_inverse().map_or(f64::INFINITY, |inverse| normal.dot(&(inverse * normal)))
    });
    2.0 / (answers.sum::<f64>() / DIRECTIONS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions that are evenly spread.
    fn spread(count: usize) -> Vec<Pull> {
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let at = |n: usize| {
            let (z, turn) = ((n as f64 + 0.5) / count as f64, golden * n as f64);
            let around = (1.0 - z * z).sqrt();
            (Vec3::new(around * turn.cos(), around * turn.sin(), z), 1.0 / count as f64)
        };
        (0..count).map(at).collect()
    }

    #[test]
    fn springs_in_all_directions_are_an_isotropic_continuum() {
        // mu = lambda = sum k L^2 / 15, so that nu = 1/4 and E = 2.5 mu.
        let expected = 2.5 / 15.0 / (1.0 - 0.0625);
        for normal in [Vec3::x(), Vec3::z()] {
            let found = contact_modulus(&spread(4000), normal);
            assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
        }
    }

    /// Check the symmetry of a lattice: the faces of a cube are alike, and those of a stretched one are not.
    #[test]
    fn faces_of_a_cube_are_alike() {
        let pulls = |stretch: f64| -> Vec<Pull> {
            let offsets =
                crate::mesh::Lattice::FORWARD.map(|[x, y, z]| Vec3::new(x as f64, y as f64, stretch * z as f64));
            offsets.into_iter().map(|offset| (offset.normalize(), offset.norm_squared() / stretch)).collect()
        };
        let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|normal| contact_modulus(&pulls(1.0), normal));
        assert!((x / z - 1.0).abs() < 1e-9 && (y / z - 1.0).abs() < 1e-9, "{x} {y} {z}");
        let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|normal| contact_modulus(&pulls(1.5), normal));
        assert!((x / y - 1.0).abs() < 1e-9 && (x / z - 1.0).abs() > 0.05, "{x} {y} {z}");
    }
}
