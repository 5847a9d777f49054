//! The contact normal: interpolated unit vertex normals, or the triangle's own.

use super::super::Vec3;
use super::super::mesh::Surface;
use super::Normals;

/// The outward unit normal at `weights` of triangle `t`; zero for a degenerate place.
pub(super) fn contact_normal(kind: Normals, surface: &Surface, x: &[Vec3], t: u32, weights: &[f64; 3]) -> Vec3 {
    let face = unit(area_vector(surface, x, t));
    match kind {
        Normals::Face => face,
        Normals::Interpolated => {
            let corners = surface.triangles[t as usize];
            let sum = corners.iter().zip(weights).fold(Vec3::zeros(), |sum, (&node, &w)| {
                // The *unit* vertex normals are mixed: weighting raw area sums costs 33 % of the force at mu = 1.
                let vertex = surface.at_node(node).iter().fold(Vec3::zeros(), |n, &t| n + area_vector(surface, x, t));
                sum + unit(vertex) * w
            });
            if sum.norm() > 1e-9 { sum / sum.norm() } else { face }
        }
    }
}

/// Twice the triangle's area times its normal.
fn area_vector(surface: &Surface, x: &[Vec3], t: u32) -> Vec3 {
    let [a, b, c] = surface.triangles[t as usize].map(|node| x[node as usize]);
    (b - a).cross(&(c - a))
}

fn unit(vector: Vec3) -> Vec3 {
    let length = vector.norm();
    if length > 0.0 { vector / length } else { Vec3::zeros() }
}
