//! What the global model learns from the local one.

use super::kind::Kind;
use crate::Vec3;
use crate::body::State;
use crate::contact::Contact;
use crate::simulation::Simulation;

/// The feedback that the global model gets from the local one, besides the tool's trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Feedback {
    /// Nothing: it resolves the contact along the tool's trajectory itself.
    Trajectory,
    /// Positions and velocities of the three nodes that are touched, and the contact, replace its own.
    ContactNodes,
    /// All of the patch's positions and velocities, and the contact, replace its own: the paper's.
    Geometry,
}

impl Feedback {
    /// The feedback's name in scene files.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        ["trajectory", "contact_nodes", "geometry"][self as usize]
    }

    /// True if `model` can give this feedback: a linear patch. One that gives way more than the body does between held surroundings
    /// must not: `condensed` has their compliance in its own state, and the global model would add it again;
    /// `scaled_boundary` sinks in, and pulls the body after it if its whole geometry is taken over.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn fits(self, model: Kind) -> bool {
        match self {
            Self::Trajectory => true,
            Self::ContactNodes => matches!(model, Kind::Patch | Kind::LinearBoundary | Kind::ScaledBoundary),
            Self::Geometry => matches!(model, Kind::Patch | Kind::LinearBoundary),
        }
    }

    /// The feedback that `model` gives without being asked for another: the paper's for its patch, for the others what is nearest to the
    /// whole body at the haptic rate (DESIGN.md).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn of(model: Kind) -> Self {
        if model == Kind::Patch { Self::Geometry } else { Self::Trajectory }
    }
}

/// The state of a patch, for a global model that takes it over.
#[derive(Clone, Debug, Default)]
pub struct PatchGeometry {
    /// The haptic tick that it belongs to.
    pub tick: u64,
    /// Global ids of the nodes that are fed back; there may be none, with no contact.
    pub nodes: Vec<u32>,
    /// Positions (m) and velocities (m/s) of these nodes.
    pub state: State,
    /// The patch's contact; its triangle is a global id.
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

    /// Takes all nodes out.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.state.positions.clear();
        self.state.velocities.clear();
    }

    /// Adds a node: its global id, position (m) and velocity (m/s).
    ///
    /// # Real-time
    /// Bounded and real-time safe if there is room, see [`with_room`](Self::with_room).
    pub fn push(&mut self, node: u32, position: Vec3, velocity: Vec3) {
        self.nodes.push(node);
        self.state.positions.push(position);
        self.state.velocities.push(velocity);
    }

    /// True if every number is finite.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn is_usable(&self) -> bool {
        self.state.is_finite() && self.contact.weights.iter().all(|w| w.is_finite())
    }

    /// Puts the nodes and the contact in place of the global model's own of `tool`. What another tool touches is that tool's:
    /// this patch knows it as a force alone.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn write_to(&self, global: &mut Simulation, tool: usize) {
        for ((&node, x), v) in self.nodes.iter().zip(&self.state.positions).zip(&self.state.velocities) {
            if global.exerted_beside(tool).any(|(touched, _)| touched == node) {
                continue;
            }
            let state = global.state_mut();
            state.positions[node as usize] = *x;
            state.velocities[node as usize] = *v;
        }
        *global.contact_mut(tool) = self.contact;
    }
}
