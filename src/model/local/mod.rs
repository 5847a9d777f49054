//! Local models: what runs at the haptic rate between two results of the global model. One file per model.

mod aim;
mod full;
mod hold;
mod near;
mod patch;
mod predictive;
mod ring_path;
mod succession;
mod window;

use std::sync::Arc;

use super::Vec3;
use super::body::{Body, State};
use super::contact::{Contact, ToolMotion};
use super::forecast::ToolForecast;
use super::simulation::Simulation;
use super::surroundings::{Bases, SpringGraph};
use crate::error::Error;

pub use aim::Aim;
pub use full::Full;
pub use hold::Hold;
pub use patch::Patch;
pub use predictive::Predictive;
pub use succession::{Resynced, Served, Succession};

/// The local models by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Full`].
    Full,
    /// [`Hold`].
    Hold,
    /// [`Patch`].
    Patch,
    /// [`Predictive`] while it has no basis: the ring moves as predicted, whatever happens.
    Predicted,
    /// [`Predictive`].
    Predictive,
}

/// How `predictive` finds where its ring will go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Prediction {
    /// By a reduced model of the surroundings, where that holds the present motion; else as [`Full`](Self::Full).
    #[default]
    Reduced,
    /// By running the whole body ahead.
    Full,
}

impl Kind {
    /// Its name in tables and logs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
            Self::Predicted => "predicted",
            Self::Predictive => "predictive",
        }
    }
}

/// What the local models of a session are made from.
#[derive(Clone, Debug)]
pub struct Template {
    /// Which model.
    pub kind: Kind,
    /// Patch nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// How `predictive` looks ahead.
    pub prediction: Prediction,
    /// The body's springs, for the models that need them.
    pub springs: Option<Arc<SpringGraph>>,
}

impl Template {
    /// For models of `body`; a patch has `patch` nodes along the surface, along it, into depth.
    ///
    /// # Errors
    /// If the model needs springs and the body has none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(kind: Kind, patch: [usize; 3], prediction: Prediction, body: &dyn Body) -> Result<Self, Error> {
        let springs = match kind {
            Kind::Predictive | Kind::Predicted => {
                let springs = SpringGraph::new(body).ok_or_else(|| {
                    let message = format!("{:?} needs a body of springs, use another model", kind.name());
                    Error::scene("local.model", message)
                })?;
                Some(Arc::new(springs))
            }
            _ => None,
        };
        Ok(Self { kind, patch, prediction, springs })
    }

    /// An empty model, to be rebuilt in place; `None` for [`Full`], which is the simulation itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn empty(&self) -> Option<Box<dyn LocalModel>> {
        match (self.kind, &self.springs) {
            (Kind::Full, _) => None,
            (Kind::Patch, _) => Some(Box::new(Patch::new(self.patch))),
            (Kind::Predictive | Kind::Predicted, Some(springs)) => {
                Some(Box::new(Predictive::new(self.patch, self.prediction, Arc::clone(springs))))
            }
            (Kind::Hold | Kind::Predictive | Kind::Predicted, _) => Some(Box::new(Hold::default())),
        }
    }
}

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
    /// The patch to use, if it is not to be the one around the triangles: node ids in increasing order.
    pub patch: Option<&'a [u32]>,
    /// Where the tool is, and where it is expected.
    pub tool: ToolForecast,
    /// Haptic ticks that the model may have to reach ahead, catching up included.
    pub horizon: u32,
    /// Reduced surroundings that are there.
    pub bases: &'a Bases,
}

impl<'a> ResyncView<'a> {
    /// Of a tool that rests at `tool` (m), over `triangles`, for a model that looks `horizon` ticks ahead.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn at_rest(
        global: &'a mut Simulation,
        tick: u64,
        tool: Vec3,
        triangles: &'a [u32],
        horizon: u32,
        bases: &'a Bases,
    ) -> Self {
        Self { global, tick, triangles, patch: None, tool: ToolForecast::at_rest(tool), horizon, bases }
    }
}

/// What a patch found, for a global model that takes the local one's geometry.
#[derive(Clone, Debug, Default)]
pub struct PatchGeometry {
    /// The haptic tick that it belongs to.
    pub tick: u64,
    /// Global ids of the patch nodes.
    pub nodes: Vec<u32>,
    /// Their positions (m) and velocities (m/s).
    pub state: State,
    /// The contact; its triangle is a global id.
    pub contact: Contact,
}

impl PatchGeometry {
    /// An empty geometry with room for a patch of `nodes` nodes, in pages that have been written to: a real-time tick
    /// that fills it neither allocates nor faults.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_room(nodes: usize) -> Self {
        // Zeros could come from the system as pages that are still to be faulted in.
        let (mut ids, mut vectors) = (vec![u32::MAX; nodes], vec![Vec3::repeat(f64::NAN); nodes]);
        let mut more = vectors.clone();
        ids.clear();
        vectors.clear();
        more.clear();
        Self { nodes: ids, state: State { positions: vectors, velocities: more }, ..Self::default() }
    }

    /// True if there is something to take and every number is finite.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn is_usable(&self) -> bool {
        !self.nodes.is_empty() && self.state.is_finite()
    }

    /// Puts the patch's state and contact in place of the global model's own.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn write_to(&self, global: &mut Simulation) {
        let (state, contact) = global.state_mut();
        for ((&node, x), v) in self.nodes.iter().zip(&self.state.positions).zip(&self.state.velocities) {
            state.positions[node as usize] = *x;
            state.velocities[node as usize] = *v;
        }
        *contact = self.contact;
    }
}

/// A model that turns tool motion into force at the haptic rate.
pub trait LocalModel: Send + std::fmt::Debug {
    /// Makes it anew, in place, from the global model.
    ///
    /// # Real-time
    /// For the global actor: may allocate, at first use and where its size changes.
    fn rebuild(&mut self, resync: ResyncView<'_>);

    /// Advances one haptic tick while the tool moves along `tool`; returns the mean force on the tool (N), which is not
    /// finite if the model has diverged.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn tick(&mut self, tool: ToolMotion) -> Vec3;

    /// The haptic tick that its state was built at; catching up starts there.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn built_at(&self) -> u64;

    /// What its force in the last tick was: its own kind, or what it falls back to.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn serves_as(&self) -> Kind;

    /// True if its state has to be advanced to the present before it can serve.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn catches_up(&self) -> bool;

    /// The contact; its triangle is a global id.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn contact(&self) -> Contact;

    /// Where `node` (a global id) is in this model (m); `None` if the model does not hold it.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn position(&self, node: u32) -> Option<Vec3>;

    /// Where `node` was in the global model that this one was built from (m); `None` if that is not known.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    fn global_position(&self, probe: usize) -> Option<Vec3>;

    /// Nodes whose global position is to be remembered at each rebuild, by place in this list.
    ///
    /// # Real-time
    /// Not called in a tick: may allocate.
    fn watch(&mut self, nodes: &[u32]);

    /// Writes its geometry for feedback; false if it has none.
    ///
    /// # Real-time
    /// Bounded and real-time safe if `geometry` has room for the patch, see [`PatchGeometry::with_room`].
    fn geometry(&self, geometry: &mut PatchGeometry) -> bool;
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

    fn take(&mut self, state: &State) {
        self.positions.clear();
        self.positions.extend(self.nodes.iter().map(|&node| state.positions[node as usize]));
    }
}
