//! A whole body with its contacts, advanced tick by tick: the global model, and `full` at the haptic rate.

mod ahead;
mod moving;
mod recorded;
mod snapshot;
mod stepping;
mod told;

use std::sync::Arc;

use crate::body::{Body, State, Stiffened, Stiffness};
use crate::contact::{Coarseness, Contact, ContactPoint, Friction, Law, Rows, Skin, ToolMotion, ToolShape, Touch};
use crate::error::ModelError;
use crate::mesh::NearestTriangle;
use crate::{Pose, Vec3, Wrench};
use ahead::{Ahead, Glimpse};
use moving::Moving;

pub(crate) use told::Told;

pub use snapshot::Snapshot;
pub(crate) use stepping::Part;
pub use stepping::Stepping;

/// A body, its state and the contacts of the tools with it. Tools are numbered in the order of their devices.
#[derive(Debug)]
pub struct Simulation {
    moving: Moving,
    /// Where its stiffness goes, tick by tick.
    stiffness: Stiffness,
    ahead: Box<Ahead>,
    /// What the simulation on another computer, of which this is the image, has told.
    told: Option<Told>,
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
        let (touches, rows, means) = Default::default();
        let body = Stiffened::new(body);
        let stride = 1;
        let moving =
            Moving { body, state, forces, touches, rows, law, stepping, stride, candidates, inverse_masses, means };
        let new = Self { moving, stiffness: Stiffness::default(), ahead: Box::default(), told: None };
        Ok(new.with_tool(contact))
    }

    /// Adds one more tool, which starts in `contact`.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn with_tool(mut self, contact: Contact) -> Self {
        self.moving.touches.push(Touch::new(ToolShape::Point, Arc::default(), contact));
        let force = self.resting_force(&contact);
        self.moving.means.push(force.into());
        self.moving.make_room();
        self
    }

    /// Gives a tool the shape; one that is glued keeps its one contact, at its centre.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and looks at every node of the surface.
    #[must_use]
    pub fn with_shape(mut self, tool: usize, shape: ToolShape) -> Self {
        let skin = if shape == ToolShape::Point {
            Skin::default()
        } else {
            Skin::new(self.moving.body.as_made(), shape.radius())
        };
        self.moving.touches[tool] = Touch::new(shape, Arc::new(skin), self.moving.touches[tool].contact);
        self.moving.make_room();
        self
    }

    /// A copy of body, state and contacts, if the body can make one of itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn duplicate(&self) -> Option<Self> {
        let mut moving = Moving {
            body: self.moving.body.copy()?,
            state: self.moving.state.clone(),
            forces: self.moving.forces.clone(),
            touches: self.moving.touches.clone(),
            rows: Rows::default(),
            law: self.moving.law,
            stepping: self.moving.stepping,
            stride: self.moving.stride,
            candidates: self.moving.candidates.clone(),
            inverse_masses: self.moving.inverse_masses.clone(),
            means: self.moving.means.clone(),
        };
        moving.make_room();
        Some(Self { moving, stiffness: self.stiffness, ahead: Box::new(self.ahead.anew()), told: self.told.clone() })
    }

    /// The force that holds the contact point still in the present state (N): what a tool feels before the first tick.
    fn resting_force(&mut self, contact: &Contact) -> Vec3 {
        let Some(triangle) = contact.triangle else { return Vec3::zeros() };
        self.moving.body.forces(&self.moving.state, &mut self.moving.forces);
        let nodes = self.moving.body.surface().triangles[triangle as usize];
        let (mut acceleration, mut compliance) = (Vec3::zeros(), 0.0);
        for (&node, w) in nodes.iter().zip(&contact.weights) {
            let mobility = w * self.moving.inverse_masses[node as usize];
            acceleration += self.moving.forces[node as usize] * mobility;
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
        self.moving.means[0]
    }

    /// Advances one haptic tick while each tool moves along its own of `motions`, one for each tool.
    ///
    /// # Panics
    /// If a tool has none.
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn tick_all(&mut self, motions: &[ToolMotion]) {
        self.step_all(1, motions);
    }

    /// Advances `ticks` haptic ticks in one step, from one to [`stride`](Self::stride), while each tool moves straight along its own of
    /// `motions`, one for each tool. A longer step may be unstable.
    ///
    /// # Panics
    /// If a tool has none; with debug assertions, if a step may not have so many ticks.
    ///
    /// # Real-time
    /// Bounded and real-time safe if the body's forces are.
    pub fn step_all(&mut self, ticks: u32, motions: &[ToolMotion]) {
        let time = f64::from(ticks) * self.moving.stepping.tick;
        let stiffness = self.moving.body.stiffness().towards(self.stiffness, time);
        self.moving.put_stiffness(stiffness);
        self.moving.advance(ticks, |tool| motions[tool], &mut |_| ());
    }

    /// Lets one step span up to so many haptic ticks ([`step_all`](Self::step_all)), and every step that runs ahead: a body need not
    /// follow a haptic rate that is higher than its own stability asks for. Whoever says so knows that the body bears it.
    ///
    /// # Panics
    /// If `ticks` is zero, or more than one where a tick has several substeps.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn striding(mut self, ticks: u32) -> Self {
        let substeps = self.moving.stepping.substeps;
        assert!(ticks == 1 || ticks > 1 && substeps == 1, "steps of {ticks} ticks of {substeps} substeps");
        self.moving.stride = ticks;
        self
    }

    /// Haptic ticks that one step may span.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stride(&self) -> u32 {
        self.moving.stride
    }

    /// Nodes around a patch that run ahead, if nothing else is said.
    pub const AHEAD: usize = Ahead::NODES;

    /// Lets at most about so many nodes around a patch run ahead: what a prediction costs, and how far from the tool the body may
    /// do something unexpected.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn looking_ahead_with(mut self, nodes: usize) -> Self {
        *self.ahead = Ahead::with(nodes);
        self
    }

    /// Runs on for `ticks` haptic ticks along `motion` (of each tool in each tick, from 0), or until its last step of
    /// [`stride`](Self::stride) ticks is a whole one, shows `watch` the state at the start of every step and at the end, and goes back
    /// to the present. It ends early with a tick in which `watch` says no. Of a large body only the neighbourhood of `patch` runs ahead
    /// (ids in increasing order).
    ///
    /// # Real-time
    /// For the global actor: costs as much as the ticks, of a large body those of a small one; allocates where the patch moves.
    pub(crate) fn look_ahead(
        &mut self,
        patch: &[u32],
        ticks: u32,
        motion: impl Fn(usize, u32) -> ToolMotion,
        watch: impl FnMut(Glimpse<'_>) -> bool,
    ) {
        self.ahead.run(&mut self.moving, patch, ticks, motion, watch);
    }

    /// The nodes that all tools but `tool` press, each with the force on it (N).
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub(crate) fn exerted_beside(&self, tool: usize) -> impl Iterator<Item = (u32, Vec3)> {
        (0..self.moving.touches.len()).filter(move |&other| other != tool).flat_map(|other| self.exerted(other))
    }

    /// What the simulation that this is an image of has told; `None` for one of its own.
    pub(crate) fn told(&self) -> Option<&Told> {
        self.told.as_ref()
    }

    /// Makes this the image of another one, which is so stiff and has told of the ring's `path`.
    pub(crate) fn be_told(&mut self, stiffness: Stiffness, path: &[f64]) {
        if self.stiffness() != stiffness {
            self.stiffness = stiffness;
            self.moving.put_stiffness(stiffness);
        }
        let told = self.told.get_or_insert_default();
        told.exerted.resize_with(self.moving.touches.len(), Vec::new);
        told.path.clear();
        told.path.extend_from_slice(path);
    }

    /// The image of a tool: it felt `wrench`, touched as `touch` is told to, and `exerted` forces on nodes (N).
    pub(crate) fn be_told_of(
        &mut self,
        tool: usize,
        wrench: Wrench,
        exerted: &[(u32, Vec3)],
        touch: impl FnOnce(&mut Touch),
    ) {
        self.moving.means[tool] = wrench;
        touch(&mut self.moving.touches[tool]);
        if let Some(told) = self.told.as_mut().and_then(|told| told.exerted.get_mut(tool)) {
            exerted.clone_into(told);
        }
    }

    /// The nodes that `tool` touches with the force on each (N): of a point its mean over the last tick, of a tool with a shape
    /// that of the last step.
    pub(crate) fn exerted(&self, tool: usize) -> Vec<(u32, Vec3)> {
        if let Some(told) = &self.told {
            return told.exerted[tool].clone();
        }
        let mut exerted = Vec::new();
        let (surface, force) = (self.moving.body.surface(), self.moving.means[tool].force);
        self.moving.touches[tool].each_exerted(surface, force, |node, force| exerted.push((node, force)));
        exerted
    }

    /// The body that is simulated, as stiff as it is now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn body(&self) -> &dyn Body {
        &self.moving.body
    }

    /// The body with the stiffness that it was made with.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn body_as_made(&self) -> &dyn Body {
        self.moving.body.as_made()
    }

    /// How stiff the body is now.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stiffness(&self) -> Stiffness {
        self.moving.body.stiffness()
    }

    /// Lets the body become as stiff as `target`, tick by tick, ten times within half a second: a deformed body that stiffens pushes.
    /// Whoever asks for more than [`Stiffness::largest`] has a body that its steps do not bear.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn approach_stiffness(&mut self, target: Stiffness) {
        self.stiffness = target;
    }

    /// Changes the friction between tools and body from the next tick on.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn set_friction(&mut self, friction: Friction) {
        self.moving.law.friction = friction;
    }

    /// Positions and velocities of all nodes of the body.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state(&self) -> &State {
        &self.moving.state
    }

    /// Positions and velocities of all nodes, to put in what a local model found.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.moving.state
    }

    /// Number of tools that touch the body or may touch it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn tools(&self) -> usize {
        self.moving.touches.len()
    }

    /// The contact of a tool; its triangle is the body's.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn contact(&self, tool: usize) -> &Contact {
        &self.moving.touches[tool].contact
    }

    /// The contact of a tool, to put in what a local model found.
    pub(crate) fn contact_mut(&mut self, tool: usize) -> &mut Contact {
        &mut self.moving.touches[tool].contact
    }

    /// Takes `tool` off the body, unless it is glued to it: what it touched is let go.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn lift(&mut self, tool: usize) {
        if self.moving.touches[tool].lift() {
            self.moving.means[tool] = Wrench::default();
        }
    }

    /// The law by which contacts are resolved.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn law(&self) -> &Law {
        &self.moving.law
    }

    /// The haptic tick and its substeps.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stepping(&self) -> Stepping {
        self.moving.stepping
    }

    /// Mean force of the last tick on a tool (N).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn force(&self, tool: usize) -> Vec3 {
        self.moving.means[tool].force
    }

    /// Mean force and torque of the last tick on a tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn wrench(&self, tool: usize) -> Wrench {
        self.moving.means[tool]
    }

    /// How coarse the surface is against a tool with a shape; `None` for a point, and for a tool that is glued.
    ///
    /// # Real-time
    /// Not for a tick: looks at every triangle of the surface.
    pub fn coarseness(&self, tool: usize) -> Option<Coarseness> {
        let touch = &self.moving.touches[tool];
        touch.has_shape().then(|| touch.skin.coarseness(&self.moving.body, touch.shape.radius()))
    }

    /// The shape of a tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn shape(&self, tool: usize) -> ToolShape {
        self.moving.touches[tool].shape
    }

    /// Puts the nodes of a patch for `tool` around surface triangles in place of `nodes`, in increasing order: those of
    /// [`Body::patch`], and all that the tool presses where it touches these triangles.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; `nodes` may grow.
    pub fn patch(&self, tool: usize, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        self.moving.body.patch(triangles, size, nodes);
        self.moving.touches[tool].complete(&self.moving.body, triangles, nodes);
    }

    /// Puts the nodes that `tool` presses where it touches `triangles` in place of `nodes`, in increasing order: a patch without one
    /// of them does not hold the contact.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; `nodes` may grow.
    pub fn pressed_at(&self, tool: usize, triangles: &[u32], nodes: &mut Vec<u32>) {
        nodes.clear();
        let corners = triangles.iter().flat_map(|&triangle| self.moving.body.surface().triangles[triangle as usize]);
        nodes.extend(corners.filter(|&node| self.moving.inverse_masses[node as usize] > 0.0));
        nodes.sort_unstable();
        nodes.dedup();
        self.moving.touches[tool].complete(&self.moving.body, triangles, nodes);
    }

    /// Puts the nodes that all tools but `tool` press, and would press at the `triangles` of each, in place of `nodes`: what a patch has to
    /// hold if the others are to be resolved in it.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; allocates.
    pub fn pressed_beside<'a>(&self, tool: usize, triangles: impl Fn(usize) -> &'a [u32], nodes: &mut Vec<u32>) {
        nodes.clear();
        let mut pressed = Vec::new();
        for other in (0..self.tools()).filter(|&other| other != tool) {
            self.pressed_at(other, triangles(other), &mut pressed);
            nodes.append(&mut pressed);
        }
        let can_move = |node: &u32| self.moving.inverse_masses[*node as usize] > 0.0;
        nodes.extend(self.exerted_beside(tool).map(|(node, _)| node).filter(can_move));
        nodes.sort_unstable();
        nodes.dedup();
    }

    /// Appends the triangles that `tool` touches, or may touch soon, at `pose`, or if its radius were larger by `margin` (m), each
    /// once; none for a point, which is over one.
    ///
    /// # Real-time
    /// For the global actor: looks at every triangle; allocates.
    pub fn footprint(&self, tool: usize, pose: &Pose, margin: f64, triangles: &mut Vec<u32>) {
        if self.moving.touches[tool].has_shape() {
            let surface = (self.moving.body.surface(), &self.moving.state.positions[..]);
            if let Ok(nearest) = NearestTriangle::new(surface.0, surface.1) {
                self.moving.touches[tool].footprint(&nearest, surface, pose, margin, triangles);
            }
        }
    }

    /// What is known of a tool.
    pub(crate) fn touch(&self, tool: usize) -> &Touch {
        &self.moving.touches[tool]
    }

    /// The places where a tool with a shape touched in the last tick; none for a point, whose one place
    /// [`contact`](Self::contact) tells.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.moving.touches[tool].points()
    }

    /// The area that a tool with a shape touches (m^2), as fine as the triangles tell.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn contact_area(&self, tool: usize) -> f64 {
        self.moving.touches[tool].area(self.moving.body.surface(), &self.moving.state.positions)
    }
}
