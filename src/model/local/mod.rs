//! Local models: what runs at the haptic rate between two results of the global model. One file per model.

mod aim;
mod beyond;
mod feedback;
mod forecast;
mod hold;
mod kind;
mod linear;
mod models;
mod parcel;
mod patch;
mod predictive;
mod succession;
mod template;
mod whole;
mod windows;

use crate::body::State;
use crate::contact::{Contact, ContactPoint, Skin, ToolMotion};
use crate::simulation::Simulation;
use crate::surroundings::Bases;
use crate::{Vec3, Wrench};

pub use aim::Aim;
pub use feedback::{Feedback, PatchGeometry};
pub use forecast::{ToolForecast, ToolHistory};
pub use hold::Hold;
pub use kind::Kind;
pub use models::LocalModels;
pub use parcel::{Image, Parcel, Shipment};
pub use succession::{Blend, BlendKind, Jump, Resynced, Served, Succession, Ways};
pub use template::Template;
pub use windows::{Beside, Windows};

/// The global model at a resync, and what is expected: what a local model is built from.
#[derive(Debug)]
pub struct ResyncView<'a> {
    /// The whole body after the last tool sample it has received.
    pub global: &'a mut Simulation,
    /// The haptic tick that this state belongs to.
    pub tick: u64,
    /// The surface triangle to build around (the contact's, or the one nearest to the tool), then those that the tool is
    /// expected over before the next model serves.
    pub triangles: &'a [u32],
    /// The surface triangle that each tool touches, or is nearest to: those whose place a window holds are resolved in it. None of them if
    /// the list is empty.
    pub nearest: &'a [u32],
    /// The patch to use, if it is not to be the one around the triangles: node ids in increasing order.
    pub patch: Option<&'a [u32]>,
    /// The forecast of each tool: where it is, and where it is expected.
    pub tools: &'a [ToolForecast],
    /// The tool that the model is built around.
    pub index: usize,
    /// Haptic ticks that the model may have to reach ahead, catching up included.
    pub horizon: u32,
    /// The reduced surroundings that have been computed so far.
    pub bases: &'a Bases,
}

impl ResyncView<'_> {
    /// The surface as the tools meet it that may be resolved in the model: its own, and others if it is told where they are.
    fn skins(&self) -> impl Iterator<Item = &Skin> {
        let is_told_of = |&tool: &usize| tool == self.index || tool < self.nearest.len();
        (0..self.global.tools()).filter(is_told_of).map(|tool| &*self.global.touch(tool).skin)
    }
}

/// A model that turns tool motion into force at the haptic rate.
pub trait LocalModel: Send + std::fmt::Debug {
    /// Makes the model anew, in place, from the global model.
    ///
    /// # Real-time
    /// For the global actor: may allocate, at first use and where its size changes.
    fn rebuild(&mut self, resync: ResyncView<'_>);

    /// Advances one haptic tick while each tool of the session moves along its own of `tools`; returns the mean force and torque on the tool
    /// that the model is built around, which are not finite if the model has diverged.
    ///
    /// # Panics
    /// If `tools` are fewer than those of the global model that it was built from.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn tick(&mut self, tools: &[ToolMotion]) -> Wrench;

    /// The haptic tick that the model's state was built at; catching up starts there.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn built_at(&self) -> u64;

    /// The kind of model that it is.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn kind(&self) -> Kind;

    /// The mean force and torque on tool number `tool` in the last tick, if it is resolved in the model: the one that it is built around is,
    /// and others may be. They are not finite if the model has diverged.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn wrench(&self, tool: usize) -> Option<Wrench>;

    /// The kind of model that made the force on tool number `tool` in the last tick: its own, or the one that it falls back to.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn serves_as(&self, tool: usize) -> Kind;

    /// True if the model's state has to be advanced to the present before it can serve.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn catches_up(&self) -> bool {
        true
    }

    /// Ticks that it is advanced per haptic tick until it has caught up, more than one; another model serves meanwhile.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn catch_up_ticks(&self) -> u64 {
        8
    }

    /// The contact of tool number `tool` in this model; its triangle is a global id.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn contact(&self, tool: usize) -> Contact;

    /// The places where tool number `tool` touches if it has a shape; none for a point, whose one place [`contact`](Self::contact) tells.
    /// Triangles are global ids.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn contact_points(&self, _tool: usize) -> &[ContactPoint] {
        &[]
    }

    /// The area in which tool number `tool` touches if it has a shape (m^2), as fine as the surface's triangles tell; zero for a point.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn contact_area(&self, _tool: usize) -> f64 {
        0.0
    }

    /// The position of `node` (a global id) in this model (m); `None` if the model does not hold it.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn position(&self, _node: u32) -> Option<Vec3> {
        None
    }

    /// The position that the watched node of number `probe` had in the global model that this one was built from (m); `None` if that is not known.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn global_position(&self, _probe: usize) -> Option<Vec3> {
        None
    }

    /// Sets the nodes whose global position is to be remembered at each rebuild, by place in this list.
    ///
    /// # Real-time
    /// Not called in a tick: may allocate.
    fn watch(&mut self, _nodes: &[u32]) {}

    /// What the model is built from on another computer, if it is [one for that](Template::departing).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn parcel(&self) -> Option<&Parcel> {
        None
    }

    /// Writes what the model tells the global one, but for the tick; false if that is nothing.
    ///
    /// # Real-time
    /// Bounded and real-time safe if `geometry` has room for the patch, see [`PatchGeometry::with_room`].
    fn geometry(&self, _geometry: &mut PatchGeometry) -> bool {
        false
    }
}

/// Global positions of watched nodes at the resync.
#[derive(Clone, Debug, Default)]
struct Watched {
    nodes: Vec<u32>,
    positions: Vec<Vec3>,
}

impl Watched {
    fn set(&mut self, nodes: &[u32]) {
        self.nodes = nodes.to_vec();
    }

    fn position(&self, probe: usize) -> Option<Vec3> {
        self.positions.get(probe).copied()
    }

    fn take(&mut self, state: &State) {
        self.positions.clear();
        self.positions.extend(self.nodes.iter().map(|&node| state.positions[node as usize]));
    }
}
