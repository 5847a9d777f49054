//! The linear patch: four local models that differ in how its surroundings enter, see [`Boundary`].

mod boundary;
mod stable;

use self::stable::stable_stepping;
use super::feedback::{Feedback, PatchGeometry};
use super::patch::{Patch, Window};
use super::{Kind, LocalModel, ResyncView};
use crate::contact::{Contact, ContactPoint, Equations, ToolMotion, step_implicit};
use crate::linear::{Drift, ImplicitStep, PatchTangent};
use crate::simulation::Part;
use crate::{Vec3, Wrench};

pub(super) use boundary::{Boundary, Layers, Yielding};

/// How far surroundings give way, of what they would: the first that leaves the patch stable.
const WEAKENED: [f64; 5] = [1.0, 0.75, 0.5, 0.25, 0.0];

/// What a linear patch is made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LinearSpec {
    /// Patch nodes along the surface, along it, into depth.
    pub(super) size: [usize; 3],
    /// What it tells the global model.
    pub(super) feedback: Feedback,
    /// One implicit step per tick in place of the global model's explicit ones, even where these are stable.
    pub(super) is_implicit: bool,
}

/// The nodes around the contact, with their tangent at the resync, in surroundings that `boundary` says.
#[derive(Clone, Debug)]
pub(super) struct LinearPatch {
    boundary: Boundary,
    spec: LinearSpec,
    /// Its forces are those on the movable nodes.
    patch: Patch,
    tangent: PatchTangent,
    /// In use if the patch is implicit.
    system: ImplicitStep,
    is_implicit: bool,
    /// Ticks since it was built.
    ticks: u32,
}

impl LinearPatch {
    /// An empty patch. Memory comes with the first [`rebuild`](LocalModel::rebuild).
    pub(super) fn new(spec: LinearSpec, boundary: Boundary) -> Self {
        let (patch, tangent, system) = Default::default();
        Self { boundary, spec, patch, tangent, system, is_implicit: false, ticks: 0 }
    }

    /// The part of the body that it holds.
    pub(super) fn window(&self) -> &Window {
        &self.patch.window
    }

    /// The surroundings `t` seconds into the present tick.
    fn drift(&self, t: f64) -> Drift {
        let moving = self.boundary.moving_ticks();
        let ticks = f64::from(self.ticks.min(moving));
        let is_moving = self.ticks < moving;
        Drift { time: ticks * self.patch.stepping.tick + if is_moving { t } else { 0.0 }, is_moving }
    }

    /// One step, the `part` of the present tick, in which each tool goes its way.
    fn step(&mut self, tools: &[ToolMotion], part: Part) {
        let (d, [from, to]) = (self.patch.stepping.step(), part.shares);
        let motion = |tool: usize| tools[tool].part(from, to);
        // An implicit step takes its forces at its end.
        let ahead = if self.is_implicit { d } else { 0.0 };
        let drift = self.drift(part.steps[0] * d + ahead);
        let Self { patch, system, tangent, .. } = self;
        let movable = patch.window.movable;
        let (x, v) = (&patch.state.positions[..movable], &patch.state.velocities[..movable]);
        tangent.forces(x, v, ahead, drift, &mut patch.forces);
        if self.is_implicit {
            patch.with_contact(part.length, |body, forces, (touches, numbers, rows), law| {
                step_implicit(body, system, forces, touches, rows, law, |tool| motion(numbers[tool]));
            });
        } else {
            patch.step(motion, part.length);
        }
    }

    /// The nodes that the patch does not move stop.
    fn hold_rim(&mut self) {
        self.patch.state.velocities[self.patch.window.movable..].fill(Vec3::zeros());
    }
}

impl LocalModel for LinearPatch {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        let touch = resync.global.touch(resync.index);
        // A point's patch is around its triangle; a tool with a shape comes with all that it may touch.
        let triangles = if touch.has_shape() { resync.triangles } else { &resync.triangles[..1] };
        let (global, size, tool) = (&*resync.global, self.spec.size, resync.index);
        let body = global.body();
        let patch = |nodes: &mut Vec<u32>| global.patch(tool, triangles, size, nodes);
        self.patch.window.rebuild(body, triangles, resync.skins(), patch, |_| [&[], &[]]);
        self.patch.take_present(&resync);
        if self.boundary.moving_ticks() == 0 {
            // The rim stands still, and so must the velocities that a contact on it would see.
            self.hold_rim();
        }
        let Self { boundary, spec, patch, tangent, .. } = self;
        let window = &patch.window;
        let nodes = &window.nodes[..window.movable];
        patch.forces.resize(nodes.len(), Vec3::zeros());
        // Surroundings that give way take stiffness from the patch. Of springs at rest it is left with enough; of elements, or
        // far from rest, it may be left without what holds it.
        let compliance = boundary.compliance(nodes);
        for &weakened in if boundary.gives_way() { &WEAKENED[..] } else { &[0.0] } {
            let share = |row, column| 1.0 - weakened * (1.0 - boundary.share(body, row, column));
            tangent.rebuild(body, resync.global.state(), nodes, &|node| window.movable(node), &share);
            if let Some(stiffness) = &compliance {
                tangent.add_stiffness(stiffness, weakened * resync.global.stiffness().factor());
            }
            if weakened == 0.0 || tangent.is_stable() {
                break;
            }
        }
        self.ticks = 0;
        (patch.stepping, self.is_implicit) =
            stable_stepping(spec.is_implicit, tangent, &patch.inverse_masses, patch.stepping, &patch.law);
        if self.is_implicit {
            patch.reserve_implicit();
            patch.law.equations = Equations::Corrected;
            self.system.rebuild(tangent, &patch.inverse_masses, patch.stepping.step());
        }
    }

    fn tick(&mut self, tools: &[ToolMotion]) -> Wrench {
        let ends = |tool: usize| tools[tool].to;
        if self.patch.is_left() {
            return self.patch.feel(ends);
        }
        let mut progress = self.patch.stepping.begin();
        self.patch.tools.begin(tools);
        while !progress.is_over() {
            self.step(tools, progress.next(|| 1.0));
        }
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks == self.boundary.moving_ticks() {
            self.hold_rim();
        }
        self.patch.feel(ends)
    }

    fn built_at(&self) -> u64 {
        self.patch.built_at
    }

    fn kind(&self) -> Kind {
        self.boundary.kind()
    }

    fn wrench(&self, tool: usize) -> Option<Wrench> {
        self.patch.wrench(tool)
    }

    fn serves_as(&self, tool: usize) -> Kind {
        if self.patch.has_left(tool) { Kind::Hold } else { self.boundary.kind() }
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

    fn geometry(&self, geometry: &mut PatchGeometry) -> bool {
        let patch = &self.patch;
        geometry.clear();
        geometry.contact = patch.contact(patch.own);
        match self.spec.feedback {
            // What has left is as it was then.
            _ if patch.has_left(patch.own) => return false,
            Feedback::Trajectory => return false,
            Feedback::Geometry => (0..patch.window.movable).for_each(|place| patch.tell(geometry, place)),
            Feedback::ContactNodes => {
                let Some(touch) = patch.tools.touch(patch.own) else { return false };
                touch.each_exerted(&patch.window.surface, Vec3::zeros(), |place, _| {
                    if (place as usize) < patch.window.movable {
                        patch.tell(geometry, place as usize);
                    }
                });
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::ToolForecast;
    use super::*;
    use crate::body::{Block, Body, State};
    use crate::contact::Law;
    use crate::mesh::Face;
    use crate::simulation::{Simulation, Stepping};
    use crate::surroundings::Bases;

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

    fn rebuilt(feedback: Feedback, boundary: Boundary, (global, top): (&mut Simulation, u32)) -> LinearPatch {
        let spec = LinearSpec { size: [4, 4, 2], feedback, is_implicit: false };
        let mut model = LinearPatch::new(spec, boundary);
        let (tools, bases) = (&[ToolForecast::default()], &Bases::default());
        let (triangles, nearest) = (&[top], &[top]);
        model.rebuild(ResyncView {
            global,
            tick: 0,
            triangles,
            nearest,
            patch: None,
            tools,
            index: 0,
            horizon: 0,
            bases,
        });
        model
    }

    #[test]
    fn surroundings_move_for_their_ticks_and_then_stand_still() {
        let (mut global, top) = touched();
        let mut model = rebuilt(Feedback::Trajectory, Boundary::Drifting { ticks: 3 }, (&mut global, top));
        let rim = model.patch.window.movable;
        let start = model.patch.state.positions[rim];
        let tool = Vec3::new(0.02, 0.02, 0.05);
        let mut seen = Vec::new();
        for _ in 0..5 {
            seen.push((model.drift(0.5e-3), model.patch.state.positions[rim].x - start.x));
            model.tick(&[ToolMotion::straight(tool, tool)]);
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-15;
        for (tick, (drift, moved)) in seen.into_iter().enumerate() {
            let (ticks, is_moving) = (tick.min(3) as f64, tick < 3);
            assert!(near(drift.time, ticks * 1e-3 + if is_moving { 0.5e-3 } else { 0.0 }), "{tick}: {drift:?}");
            assert_eq!(drift.is_moving, is_moving);
            assert!(near(moved, ticks * 1e-3 * 0.1), "tick {tick}: the rim moved {moved}");
        }
        let mut still = rebuilt(Feedback::Trajectory, Boundary::Still, (&mut global, top));
        still.tick(&[ToolMotion::straight(tool, tool)]);
        assert_eq!((still.drift(0.0), still.patch.state.positions[rim]), (Drift::default(), start));
    }

    #[test]
    fn each_kind_of_feedback_names_its_nodes() {
        let (mut global, top) = touched();
        let corners = global.body().surface().triangles[top as usize];
        let mut told = |feedback| {
            let model = rebuilt(feedback, Boundary::Still, (&mut global, top));
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
