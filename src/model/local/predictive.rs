//! `predictive`: a non-linear patch in a ring that moves as the global model predicts, corrected by reduced surroundings.

use std::sync::Arc;

use super::super::Vec3;
use super::super::body::State;
use super::super::contact::{Contact, Deformable, Law, ToolMotion, step};
use super::super::simulation::Stepping;
use super::super::surroundings::{Basis, SpringGraph};
use super::near::NearSprings;
use super::ring_path::{RingPath, RingSample};
use super::window::Window;
use super::{LocalModel, PatchGeometry, ResyncView, Watched};

/// The patch and every spring that touches it stay non-linear. The ring, the patch's neighbours outside, moves as the
/// global model has predicted for the expected path of the tool, and answers by the reduced surroundings to what the
/// springs do differently from the prediction:
///
/// x_ring = x_predicted + Phi eta, eta'' = K eta + C eta' + B^T (f_near - f_near,predicted).
///
/// It is built at the time of the global model's state; a model that comes late replays the tool's own path.
#[derive(Debug)]
pub struct Predictive {
    size: [usize; 3],
    springs: Arc<SpringGraph>,
    window: Window,
    near: NearSprings,
    /// Of all window nodes: the patch, the ring, then what stands still.
    state: State,
    /// Zero for all but the patch: the ring is moved by its path.
    inverse_masses: Vec<f64>,
    forces: Vec<Vec3>,
    path: RingPath,
    /// Substeps since it was built.
    substep: usize,
    basis: Option<Arc<Basis>>,
    eta: Vec<f64>,
    eta_rate: Vec<f64>,
    acceleration: Vec<f64>,
    /// Its triangle is local.
    contact: Contact,
    law: Law,
    stepping: Stepping,
    built_at: u64,
    watched: Watched,
    /// The global model's present while it looks ahead.
    present: State,
}

impl Predictive {
    /// An empty model with a patch of `size` = nodes along the surface, along it, into depth.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](LocalModel::rebuild).
    pub fn new(size: [usize; 3], springs: Arc<SpringGraph>) -> Self {
        Self {
            size,
            springs,
            window: Window::default(),
            near: NearSprings::default(),
            state: State::default(),
            inverse_masses: Vec::new(),
            forces: Vec::new(),
            path: RingPath::default(),
            substep: 0,
            basis: None,
            eta: Vec::new(),
            eta_rate: Vec::new(),
            acceleration: Vec::new(),
            contact: Contact::default(),
            law: Law::default(),
            stepping: Stepping { tick: 1e-3, substeps: 1 },
            built_at: 0,
            watched: Watched::default(),
            present: State::default(),
        }
    }

    /// Runs the global model ahead and records what the ring does.
    fn predict(&mut self, resync: &mut ResyncView<'_>) {
        let Self { window, near, state, forces, path, present, .. } = self;
        let tick = resync.global.stepping().tick;
        path.clear(window.ring, resync.global.stepping().step());
        let ring = window.movable..window.movable + window.ring;
        resync.global.look_ahead(resync.horizon, |n| resync.tool.motion(n, tick), present, |global| {
            window.gather(&global.positions, &mut state.positions);
            window.gather(&global.velocities, &mut state.velocities);
            near.forces(&state.positions, &state.velocities, forces);
            path.push(ring.clone().map(|node| RingSample {
                position: state.positions[node],
                velocity: state.velocities[node],
                force: forces[node],
            }));
        });
    }

    /// eta' and eta one substep on; `forces` are those of the near springs at its start.
    fn advance_surroundings(&mut self, d: f64) {
        let Some(basis) = &self.basis else { return };
        let r = basis.states;
        let ring = self.window.movable..self.window.movable + self.window.ring;
        self.acceleration.fill(0.0);
        for ((force, predicted), inputs) in
            self.forces[ring].iter().zip(self.path.at(self.substep)).zip(basis.inputs.chunks_exact(3 * r))
        {
            let deviation = force - predicted.force;
            for (axis, input) in inputs.chunks_exact(r).enumerate() {
                self.acceleration.iter_mut().zip(input).for_each(|(a, input)| *a += input * deviation[axis]);
            }
        }
        for (state, acceleration) in self.acceleration.iter_mut().enumerate() {
            let row = |matrix: &[f64], x: &[f64]| -> f64 {
                matrix[state * r..(state + 1) * r].iter().zip(x).map(|(a, x)| a * x).sum()
            };
            *acceleration += row(&basis.stiffness, &self.eta) + row(&basis.damping, &self.eta_rate);
        }
        for ((eta, rate), acceleration) in self.eta.iter_mut().zip(&mut self.eta_rate).zip(&self.acceleration) {
            *rate += d * acceleration;
            *eta += d * *rate;
        }
    }

    /// Puts the ring where it is at the start of the present substep.
    fn place_ring(&mut self) {
        let ring = self.window.movable..self.window.movable + self.window.ring;
        let nodes = self.state.positions[ring.clone()].iter_mut().zip(&mut self.state.velocities[ring]);
        for ((x, v), sample) in nodes.zip(self.path.at(self.substep)) {
            (*x, *v) = (sample.position, sample.velocity);
        }
        let Some(basis) = &self.basis else { return };
        let (first, r) = (self.window.movable, basis.states);
        for (place, shapes) in basis.shapes.chunks_exact(3 * r).enumerate() {
            for (axis, shape) in shapes.chunks_exact(r).enumerate() {
                let (mut x, mut v) = (0.0, 0.0);
                for ((phi, eta), rate) in shape.iter().zip(&self.eta).zip(&self.eta_rate) {
                    x += phi * eta;
                    v += phi * rate;
                }
                self.state.positions[first + place][axis] += x;
                self.state.velocities[first + place][axis] += v;
            }
        }
    }

    fn substep(&mut self, tool: ToolMotion, d: f64) -> Vec3 {
        self.near.forces(&self.state.positions, &self.state.velocities, &mut self.forces);
        let mut deformable = Deformable {
            positions: &mut self.state.positions,
            velocities: &mut self.state.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.window.surface,
            candidates: &self.window.candidates,
        };
        let force = step(&mut deformable, &self.forces, &mut self.contact, &self.law, tool, d);
        self.advance_surroundings(d);
        self.substep += 1;
        self.place_ring();
        force
    }
}

impl LocalModel for Predictive {
    fn rebuild(&mut self, mut resync: ResyncView<'_>) {
        self.window.rebuild(resync.global.body(), resync.triangles, self.size, Some(&self.springs));
        self.near.rebuild(&self.springs, &self.window);
        let nodes = self.window.nodes.len();
        self.forces.resize(nodes, Vec3::zeros());
        self.predict(&mut resync);
        let global = &*resync.global;
        let (window, movable) = (&self.window, self.window.movable);
        window.gather(&global.state().positions, &mut self.state.positions);
        window.gather(&global.state().velocities, &mut self.state.velocities);
        // What is beyond the ring stands still.
        self.state.velocities[movable + window.ring..].fill(Vec3::zeros());
        self.inverse_masses.clear();
        let masses = global.body().inverse_masses();
        self.inverse_masses.extend(window.nodes[..movable].iter().map(|&node| masses[node as usize]));
        self.inverse_masses.resize(nodes, 0.0);
        self.basis = resync.bases.get(&window.nodes[..movable]).filter(|basis| basis.states > 0).cloned();
        let states = self.basis.as_ref().map_or(0, |basis| basis.states);
        for states_of in [&mut self.eta, &mut self.eta_rate, &mut self.acceleration] {
            states_of.clear();
            states_of.resize(states, 0.0);
        }
        self.substep = 0;
        self.contact = *global.contact();
        self.contact.triangle = self.contact.triangle.and_then(|t| window.triangle(t));
        if self.contact.triangle.is_none() {
            self.contact = Contact { glued: self.contact.glued, ..Contact::default() };
        }
        (self.law, self.stepping, self.built_at) = (*global.law(), global.stepping(), resync.tick);
        self.watched.take(global.state());
    }

    fn tick(&mut self, tool: ToolMotion) -> Vec3 {
        let stepping = self.stepping;
        let force = stepping.tick(tool, |tool, d| self.substep(tool, d));
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if self.state.is_finite() { force } else { Vec3::repeat(f64::NAN) }
    }

    fn built_at(&self) -> u64 {
        self.built_at
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

    fn geometry(&self, _: &mut PatchGeometry) -> bool {
        false
    }
}
