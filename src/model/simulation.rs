//! A whole body with its contacts, advanced tick by tick: the global model, and `full` at the haptic rate.

mod ahead;

use std::sync::Arc;

use crate::body::{Body, State, Stiffened, Stiffness};
use crate::contact::{
    Coarseness, Contact, ContactPoint, Deformable, Friction, Law, Rows, Skin, ToolMotion, ToolShape, Touch, step_all,
};
use crate::error::ModelError;
use crate::integrator::Spectrum;
use crate::{Pose, Vec3, Wrench};
use ahead::Ahead;

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

impl Default for Stepping {
    /// One substep per millisecond.
    fn default() -> Self {
        Self { tick: 1e-3, substeps: 1 }
    }
}

impl Stepping {
    /// Substeps per tick of `tick` (s) from the body's stability limit.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and evaluates the body's forces hundreds of times.
    pub fn stable_substeps(body: &mut dyn Body, tick: f64) -> u32 {
        Spectrum::estimate(body).substeps(tick)
    }

    /// The substep d (s).
    pub fn step(&self) -> f64 {
        self.tick / f64::from(self.substeps)
    }

    /// Runs one tick: calls `substep` for each part of the tool's motion and returns the mean of what it gives.
    pub(crate) fn tick(&self, tool: ToolMotion, mut substep: impl FnMut(ToolMotion, f64) -> Wrench) -> Wrench {
        let n = f64::from(self.substeps);
        let sum = (0..self.substeps).fold(Wrench::default(), |sum, u| {
            let u = f64::from(u);
            sum + substep(tool.part(u / n, (u + 1.0) / n), self.step())
        });
        sum / n
    }
}

/// A body, its state and the contacts of the tools with it. Tools are numbered in the order of their devices.
#[derive(Debug)]
pub struct Simulation {
    body: Stiffened,
    /// Where its stiffness goes, tick by tick.
    stiffness: Stiffness,
    state: State,
    forces: Vec<Vec3>,
    touches: Vec<Touch>,
    rows: Rows,
    law: Law,
    stepping: Stepping,
    /// All surface triangles: a tool may touch anywhere.
    candidates: Vec<u32>,
    inverse_masses: Vec<f64>,
    /// On each tool: mean force and torque of the last tick, or of the resting contact before the first.
    means: Vec<Wrench>,
    ahead: Box<Ahead>,
}

impl Simulation {
    /// A simulation of `body` from `state`; the one tool starts in `contact` (default: not touching).
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
    ) -> Result<Self, ModelError> {
        let nodes = body.rest().len();
        if state.positions.len() != nodes || state.velocities.len() != nodes || body.inverse_masses().len() != nodes {
            let lengths = (state.positions.len(), state.velocities.len(), body.inverse_masses().len());
            let message = format!("{nodes} nodes, but {lengths:?} positions, velocities and inverse masses");
            return Err(ModelError::of("body", message));
        }
        if !state.is_finite() {
            return Err(ModelError::of("initial", "the initial state has numbers that are not finite"));
        }
        let candidates = (0..body.surface().triangles.len() as u32).collect();
        let inverse_masses = body.inverse_masses().to_vec();
        let forces = vec![Vec3::zeros(); nodes];
        let (touches, rows, means, ahead) = Default::default();
        let (body, stiffness) = (Stiffened::new(body), Stiffness::default());
        let new = Self {
            body,
            stiffness,
            state,
            forces,
            touches,
            rows,
            law,
            stepping,
            candidates,
            inverse_masses,
            means,
            ahead,
        };
        Ok(new.with_tool(contact))
    }

    /// Adds one more tool, which starts in `contact`.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn with_tool(mut self, contact: Contact) -> Self {
        self.touches.push(Touch::new(ToolShape::Point, Arc::default(), contact));
        let force = self.resting_force(&contact);
        self.means.push(force.into());
        self.rows = Rows::with_room(self.touches.len());
        self.rows.make_room(self.inverse_masses.len());
        self
    }

    /// Gives a tool the shape; one that is glued keeps its one contact, at its centre.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and looks at every node of the surface.
    #[must_use]
    pub fn with_shape(mut self, tool: usize, shape: ToolShape) -> Self {
        let skin =
            if shape == ToolShape::Point { Skin::default() } else { Skin::new(self.body.as_made(), shape.radius()) };
        self.touches[tool] = Touch::new(shape, Arc::new(skin), self.touches[tool].contact);
        self.rows.make_room(self.inverse_masses.len());
        self
    }

    /// A copy of body, state and contacts, if the body can make one of itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn duplicate(&self) -> Option<Self> {
        let mut rows = Rows::with_room(self.touches.len());
        rows.make_room(self.inverse_masses.len());
        Some(Self {
            body: self.body.copy()?,
            stiffness: self.stiffness,
            state: self.state.clone(),
            forces: self.forces.clone(),
            touches: self.touches.clone(),
            rows,
            law: self.law,
            stepping: self.stepping,
            candidates: self.candidates.clone(),
            inverse_masses: self.inverse_masses.clone(),
            means: self.means.clone(),
            ahead: Box::new(self.ahead.anew()),
        })
    }

    /// The force that holds the contact point still in the present state (N): what a tool feels before the first tick.
    fn resting_force(&mut self, contact: &Contact) -> Vec3 {
        let Some(triangle) = contact.triangle else { return Vec3::zeros() };
        self.body.forces(&self.state, &mut self.forces);
        let nodes = self.body.surface().triangles[triangle as usize];
        let (mut acceleration, mut compliance) = (Vec3::zeros(), 0.0);
        for (&node, w) in nodes.iter().zip(&contact.weights) {
            let mobility = w * self.inverse_masses[node as usize];
            acceleration += self.forces[node as usize] * mobility;
            compliance += w * mobility;
        }
        if compliance > 0.0 { acceleration / compliance } else { Vec3::zeros() }
    }

    /// Advances one haptic tick while the one tool moves along `tool`; returns the force and the torque on it, their means over
    /// the tick.
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn tick(&mut self, tool: ToolMotion) -> Wrench {
        self.tick_all(&[tool]);
        self.means[0]
    }

    /// Advances one haptic tick while each tool moves along its own of `motions`, one for each tool.
    ///
    /// # Panics
    /// If a tool has none.
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn tick_all(&mut self, motions: &[ToolMotion]) {
        let stiffness = self.body.stiffness().towards(self.stiffness, self.stepping.tick);
        self.put_stiffness(stiffness);
        self.advance(|tool| motions[tool], &mut |_| ());
    }

    fn advance(&mut self, motion: impl Fn(usize) -> ToolMotion, watch: &mut impl FnMut(&State)) {
        let Self { body, state, forces, touches, rows, law, candidates, inverse_masses, stepping, means, .. } = self;
        let (n, d) = (f64::from(stepping.substeps), stepping.step());
        means.fill(Wrench::default());
        touches.iter_mut().for_each(Touch::begin);
        for u in 0..stepping.substeps {
            let u = f64::from(u);
            watch(state);
            body.forces(state, forces);
            let mut deformable = Deformable {
                positions: &mut state.positions,
                velocities: &mut state.velocities,
                inverse_masses,
                surface: body.surface(),
                candidates,
            };
            let part = |tool| motion(tool).part(u / n, (u + 1.0) / n);
            step_all(&mut deformable, forces, touches, rows, law, part, d);
            means.iter_mut().zip(&*touches).for_each(|(sum, touch)| *sum += touch.wrench);
        }
        means.iter_mut().for_each(|sum| *sum = *sum / n);
        touches.iter_mut().for_each(|touch| touch.end(stepping.substeps, |triangle| triangle));
    }

    /// The nodes that all tools but `tool` press, each with the force on it (N).
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub(crate) fn exerted_beside(&self, tool: usize) -> impl Iterator<Item = (u32, Vec3)> {
        (0..self.touches.len()).filter(move |&other| other != tool).flat_map(|other| self.exerted(other))
    }

    /// The nodes that `tool` touches with the force on each (N): of a point its mean over the last tick, of a tool with a shape
    /// that of the last step.
    fn exerted(&self, tool: usize) -> Vec<(u32, Vec3)> {
        let touch = &self.touches[tool];
        if touch.has_shape() {
            return touch.pressed().to_vec();
        }
        let Contact { triangle, weights, .. } = touch.contact;
        let force = self.means[tool].force;
        let nodes = triangle.map(|triangle| self.body.surface().triangles[triangle as usize]);
        nodes.into_iter().flat_map(|nodes| (0..3).map(move |i| (nodes[i], -force * weights[i]))).collect()
    }

    /// The body that is simulated, as stiff as it is now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn body(&self) -> &dyn Body {
        &self.body
    }

    /// The body with the stiffness that it was made with.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn body_as_made(&self) -> &dyn Body {
        self.body.as_made()
    }

    /// How stiff the body is now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stiffness(&self) -> Stiffness {
        self.body.stiffness()
    }

    /// Lets the body become as stiff as `target`, tick by tick, ten times within half a second: a deformed body that stiffens pushes.
    /// Whoever asks for more than [`Stiffness::largest`] has a body that its steps do not bear.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn approach_stiffness(&mut self, target: Stiffness) {
        self.stiffness = target;
    }

    fn put_stiffness(&mut self, stiffness: Stiffness) {
        self.body.set_stiffness(stiffness);
        self.touches.iter_mut().for_each(|touch| touch.stiffness = stiffness);
    }

    /// Changes the friction between tools and body from the next tick on.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn set_friction(&mut self, friction: Friction) {
        self.law.friction = friction;
    }

    /// Positions and velocities of all nodes of the body.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Positions and velocities of all nodes, to put in what a local model found.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// Number of tools that touch the body or may touch it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn tools(&self) -> usize {
        self.touches.len()
    }

    /// The contact of a tool; its triangle is the body's.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn contact(&self, tool: usize) -> &Contact {
        &self.touches[tool].contact
    }

    /// The contact of a tool, to put in what a local model found.
    pub(crate) fn contact_mut(&mut self, tool: usize) -> &mut Contact {
        &mut self.touches[tool].contact
    }

    /// Puts `tool` in `contact` with the mean `force` of a last tick on it (N): to go on from what another one has saved.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn restore_tool(&mut self, tool: usize, contact: Contact, force: Vec3) {
        (self.touches[tool].contact, self.means[tool]) = (contact, force.into());
    }

    /// The law by which contacts are resolved.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// The haptic tick and its substeps.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stepping(&self) -> Stepping {
        self.stepping
    }

    /// Mean force of the last tick on a tool (N).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn force(&self, tool: usize) -> Vec3 {
        self.means[tool].force
    }

    /// Mean force and torque of the last tick on a tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn wrench(&self, tool: usize) -> Wrench {
        self.means[tool]
    }

    /// How coarse the surface is against a tool with a shape; `None` for a point, and for a tool that is glued.
    ///
    /// # Real-time
    /// Not for a tick: looks at every triangle of the surface.
    pub fn coarseness(&self, tool: usize) -> Option<Coarseness> {
        let touch = &self.touches[tool];
        touch.has_shape().then(|| touch.skin.coarseness(&self.body))
    }

    /// The shape of a tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn shape(&self, tool: usize) -> ToolShape {
        self.touches[tool].shape
    }

    /// Puts the nodes of a patch for `tool` around surface triangles in place of `nodes`, in increasing order: those of
    /// [`Body::patch`], and all that the tool presses where it touches these triangles.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; `nodes` may grow.
    pub fn patch(&self, tool: usize, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        self.body.patch(triangles, size, nodes);
        self.touches[tool].complete(&self.body, triangles, nodes);
    }

    /// Puts the nodes that `tool` presses where it touches `triangles` in place of `nodes`, in increasing order: a patch without one
    /// of them does not hold the contact.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; `nodes` may grow.
    pub fn pressed_at(&self, tool: usize, triangles: &[u32], nodes: &mut Vec<u32>) {
        nodes.clear();
        let corners = triangles.iter().flat_map(|&triangle| self.body.surface().triangles[triangle as usize]);
        nodes.extend(corners.filter(|&node| self.inverse_masses[node as usize] > 0.0));
        nodes.sort_unstable();
        nodes.dedup();
        self.touches[tool].complete(&self.body, triangles, nodes);
    }

    /// Appends the triangles that `tool` touches, or may touch soon, at `pose`, or if its radius were larger by `margin` (m), each
    /// once; none for a point, which is over one.
    ///
    /// # Real-time
    /// For the global actor: looks at every triangle; `triangles` may grow.
    pub fn footprint(&self, tool: usize, pose: &Pose, margin: f64, triangles: &mut Vec<u32>) {
        if self.touches[tool].has_shape() {
            let surface = (self.body.surface(), &self.state.positions[..]);
            self.touches[tool].footprint(surface, pose, margin, triangles);
        }
    }

    /// What is known of a tool.
    pub(crate) fn touch(&self, tool: usize) -> &Touch {
        &self.touches[tool]
    }

    /// The places where a tool with a shape touched in the last tick; none for a point, whose one place
    /// [`contact`](Self::contact) tells.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.touches[tool].points()
    }

    /// The area that a tool with a shape touches (m^2), as fine as the triangles tell.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn contact_area(&self, tool: usize) -> f64 {
        self.touches[tool].area(self.body.surface(), &self.state.positions)
    }
}
