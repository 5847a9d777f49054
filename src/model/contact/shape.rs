//! The shape of a tool.

use crate::{Pose, Vec3};

/// The shape of a tool, in its own axes, around its centre.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ToolShape {
    /// A point: one contact, with a single triangle.
    #[default]
    Point,
    /// A sphere.
    Sphere {
        /// Its radius (m).
        radius: f64,
    },
    /// A cylinder with a half sphere at both ends: a sphere that is swept along its axis.
    Capsule {
        /// The radius (m).
        radius: f64,
        /// From the centre to the centre of the half sphere at one end (m).
        half_axis: Vec3,
    },
}

impl ToolShape {
    /// The radius (m); zero for a point.
    pub fn radius(&self) -> f64 {
        match *self {
            Self::Point => 0.0,
            Self::Sphere { radius } | Self::Capsule { radius, .. } => radius,
        }
    }

    /// The axis from its middle to one end (m); zero but for a capsule.
    pub fn half_axis(&self) -> Vec3 {
        match *self {
            Self::Point | Self::Sphere { .. } => Vec3::zeros(),
            Self::Capsule { half_axis, .. } => half_axis,
        }
    }

    /// The two ends of the axis of a tool at `pose` (m); both are the centre but for a capsule.
    pub fn axis(&self, pose: &Pose) -> [Vec3; 2] {
        let half = pose.orientation * self.half_axis();
        [pose.position - half, pose.position + half]
    }

    /// How high a tool at `pose` is over the origin along the unit vector `up` (m): its lowest part.
    pub(crate) fn height(&self, pose: &Pose, up: &Vec3) -> f64 {
        let [one, other] = self.axis(pose).map(|end| end.dot(up));
        one.min(other) - self.radius()
    }
}
