//! The paper's printed contact equations, kept to show what the corrected ones change.
//!
//! Literal: the un-weighted projections P and Q of (10) to (22), the contact point held still while the tool moves
//! (p-dot = 0 in (6)), the stick update (13) with the *old* velocity and the slip updates (21), (29) with the new one,
//! the net node forces (15), (23), (31) as the force on the tool, friction scaled to its limit by (27) even when it is
//! below, and the geometric push of section 4.1, split as w_i / sum w^2. Not literal, because nothing runs without:
//! internal forces are those of the body (f_0 of (3) is missing in (11)); detection, release and edge crossing, which
//! the paper does not give, are those of the corrected equations.

use super::super::{Vec3, integrator};
use super::normal::contact_normal;
use super::step::{Deformable, detect, reseat};
use super::triangle::interpolate;
use super::{Contact, Law, Mode, ToolMotion};

/// One step with the printed equations; same contract as [`super::step`].
pub(super) fn step(
    body: &mut Deformable<'_>,
    forces: &[Vec3],
    contact: &mut Contact,
    law: &Law,
    tool: ToolMotion,
    d: f64,
) -> Vec3 {
    let was_slipping = contact.mode == Mode::Slip;
    let predicted = |body: &Deformable<'_>, node: usize| {
        let force = forces.get(node).copied().unwrap_or_default();
        body.velocities[node] + force * (d * body.inverse_masses[node])
    };
    // Detection looks at the motion that the predicted velocities make.
    let touching = contact.triangle.is_some();
    if !touching {
        integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
        if detect(body, contact, tool, d).is_none() {
            body.drift(d);
            return Vec3::zeros();
        }
    }
    let Some(triangle) = contact.triangle else { return Vec3::zeros() };
    let nodes = body.surface.triangles[triangle as usize].map(|node| node as usize);
    let weights = contact.weights;
    let normal = contact_normal(law.normals, body.surface, body.positions, triangle, &weights);
    contact.normal = normal;
    let sum_squares: f64 =
        nodes.iter().zip(&weights).map(|(&i, w)| if body.inverse_masses[i] > 0.0 { w * w } else { 0.0 }).sum();
    let velocities =
        if touching { nodes.map(|node| predicted(body, node)) } else { nodes.map(|node| body.velocities[node]) };
    let point_velocity = interpolate(&weights, &velocities);
    // Net of the node forces m_i w_i u / (d sum w^2) for a contact point slowed by u.
    let inertia: f64 = nodes
        .iter()
        .zip(&weights)
        .filter(|&(&i, _)| body.inverse_masses[i] > 0.0)
        .map(|(&i, w)| w / body.inverse_masses[i])
        .sum();
    if sum_squares < 1e-12 {
        contact.mode = Mode::Lost;
        if touching {
            integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
        }
        body.drift(d);
        return Vec3::zeros();
    }
    let force_of = |slowed: Vec3| slowed * (inertia / (sum_squares * d));

    let (along, across) = (normal * point_velocity.dot(&normal), point_velocity - normal * point_velocity.dot(&normal));
    let slowed;
    (contact.mode, slowed) = if contact.glued {
        (Mode::Stick, point_velocity)
    } else if point_velocity.dot(&normal) <= 0.0 && touching {
        (Mode::Free, Vec3::zeros())
    } else {
        let limit = law.friction * along.norm();
        if was_slipping || across.norm() > limit {
            // (27): scaled to the limit whether above or below it; 0/0 is read as no friction.
            let friction = if across.norm() > 0.0 { across * (limit.min(f64::MAX) / across.norm()) } else { across };
            (Mode::Slip, along + friction)
        } else {
            (Mode::Stick, point_velocity)
        }
    };

    // (13) moves with the old velocity, (21) and (29) with the new one.
    if contact.mode == Mode::Stick {
        body.drift(d);
    }
    if touching {
        integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
    }
    for (&node, w) in nodes.iter().zip(&weights) {
        if body.inverse_masses[node] > 0.0 {
            body.velocities[node] -= slowed * (w / sum_squares);
        }
    }
    if contact.mode != Mode::Stick {
        body.drift(d);
    }

    // Section 4.1: the surface is pushed to the tool, along the normal without friction, along its motion with it.
    if contact.mode != Mode::Free {
        let point = interpolate(&weights, &nodes.map(|node| body.positions[node]));
        let gap = tool.to - point;
        let push = if law.friction > 0.0 || contact.glued { gap } else { normal * gap.dot(&normal) };
        for (&node, w) in nodes.iter().zip(&weights) {
            if body.inverse_masses[node] > 0.0 {
                body.positions[node] += push * (w / sum_squares);
            }
        }
    }
    if contact.mode != Mode::Stick {
        reseat(body, contact, law, triangle, &tool.to);
    }
    force_of(slowed)
}
