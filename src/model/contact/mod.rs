//! Contact of a point tool with a deformable surface: detection, friction and tracking.
//!
//! [`step`] is one explicit step of any model, whole body or patch:
//!
//! ```text
//! v* = v + d M^-1 f
//! not in contact:  swept point against moving triangles, earliest hit; then the "already inside" search
//! hit at share s:  x += s d v*;  d_c = (1 - s) d
//! in contact:      impulse J so that the contact point follows the tool; release, slip or stick; v = v* - M^-1 G^T J
//! x += d_c v;  slip or release: walk to the triangle under the tool
//! force on the tool: J / d
//! ```
//!
//! Several tools, and the places of one with a shape, are resolved together. An implicit step differs in v*, which comes from a linear system, and in the
//! impulse, which moves every node.

mod closest;
mod columns;
mod corners;
mod coupled;
mod deformable;
mod exact;
mod extent;
mod friction;
mod grain;
mod inside;
mod near;
mod nearness;
mod paper;
mod passing;
mod resolve;
mod row;
mod rows;
mod search;
mod shape;
mod skin;
mod solve;
mod steady;
mod step;
mod swept;
mod touch;
mod triangle;
mod vicinity;
mod work;

use crate::{Pose, Vec3};

pub use deformable::Deformable;
pub use friction::Friction;
pub(crate) use rows::Rows;
pub use shape::ToolShape;
pub use skin::Coarseness;
pub(crate) use skin::Skin;
pub(crate) use steady::Steady;
pub use step::step;
pub(crate) use step::{step_all, step_implicit};
pub(crate) use touch::{Felt, Touch};
pub(crate) use triangle::{contact_normal, interpolate};

/// The state of a contact.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u16)]
pub enum ContactMode {
    /// No force: not touching, or just released and still tracked.
    #[default]
    Free = 0,
    /// The contact point follows the tool.
    Stick = 1,
    /// The tool slides over the surface.
    Slip = 2,
    /// Every node of the triangle is held: no force can be computed.
    Lost = 3,
}

impl ContactMode {
    /// The mode with this number; unknown numbers read as free.
    pub fn from_code(code: u16) -> Self {
        match code {
            1 => Self::Stick,
            2 => Self::Slip,
            3 => Self::Lost,
            _ => Self::Free,
        }
    }
}

/// The choice of the normal that a contact uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Normals {
    /// Unit vertex normals interpolated over the triangle: continuous along the surface.
    #[default]
    Interpolated,
    /// The triangle's own, as printed in the paper; frictionless drags flip between facets and lose the contact.
    Face,
}

/// The choice of the equations that resolve a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Equations {
    /// Velocity level, mass-weighted; the default.
    #[default]
    Corrected,
    /// The paper's printed equations (10) to (31), to show the difference.
    Paper,
}

/// The law by which contacts are resolved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Law {
    /// Friction between tool and body.
    pub friction: Friction,
    /// The normal that contacts use.
    pub normals: Normals,
    /// The equations that resolve them.
    pub equations: Equations,
}

/// A contact of a tool: the surface triangle that it touches, barycentric weights and the mode.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Triangle id; `None` when nothing is tracked.
    pub triangle: Option<u32>,
    /// Weights of the triangle's three nodes; they sum to one.
    pub weights: [f64; 3],
    /// The state of the contact.
    pub mode: ContactMode,
    /// Glued to its point: no cone test, no release.
    pub glued: bool,
    /// The normal that the last step used; zero before the first.
    pub normal: Vec3,
}

impl Contact {
    /// A contact that is glued to the surface at `weights` of `triangle`.
    pub fn glued(triangle: u32, weights: [f64; 3]) -> Self {
        Self { triangle: Some(triangle), weights, mode: ContactMode::Stick, glued: true, normal: Vec3::zeros() }
    }

    /// True if a force acts.
    pub fn is_touching(&self) -> bool {
        matches!(self.mode, ContactMode::Stick | ContactMode::Slip)
    }
}

/// One of the places at which a tool with a shape touches.
///
/// # Real-time
/// A plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactPoint {
    /// The surface triangle.
    pub triangle: u32,
    /// The place (m).
    pub place: Vec3,
    /// The unit normal, from the surface to the tool.
    pub normal: Vec3,
    /// The force on the tool (N).
    pub force: Vec3,
    /// Its state.
    pub mode: ContactMode,
}

/// The tool's motion during one step: a straight line, and an even turn.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolMotion {
    /// The tool at the start of the step.
    pub from: Pose,
    /// The tool at the end of the step.
    pub to: Pose,
}

impl ToolMotion {
    /// From one position to another (m), not turned.
    pub fn straight(from: Vec3, to: Vec3) -> Self {
        Self { from: Pose::at(from), to: Pose::at(to) }
    }

    /// The part from share `a` to share `b` of the motion.
    pub fn part(&self, a: f64, b: f64) -> Self {
        Self { from: self.at(a), to: self.at(b) }
    }

    /// The tool at share `s` of the way.
    pub fn at(&self, s: f64) -> Pose {
        self.from.towards(&self.to, s)
    }

    /// How far its centre moves (m).
    pub fn way(&self) -> Vec3 {
        self.to.position - self.from.position
    }
}
