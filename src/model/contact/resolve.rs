//! The corrected contact equations: velocity level, mass-weighted, with Coulomb friction.

use super::deformable::Deformable;
use super::triangle::{contact_normal, interpolate};
use super::{ContactMode, Law, ToolMotion};
use crate::Vec3;

/// Penetration is recovered at this speed (m/s); an open gap is closed in full.
const RECOVERY: f64 = 0.1;
/// Below this compliance S (1/kg) all nodes are held and no force can be computed.
pub(super) const IMMOVABLE: f64 = 1e-9;
/// A remaining step shorter than this cannot carry an impulse (s).
pub(super) const NO_TIME: f64 = 1e-12;

/// What a contact did in one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// The mode that resulted.
    pub mode: ContactMode,
    /// Impulse on the tool (N s).
    pub impulse: Vec3,
    /// The normal used.
    pub normal: Vec3,
}

impl Resolution {
    pub(super) fn without_force(mode: ContactMode, normal: Vec3) -> Self {
        Self { mode, impulse: Vec3::zeros(), normal }
    }
}

/// Where a contact is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub triangle: u32,
    pub weights: &'a [f64; 3],
    pub is_glued: bool,
}

/// The velocity that the contact point is to take over the last `d_c` of a step of `d` (s): v_t = (q1 - q_start + r) / d_c, r
/// the drift between the tool and `point`.
pub(super) fn target_velocity(point: Vec3, normal: &Vec3, tool: ToolMotion, d_c: f64, d: f64) -> Vec3 {
    let mut drift = tool.from - point;
    let (length, cap) = (drift.norm(), RECOVERY * d);
    if length > cap && drift.dot(normal) < 0.0 {
        drift *= cap / length;
    }
    (tool.to - tool.from + drift) / d_c
}

/// Solves the contact over the last `d_c` of a step of `d` (s) and changes the three nodes' velocities.
///
/// The contact point G x is to move with the tool. The impulse J = (G v* - v_t) / S with S = sum w_i^2 / m_i, and v_i = v*_i - (w_i / m_i) J. Source: physics of the
/// paper's sections 4.2 to 4.4 in the mass-weighted form; J is the Lagrange multiplier for any masses.
pub(super) fn resolve(
    body: &mut Deformable<'_>,
    law: &Law,
    Place { triangle, weights, is_glued }: Place<'_>,
    tool: ToolMotion,
    d_c: f64,
    d: f64,
) -> Resolution {
    let nodes = body.corners(triangle);
    let compliance: f64 = nodes.iter().zip(weights).map(|(&node, w)| w * w * body.inverse_masses[node]).sum();
    let normal = contact_normal(law.normals, body.surface, body.positions, triangle, weights);
    if compliance < IMMOVABLE {
        return Resolution::without_force(ContactMode::Lost, normal);
    }
    if d_c < NO_TIME {
        // Found at the very end of the step: tracked, and resolved in the next one.
        return Resolution::without_force(ContactMode::Free, normal);
    }
    let point = interpolate(weights, &nodes.map(|node| body.positions[node]));
    let velocity = interpolate(weights, &nodes.map(|node| body.velocities[node]));
    let target = target_velocity(point, &normal, tool, d_c, d);
    let mut impulse = (velocity - target) / compliance;
    let mut mode = ContactMode::Stick;
    if !is_glued {
        let along = impulse.dot(&normal);
        // Written so that an impulse that is not a number releases.
        if along.is_nan() || along <= 0.0 {
            return Resolution::without_force(ContactMode::Free, normal);
        }
        let tangential = impulse - normal * along;
        let limit = law.friction * along;
        if tangential.norm() > limit {
            mode = ContactMode::Slip;
            impulse = normal * along + tangential * (limit / tangential.norm());
        }
    }
    for (&node, w) in nodes.iter().zip(weights) {
        body.velocities[node] -= impulse * (w * body.inverse_masses[node]);
    }
    Resolution { mode, impulse, normal }
}
