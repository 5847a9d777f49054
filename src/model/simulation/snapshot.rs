//! Where a simulation is, for another one to go on from.

use super::Simulation;
use crate::body::{State, Stiffness};
use crate::contact::{Law, Touch};
use crate::{Vec3, Wrench};

/// A simulation at one moment: another one of the same body, with the same tools, goes on from it bit for bit.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    state: State,
    forces: Vec<Vec3>,
    law: Law,
    /// Now, and where it goes.
    stiffness: [Stiffness; 2],
    /// Of each tool, without its shape.
    touches: Vec<Touch>,
    means: Vec<Wrench>,
}

impl Simulation {
    /// Writes where it is `to` a snapshot.
    ///
    /// # Real-time
    /// Bounded; allocates until the snapshot has once held as many places that are touched.
    pub fn save(&self, to: &mut Snapshot) {
        let moving = &self.moving;
        to.state.clone_from(&moving.state);
        to.forces.clone_from(&moving.forces);
        to.law = moving.law;
        to.stiffness = [moving.body.stiffness(), self.stiffness];
        to.touches.resize_with(moving.touches.len(), Touch::default);
        to.touches.iter_mut().zip(&moving.touches).for_each(|(to, touch)| to.remember(touch));
        to.means.clone_from(&moving.means);
    }

    /// Goes on from a snapshot of a simulation of the same body, with as many tools.
    ///
    /// # Real-time
    /// Bounded; allocates if more was touched than here so far.
    pub fn restore(&mut self, from: &Snapshot) {
        let moving = &mut self.moving;
        moving.state.clone_from(&from.state);
        moving.forces.clone_from(&from.forces);
        moving.law = from.law;
        moving.touches.iter_mut().zip(&from.touches).for_each(|(touch, from)| touch.remember(from));
        moving.means.clone_from(&from.means);
        let [now, aim] = from.stiffness;
        self.stiffness = aim;
        self.moving.put_stiffness(now);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Stepping;
    use super::*;
    use crate::body::{Block, Body};
    use crate::contact::{Contact, Friction, ToolMotion, ToolShape};
    use crate::mesh::Face;

    /// A sphere on elements so fine that it meets their corners, which stick and slip, while the body becomes stiffer.
    #[test]
    fn another_one_goes_on_bit_for_bit() {
        let builder = Block::builder([13, 13, 4], [0.024, 0.024, 0.006]).stiffness(50.0).node_mass(1e-4);
        let mut block = builder.damping_ratio(0.5).fix(Face::ZMin).build().unwrap();
        let stepping = Stepping { tick: 1e-3, substeps: 2 * Stepping::stable_substeps(&mut block, 1e-3) };
        let friction = Friction { kinetic: 0.4, breakaway: 0.7, stribeck: 0.0 };
        let law = Law { friction, ..Law::default() };
        let state = State::at_rest(block.rest());
        let simulation = Simulation::new(Box::new(block), state, Contact::default(), law, stepping).unwrap();
        let mut first = simulation.with_shape(0, ToolShape::Sphere { radius: 8e-3 });
        let fresh = first.duplicate().unwrap();
        let at = |k: i32| {
            let (down, along) = (1.5e-3 * (f64::from(k) / 100.0).min(1.0), 2e-5 * f64::from((k - 150).max(0)));
            Vec3::new(0.011 + along, 0.0123, 0.014 - down)
        };
        let mut snapshot = Snapshot::default();
        for k in 0..200 {
            if k == 180 {
                first.approach_stiffness(Stiffness::times(2.0).unwrap());
            }
            first.tick(ToolMotion::straight(at(k), at(k + 1)));
        }
        assert!(first.contact_points(0).len() > 4, "elements are fine");
        first.save(&mut snapshot);
        let mut second = fresh;
        second.restore(&snapshot);
        assert_eq!(second.wrench(0), first.wrench(0));
        for k in 200..300 {
            let motion = ToolMotion::straight(at(k), at(k + 1));
            assert_eq!(second.tick(motion), first.tick(motion), "after {k} ms");
        }
    }
}
