//! `predictive`: a non-linear patch in a ring that moves as predicted, corrected by reduced surroundings.

mod ring;

use std::sync::Arc;

use self::ring::{NearBody, RingPath};
use super::patch::{Patch, Window};
use super::{Kind, LocalModel, ResyncView};
use crate::contact::{Contact, ContactPoint, ToolMotion};
use crate::simulation::Part;
use crate::surroundings::{Basis, ReducedMotion};
use crate::{Vec3, Wrench};

/// A ring that moves by more than this share of the patch's extent in one step is torn along.
const TORN: f64 = 0.05;
/// Nodes that are moved at most to catch up in one haptic tick.
const CATCH_UP_NODES: usize = 5000;
/// So long before it was seen to be torn along (ticks) it was on the way to that.
const TORN_TICKS: u32 = 2;

/// The patch and what of the body depends on it stay non-linear. The ring, the patch's neighbours outside, moves as
/// predicted for the expected path of the tool, and answers by the reduced surroundings to what the near part does
/// differently from the prediction:
///
/// x_ring = x_predicted + Phi eta, eta'' = K eta + C eta' + Phi^T (f_near - f_near,predicted).
///
/// It is built at the time of the global model's state; a model that comes late replays the tool's own path. While there
/// is no basis the ring moves as predicted for tools that stay where they are, whatever happens. A contact that leaves the
/// patch would press against nodes that do not give way: from then on the last force is held.
#[derive(Debug)]
pub(super) struct Predictive {
    size: [usize; 3],
    /// True for one that takes a basis where there is one: `predicted` has none.
    reduces: bool,
    /// Its window nodes are the patch, the ring, then what stands still; the ring is moved by its path.
    patch: Patch,
    near: NearBody,
    path: RingPath,
    /// Substeps since it was built.
    substep: usize,
    basis: Option<Arc<Basis>>,
    surroundings: ReducedMotion,
    /// Working memory: of the ring, three numbers for each node.
    ring_positions: Vec<f64>,
    ring_velocities: Vec<f64>,
    ring_forces: Vec<f64>,
    /// Inverse masses of the ring's nodes (1/kg).
    ring_weights: Vec<f64>,
}

impl Predictive {
    /// An empty model with a patch of `size` = nodes along the surface, along it, into depth. Memory comes with the first
    /// [`rebuild`](LocalModel::rebuild).
    pub(super) fn new(size: [usize; 3], reduces: bool) -> Self {
        let (patch, near, path, surroundings) = Default::default();
        let (ring_positions, ring_velocities, ring_forces, ring_weights) = Default::default();
        let (substep, basis) = Default::default();
        Self {
            size,
            reduces,
            patch,
            near,
            path,
            substep,
            basis,
            surroundings,
            ring_positions,
            ring_velocities,
            ring_forces,
            ring_weights,
        }
    }

    /// The part of the body that it holds.
    pub(super) fn window(&self) -> &Window {
        &self.patch.window
    }

    /// Numbers of one quantity of the ring, and its path.
    pub(super) fn path(&self) -> (usize, &[f64]) {
        (3 * self.patch.window.ring, self.path.samples())
    }

    fn ring(&self) -> std::ops::Range<usize> {
        let window = &self.patch.window;
        window.movable..window.movable + window.ring
    }

    /// Everything but the path as it is in the global model.
    fn take_present(&mut self, resync: &ResyncView<'_>) {
        self.patch.take_present(resync);
        // What is beyond the ring stands still.
        let beyond = self.ring().end;
        self.patch.state.velocities[beyond..].fill(Vec3::zeros());
        self.substep = 0;
    }

    /// Finds the ring's path: the body runs ahead, or what of it is around the patch. Its tool goes where no hand may ever go, as into
    /// elements until they give way: a ring that is torn along ends the path.
    fn predict(&mut self, resync: &mut ResyncView<'_>) {
        let ring = self.ring();
        let Self { patch: Patch { window, state, forces, stepping, .. }, near, path, ring_weights, .. } = self;
        let stride = resync.global.stride();
        let steps = resync.horizon.div_ceil(stride) * stepping.substeps + 1;
        path.clear(window.ring, (stepping.step(), stride as usize), steps as usize);
        if ring.is_empty() {
            // The patch is all that can move.
            return;
        }
        if let Some(told) = resync.global.told() {
            if !path.take(&told.path) {
                // Another path than this body's. From the next model on the ring moves again.
                self.stand_still();
            }
            return;
        }
        // What the tool does otherwise than expected moves the ring only by a basis. Without one a path that goes on with the tool's
        // velocity is an error that comes back a period later and larger: a light tool on a late model swings ever wider.
        let stays = self.reduces && self.basis.is_none();
        let motion = |tool: usize, n| {
            let forecast = resync.tools[tool];
            let forecast = if stays { forecast.staying() } else { forecast };
            forecast.motion(n, stepping.tick)
        };
        let body = resync.global.body();
        let (step, extent) = (f64::from(stride) * stepping.step(), window.extent(body.rest()));
        ring_weights.clear();
        ring_weights.extend(window.nodes[ring.clone()].iter().map(|&node| body.inverse_masses()[node as usize]));
        let reached = &window.nodes[..near.len()];
        resync.global.look_ahead(&window.nodes[..window.movable], resync.horizon, motion, |ahead| {
            let places = state.positions.iter_mut().zip(&mut state.velocities);
            for ((x, v), &node) in places.zip(reached) {
                (*x, *v) = ahead.node(node).unwrap_or((*x, *v));
            }
            near.forces(state, forces);
            let is_still_whole = |node: usize| {
                let [way, pull] = [state.velocities[node], forces[node] * (ring_weights[node - ring.start] * step)]
                    .map(|velocity| velocity.norm() * step);
                // The rest of the body pulls at a node too, so that what is near may well pull.
                way <= TORN * extent && pull <= extent
            };
            let is_sound = ring.clone().all(is_still_whole);
            if is_sound {
                path.push(state, forces, ring.clone());
            } else {
                path.drop_last((TORN_TICKS * stepping.substeps).div_ceil(stride) as usize);
            }
            is_sound
        });
        self.take_present(resync);
        if self.path.samples().is_empty() {
            // It was torn along from the first.
            self.stand_still();
        }
    }

    /// Lets the ring stay where it is.
    fn stand_still(&mut self) {
        let ring = self.ring();
        let Self { patch: Patch { state, forces, .. }, near, path, .. } = self;
        state.velocities[ring.clone()].fill(Vec3::zeros());
        near.forces(state, forces);
        path.push(state, forces, ring);
    }

    /// The ring's nodes to `ring_positions` with `ring_velocities`.
    fn place_ring(&mut self) {
        let ring = self.ring();
        let places = self.ring_positions.as_chunks::<3>().0.iter().zip(self.ring_velocities.as_chunks::<3>().0);
        for (node, (x, v)) in ring.zip(places) {
            (self.patch.state.positions[node], self.patch.state.velocities[node]) = (Vec3::from(*x), Vec3::from(*v));
        }
    }

    fn take_near_forces(&mut self) {
        let Patch { state, forces, .. } = &mut self.patch;
        self.near.forces(state, forces);
    }

    /// A `part` of a tick by the near forces at its start, in which each tool goes its way.
    fn step(&mut self, tools: &[ToolMotion], part: Part) {
        let Part { steps, shares: [from, to], length } = part;
        self.patch.step(|tool| tools[tool].part(from, to), length);
        let [from, to] = steps.map(|step| self.substep as f64 + step);
        if let Some(basis) = &self.basis {
            self.path.at(from).write_forces(&mut self.ring_forces);
            deviations(&mut self.ring_forces, &self.patch.forces[self.patch.window.movable..]);
            basis.answers.step(&mut self.surroundings, &self.ring_forces, self.patch.stepping.step() * length);
        }
        self.path.at(to).write(&mut self.ring_positions, &mut self.ring_velocities);
        self.surroundings.add_ring(&mut self.ring_positions, &mut self.ring_velocities);
        self.place_ring();
    }
}

/// Puts how much `forces` differ from what was `expected` in its place, as far as it reaches.
fn deviations(expected: &mut [f64], forces: &[Vec3]) {
    for (expected, force) in expected.as_chunks_mut::<3>().0.iter_mut().zip(forces) {
        *expected = [force.x - expected[0], force.y - expected[1], force.z - expected[2]];
    }
}

impl LocalModel for Predictive {
    fn rebuild(&mut self, mut resync: ResyncView<'_>) {
        let (body, triangles, size) = (resync.global.body(), resync.triangles, self.size);
        self.near.expect(resync.global.stiffness());
        let patch = |nodes: &mut Vec<u32>| match resync.patch {
            Some(patch) => nodes.extend_from_slice(patch),
            None => resync.global.patch(resync.index, triangles, size, nodes),
        };
        self.patch.window.rebuild(body, triangles, resync.skins(), patch, |nodes| self.near.rebuild(body, nodes));
        let window = &self.patch.window;
        self.patch.forces.resize(window.nodes.len(), Vec3::zeros());
        let known = self.reduces.then(|| resync.bases.get(&window.nodes[..window.movable])).flatten();
        self.basis = known.filter(|basis| basis.answers.is_of(3 * window.ring)).cloned();
        for numbers in [&mut self.ring_positions, &mut self.ring_velocities, &mut self.ring_forces] {
            numbers.resize(3 * window.ring, 0.0);
        }
        self.take_present(&resync);
        self.predict(&mut resync);
        self.surroundings.rest(self.basis.as_ref().map(|basis| &basis.answers), resync.global.stiffness());
    }

    fn tick(&mut self, tools: &[ToolMotion]) -> Wrench {
        let ends = |tool: usize| tools[tool].to;
        if self.patch.is_left() {
            return self.patch.feel(ends);
        }
        self.patch.tools.begin(tools);
        let mut progress = self.patch.stepping.begin();
        while !progress.is_over() {
            self.take_near_forces();
            let part = progress.next(|| self.near.stable_share());
            self.step(tools, part);
        }
        self.substep += self.patch.stepping.substeps as usize;
        self.patch.feel(ends)
    }

    fn built_at(&self) -> u64 {
        self.patch.built_at
    }

    fn kind(&self) -> Kind {
        if self.reduces { Kind::Predictive } else { Kind::Predicted }
    }

    fn catch_up_ticks(&self) -> u64 {
        (CATCH_UP_NODES / self.patch.window.nodes.len().max(1)).clamp(2, 8) as u64
    }

    fn wrench(&self, tool: usize) -> Option<Wrench> {
        self.patch.wrench(tool)
    }

    fn serves_as(&self, tool: usize) -> Kind {
        match &self.basis {
            _ if self.patch.has_left(tool) => Kind::Hold,
            None => Kind::Predicted,
            Some(_) => Kind::Predictive,
        }
    }

    fn contact(&self, tool: usize) -> Contact {
        self.patch.contact(tool)
    }

    fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.patch.contact_points(tool)
    }

    fn contact_area(&self, tool: usize) -> f64 {
        self.patch.contact_area(tool)
    }

    fn position(&self, node: u32) -> Option<Vec3> {
        self.patch.position(node)
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.patch.watched.position(probe)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.patch.watched.set(nodes);
    }
}
