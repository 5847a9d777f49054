//! The local model on the side of the global one: it serves nobody here, and takes down what the one over there is built from.

use super::super::linear::LinearPatch;
use super::super::predictive::Predictive;
use super::super::{Kind, LocalModel, ResyncView};
use super::{Parcel, Pressing};
use crate::Wrench;
use crate::body::Body;
use crate::contact::{Contact, ToolMotion};
use crate::simulation::Simulation;

/// What is built over there, and here as far as it takes to know what that looks at.
#[derive(Debug)]
pub(in crate::local) enum Model {
    Hold,
    Linear(Box<LinearPatch>),
    Predictive(Box<Predictive>),
}

/// A model that is built elsewhere.
#[derive(Debug)]
pub(in crate::local) struct Departing {
    /// Of the model over there.
    kind: Kind,
    model: Model,
    parcel: Parcel,
    /// Nodes whose global position is told.
    watched: Vec<u32>,
    /// The patch that the nodes around it were looked for, and these.
    of: Vec<u32>,
    around: Option<Vec<u32>>,
}

impl Departing {
    pub(in crate::local) fn new(kind: Kind, model: Model) -> Self {
        Self { kind, model, parcel: Parcel::default(), watched: Vec::new(), of: Vec::new(), around: None }
    }

    /// Builds the model as far as it is looked at here; which nodes it looks at.
    fn nodes(&mut self, resync: ResyncView<'_>) -> Vec<u32> {
        // What the model tells a contact area of.
        let felt =
            if matches!(self.model, Model::Hold) { 0..resync.global.tools() } else { resync.index..resync.index + 1 };
        let mut nodes: Vec<u32> = felt.flat_map(|tool| touched(resync.global, tool)).collect();
        let ResyncView { global, tick, triangles, nearest, patch, tools, index, horizon, bases } = resync;
        let view = ResyncView { global: &mut *global, tick, triangles, nearest, patch, tools, index, horizon, bases };
        match &mut self.model {
            Model::Hold => {}
            Model::Linear(model) => {
                model.rebuild(view);
                let window = model.window();
                let patch = &window.nodes[..window.movable];
                if self.around.is_none() || self.of != patch {
                    patch.clone_into(&mut self.of);
                    self.around = Some(around(global.body(), patch));
                }
                nodes.extend(window.nodes.iter().chain(self.around.iter().flatten()));
            }
            Model::Predictive(model) => {
                model.rebuild(view);
                nodes.extend(&model.window().nodes);
                let (ring, path) = model.path();
                self.parcel.ring = ring;
                self.parcel.path.clear();
                self.parcel.path.extend_from_slice(path);
            }
        }
        nodes.extend(&self.watched);
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// The nodes of the triangles around those that a tool touches.
fn touched(global: &Simulation, tool: usize) -> impl Iterator<Item = u32> {
    let surface = global.body().surface();
    let corners = |triangle: u32| surface.triangles[triangle as usize];
    let touched = global.touch(tool).felt().iter().flat_map(move |felt| corners(felt.point.triangle));
    touched.flat_map(|node| surface.at_node(node).iter().copied()).flat_map(corners)
}

/// The nodes that the forces on `patch` depend on: all, if the body does not say.
fn around(body: &dyn Body, patch: &[u32]) -> Vec<u32> {
    body.restriction(patch).map_or_else(|| (0..body.rest().len() as u32).collect(), |near| near.nodes)
}

impl LocalModel for Departing {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        let ResyncView { global, tick, triangles, nearest, patch, tools, index, horizon, bases } = resync;
        let view = ResyncView { global: &mut *global, tick, triangles, nearest, patch, tools, index, horizon, bases };
        self.parcel.nodes = self.nodes(view);
        let Parcel { nodes, state, tools: pressing, .. } = &mut self.parcel;
        let all = global.state();
        state.positions.clear();
        state.positions.extend(nodes.iter().map(|&node| all.positions[node as usize]));
        state.velocities.clear();
        state.velocities.extend(nodes.iter().map(|&node| all.velocities[node as usize]));
        pressing.resize_with(global.tools(), Pressing::default);
        for (number, pressing) in pressing.iter_mut().enumerate() {
            let touch = global.touch(number);
            (pressing.contact, pressing.steady, pressing.wrench) =
                (touch.contact, touch.steady(), global.wrench(number));
            pressing.pose = tools[number].pose(0.0);
            touch.felt().clone_into(&mut pressing.felt);
            pressing.exerted = global.exerted(number);
        }
        let parcel = &mut self.parcel;
        (parcel.tick, parcel.tool) = (tick, index as u16);
        (parcel.friction, parcel.stiffness) = (global.law().friction, global.stiffness());
        triangles.clone_into(&mut parcel.triangles);
        parcel.patch = patch.map(<[u32]>::to_vec);
        nearest.clone_into(&mut parcel.nearest);
        if parcel.bases.len() != bases.len() {
            parcel.bases.clone_from(bases);
        }
    }

    fn tick(&mut self, _: &[ToolMotion]) -> Wrench {
        Wrench::default()
    }

    fn built_at(&self) -> u64 {
        self.parcel.tick
    }

    fn kind(&self) -> Kind {
        self.kind
    }

    fn wrench(&self, tool: usize) -> Option<Wrench> {
        match &self.model {
            Model::Hold => self.parcel.tools.get(tool).map(|pressing| pressing.wrench),
            Model::Linear(model) => model.wrench(tool),
            Model::Predictive(model) => model.wrench(tool),
        }
    }

    fn serves_as(&self, _: usize) -> Kind {
        Kind::Hold
    }

    fn catches_up(&self) -> bool {
        false
    }

    fn contact(&self, tool: usize) -> Contact {
        self.parcel.tools.get(tool).map(|pressing| pressing.contact).unwrap_or_default()
    }

    fn watch(&mut self, nodes: &[u32]) {
        nodes.clone_into(&mut self.watched);
    }

    fn parcel(&self) -> Option<&Parcel> {
        Some(&self.parcel)
    }
}
