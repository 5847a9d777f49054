//! A point over a triangle of the surface: its distance, weights and normal, and the walk to the triangle under it.

use super::Normals;
use crate::Vec3;
use crate::mesh::Surface;

/// Twice the area below which corners are no triangle (m^2).
const SLIVER: f64 = 1e-14;

/// Longest walk within one step.
const MAX_HOPS: usize = 16;
/// Weights above minus this are inside.
const INSIDE: f64 = 1e-9;

/// A point seen from a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    /// Signed distance along the triangle's normal (m); positive outside.
    pub distance: f64,
    /// Barycentric weights of the projected point.
    pub weights: [f64; 3],
}

impl Projection {
    /// Projects `point` along the normal of the triangle `corners`; `None` for a sliver without a normal.
    pub(super) fn new(corners: &[Vec3; 3], point: &Vec3) -> Option<Self> {
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let across = e1.cross(&e2);
        let area = across.norm();
        if area < SLIVER {
            return None;
        }
        let normal = across / area;
        let r = point - corners[0];
        let beta = r.cross(&e2).dot(&normal) / area;
        let gamma = e1.cross(&r).dot(&normal) / area;
        Some(Self { distance: normal.dot(&r), weights: [1.0 - beta - gamma, beta, gamma] })
    }

    /// True if the projected point is inside the triangle up to `tolerance` in the weights.
    pub(super) fn is_inside(&self, tolerance: f64) -> bool {
        self.weights.iter().all(|&w| w >= -tolerance)
    }
}

/// sum w_i p_i.
pub(crate) fn interpolate(weights: &[f64; 3], corners: &[Vec3; 3]) -> Vec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// The outward unit normal at `weights` of triangle `t`; zero for a degenerate place.
pub(crate) fn contact_normal(kind: Normals, surface: &Surface, x: &[Vec3], t: u32, weights: &[f64; 3]) -> Vec3 {
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

/// Walks from triangle `from` across the edge of the most negative weight to the triangle under `point`, projecting
/// along face normals. A walk that returns (a valley or a ridge) or meets the surface's rim is clamped to the edge.
pub(super) fn walk(surface: &Surface, x: &[Vec3], from: u32, point: &Vec3) -> (u32, [f64; 3]) {
    let (mut t, mut previous) = (from, Surface::NONE);
    let mut weights = [1.0 / 3.0; 3];
    for hop in 0..=MAX_HOPS {
        let corners = surface.triangles[t as usize].map(|node| x[node as usize]);
        // A sliver has no weights of its own: stay in its middle.
        weights = Projection::new(&corners, point).map_or([1.0 / 3.0; 3], |seen| seen.weights);
        let lowest = (0..3).fold(0, |lowest, i| if weights[i] < weights[lowest] { i } else { lowest });
        if weights[lowest] >= -INSIDE {
            return (t, weights);
        }
        let next = surface.neighbours[t as usize][lowest];
        if next == Surface::NONE || next == previous || hop == MAX_HOPS {
            break;
        }
        (previous, t) = (t, next);
    }
    (t, clamp(weights))
}

/// The weights without their negative part.
fn clamp(weights: [f64; 3]) -> [f64; 3] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f64 = positive.iter().sum();
    positive.map(|w| w / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_reproduce_the_projected_point() {
        let corners = [Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.3, 0.1, 0.0), Vec3::new(0.0, 0.2, 0.1)];
        let point = Vec3::new(0.1, 0.1, 0.5);
        let seen = Projection::new(&corners, &point).unwrap();
        let foot = interpolate(&seen.weights, &corners);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
        assert!((foot + normal * seen.distance - point).norm() < 1e-15);
    }

    #[test]
    fn a_sliver_is_no_triangle() {
        let corners = [Vec3::zeros(), Vec3::x() * 0.01, Vec3::new(0.005, 1e-13, 0.0)];
        assert!(Projection::new(&corners, &Vec3::z()).is_none());
        let thin = [Vec3::zeros(), Vec3::x() * 0.01, Vec3::new(0.005, 1e-10, 0.0)];
        assert!(Projection::new(&thin, &Vec3::new(0.005, 0.5e-10, 1.0)).unwrap().is_inside(1e-9));
    }
}
