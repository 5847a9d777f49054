//! One explicit step with contact, for a whole body and for a patch alike.

use super::super::{Vec3, integrator};
use super::deformable::Deformable;
use super::resolve::{Resolution, resolve};
use super::{Contact, Equations, Law, Mode, ToolMotion, paper};

/// One step of `d` seconds: velocities take `forces`, the tool's contact is found and resolved, positions move.
/// Returns the force on the tool (N), the impulse over the full step.
///
/// Velocities of nodes with zero inverse mass must be zero.
///
/// # Real-time
/// Bounded, real-time safe.
pub fn step(
    body: &mut Deformable<'_>,
    forces: &[Vec3],
    contact: &mut Contact,
    law: &Law,
    tool: ToolMotion,
    d: f64,
) -> Vec3 {
    if law.equations == Equations::Paper {
        return paper::step(body, forces, contact, law, tool, d);
    }
    integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
    let Some((triangle, share)) = body.detect(contact, tool, d) else {
        body.drift(d);
        return Vec3::zeros();
    };
    if share > 0.0 {
        body.drift(share * d);
    }
    let d_c = (1.0 - share) * d;
    let place = (triangle, &contact.weights, contact.glued);
    let Resolution { mode, impulse, normal } = resolve(body, law, place, tool.part(share, 1.0), d_c, d);
    (contact.mode, contact.normal) = (mode, normal);
    body.drift(d_c);
    if mode != Mode::Stick {
        body.reseat(contact, law, triangle, &tool.to);
    }
    impulse / d
}
