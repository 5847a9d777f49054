//! The linear patch that four local models share; they differ in how the surroundings enter.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::super::Vec3;
use super::super::body::{Body, State};
use super::super::contact::{Contact, Deformable, Equations, Law, ToolMotion, step, step_implicit};
use super::super::implicit::ImplicitStep;
use super::super::simulation::Stepping;
use super::super::tangent::{Drift, PatchTangent};
use super::feedback::{Feedback, PatchGeometry};
use super::felt::Felt;
use super::stable::stable_stepping;
use super::window::Window;
use super::{Kind, LocalModel, ResyncView, Watched};

/// What a linear patch is made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinearSpec {
    /// Patch nodes along the surface, along it, into depth.
    pub size: [usize; 3],
    /// What it tells the global model.
    pub feedback: Feedback,
    /// One implicit step per tick in place of the global model's explicit ones, even where these are stable.
    pub is_implicit: bool,
}

/// How the surroundings of a linear patch answer between two resyncs. The default is the paper's: they stand still.
pub trait Boundary: Send + std::fmt::Debug {
    /// The model that it makes of a linear patch.
    const KIND: Kind;

    /// How much of the coupling of patch node `row` to the outside node `column` of `body` answers to the patch's motion.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded.
    fn share(&self, _body: &dyn Body, _row: u32, _column: u32) -> f64 {
        1.0
    }

    /// What is added to the stiffness of the patch of `nodes` (N/m, 3n x 3n).
    ///
    /// # Real-time
    /// For the global actor, at each resync: may allocate, and may block until another model has found the same.
    fn compliance(&mut self, _nodes: &[u32]) -> Option<Arc<DMatrix<f64>>> {
        None
    }

    /// Haptic ticks for which outside nodes move on with their velocity at the resync.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    fn moving_ticks(&self) -> u32 {
        0
    }
}

/// The nodes around the contact, with their tangent at the resync, in surroundings `B`.
#[derive(Clone, Debug)]
pub struct LinearPatch<B> {
    boundary: B,
    spec: LinearSpec,
    window: Window,
    tangent: PatchTangent,
    /// In use if the patch is implicit.
    system: ImplicitStep,
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
    /// Ticks since then.
    ticks: u32,
    is_implicit: bool,
    felt: Felt,
    watched: Watched,
}

impl<B: Boundary> LinearPatch<B> {
    /// An empty patch in surroundings `boundary`.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](LocalModel::rebuild).
    pub fn with_boundary(spec: LinearSpec, boundary: B) -> Self {
        Self {
            boundary,
            spec,
            window: Window::default(),
            tangent: PatchTangent::default(),
            system: ImplicitStep::default(),
            state: State::default(),
            inverse_masses: Vec::new(),
            forces: Vec::new(),
            contact: Contact::default(),
            law: Law::default(),
            stepping: Stepping { tick: 1e-3, substeps: 1 },
            built_at: 0,
            ticks: 0,
            is_implicit: false,
            felt: Felt::default(),
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

    /// The surroundings `t` seconds into the present tick.
    fn drift(&self, t: f64) -> Drift {
        let moving = self.boundary.moving_ticks();
        let ticks = f64::from(self.ticks.min(moving));
        let is_moving = self.ticks < moving;
        Drift { time: ticks * self.stepping.tick + if is_moving { t } else { 0.0 }, is_moving }
    }

    /// One step from `t` seconds into the present tick; returns the force on the tool (N).
    fn step(&mut self, tool: ToolMotion, t: f64, d: f64) -> Vec3 {
        // An implicit step takes its forces at its end.
        let ahead = if self.is_implicit { d } else { 0.0 };
        let drift = self.drift(t + ahead);
        let movable = self.window.movable;
        let (x, v) = (&self.state.positions[..movable], &self.state.velocities[..movable]);
        self.tangent.forces(x, v, ahead, drift, &mut self.forces);
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        let (forces, contact, law) = (&self.forces, &mut self.contact, &self.law);
        if self.is_implicit {
            step_implicit(&mut deformable, &mut self.system, forces, contact, law, tool)
        } else {
            step(&mut deformable, forces, contact, law, tool, d)
        }
    }
}

impl<B: Boundary> LocalModel for LinearPatch<B> {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        let global = resync.global;
        let (body, state) = (global.body(), global.state());
        self.window.rebuild(body, &resync.triangles[..1], self.spec.size, None);
        let (window, movable) = (&self.window, self.window.movable);
        let nodes = &window.nodes[..movable];
        window.gather(&state.positions, &mut self.state.positions);
        window.gather(&state.velocities, &mut self.state.velocities);
        if self.boundary.moving_ticks() == 0 {
            // The rim stands still, and so must the velocities that a contact on it would see.
            self.state.velocities[movable..].fill(Vec3::zeros());
        }
        window.gather_movable(body.inverse_masses(), &mut self.inverse_masses);
        self.forces.resize(movable, Vec3::zeros());
        let share = |row, column| self.boundary.share(body, row, column);
        self.tangent.rebuild(body, state, nodes, &|node| window.movable(node), &share);
        for (node, force) in global.exerted_beside(resync.index) {
            if let Some(place) = window.movable(node) {
                self.tangent.add_force(place, force);
            }
        }
        if let Some(stiffness) = self.boundary.compliance(nodes) {
            self.tangent.add_stiffness(&stiffness);
        }
        self.contact = window.localised(global.contact(resync.index));
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        self.ticks = 0;
        self.felt = Felt::new(global.force(resync.index));
        (self.stepping, self.is_implicit) =
            stable_stepping(self.spec.is_implicit, &self.tangent, &self.inverse_masses, self.stepping, &self.law);
        if self.is_implicit {
            self.law.equations = Equations::Corrected;
            self.system.rebuild(&self.tangent, &self.inverse_masses, self.stepping.step());
        }
        self.watched.take(state);
    }

    fn tick(&mut self, tool: ToolMotion) -> Vec3 {
        if let Some(force) = self.felt.held() {
            return force;
        }
        let (stepping, mut t) = (self.stepping, 0.0);
        let force = stepping.tick(tool, |tool, d| {
            let force = self.step(tool, t, d);
            t += d;
            force
        });
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks == self.boundary.moving_ticks() {
            self.state.velocities[self.window.movable..].fill(Vec3::zeros());
        }
        self.felt.after(force, &self.state, self.window.has_left(&self.contact))
    }

    fn built_at(&self) -> u64 {
        self.built_at
    }

    fn serves_as(&self) -> Kind {
        if self.felt.held().is_some() { Kind::Hold } else { B::KIND }
    }

    fn catches_up(&self) -> bool {
        true
    }

    fn contact(&self) -> Contact {
        self.window.globalised(&self.contact)
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
        geometry.clear();
        geometry.contact = self.contact();
        match self.spec.feedback {
            // What has left is as it was then.
            _ if self.felt.held().is_some() => return false,
            Feedback::Trajectory => return false,
            Feedback::Geometry => (0..self.window.movable).for_each(|place| self.add_to(geometry, place)),
            Feedback::ContactNodes => {
                let touched = self.contact.triangle.map(|t| self.window.surface.triangles[t as usize]);
                for place in touched.into_iter().flatten().filter(|&place| (place as usize) < self.window.movable) {
                    self.add_to(geometry, place as usize);
                }
            }
        }
        true
    }
}

impl<B> LinearPatch<B> {
    fn add_to(&self, geometry: &mut PatchGeometry, place: usize) {
        geometry.push(self.window.nodes[place], self.state.positions[place], self.state.velocities[place]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::body::Block;
    use super::super::super::forecast::ToolForecast;
    use super::super::super::mesh::Face;
    use super::super::super::simulation::Simulation;
    use super::super::super::surroundings::Bases;
    use super::super::{LinearBoundary, Patch};
    use super::*;

    /// A block whose nodes all move sideways, touched in the middle of its top.
    fn touched() -> (Simulation, u32) {
        let block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let top = block.surface().triangles.len() as u32 - 5;
        let mut state = State::at_rest(block.rest());
        state.velocities.iter_mut().zip(block.inverse_masses()).for_each(|(v, w)| *v = Vec3::x() * w.min(0.1));
        let contact = Contact::glued(top, [0.2, 0.3, 0.5]);
        let stepping = Stepping { tick: 1e-3, substeps: 2 };
        (Simulation::new(Box::new(block), state, contact, Law::default(), stepping).unwrap(), top)
    }

    fn rebuilt<B: Boundary>(mut model: LinearPatch<B>, (global, top): (&mut Simulation, u32)) -> LinearPatch<B> {
        let (tool, bases) = (ToolForecast::default(), Bases::default());
        let (triangles, tools) = (&[top], &[tool]);
        model.rebuild(ResyncView {
            global,
            tick: 0,
            triangles,
            patch: None,
            tools,
            index: 0,
            horizon: 0,
            bases: &bases,
        });
        model
    }

    fn spec(feedback: Feedback) -> LinearSpec {
        LinearSpec { size: [4, 4, 2], feedback, is_implicit: false }
    }

    #[test]
    fn surroundings_move_for_their_ticks_and_then_stand_still() {
        let (mut global, top) = touched();
        let mut model = rebuilt(LinearBoundary::new(spec(Feedback::Trajectory), 3), (&mut global, top));
        let rim = model.window.movable;
        let start = model.state.positions[rim];
        let tool = Vec3::new(0.02, 0.02, 0.05);
        let mut seen = Vec::new();
        for _ in 0..5 {
            seen.push((model.drift(0.5e-3), model.state.positions[rim].x - start.x));
            model.tick(ToolMotion { from: tool, to: tool });
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-15;
        for (tick, (drift, moved)) in seen.into_iter().enumerate() {
            let (ticks, is_moving) = (tick.min(3) as f64, tick < 3);
            assert!(near(drift.time, ticks * 1e-3 + if is_moving { 0.5e-3 } else { 0.0 }), "{tick}: {drift:?}");
            assert_eq!(drift.is_moving, is_moving);
            assert!(near(moved, ticks * 1e-3 * 0.1), "tick {tick}: the rim moved {moved}");
        }
        let mut still = rebuilt(Patch::new(spec(Feedback::Trajectory)), (&mut global, top));
        still.tick(ToolMotion { from: tool, to: tool });
        assert_eq!((still.drift(0.0), still.state.positions[rim]), (Drift::default(), start));
    }

    #[test]
    fn each_kind_of_feedback_names_its_nodes() {
        let (mut global, top) = touched();
        let corners = global.body().surface().triangles[top as usize];
        let mut told = |feedback| {
            let model = rebuilt(Patch::new(spec(feedback)), (&mut global, top));
            let mut geometry = PatchGeometry::default();
            model.geometry(&mut geometry).then_some(geometry)
        };
        assert!(told(Feedback::Trajectory).is_none());
        let whole = told(Feedback::Geometry).unwrap();
        let touched = told(Feedback::ContactNodes).unwrap();
        assert_eq!((whole.nodes.len(), &touched.nodes[..]), (32, &corners[..]));
        assert_eq!((touched.contact.triangle, touched.is_usable()), (Some(top), true));
        let x: Vec<Vec3> = corners.iter().map(|&node| global.state().positions[node as usize]).collect();
        assert_eq!(touched.state.positions, x);
        // What is told replaces that and nothing else.
        let before = global.state().clone();
        let mut moved = touched;
        moved.state.positions[0] += Vec3::z();
        moved.write_to(&mut global, 0);
        let changed = |n: &usize| global.state().positions[*n] != before.positions[*n];
        assert_eq!((0..before.positions.len()).filter(changed).collect::<Vec<_>>(), [corners[0] as usize]);
    }
}
