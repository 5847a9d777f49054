//! `full`: the whole body at the haptic rate, the reference that the others are measured against.

use super::{Kind, LocalModel, ResyncView};
use crate::contact::{Contact, ContactPoint, ToolMotion};
use crate::simulation::Simulation;
use crate::{Vec3, Wrench};

/// The global model itself, run at the haptic rate. There is nothing to resync with.
///
/// # Real-time
/// Bounded and real-time safe if the body's forces are.
#[derive(Debug)]
pub struct Full {
    simulation: Simulation,
    watched: Vec<u32>,
}

impl Full {
    /// The model that runs `simulation`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(simulation: Simulation) -> Self {
        Self { simulation, watched: Vec::new() }
    }

    /// The simulation that it runs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }
}

impl LocalModel for Full {
    fn rebuild(&mut self, _: ResyncView<'_>) {}

    fn tick(&mut self, tool: ToolMotion) -> Wrench {
        let wrench = self.simulation.tick(tool);
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if self.simulation.state().is_finite() { wrench } else { Vec3::repeat(f64::NAN).into() }
    }

    fn built_at(&self) -> u64 {
        0
    }

    fn serves_as(&self) -> Kind {
        Kind::Full
    }

    fn catches_up(&self) -> bool {
        false
    }

    fn contact(&self) -> Contact {
        *self.simulation.contact(0)
    }

    fn contact_points(&self) -> &[ContactPoint] {
        self.simulation.contact_points(0)
    }

    fn contact_area(&self) -> f64 {
        self.simulation.contact_area(0)
    }

    fn position(&self, node: u32) -> Option<Vec3> {
        self.simulation.state().positions.get(node as usize).copied()
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.position(*self.watched.get(probe)?)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched = nodes.to_vec();
    }
}
