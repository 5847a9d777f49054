//! One explicit step with contact, for a whole body and for a patch alike.

use super::super::mesh::Surface;
use super::super::{Vec3, integrator};
use super::normal::contact_normal;
use super::resolve::{Resolution, resolve};
use super::triangle::interpolate;
use super::walk::walk;
use super::{Contact, Equations, Law, Mode, ToolMotion, paper, swept};

/// A released tool that is nearer than this is still tracked (m): touching again needs no new detection.
const TRACKED_GAP: f64 = 3e-4;

/// What a step works on: nodes in contact order, movable ones first for a patch.
#[derive(Debug)]
pub struct Deformable<'a> {
    /// Positions of all nodes that the surface names (m).
    pub positions: &'a mut [Vec3],
    /// Their velocities (m/s).
    pub velocities: &'a mut [Vec3],
    /// Their inverse masses (1/kg); zero for nodes that this model does not move.
    pub inverse_masses: &'a [f64],
    /// The surface over these nodes.
    pub surface: &'a Surface,
    /// The triangles that detection looks at.
    pub candidates: &'a [u32],
}

impl Deformable<'_> {
    /// Moves every movable node with its velocity for `d` seconds.
    pub(super) fn drift(&mut self, d: f64) {
        integrator::advance(self.positions, self.velocities, d);
    }
}

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
    let Some(share) = detect(body, contact, tool, d) else {
        body.drift(d);
        return Vec3::zeros();
    };
    let Some(triangle) = contact.triangle else { return Vec3::zeros() };
    if share > 0.0 {
        body.drift(share * d);
    }
    let d_c = (1.0 - share) * d;
    let place = (triangle, &contact.weights, contact.glued);
    let Resolution { mode, impulse, normal } = resolve(body, law, place, tool.part(share, 1.0), d_c, d);
    (contact.mode, contact.normal) = (mode, normal);
    body.drift(d_c);
    if mode != Mode::Stick {
        reseat(body, contact, law, triangle, &tool.to);
    }
    impulse / d
}

/// The share of the step after which the contact acts: 0 for one that exists, the hit's for a new one.
pub(super) fn detect(body: &Deformable<'_>, contact: &mut Contact, tool: ToolMotion, d: f64) -> Option<f64> {
    if contact.triangle.is_some() {
        return Some(0.0);
    }
    let hit = swept::find(body.surface, body.candidates, body.positions, body.velocities, tool, d)?;
    contact.triangle = Some(hit.triangle);
    contact.weights = hit.weights;
    Some(hit.share)
}

/// After a slip or a release: to the triangle under the tool, or off when the tool has left the surface.
pub(super) fn reseat(body: &Deformable<'_>, contact: &mut Contact, law: &Law, from: u32, tool: &Vec3) {
    let (triangle, weights) = walk(body.surface, body.positions, from, tool);
    (contact.triangle, contact.weights) = (Some(triangle), weights);
    if contact.mode == Mode::Free {
        let normal = contact_normal(law.normals, body.surface, body.positions, triangle, &weights);
        let corners = body.surface.triangles[triangle as usize].map(|node| body.positions[node as usize]);
        if normal.dot(&(tool - interpolate(&weights, &corners))) > TRACKED_GAP {
            contact.triangle = None;
        }
    }
}
