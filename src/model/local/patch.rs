//! `patch`: the paper's local model, a linear patch around the tool in surroundings that stand still.

use super::super::Vec3;
use super::super::body::State;
use super::super::contact::{Contact, Deformable, Law, ToolMotion, step};
use super::super::simulation::Stepping;
use super::super::tangent::PatchTangent;
use super::window::Window;
use super::{Kind, LocalModel, PatchGeometry, ResyncView, Watched};

/// The nodes around the contact, with their tangent at the resync; every other node stands still (paper, section 2.3).
#[derive(Clone, Debug)]
pub struct Patch {
    size: [usize; 3],
    window: Window,
    tangent: PatchTangent,
    /// Of all window nodes, movable ones first.
    state: State,
    inverse_masses: Vec<f64>,
    /// Of the movable nodes.
    forces: Vec<Vec3>,
    /// Its triangle is local.
    contact: Contact,
    law: Law,
    stepping: Stepping,
    built_at: u64,
    watched: Watched,
}

impl Patch {
    /// An empty patch of `size` = nodes along the surface, along it, into depth.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](LocalModel::rebuild).
    pub fn new(size: [usize; 3]) -> Self {
        Self {
            size,
            window: Window::default(),
            tangent: PatchTangent::default(),
            state: State::default(),
            inverse_masses: Vec::new(),
            forces: Vec::new(),
            contact: Contact::default(),
            law: Law::default(),
            stepping: Stepping { tick: 1e-3, substeps: 1 },
            built_at: 0,
            watched: Watched::default(),
        }
    }

    /// Number of nodes that move.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn nodes(&self) -> usize {
        self.window.movable
    }
}

impl LocalModel for Patch {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        let global = resync.global;
        let (body, state) = (global.body(), global.state());
        self.window.rebuild(body, &resync.triangles[..1], self.size, None);
        let (window, movable) = (&self.window, self.window.movable);
        window.gather(&state.positions, &mut self.state.positions);
        window.gather(&state.velocities, &mut self.state.velocities);
        // The rim stands still, and so must the velocities that a contact on it would see.
        self.state.velocities[movable..].fill(Vec3::zeros());
        self.inverse_masses.clear();
        self.inverse_masses.extend(window.nodes[..movable].iter().map(|&node| body.inverse_masses()[node as usize]));
        self.inverse_masses.resize(window.nodes.len(), 0.0);
        self.forces.resize(movable, Vec3::zeros());
        self.tangent.rebuild(body, state, &window.nodes[..movable], &|node| window.movable(node));
        self.contact = *global.contact();
        // A contact outside the window cannot be followed here: detection starts anew.
        self.contact.triangle = self.contact.triangle.and_then(|t| window.triangle(t));
        if self.contact.triangle.is_none() {
            self.contact = Contact { glued: self.contact.glued, ..Contact::default() };
        }
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        self.watched.take(state);
    }

    fn tick(&mut self, tool: ToolMotion) -> Vec3 {
        let Self { window, tangent, state, inverse_masses, forces, contact, law, stepping, .. } = self;
        let force = stepping.tick(tool, |tool, d| {
            tangent.forces(&state.positions, &state.velocities, forces);
            let mut deformable = Deformable {
                positions: &mut state.positions,
                velocities: &mut state.velocities,
                inverse_masses,
                surface: &window.surface,
                candidates: &window.candidates,
            };
            step(&mut deformable, forces, contact, law, tool, d)
        });
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if self.state.is_finite() { force } else { Vec3::repeat(f64::NAN) }
    }

    fn built_at(&self) -> u64 {
        self.built_at
    }

    fn serves_as(&self) -> Kind {
        Kind::Patch
    }

    fn catches_up(&self) -> bool {
        true
    }

    fn contact(&self) -> Contact {
        Contact { triangle: self.contact.triangle.map(|t| self.window.triangles[t as usize]), ..self.contact }
    }

    fn position(&self, node: u32) -> Option<Vec3> {
        self.window.movable(node).map(|place| self.state.positions[place])
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.watched.positions.get(probe).copied()
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched.set(nodes);
    }

    fn geometry(&self, geometry: &mut PatchGeometry) -> bool {
        let movable = self.window.movable;
        geometry.nodes.clear();
        geometry.nodes.extend_from_slice(&self.window.nodes[..movable]);
        geometry.state.positions.clear();
        geometry.state.positions.extend_from_slice(&self.state.positions[..movable]);
        geometry.state.velocities.clear();
        geometry.state.velocities.extend_from_slice(&self.state.velocities[..movable]);
        geometry.contact = self.contact();
        true
    }
}
