//! A point over a triangle: signed distance and barycentric weights.

use super::super::Vec3;

/// Twice the area below which corners are no triangle (m^2).
const SLIVER: f64 = 1e-14;

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
pub(super) fn interpolate(weights: &[f64; 3], corners: &[Vec3; 3]) -> Vec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
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
