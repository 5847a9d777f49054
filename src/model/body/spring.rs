//! One spring with a parallel damper: force and tangent.

use crate::{Mat3, Vec3};

/// A spring and a damper in parallel between two nodes.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Stiffness k (N/m).
    pub stiffness: f64,
    /// Damping b (N s/m).
    pub damping: f64,
    /// Rest length L0 (m).
    pub rest_length: f64,
}

/// How the force on a spring's first node answers to its second; the answer to the first node is the opposite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringTangent {
    /// df_i / dx_j (N/m).
    pub position: Mat3,
    /// df_i / dv_j (N s/m).
    pub velocity: Mat3,
}

impl Spring {
    /// A spring shorter than this share of its rest length has no direction: no force, no tangent.
    pub const COLLAPSED: f64 = 1e-3;

    /// The unit vector along a spring whose second node is `along` (m) from the first, and its length (m); `None` for one that
    /// is too short to have a direction.
    fn direction(&self, along: Vec3) -> Option<(Vec3, f64)> {
        let length = along.norm();
        (length >= Self::COLLAPSED * self.rest_length).then(|| (along / length, length))
    }

    /// Force on the first node (N): `[k (L - L0) + b u.(v_j - v_i)] u`, u the unit vector to the second node.
    ///
    /// `along` = x_j - x_i (m), `closing` = v_j - v_i (m/s).
    pub fn force(&self, along: Vec3, closing: Vec3) -> Vec3 {
        let Some((u, length)) = self.direction(along) else { return Vec3::zeros() };
        u * (self.stiffness * (length - self.rest_length) + self.damping * u.dot(&closing))
    }

    /// The tangent at `along` = x_j - x_i, `closing` = v_j - v_i.
    ///
    /// `clamp` leaves the geometric term (s / L)(I - u u^T) of a spring under compression (s < 0) out.
    pub fn tangent(&self, along: Vec3, closing: Vec3, clamp: bool) -> SpringTangent {
        let Some((u, length)) = self.direction(along) else {
            return SpringTangent { position: Mat3::zeros(), velocity: Mat3::zeros() };
        };
        let axial = u * u.transpose();
        let rate = u.dot(&closing);
        let tension = self.stiffness * (length - self.rest_length) + self.damping * rate;
        let geometric = if clamp { (tension / length).max(0.0) } else { tension / length };
        let turning = u * (closing - u * rate).transpose() * (self.damping / length);
        SpringTangent {
            position: axial * self.stiffness + (Mat3::identity() - axial) * geometric + turning,
            velocity: axial * self.damping,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRING: Spring = Spring { stiffness: 30.0, damping: 0.05, rest_length: 0.009 };

    #[test]
    fn the_tangent_is_the_derivative_of_the_force() {
        let (along, closing) = (Vec3::new(0.004, -0.007, 0.008), Vec3::new(0.3, 0.1, -0.2));
        let tangent = SPRING.tangent(along, closing, false);
        for axis in 0..3 {
            let step = Vec3::ith(axis, 1e-7);
            let by_position =
                (SPRING.force(along + step, closing) - SPRING.force(along - step, closing)) / (2.0 * 1e-7);
            let by_velocity =
                (SPRING.force(along, closing + step) - SPRING.force(along, closing - step)) / (2.0 * 1e-7);
            assert!((by_position - tangent.position.column(axis)).norm() < 1e-5);
            assert!((by_velocity - tangent.velocity.column(axis)).norm() < 1e-7);
        }
    }

    #[test]
    fn clamping_drops_the_negative_geometric_term_only() {
        let squeezed = Vec3::new(0.0, 0.0, 0.005);
        let stretched = Vec3::new(0.0, 0.0, 0.015);
        let across = |along, clamp| SPRING.tangent(along, Vec3::zeros(), clamp).position[(0, 0)];
        assert!(across(squeezed, false) < 0.0);
        assert_eq!(across(squeezed, true), 0.0);
        assert_eq!(across(stretched, true), across(stretched, false));
    }

    #[test]
    fn a_collapsed_spring_is_finite_and_forceless() {
        let tiny = Vec3::new(1e-9, 0.0, 0.0);
        assert_eq!(SPRING.force(tiny, Vec3::x()), Vec3::zeros());
        assert_eq!(SPRING.force(Vec3::zeros(), Vec3::x()), Vec3::zeros());
        assert_eq!(SPRING.tangent(Vec3::zeros(), Vec3::x(), false).position, Mat3::zeros());
    }
}
