//! A whole body with its contact, advanced tick by tick: the global model, and `full` at the haptic rate.

use super::Vec3;
use super::body::{Body, State};
use super::contact::{Contact, Deformable, Law, ToolMotion, step};
use super::integrator::Spectrum;
use crate::error::Error;

/// How time is divided: ticks of the haptic rate, each of several explicit substeps.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// Haptic period (s).
    pub tick: f64,
    /// Explicit substeps per tick, at least one.
    pub substeps: u32,
}

impl Stepping {
    /// The substep d (s).
    pub fn step(&self) -> f64 {
        self.tick / f64::from(self.substeps)
    }

    /// Runs one tick: calls `substep` for each part of the tool's motion and returns the mean force (N).
    pub(crate) fn tick(&self, tool: ToolMotion, mut substep: impl FnMut(ToolMotion, f64) -> Vec3) -> Vec3 {
        let n = f64::from(self.substeps);
        let sum = (0..self.substeps).fold(Vec3::zeros(), |sum, u| {
            let u = f64::from(u);
            sum + substep(tool.part(u / n, (u + 1.0) / n), self.step())
        });
        sum / n
    }
}

/// A body, its state and the tool's contact with it.
#[derive(Debug)]
pub struct Simulation {
    body: Box<dyn Body>,
    state: State,
    forces: Vec<Vec3>,
    contact: Contact,
    law: Law,
    stepping: Stepping,
    /// All surface triangles: the tool may touch anywhere.
    candidates: Vec<u32>,
    inverse_masses: Vec<f64>,
    /// Mean force of the last tick, or of the resting contact before the first (N).
    force: Vec3,
}

impl Simulation {
    /// A simulation of `body` from `state`; the tool starts in `contact` (default: not touching).
    ///
    /// # Errors
    /// If the state does not fit the body or is not finite.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(
        body: Box<dyn Body>,
        state: State,
        contact: Contact,
        law: Law,
        stepping: Stepping,
    ) -> Result<Self, Error> {
        let nodes = body.rest().len();
        if state.positions.len() != nodes || state.velocities.len() != nodes || body.inverse_masses().len() != nodes {
            let lengths = (state.positions.len(), state.velocities.len(), body.inverse_masses().len());
            let message = format!("{nodes} nodes, but {lengths:?} positions, velocities and inverse masses");
            return Err(Error::scene("body", message));
        }
        if !state.is_finite() {
            return Err(Error::scene("initial", "the initial state has numbers that are not finite"));
        }
        let candidates = (0..body.surface().triangles.len() as u32).collect();
        let inverse_masses = body.inverse_masses().to_vec();
        let forces = vec![Vec3::zeros(); nodes];
        let force = Vec3::zeros();
        let mut new = Self { body, state, forces, contact, law, stepping, candidates, inverse_masses, force };
        new.force = new.resting_force();
        Ok(new)
    }

    /// A copy, if the body can make one.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn duplicate(&self) -> Option<Self> {
        Some(Self {
            body: self.body.duplicate()?,
            state: self.state.clone(),
            forces: self.forces.clone(),
            contact: self.contact,
            law: self.law,
            stepping: self.stepping,
            candidates: self.candidates.clone(),
            inverse_masses: self.inverse_masses.clone(),
            force: self.force,
        })
    }

    /// The force that holds the contact point still in the present state (N): what a tool feels before the first tick.
    fn resting_force(&mut self) -> Vec3 {
        let Some(triangle) = self.contact.triangle else { return Vec3::zeros() };
        self.body.forces(&self.state, &mut self.forces);
        let nodes = self.body.surface().triangles[triangle as usize];
        let (mut acceleration, mut compliance) = (Vec3::zeros(), 0.0);
        for (&node, w) in nodes.iter().zip(&self.contact.weights) {
            let mobility = w * self.inverse_masses[node as usize];
            acceleration += self.forces[node as usize] * mobility;
            compliance += w * mobility;
        }
        if compliance > 0.0 { acceleration / compliance } else { Vec3::zeros() }
    }

    /// Advances one haptic tick while the tool moves along `tool`; returns the force on the tool, its mean over the
    /// tick (N).
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn tick(&mut self, tool: ToolMotion) -> Vec3 {
        self.advance(tool, &mut |_| ())
    }

    fn advance(&mut self, tool: ToolMotion, watch: &mut impl FnMut(&State)) -> Vec3 {
        let Self { body, state, forces, contact, law, candidates, inverse_masses, stepping, .. } = self;
        self.force = stepping.tick(tool, |tool, d| {
            watch(state);
            body.forces(state, forces);
            let mut deformable = Deformable {
                positions: &mut state.positions,
                velocities: &mut state.velocities,
                inverse_masses,
                surface: body.surface(),
                candidates,
            };
            step(&mut deformable, forces, contact, law, tool, d)
        });
        self.force
    }

    /// Runs on for `ticks` haptic ticks along `motion` (of each, from 0), shows `watch` the state at the start of every
    /// substep and at the end, and goes back to the present.
    ///
    /// # Real-time
    /// For the global actor: costs as much as the ticks; `present` keeps the state meanwhile and may grow.
    pub fn look_ahead(
        &mut self,
        ticks: u32,
        motion: impl Fn(u32) -> ToolMotion,
        present: &mut State,
        mut watch: impl FnMut(&State),
    ) {
        present.clone_from(&self.state);
        let (contact, force) = (self.contact, self.force);
        for tick in 0..ticks {
            self.advance(motion(tick), &mut watch);
        }
        watch(&self.state);
        std::mem::swap(&mut self.state, present);
        (self.contact, self.force) = (contact, force);
    }

    /// The state, and the internal force on every node in it (N).
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn internal_forces(&mut self) -> (&State, &[Vec3]) {
        self.body.forces(&self.state, &mut self.forces);
        (&self.state, &self.forces)
    }

    /// The body.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn body(&self) -> &dyn Body {
        &*self.body
    }

    /// Positions and velocities.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Positions, velocities and contact, to put in what a local model found.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state_mut(&mut self) -> (&mut State, &mut Contact) {
        (&mut self.state, &mut self.contact)
    }

    /// The tool's contact; triangles are the body's.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn contact(&self) -> &Contact {
        &self.contact
    }

    /// How contacts are resolved.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// How time is divided.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stepping(&self) -> Stepping {
        self.stepping
    }

    /// Mean force of the last tick on the tool (N).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn force(&self) -> Vec3 {
        self.force
    }
}

/// Substeps per tick of `tick` (s) from the body's stability limit.
///
/// # Real-time
/// Not real-time safe: as [`Spectrum::estimate`].
pub fn stable_substeps(body: &mut dyn Body, tick: f64) -> u32 {
    Spectrum::estimate(body).substeps(tick)
}
