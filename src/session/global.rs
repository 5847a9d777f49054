//! Makes the global actor: once at the start, and again after a fault, from its last good state.

use crate::actors::{
    Checkpoint, GlobalActor, GlobalPlan, GlobalPorts, SurfaceView, SurroundingsPorts, ToolTick, Wishes,
};
use crate::error::{Error, ErrorKind};
use crate::model::local::{LocalModel, PatchGeometry};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::{Actor, ExchangePort, OutletPort, OutletReader, QueuePort, RecorderPort, Stopwatch};

/// The ports whose global halves a new actor takes again.
pub(super) struct GlobalSide {
    pub(super) ticks: QueuePort<ToolTick>,
    pub(super) geometry: Option<ExchangePort<PatchGeometry>>,
    pub(super) models: ExchangePort<Box<dyn LocalModel>>,
    pub(super) surroundings: Option<(ExchangePort<Wishes>, ExchangePort<Bases>)>,
    pub(super) surface: OutletPort<SurfaceView>,
    pub(super) checkpoint: OutletPort<Checkpoint>,
    pub(super) recorder: RecorderPort,
}

impl GlobalSide {
    fn take(&self) -> GlobalPorts {
        GlobalPorts {
            ticks: self.ticks.reader(),
            geometry: self.geometry.as_ref().map(ExchangePort::reader),
            models: self.models.writer(),
            surroundings: self
                .surroundings
                .as_ref()
                .map(|(wishes, bases)| SurroundingsPorts { wishes: wishes.writer(), bases: bases.reader() }),
            surface: self.surface.writer(),
            checkpoint: self.checkpoint.writer(),
            recorder: self.recorder.recorder(),
            build_cost: None,
        }
    }
}

/// What a global actor is made of.
pub(super) struct GlobalMaker {
    /// For the first actor.
    first: Option<Simulation>,
    /// For all others; `None` if the body cannot be copied.
    spare: Option<Simulation>,
    /// The last state that was good; the start if there was none.
    last: Checkpoint,
    saved: OutletReader<Checkpoint>,
    plan: GlobalPlan,
    side: GlobalSide,
    /// For the first actor; one that is started again is not measured.
    build_cost: Option<Stopwatch>,
}

impl GlobalMaker {
    pub(super) fn new(simulation: Simulation, tool: ToolTick, plan: GlobalPlan, side: GlobalSide) -> Self {
        let spare = simulation.duplicate();
        let last = Checkpoint { tool, state: simulation.state().clone(), contact: *simulation.contact() };
        let saved = side.checkpoint.reader();
        Self { first: Some(simulation), spare, last, saved, plan, side, build_cost: None }
    }

    /// Measures what building a local model costs.
    pub(super) fn measured_by(mut self, build_cost: Option<Stopwatch>) -> Self {
        self.build_cost = build_cost;
        self
    }

    pub(super) fn can_restart(&self) -> bool {
        self.spare.is_some()
    }

    /// The actor, connected; the one before is cut off.
    ///
    /// # Errors
    /// If the body has no surface, or was said to be copied and cannot be.
    pub(super) fn make(&mut self) -> Result<Vec<Box<dyn Actor>>, Error> {
        // First: taking the ports again cuts off the checkpoint too.
        if self.saved.refresh() {
            self.last.clone_from(self.saved.get());
        }
        let ports = GlobalPorts { build_cost: self.build_cost.take(), ..self.side.take() };
        let simulation = match self.first.take() {
            Some(first) => first,
            None => self.restored()?,
        };
        Ok(vec![Box::new(GlobalActor::new(simulation, self.last.tool, self.plan.clone(), ports)?)])
    }

    fn restored(&self) -> Result<Simulation, Error> {
        let copy = self.spare.as_ref().and_then(Simulation::duplicate);
        let mut simulation = copy.ok_or_else(|| Error::new(ErrorKind::Fault, "the body cannot be copied"))?;
        let (state, contact) = simulation.state_mut();
        state.clone_from(&self.last.state);
        *contact = self.last.contact;
        Ok(simulation)
    }
}
