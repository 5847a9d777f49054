//! The corrected contact equations: velocity level, mass-weighted, with Coulomb friction.

use super::deformable::Deformable;
use super::triangle::{contact_normal, interpolate};
use super::{ContactMode, Friction, Law, ToolMotion};
use crate::Vec3;

/// Penetration is recovered at this speed (m/s); an open gap is closed in full.
pub(super) const RECOVERY: f64 = 0.1;
/// Below this compliance S (1/kg) all nodes are held and no force can be computed.
pub(super) const IMMOVABLE: f64 = 1e-9;
/// A remaining step shorter than this cannot carry an impulse (s).
const NO_TIME: f64 = 1e-12;

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
    fn without_force(mode: ContactMode, normal: Vec3) -> Self {
        Self { mode, impulse: Vec3::zeros(), normal }
    }
}

/// Where a contact is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub triangle: u32,
    pub weights: &'a [f64; 3],
    pub is_glued: bool,
    /// It stuck in the step before.
    pub was_sticking: bool,
}

/// The normal of a contact whose point has the `compliance` (1/kg), and its closing velocity G v* - v_t (m/s) over the last `d_c`
/// of a step of `d` (s): v_t = (q1 - q_start + r) / d_c, r the drift between the tool and the point.
///
/// # Errors
/// The outcome where there can be no force: nothing gives way, or no time is left.
pub(super) fn approach(
    body: &Deformable<'_>,
    law: &Law,
    Place { triangle, weights, .. }: Place<'_>,
    tool: ToolMotion,
    [d_c, d]: [f64; 2],
    compliance: f64,
) -> Result<(Vec3, Vec3), Resolution> {
    let nodes = body.corners(triangle);
    let normal = contact_normal(law.normals, body.surface, body.positions, triangle, weights);
    if compliance < IMMOVABLE {
        return Err(Resolution::without_force(ContactMode::Lost, normal));
    }
    if d_c < NO_TIME {
        // Found at the very end of the step: tracked, and resolved in the next one.
        return Err(Resolution::without_force(ContactMode::Free, normal));
    }
    let mut drift = tool.from.position - interpolate(weights, &nodes.map(|node| body.positions[node]));
    let (length, cap) = (drift.norm(), RECOVERY * d);
    if length > cap && drift.dot(&normal) < 0.0 {
        drift *= cap / length;
    }
    let target = (tool.way() + drift) / d_c;
    Ok((normal, interpolate(weights, &nodes.map(|node| body.velocities[node])) - target))
}

/// Solves the contact over the last `d_c` of a step of `d` (s) and changes the three nodes' velocities.
///
/// The contact point G x is to move with the tool. The impulse J = (G v* - v_t) / S with S = sum w_i^2 / m_i, and v_i = v*_i - (w_i / m_i) J. Source: physics of the
/// paper's sections 4.2 to 4.4 in the mass-weighted form; J is the Lagrange multiplier for any masses.
pub(super) fn resolve(
    body: &mut Deformable<'_>,
    law: &Law,
    place: Place<'_>,
    tool: ToolMotion,
    d_c: f64,
    d: f64,
) -> Resolution {
    let (nodes, weights) = (body.corners(place.triangle), place.weights);
    let compliance: f64 = nodes.iter().zip(weights).map(|(&node, w)| w * w * body.inverse_masses[node]).sum();
    let (normal, closing) = match approach(body, law, place, tool, [d_c, d], compliance) {
        Ok(found) => found,
        Err(without_force) => return without_force,
    };
    let friction = if place.is_glued { None } else { Some((law.friction, place.was_sticking)) };
    let (mode, impulse) = impulse(compliance, closing, &normal, friction);
    for (&node, w) in nodes.iter().zip(weights) {
        body.velocities[node] -= impulse * (w * body.inverse_masses[node]);
    }
    Resolution { mode, impulse, normal }
}

/// The impulse on the tool (N s) that takes away `closing` = G v* - v_t (m/s) at a point of the `compliance` (1/kg) within the cone of the
/// friction, with whether the contact stuck in the step before; `None` is glued.
pub(super) fn impulse(
    compliance: f64,
    closing: Vec3,
    normal: &Vec3,
    friction: Option<(Friction, bool)>,
) -> (ContactMode, Vec3) {
    let sticking = closing / compliance;
    let Some((friction, was_sticking)) = friction else { return (ContactMode::Stick, sticking) };
    let along = sticking.dot(normal);
    // Written so that an impulse that is not a number releases.
    if along.is_nan() || along <= 0.0 {
        return (ContactMode::Free, Vec3::zeros());
    }
    let (mode, across) = friction.resolve(was_sticking, sticking - normal * along, along, compliance);
    match mode {
        ContactMode::Stick => (mode, sticking),
        ContactMode::Slip => (mode, normal * along + across),
        ContactMode::Free | ContactMode::Lost => (ContactMode::Free, Vec3::zeros()),
    }
}
