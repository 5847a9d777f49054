//! `full` beside a global model: the whole body goes on by itself at the haptic rate.

use super::{Kind, LocalModel, ResyncView};
use crate::contact::{Contact, ContactPoint, ToolMotion};
use crate::simulation::Simulation;
use crate::{Vec3, Wrench};

/// The whole body with all tools, as it was in the global model when it was built, and by itself from there on.
///
/// It follows the tools as the global model does, a tick at a time, so it needs no resync and is never old; it is built anew only where
/// something else than the tools changes.
#[derive(Debug, Default)]
pub(super) struct Whole {
    /// `None` before it is built, and for a body that cannot be copied.
    simulation: Option<Simulation>,
    /// The tool that it is built around.
    own: usize,
    /// The tick of its state.
    now: u64,
    /// A state that is not finite touches nothing: its zero force would look like a free tool.
    is_finite: bool,
    /// Nodes that are watched.
    watched: Vec<u32>,
}

/// A tick of it is a long one.
const CATCH_UP_TICKS: u64 = 3;

impl LocalModel for Whole {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        (self.simulation, self.own, self.now) = (resync.global.duplicate(), resync.index, resync.tick);
        self.is_finite = self.simulation.is_some();
    }

    fn tick(&mut self, tools: &[ToolMotion]) -> Wrench {
        self.now += 1;
        if let Some(simulation) = &mut self.simulation {
            simulation.tick_all(tools);
            self.is_finite = simulation.state().is_finite();
        }
        self.wrench(self.own).unwrap_or_default()
    }

    fn built_at(&self) -> u64 {
        self.now
    }

    fn kind(&self) -> Kind {
        Kind::Full
    }

    fn wrench(&self, tool: usize) -> Option<Wrench> {
        let simulation = self.simulation.as_ref().filter(|_| self.is_finite);
        Some(simulation.map_or(Vec3::repeat(f64::NAN).into(), |simulation| simulation.wrench(tool)))
    }

    fn serves_as(&self, _: usize) -> Kind {
        Kind::Full
    }

    fn catch_up_ticks(&self) -> u64 {
        CATCH_UP_TICKS
    }

    fn contact(&self, tool: usize) -> Contact {
        self.simulation.as_ref().map_or(Contact::default(), |simulation| *simulation.contact(tool))
    }

    fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.simulation.as_ref().map_or(&[], |simulation| simulation.contact_points(tool))
    }

    fn contact_area(&self, tool: usize) -> f64 {
        self.simulation.as_ref().map_or(0.0, |simulation| simulation.contact_area(tool))
    }

    fn position(&self, node: u32) -> Option<Vec3> {
        self.simulation.as_ref()?.state().positions.get(node as usize).copied()
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.position(*self.watched.get(probe)?)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched = nodes.to_vec();
    }
}
