//! One place at which a tool may touch, as a row of the system for the impulses of all of them.

use std::cmp::Ordering;

use super::ContactMode;
use super::grain::{Grain, Sinking, Sunk};
use crate::Vec3;

/// One place at which a tool may touch: its point of the surface is the mean of some nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) tool: usize,
    pub(super) triangle: u32,
    pub(super) weights: [f64; 3],
    /// The corners with a weight, in increasing order; none of a point tool.
    pub(super) feature: [u32; 3],
    /// Where on the tool's axis, from one end to the other.
    pub(super) share: f64,
    /// Where it is at the end of the step if nothing presses (m).
    pub(super) place: Vec3,
    /// From the surface to the tool.
    pub(super) normal: Vec3,
    /// How fast the tool moves there (m/s).
    pub(super) target: Vec3,
    /// How fast it closes on the tool if nothing presses (m/s).
    pub(super) closing: Vec3,
    /// At this velocity along the normal, against the tool's, the surface just touches the tool at the end of the step (m/s).
    pub(super) allowed: f64,
    /// How much the place gives way to an impulse at most, and along the normal (1/kg).
    pub(super) compliance: f64,
    pub(super) along: f64,
    /// How deep the tool sinks in beside the elements, and how coarse they are, if that is known.
    pub(super) sinking: Option<(Sinking, Grain)>,
    /// The same as the speed that it takes away in the step, linear around the impulse that is expected.
    pub(super) sunk: Sunk,
    pub(super) stuck: bool,
    pub(super) glued: bool,
    pub(super) mode: ContactMode,
    /// On the tool (N s).
    pub(super) impulse: Vec3,
    /// How much of the step is over before it touches (s); nothing for a tool with a shape.
    pub(super) before: f64,
    /// Its nodes in the list of the system.
    pub(super) nodes: (usize, usize),
}

impl Row {
    /// True if the tool is a point: others touch with features of the surface.
    pub(super) fn is_of_point(&self) -> bool {
        self.feature == [u32::MAX; 3]
    }

    /// The order of two places: by where they are, then by their normals, then by how the tools move there.
    pub(super) fn in_order(&self, other: &Self) -> Ordering {
        let by = |one: &Vec3, other: &Vec3| {
            one.x.total_cmp(&other.x).then_with(|| one.y.total_cmp(&other.y)).then_with(|| one.z.total_cmp(&other.z))
        };
        by(&self.place, &other.place)
            .then_with(|| by(&self.normal, &other.normal))
            .then_with(|| by(&self.target, &other.target))
    }
}
