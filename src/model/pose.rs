//! Where a tool is and how it is turned, and what acts on it.

use crate::{Turn, Vec3};

/// The place and the orientation of a rigid tool.
///
/// ```
/// use palpate_model::{Pose, Vec3};
///
/// let upright = Pose::at(Vec3::new(0.0, 0.0, 0.1));
/// assert_eq!(upright.point(&Vec3::new(0.01, 0.0, 0.0)), Vec3::new(0.01, 0.0, 0.1));
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The tool's centre (m).
    pub position: Vec3,
    /// The turn from the tool's own axes to those of the world.
    pub orientation: Turn,
}

impl Default for Pose {
    /// At the origin, not turned.
    fn default() -> Self {
        Self::at(Vec3::zeros())
    }
}

impl From<Vec3> for Pose {
    fn from(position: Vec3) -> Self {
        Self::at(position)
    }
}

impl Pose {
    /// At `position` (m), not turned.
    pub fn at(position: Vec3) -> Self {
        Self { position, orientation: Turn::identity() }
    }

    /// Where the tool's own point `offset` (m, in its own axes) is (m).
    pub fn point(&self, offset: &Vec3) -> Vec3 {
        self.position + self.orientation * offset
    }

    /// The pose at share `s` of the way to `to`: straight in the position, evenly turned on the shorter way.
    #[must_use]
    pub fn towards(&self, to: &Self, s: f64) -> Self {
        let position = self.position + (to.position - self.position) * s;
        // A tool that does not turn keeps its orientation to the last bit.
        let orientation = if self.orientation == to.orientation {
            self.orientation
        } else {
            let near = if self.orientation.dot(&to.orientation) < 0.0 {
                Turn::new_unchecked(-to.orientation.into_inner())
            } else {
                to.orientation
            };
            self.orientation.nlerp(&near, s)
        };
        Self { position, orientation }
    }

    /// The first of `parts` equal parts of the way to `to`.
    #[must_use]
    pub fn towards_in(&self, to: &Self, parts: u64) -> Self {
        let position = self.position + (to.position - self.position) / parts as f64;
        Self { position, ..self.towards(to, 1.0 / parts as f64) }
    }

    /// By how much it is turned against `before` (rad), along the axis of the turn in the world; small turns are meant.
    pub fn turned_since(&self, before: &Self) -> Vec3 {
        if self.orientation == before.orientation {
            return Vec3::zeros();
        }
        (self.orientation * before.orientation.inverse()).scaled_axis()
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position.iter().chain(self.orientation.coords.iter()).all(|c| c.is_finite())
    }
}

/// A force and a torque on a tool, about its centre.
///
/// ```
/// use palpate_model::{Vec3, Wrench};
///
/// let lever = Wrench::at(Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.0, 0.0, 2.0));
/// assert_eq!(lever.torque.y, -0.2);
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// The force (N).
    pub force: Vec3,
    /// The torque about the tool's centre, in the world's axes (N m).
    pub torque: Vec3,
}

impl From<Vec3> for Wrench {
    /// A force at the centre.
    fn from(force: Vec3) -> Self {
        Self { force, torque: Vec3::zeros() }
    }
}

impl Wrench {
    /// That of `force` (N) at `arm` (m) from the centre.
    pub fn at(arm: Vec3, force: Vec3) -> Self {
        Self { force, torque: arm.cross(&force) }
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().chain(self.torque.iter()).all(|c| c.is_finite())
    }
}

impl std::ops::Add for Wrench {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, torque: self.torque + other.torque }
    }
}

impl std::ops::AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl std::ops::Sub for Wrench {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { force: self.force - other.force, torque: self.torque - other.torque }
    }
}

impl std::ops::Mul<f64> for Wrench {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { force: self.force * factor, torque: self.torque * factor }
    }
}

impl std::ops::Div<f64> for Wrench {
    type Output = Self;

    fn div(self, divisor: f64) -> Self {
        Self { force: self.force / divisor, torque: self.torque / divisor }
    }
}

impl std::iter::Sum for Wrench {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |sum, part| sum + part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_goes_straight_and_turns_evenly_the_shorter_way() {
        let turn = |angle: f64| Turn::from_axis_angle(&Vec3::z_axis(), angle);
        let (from, to) = (Pose::default(), Pose { position: Vec3::x(), orientation: turn(0.4) });
        let middle = from.towards(&to, 0.5);
        assert_eq!(middle.position, Vec3::x() * 0.5);
        assert!(middle.orientation.angle_to(&turn(0.2)) < 1e-12);
        // The same turn, written with the other sign.
        let other = Pose { orientation: Turn::new_unchecked(-turn(0.4).into_inner()), ..to };
        assert!(from.towards(&other, 0.5).orientation.angle_to(&turn(0.2)) < 1e-7);
    }
}
