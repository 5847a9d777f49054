//! One step with contact, for a whole body and for a patch, explicit and implicit alike.

use super::coupled::resolve_coupled;
use super::deformable::Deformable;
use super::resolve::{Place, Resolution, resolve};
use super::rows::Rows;
use super::touch::Touch;
use super::{Contact, ContactMode, Equations, Law, ToolMotion, paper};
use crate::linear::ImplicitStep;
use crate::{Vec3, integrator};

/// One explicit step of `d` seconds: velocities take `forces`, the tool's contact is found and resolved, positions move.
/// Returns the force on the tool (N), the impulse over the full step.
///
/// Velocities of nodes with zero inverse mass are theirs to keep.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Block, Body, State};
/// use palpate_model::contact::{Contact, Deformable, Law, ToolMotion, step};
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let mut block = Block::builder([4; 3], [0.03; 3]).build()?;
/// let State { mut positions, mut velocities } = State::at_rest(block.rest());
/// let forces = vec![Vec3::zeros(); positions.len()];
/// let mut body = Deformable {
///     positions: &mut positions,
///     velocities: &mut velocities,
///     inverse_masses: block.inverse_masses(),
///     surface: block.surface(),
///     candidates: &(0..block.surface().triangles.len() as u32).collect::<Vec<_>>(),
/// };
/// // From 1 mm above the block to 1 mm below its top.
/// let tool = ToolMotion::straight(Vec3::new(0.014, 0.016, 0.031), Vec3::new(0.014, 0.016, 0.029));
/// let force = step(&mut body, &forces, &mut Contact::default(), &Law::default(), tool, 1e-3);
/// assert!(force.z > 0.0, "the surface pushes the tool out");
/// # Ok(())
/// # }
/// ```
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
    move_with_tool(body, contact, law, tool, d, |body, place, tool, d_c| resolve(body, law, place, tool, d_c, d))
}

/// One explicit step of `d` seconds with several tools, or with one that has a shape; `motion` is that of the tool at a place of
/// `touches`.
///
/// All places at which they touch are resolved together, whichever tool they are of. The equations of the paper are for one
/// point, and for one alone.
///
/// # Real-time
/// Bounded, real-time safe if `rows` has room.
pub(crate) fn step_all(
    body: &mut Deformable<'_>,
    forces: &[Vec3],
    touches: &mut [Touch],
    rows: &mut Rows,
    law: &Law,
    motion: impl Fn(usize) -> ToolMotion,
    d: f64,
) {
    if let [touch] = &mut *touches
        && !touch.has_shape()
    {
        touch.wrench = step(body, forces, &mut touch.contact, law, motion(0), d).into();
        return;
    }
    integrator::accelerate(body.velocities, forces, body.inverse_masses, d);
    press_all(body, touches, rows, law, &motion, d, |rows, body| rows.solve(body, law, d));
}

/// One step by the implicit `system` of a linear patch, explicit but for that: `forces` are those at its end for unchanged velocities, and
/// every node answers to the tools' impulses. The equations are the corrected ones.
///
/// # Real-time
/// Bounded, real-time safe if `rows` has room: 9 n^2 multiply-adds for n nodes, and what detection costs.
pub(crate) fn step_implicit(
    body: &mut Deformable<'_>,
    system: &mut ImplicitStep,
    forces: &[Vec3],
    touches: &mut [Touch],
    rows: &mut Rows,
    law: &Law,
    motion: impl Fn(usize) -> ToolMotion,
) {
    let d = system.step();
    system.accelerate(body.velocities, forces);
    if let [touch] = &mut *touches
        && !touch.has_shape()
    {
        let force = move_with_tool(body, &mut touch.contact, law, motion(0), d, |body, place, tool, d_c| {
            resolve_coupled(body, system, law, place, tool, d_c)
        });
        touch.wrench = force.into();
        return;
    }
    press_all(body, touches, rows, law, &motion, d, |rows, body| rows.solve_coupled(body, system, law));
}

/// From the velocities without contact on: detection, `solution` for all places, motion, tracking.
fn press_all(
    body: &mut Deformable<'_>,
    touches: &mut [Touch],
    rows: &mut Rows,
    law: &Law,
    motion: &impl Fn(usize) -> ToolMotion,
    d: f64,
    solution: impl FnOnce(&mut Rows, &mut Deformable<'_>),
) {
    rows.clear();
    for (tool, touch) in touches.iter_mut().enumerate() {
        if touch.has_shape() {
            rows.add_shape(body, (tool, touch), motion(tool), d);
        } else {
            rows.add_point(body, (tool, touch), law, motion(tool), d);
        }
    }
    rows.sort();
    solution(rows, body);
    body.drift(d);
    for (tool, touch) in touches.iter_mut().enumerate() {
        if touch.has_shape() {
            touch.feel(rows.of(tool), &motion(tool).to, d);
        } else {
            touch.feel_point(rows.of(tool).next().map(|(row, _)| row), d);
            follow(body, &mut touch.contact, law, motion(tool));
        }
    }
}

/// From the velocities without contact on: detection, `resolution`, motion, tracking.
fn move_with_tool(
    body: &mut Deformable<'_>,
    contact: &mut Contact,
    law: &Law,
    tool: ToolMotion,
    d: f64,
    resolution: impl FnOnce(&mut Deformable<'_>, Place<'_>, ToolMotion, f64) -> Resolution,
) -> Vec3 {
    let force = press(body, contact, tool, d, resolution);
    body.drift(d);
    follow(body, contact, law, tool);
    force
}

/// Detection and `resolution`: velocities become those after the impact. Positions are left so that drifting with these for
/// the whole step ends where two drifts, before the impact and after it, would.
fn press(
    body: &mut Deformable<'_>,
    contact: &mut Contact,
    tool: ToolMotion,
    d: f64,
    resolution: impl FnOnce(&mut Deformable<'_>, Place<'_>, ToolMotion, f64) -> Resolution,
) -> Vec3 {
    let Some((triangle, share)) = body.detect(contact, tool, d) else {
        return Vec3::zeros();
    };
    if share > 0.0 {
        body.drift(share * d);
    }
    let was_sticking = contact.mode == ContactMode::Stick;
    let place = Place { triangle, weights: &contact.weights, is_glued: contact.glued, was_sticking };
    let Resolution { mode, impulse, normal } = resolution(body, place, tool.part(share, 1.0), (1.0 - share) * d);
    (contact.mode, contact.normal) = (mode, normal);
    if share > 0.0 {
        body.drift(-share * d);
    }
    impulse / d
}

/// After the motion: the contact of a tool that slid is where the tool is now.
fn follow(body: &Deformable<'_>, contact: &mut Contact, law: &Law, tool: ToolMotion) {
    if let Some(triangle) = contact.triangle
        && contact.mode != ContactMode::Stick
    {
        body.reseat(contact, law, triangle, &tool.to.position);
    }
}
