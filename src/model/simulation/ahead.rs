//! Running ahead of the present: with the part of the body around a patch, or with all of a body that is not larger.

use std::sync::Arc;

use super::moving::Moving;
use super::recorded::Recorded;
use crate::Vec3;
use crate::body::{Cutout, State, Stiffened, neighbourhood};
use crate::contact::{Contact, Rows, Skin, ToolMotion, Touch};

/// The velocity of what is left out dies away in about this time (s), and what changes it in about that: longer than for a tool, as
/// it comes through the body.
const DECAY: f64 = 100e-3;
const CHANGE_DECAY: f64 = 60e-3;

/// What runs ahead, and where the present is meanwhile.
#[derive(Debug)]
pub(super) struct Ahead {
    /// Nodes around a patch that run ahead. Of a larger body the rest goes on as it does at present: what a tool does meanwhile
    /// hardly comes so far.
    most: usize,
    /// The patch that the part was made for.
    patch: Vec<u32>,
    /// `None` if the neighbourhood of the patch is the whole body.
    part: Option<Part>,
    present: State,
    /// Of several tools: what was seen for the one before.
    recorded: Recorded,
}

impl Default for Ahead {
    fn default() -> Self {
        let (patch, part, present, recorded) = Default::default();
        Self { most: Self::NODES, patch, part, present, recorded }
    }
}

impl Ahead {
    /// Nodes around a patch that run ahead, if nothing else is said.
    pub(super) const NODES: usize = 8192;

    /// At most about so many.
    pub(super) fn with(nodes: usize) -> Self {
        Self { most: nodes, ..Self::default() }
    }

    /// As large, before it was made.
    pub(super) fn anew(&self) -> Self {
        Self::with(self.most)
    }

    /// Runs on from the present of `whole` for `ticks` haptic ticks along `motion` (of each tool in each tick, from 0), or for as many more
    /// as make its last step a whole one, shows `watch` the state at the start of every step and at the end, and leaves `whole` as it
    /// was. It ends early with a tick in which `watch` says no. Of a large body only the neighbourhood of `patch` runs ahead (ids in
    /// increasing order).
    pub(super) fn run(
        &mut self,
        whole: &mut Moving,
        patch: &[u32],
        ticks: u32,
        motion: impl Fn(usize, u32) -> ToolMotion,
        mut watch: impl FnMut(Glimpse<'_>) -> bool,
    ) {
        if self.patch != patch {
            patch.clone_into(&mut self.patch);
            let part = Part::new(whole, patch, self.most);
            if self.part.is_some() || part.is_some() {
                self.recorded.forget();
            }
            self.part = part;
        }
        let stride = whole.stride;
        let steps = (0..ticks.div_ceil(stride)).map(|step| step * stride);
        let motion = |tool: usize, tick: u32| ToolMotion {
            from: motion(tool, tick).from,
            to: motion(tool, tick + stride - 1).to,
        };
        let Self { part, present, recorded, .. } = self;
        if let Some(part) = part.as_mut() {
            part.begin(whole);
            part.drift(0);
        }
        let tools = whole.touches.len();
        if tools > 1 {
            let motions = steps.clone().flat_map(|tick| (0..tools).map(move |tool| (tool, tick)));
            let motions = motions.map(|(tool, tick)| motion(tool, tick)).collect();
            let now = part.as_ref().map_or(&whole.state, |part| &part.moving.state);
            if recorded.is_of(&motions, now, whole) {
                let places = part.as_ref().map(|part| &part.places[..]);
                recorded.states().all(|state| watch(Glimpse { state, places }));
                return;
            }
            recorded.begin(motions, whole);
        }
        let mut record = |state: &State| {
            if tools > 1 {
                recorded.push(state);
            }
        };
        let is_through = if let Some(part) = part {
            let is_through = steps.into_iter().all(|tick| {
                part.drift(tick);
                let Part { moving, places, .. } = part;
                advance_while(
                    moving,
                    |tool| motion(tool, tick),
                    |state| {
                        record(state);
                        watch(Glimpse { state, places: Some(places) })
                    },
                )
            });
            if is_through {
                record(&part.moving.state);
                watch(Glimpse { state: &part.moving.state, places: Some(&part.places) });
            }
            is_through
        } else {
            present.clone_from(&whole.state);
            let (touches, means) = (whole.touches.clone(), whole.means.clone());
            let mut shown = |state: &State| {
                record(state);
                watch(Glimpse { state, places: None })
            };
            let mut steps = steps;
            let is_through = steps.all(|tick| advance_while(whole, |tool| motion(tool, tick), &mut shown));
            if is_through {
                shown(&whole.state);
            }
            std::mem::swap(&mut whole.state, present);
            (whole.touches, whole.means) = (touches, means);
            is_through
        };
        if !is_through {
            recorded.forget();
        }
    }
}

/// The state of what runs ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glimpse<'a> {
    state: &'a State,
    /// The place of each node of the body, [`Part::NONE`] for those that are left out; `None` if all are there.
    places: Option<&'a [u32]>,
}

impl Glimpse<'_> {
    /// Position (m) and velocity (m/s) of `node`, if it is there.
    pub(crate) fn node(&self, node: u32) -> Option<(Vec3, Vec3)> {
        let place = match self.places {
            None => node,
            Some(places) => *places.get(node as usize).filter(|&&place| place != Part::NONE)?,
        };
        Some((self.state.positions[place as usize], self.state.velocities[place as usize]))
    }
}

/// The nodes around a patch, as a body of its own.
#[derive(Debug)]
struct Part {
    moving: Moving,
    /// The id of each of its nodes in the whole body, and the other way round.
    nodes: Vec<u32>,
    places: Vec<u32>,
    /// The id of each of its triangles, in increasing order.
    triangles: Vec<u32>,
    /// Its nodes that can move in the whole body and follow nothing here.
    rim: Vec<u32>,
    /// Velocity and acceleration of each of these at the present (m/s, m/s^2).
    drifts: Vec<[Vec3; 2]>,
}

impl Part {
    const NONE: u32 = u32::MAX;

    fn new(whole: &Moving, patch: &[u32], most: usize) -> Option<Self> {
        let around = neighbourhood(whole.body.as_made(), patch, most)?;
        let Cutout { nodes, triangles, body } = whole.body.as_made().cutout(&around)?;
        let mut places = vec![Self::NONE; whole.inverse_masses.len()];
        nodes.iter().zip(0..).for_each(|(&node, place)| places[node as usize] = place);
        let gives_way = |&place: &u32| whole.inverse_masses[nodes[place as usize] as usize] > 0.0;
        let inverse_masses = body.inverse_masses().to_vec();
        let is_held = |&place: &u32| inverse_masses[place as usize] == 0.0;
        let rim = (0..nodes.len() as u32).filter(gives_way).filter(is_held).collect();
        let place = |node: u32| Some(places[node as usize]).filter(|&place| place != Self::NONE);
        // Where a smoothed corner is not all there, nothing is met.
        let candidates = (0..).zip(&body.surface().triangles).filter(|(_, corners)| {
            let made_of = |touch: &Touch| {
                corners.iter().all(|&corner| {
                    let shares = touch.skin.corner(nodes[corner as usize]);
                    shares.iter().all(|&(node, _)| place(node).is_some())
                })
            };
            whole.touches.iter().all(made_of)
        });
        let candidates: Vec<u32> = candidates.map(|(triangle, _)| triangle).collect();
        let touch = |touch: &Touch| {
            let mut skin = Skin::default();
            touch.skin.localise(&nodes, place, &mut skin);
            Touch::new(touch.shape, Arc::new(skin), Contact::default())
        };
        let mut moving = Moving {
            state: State::at_rest(body.rest()),
            forces: vec![Vec3::zeros(); nodes.len()],
            touches: whole.touches.iter().map(touch).collect(),
            rows: Rows::default(),
            law: whole.law,
            stepping: whole.stepping,
            stride: whole.stride,
            candidates,
            means: whole.means.clone(),
            inverse_masses,
            body: Stiffened::new(body),
        };
        moving.make_room();
        Some(Self { moving, nodes, places, triangles, rim, drifts: Vec::new() })
    }

    /// Takes the state of `whole`.
    fn begin(&mut self, whole: &Moving) {
        let Self { moving, nodes, triangles, rim, drifts, .. } = self;
        // What may change while a session runs.
        moving.law = whole.law;
        moving.put_stiffness(whole.body.stiffness());
        drifts.clear();
        drifts.extend(rim.iter().map(|&place| {
            let node = nodes[place as usize] as usize;
            [whole.state.velocities[node], whole.forces[node] * whole.inverse_masses[node]]
        }));
        for (place, &node) in nodes.iter().enumerate() {
            moving.state.positions[place] = whole.state.positions[node as usize];
            moving.state.velocities[place] = whole.state.velocities[node as usize];
        }
        let local = |triangle: u32| triangles.binary_search(&triangle).ok().map(|place| place as u32);
        let localised = |contact: &Contact| match contact.triangle.map(local) {
            Some(None) => Contact { glued: contact.glued, ..Contact::default() },
            triangle => Contact { triangle: triangle.flatten(), ..*contact },
        };
        for (touch, of_whole) in moving.touches.iter_mut().zip(&whole.touches) {
            touch.restart(of_whole, localised, local);
        }
        moving.means.copy_from_slice(&whole.means);
    }

    /// The rest of the body as it is expected to go on in the step that begins with the `tick`-th tick.
    fn drift(&mut self, tick: u32) {
        let State { velocities, .. } = &mut self.moving.state;
        let t = (f64::from(tick) + 0.5 * f64::from(self.moving.stride)) * self.moving.stepping.tick;
        let [of_velocity, of_change] = [(-t / DECAY).exp(), t * (-t / CHANGE_DECAY).exp()];
        for (&node, [velocity, acceleration]) in self.rim.iter().zip(&self.drifts) {
            velocities[node as usize] = velocity * of_velocity + acceleration * of_change;
        }
    }
}

/// A whole step that is shown to `watch`; false if that says no.
fn advance_while(
    moving: &mut Moving,
    motion: impl Fn(usize) -> ToolMotion,
    mut watch: impl FnMut(&State) -> bool,
) -> bool {
    let mut goes_on = true;
    moving.advance(moving.stride, motion, &mut |state| goes_on = goes_on && watch(state));
    goes_on
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, Body, Region, Shape, State};
    use crate::contact::Law;
    use crate::mesh::Face;
    use crate::simulation::{Simulation, Stepping};

    /// A block of so many nodes along each edge, 9 mm apart, with a stiff nodule; and a patch in the middle of its top.
    fn simulation(nodes: usize) -> (Simulation, Vec<u32>) {
        let size = 9e-3 * (nodes - 1) as f64;
        let middle = [0.5 * size, 0.5 * size, size - 0.03];
        let nodule = Region::new(Shape::Sphere { centre: middle, radius: 0.02 }).stiffness(90.0);
        let block = Block::builder([nodes; 3], [size; 3]).region(nodule).fix(Face::ZMin).build().unwrap();
        let nearest = crate::mesh::NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let mut patch = Vec::new();
        block.patch(&[nearest.find(&Vec3::new(0.5 * size, 0.5 * size, size))], [6, 6, 3], &mut patch);
        let (state, stepping) = (State::at_rest(block.rest()), Stepping { tick: 1e-3, substeps: 4 });
        let simulation = Simulation::new(Box::new(block), state, Contact::default(), Law::default(), stepping).unwrap();
        (simulation.looking_ahead_with(4096), patch)
    }

    /// The tool presses into the middle of the top.
    fn motion(simulation: &Simulation, tick: u32) -> ToolMotion {
        let top = simulation.body().rest().iter().fold(Vec3::zeros(), |top, x| top.sup(x));
        let at = |tick: u32| Vec3::new(0.51 * top.x, 0.49 * top.y, top.z + 1e-3 - 1e-4 * f64::from(tick));
        ToolMotion { from: at(tick).into(), to: at(tick + 1).into() }
    }

    /// Positions of `patch` in each substep ahead.
    fn seen(simulation: &mut Simulation, patch: &[u32], from: u32) -> Vec<Vec3> {
        let motions: Vec<ToolMotion> = (0..60).map(|tick| motion(simulation, from + tick)).collect();
        let mut seen = Vec::new();
        simulation.look_ahead(
            patch,
            60,
            |_, tick| motions[tick as usize],
            |ahead| {
                seen.extend(patch.iter().map(|&node| ahead.node(node).unwrap().0));
                true
            },
        );
        seen
    }

    #[test]
    fn what_is_around_a_patch_runs_ahead_as_the_whole_body_does_and_the_present_stays() {
        let (mut simulation, patch) = simulation(26);
        for tick in 0..60 {
            let motion = motion(&simulation, tick);
            simulation.tick(motion);
        }
        let (present, contact) = (simulation.state().clone(), *simulation.contact(0));
        let part = seen(&mut simulation, &patch, 60);
        assert!(simulation.ahead.part.as_ref().unwrap().nodes.len() < 6000);
        assert_eq!((simulation.state(), simulation.contact(0)), (&present, &contact));
        // Of the whole body, as it really goes on.
        let mut whole = Vec::new();
        for tick in 60..120 {
            let motion = motion(&simulation, tick);
            simulation.moving.advance(1, |_| motion, &mut |state| {
                whole.extend(patch.iter().map(|&node| state.positions[node as usize]))
            });
        }
        let moved = |from: &[Vec3], to: &[Vec3]| from.iter().zip(to).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let (first, last) = (&whole[..patch.len()], &whole[whole.len() - patch.len()..]);
        assert!(moved(first, last) > 4e-3, "{}", moved(first, last));
        let wrong = moved(&part[..whole.len()], &whole);
        assert!(wrong < 0.02 * moved(first, last), "{wrong} of {}", moved(first, last));
    }

    /// Check that nothing else is shown than what would be seen anew, of the whole body and of a part.
    #[test]
    fn what_ran_ahead_for_one_tool_is_shown_to_the_others_while_nothing_has_changed() {
        for most in [Ahead::NODES, 400] {
            let with = |ticks: u32, friction: f64| {
                let (simulation, patch) = simulation(12);
                let mut simulation = simulation.with_tool(Contact::default()).looking_ahead_with(most);
                simulation.set_friction(friction.into());
                for tick in 0..ticks {
                    let motion = motion(&simulation, tick);
                    simulation.tick_all(&[motion; 2]);
                }
                (simulation, patch)
            };
            let (mut simulation, patch) = with(30, 0.5);
            let anew = |ticks, friction, from| seen(&mut with(ticks, friction).0, &patch, from);
            let first = seen(&mut simulation, &patch, 30);
            assert_eq!(simulation.ahead.part.is_some(), most == 400);
            let runs = simulation.ahead.recorded.begun;
            assert!(seen(&mut simulation, &patch, 30) == first && simulation.ahead.recorded.begun == runs);
            // Around another patch another part runs ahead, but the whole body is the same.
            seen(&mut simulation, &patch[1..], 30);
            assert_eq!(simulation.ahead.recorded.begun == runs, most == Ahead::NODES);
            seen(&mut simulation, &patch, 30);
            let runs = simulation.ahead.recorded.begun;
            assert!(
                seen(&mut simulation, &patch, 31) == anew(30, 0.5, 31) && simulation.ahead.recorded.begun == runs + 1
            );
            simulation.set_friction(0.1.into());
            seen(&mut simulation, &patch, 31);
            assert_eq!(simulation.ahead.recorded.begun, runs + 2);
            simulation.set_friction(0.5.into());
            let motion = motion(&simulation, 30);
            simulation.tick_all(&[motion; 2]);
            assert!(seen(&mut simulation, &patch, 31) == anew(31, 0.5, 31));
            // One that is cut off is no record.
            let mut shown = 0;
            let expected = |_, tick| self::motion(&with(0, 0.5).0, 32 + tick);
            for _ in 0..2 {
                simulation.look_ahead(&patch, 5, expected, |_| {
                    shown += 1;
                    shown != 3
                });
            }
            assert_eq!(shown, 3 + 5 * 4 + 1);
        }
    }

    #[test]
    fn a_part_that_is_not_disturbed_from_outside_is_the_whole_body_bit_for_bit() {
        // At rest in all but what is near: a wave that sets out comes to the rim later.
        let (mut simulation, patch) = simulation(26);
        let near = patch[patch.len() / 2] as usize;
        simulation.state_mut().velocities[near].z = -0.05;
        let seen_ticks = 1;
        let mut part = Vec::new();
        let rest = motion(&simulation, 0).from;
        let still = ToolMotion { from: rest, to: rest };
        simulation.look_ahead(
            &patch,
            seen_ticks,
            |_, _| still,
            |ahead| {
                part.extend(patch.iter().map(|&node| ahead.node(node).unwrap().0));
                true
            },
        );
        simulation.moving.advance(1, |_| still, &mut |_| ());
        let whole = patch.iter().map(|&node| simulation.state().positions[node as usize]);
        assert!(part[part.len() - patch.len()..].iter().copied().eq(whole));
    }

    #[test]
    fn a_body_that_is_not_larger_runs_ahead_whole() {
        let (mut simulation, patch) = simulation(12);
        seen(&mut simulation, &patch, 0);
        assert!(simulation.ahead.part.is_none() && !simulation.ahead.present.positions.is_empty());
    }
}
