//! The paper's printed contact equations, kept to show what the corrected ones change.
//!
//! Literal: the un-weighted projections P and Q of (10) to (22), the contact point held still while the tool moves
//! (p-dot = 0 in (6)), the stick update (13) with the *old* velocity and the slip updates (21), (29) with the new one,
//! the net node forces (15), (23), (31) as the force on the tool, friction scaled to its limit by (27) even when it is
//! below, with one coefficient, that of sliding, and the geometric push of section 4.1, split as w_i / sum w^2. Not literal, because nothing runs without:
//! internal forces are those of the body (f_0 of (3) is missing in (11)); detection, release and edge crossing, which
//! the paper does not give, are those of the corrected equations.

use super::deformable::Deformable;
use super::triangle::{contact_normal, interpolate};
use super::{Contact, ContactMode, Law, ToolMotion};
use crate::{Vec3, integrator};

/// Without a movable node there is nothing to project (sum of the squared weights).
const IMMOVABLE: f64 = 1e-12;

/// One step with the printed equations; same contract as [`super::step`].
pub(super) fn step(
    body: &mut Deformable<'_>,
    forces: &[Vec3],
    contact: &mut Contact,
    law: &Law,
    tool: ToolMotion,
    d: f64,
) -> Vec3 {
    let (was_touching, was_slipping) = (contact.triangle.is_some(), contact.mode == ContactMode::Slip);
    integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
    let Some((triangle, _)) = body.detect(contact, tool, d) else {
        body.drift(d);
        return Vec3::zeros();
    };
    contact.normal = contact_normal(law.normals, body.surface, body.positions, triangle, &contact.weights);
    let Some(point) = Point::new(body, triangle, contact.weights) else {
        contact.mode = ContactMode::Lost;
        body.drift(d);
        body.reseat(contact, law, triangle, &tool.to.position);
        return Vec3::zeros();
    };
    let velocity = point.of(body.velocities);
    let slowed;
    (contact.mode, slowed) = if contact.glued {
        (ContactMode::Stick, velocity)
    } else if was_touching && velocity.dot(&contact.normal) <= 0.0 {
        (ContactMode::Free, Vec3::zeros())
    } else {
        cone(velocity, &contact.normal, law.friction.kinetic, was_slipping)
    };
    if contact.mode == ContactMode::Stick {
        drift_with_old_velocities(body, forces, d);
        point.slow(body, slowed);
    } else {
        point.slow(body, slowed);
        body.drift(d);
    }
    if contact.mode != ContactMode::Free {
        // Section 4.1: the surface is pushed to the tool, along the normal without friction, along its motion with it.
        let gap = tool.to.position - point.of(body.positions);
        let follows = contact.glued || law.friction.kinetic > 0.0;
        point.push(body, if follows { gap } else { contact.normal * gap.dot(&contact.normal) });
    }
    if contact.mode != ContactMode::Stick {
        body.reseat(contact, law, triangle, &tool.to.position);
    }
    point.net_force(slowed, d)
}

/// What of the contact point's velocity is taken away, (24) to (29).
fn cone(velocity: Vec3, normal: &Vec3, friction: f64, was_slipping: bool) -> (ContactMode, Vec3) {
    let along = normal * velocity.dot(normal);
    let across = velocity - along;
    let limit = friction * along.norm();
    if !was_slipping && across.norm() <= limit {
        return (ContactMode::Stick, velocity);
    }
    // (27) scales to the limit whether above or below it; 0/0 is read as no friction, an infinite limit as sticking.
    let scale = if limit.is_finite() && across.norm() > 0.0 { limit / across.norm() } else { 1.0 };
    (ContactMode::Slip, along + across * scale)
}

/// (13): the positions of a sticking step move with the velocities before it.
fn drift_with_old_velocities(body: &mut Deformable<'_>, forces: &[Vec3], d: f64) {
    for (i, force) in forces.iter().enumerate() {
        body.positions[i] += (body.velocities[i] - force * (d * body.inverse_masses[i])) * d;
    }
}

/// The contact point with the un-weighted projection of (7) to (10).
struct Point {
    nodes: [usize; 3],
    weights: [f64; 3],
    /// Of the nodes that can move: each one's share w_i / sum w^2 of a change at the point.
    shares: [f64; 3],
    /// sum m_i w_i / sum w^2 (kg): what the net of the node forces makes of a change of velocity.
    inertia: f64,
}

impl Point {
    fn new(body: &Deformable<'_>, triangle: u32, weights: [f64; 3]) -> Option<Self> {
        let nodes = body.corners(triangle);
        let mobility = nodes.map(|node| body.inverse_masses[node]);
        let movable = |i: usize| if mobility[i] > 0.0 { weights[i] } else { 0.0 };
        let sum_squares: f64 = (0..3).map(|i| movable(i) * movable(i)).sum();
        if sum_squares < IMMOVABLE {
            return None;
        }
        let shares = std::array::from_fn(|i| movable(i) / sum_squares);
        let inertia = (0..3).filter(|&i| mobility[i] > 0.0).map(|i| shares[i] / mobility[i]).sum();
        Some(Self { nodes, weights, shares, inertia })
    }

    /// The value of a node quantity at the point.
    fn of(&self, values: &[Vec3]) -> Vec3 {
        interpolate(&self.weights, &self.nodes.map(|node| values[node]))
    }

    /// Takes `velocity` away at the point (P and Q).
    fn slow(&self, body: &mut Deformable<'_>, velocity: Vec3) {
        for (&node, share) in self.nodes.iter().zip(&self.shares) {
            body.velocities[node] -= velocity * *share;
        }
    }

    /// Moves the point by `way`.
    fn push(&self, body: &mut Deformable<'_>, way: Vec3) {
        for (&node, share) in self.nodes.iter().zip(&self.shares) {
            body.positions[node] += way * *share;
        }
    }

    /// (15), (23), (31): the net of the node forces that slowed the point within `d` seconds.
    fn net_force(&self, slowed: Vec3, d: f64) -> Vec3 {
        slowed * (self.inertia / d)
    }
}
