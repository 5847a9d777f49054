//! A local model on its way to another computer: not itself, but what it is built from.
//!
//! Both sides have the body. So nothing of it crosses: a [`Parcel`] names the nodes and triangles of a window and has their state, the
//! contact, and the ring's predicted path, the one thing that takes the whole body to find. An [`Image`] of the simulation on the other
//! side builds from it the very model that would have been built here.

mod departing;
mod image;
mod knots;
mod path;
mod shipment;

use crate::body::{State, Stiffness};
use crate::bytes::{BytesReader, BytesWriter};
use crate::contact::{Contact, ContactMode, ContactPoint, Felt, Friction, Steady};
use crate::surroundings::Bases;
use crate::{Pose, Vec3, Wrench};

pub(super) use departing::{Departing, Model};
pub use image::Image;
pub use shipment::Shipment;

/// The ingredients of a local model, but for the body: they cross a link, and the model is built on the other side.
///
/// # Real-time
/// Not for a tick: allocates.
#[derive(Clone, Debug, Default)]
pub struct Parcel {
    /// The haptic tick of the state.
    tick: u64,
    /// The tool that the model is built around.
    tool: u16,
    /// As in [`ResyncView`](super::ResyncView).
    triangles: Vec<u32>,
    /// The patch, if it is not the one around the triangles.
    patch: Option<Vec<u32>>,
    /// Friction and stiffness, which may change while a session runs.
    friction: Friction,
    stiffness: Stiffness,
    /// The nodes that the model looks at, with their state.
    nodes: Vec<u32>,
    state: State,
    /// How each tool of the scene presses, and the triangles that they are nearest to, as in [`ResyncView`](super::ResyncView).
    tools: Vec<Pressing>,
    nearest: Vec<u32>,
    /// Numbers of one quantity of the ring's path, three for each node, and the path.
    ring: usize,
    path: Vec<f64>,
    /// The bases that there are. They go by themselves, once.
    bases: Bases,
}

/// How a tool presses.
#[derive(Clone, Debug, Default)]
struct Pressing {
    /// Where it is, and how it is turned.
    pose: Pose,
    contact: Contact,
    steady: Steady,
    felt: Vec<Felt>,
    wrench: Wrench,
    /// The nodes that it presses, with the force on each (N).
    exerted: Vec<(u32, Vec3)>,
}

/// Bytes of the parts of lists at least.
const NODE: usize = 4;
const STATE: usize = NODE + 6 * 8;
const PRESSED: usize = NODE + 3 * 8;
const FELT: usize = NODE + 15 * 8 + 2;
const PRESSING: usize = 3 * NODE + 21 * 8 + 3;
/// Places at which a tool touches.
const MOST_FELT: usize = 1024;

impl Parcel {
    /// The haptic tick of the state that the model is built from.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// The tool that the model is built around.
    pub fn tool(&self) -> usize {
        self.tool.into()
    }

    /// The patch of the model, if it has one that a basis may belong to.
    pub fn patch(&self) -> Option<&[u32]> {
        self.patch.as_deref()
    }

    /// The bases that the global model knew; not part of the bytes.
    pub fn bases(&self) -> &Bases {
        &self.bases
    }

    /// Appends all of it but the bases.
    pub fn write(&self, to: &mut BytesWriter<'_>) {
        to.u64(self.tick);
        to.u16(self.tool);
        to.list(&self.triangles, |to, &triangle| to.u32(triangle));
        to.u8(self.patch.is_some().into());
        to.list(self.patch.as_deref().unwrap_or_default(), |to, &node| to.u32(node));
        self.friction.write(to);
        to.f64(self.stiffness.factor());
        let State { positions, velocities } = &self.state;
        let nodes: Vec<_> = self.nodes.iter().zip(positions.iter().zip(velocities)).collect();
        to.list(&nodes, |to, &(&node, (x, v))| {
            to.u32(node);
            to.vector(x);
            to.vector(v);
        });
        to.list(&self.tools, write_pressing);
        to.list(&self.nearest, |to, &triangle| to.u32(triangle));
        path::write(to, self.ring, &self.path);
    }

    /// Takes what [`write`](Self::write) has appended; `None` if the bytes cannot be that, or hold a number that is not finite. Whether it
    /// fits a body is what [`Image::rebuild`] asks.
    pub fn read(from: &mut BytesReader<'_>) -> Option<Self> {
        let mut parcel = Self { tick: from.u64()?, tool: from.u16()?, ..Self::default() };
        from.list(NODE, &mut parcel.triangles, BytesReader::u32)?;
        let has_patch = read_bool(from)?;
        let mut patch = Vec::new();
        from.list(NODE, &mut patch, BytesReader::u32)?;
        parcel.patch = has_patch.then_some(patch);
        parcel.friction = Friction::read(from)?;
        parcel.stiffness = Stiffness::times(from.f64()?)?;
        let mut states = Vec::new();
        from.list(STATE, &mut states, |from| Some((from.u32()?, from.vector()?, from.vector()?)))?;
        for (node, x, v) in states {
            parcel.nodes.push(node);
            parcel.state.positions.push(x);
            parcel.state.velocities.push(v);
        }
        from.list(PRESSING, &mut parcel.tools, read_pressing)?;
        from.list(NODE, &mut parcel.nearest, BytesReader::u32)?;
        parcel.ring = path::read(from, &mut parcel.path)?;
        Some(parcel)
    }
}

fn write_pressing(to: &mut BytesWriter<'_>, tool: &Pressing) {
    to.pose(&tool.pose);
    write_contact(to, &tool.contact);
    let Steady { force, fineness, is_fine } = tool.steady;
    [force, fineness].into_iter().for_each(|number| to.f64(number));
    to.u8(is_fine.into());
    to.list(&tool.felt, write_felt);
    to.vector(&tool.wrench.force);
    to.vector(&tool.wrench.torque);
    to.list(&tool.exerted, |to, (node, force)| {
        to.u32(*node);
        to.vector(force);
    });
}

fn read_pressing(from: &mut BytesReader<'_>) -> Option<Pressing> {
    let (pose, contact) = (from.pose()?, read_contact(from)?);
    let [force, fineness] = [from.f64()?, from.f64().filter(|fineness| (0.0..=1.0).contains(fineness))?];
    let steady = Steady { force, fineness, is_fine: read_bool(from)? };
    let mut tool = Pressing { pose, contact, steady, ..Pressing::default() };
    from.list(FELT, &mut tool.felt, read_felt)?;
    tool.wrench = Wrench { force: from.vector()?, torque: from.vector()? };
    from.list(PRESSED, &mut tool.exerted, |from| Some((from.u32()?, from.vector()?)))?;
    Some(tool)
}

fn write_contact(to: &mut BytesWriter<'_>, contact: &Contact) {
    to.u32(contact.triangle.unwrap_or(u32::MAX));
    contact.weights.iter().for_each(|&weight| to.f64(weight));
    to.u8(contact.mode as u8);
    to.u8(contact.glued.into());
    to.vector(&contact.normal);
}

fn read_contact(from: &mut BytesReader<'_>) -> Option<Contact> {
    Some(Contact {
        triangle: Some(from.u32()?).filter(|&triangle| triangle != u32::MAX),
        weights: read_weights(from)?,
        mode: read_mode(from)?,
        glued: read_bool(from)?,
        normal: from.vector()?,
    })
}

fn write_felt(to: &mut BytesWriter<'_>, felt: &Felt) {
    let ContactPoint { triangle, place, normal, force, mode } = &felt.point;
    to.u32(*triangle);
    [place, normal, force, &felt.impulse].into_iter().for_each(|vector| to.vector(vector));
    felt.weights.iter().for_each(|&weight| to.f64(weight));
    to.u8(*mode as u8);
    to.u8(felt.is_pressing.into());
}

fn read_felt(from: &mut BytesReader<'_>) -> Option<Felt> {
    let (triangle, place, normal) = (from.u32()?, from.vector()?, from.vector()?);
    let (force, impulse, weights, mode) = (from.vector()?, from.vector()?, read_weights(from)?, read_mode(from)?);
    let point = ContactPoint { triangle, place, normal, force, mode };
    Some(Felt::told(point, weights, read_bool(from)?, impulse))
}

fn read_weights(from: &mut BytesReader<'_>) -> Option<[f64; 3]> {
    Some([from.f64()?, from.f64()?, from.f64()?])
}

fn read_mode(from: &mut BytesReader<'_>) -> Option<ContactMode> {
    from.u8().map(|code| ContactMode::from_code(code.into()))
}

fn read_bool(from: &mut BytesReader<'_>) -> Option<bool> {
    from.u8().filter(|&byte| byte < 2).map(|byte| byte == 1)
}
