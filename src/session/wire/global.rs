//! Makes the global actor: once at the start, and again after a fault, from its last good state.

use crate::actors::{
    Checkpoint, GlobalActor, GlobalPlan, GlobalPorts, GlobalSharedPorts, SurfaceView, SurroundingsPorts, ToolPorts,
    ToolTick, Tunable, Wishes,
};
use crate::error::{Error, ErrorKind};
use crate::model::Pose;
use crate::model::local::{LocalModels, PatchGeometry};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::{
    Actor, ExchangePort, OutletPort, OutletReader, QueuePort, RateGroup, RecorderPort, Restart, RuntimeBuilder,
    Stopwatch,
};

/// Between the local actor of a tool and the global one.
pub(super) struct ToolLink {
    pub(super) ticks: QueuePort<ToolTick>,
    pub(super) geometry: Option<ExchangePort<PatchGeometry>>,
}

impl ToolLink {
    fn take(&self) -> ToolPorts {
        ToolPorts { ticks: self.ticks.reader(), geometry: self.geometry.as_ref().map(ExchangePort::reader) }
    }
}

/// The ports whose global halves a new actor takes again.
pub(super) struct GlobalSide {
    pub(super) tools: Vec<ToolLink>,
    pub(super) models: ExchangePort<LocalModels>,
    pub(super) settings: Tunable,
    pub(super) surroundings: Option<(ExchangePort<Wishes>, ExchangePort<Bases>)>,
    pub(super) surfaces: Vec<OutletPort<SurfaceView>>,
    pub(super) checkpoint: OutletPort<Checkpoint>,
    pub(super) recorder: RecorderPort,
}

impl GlobalSide {
    fn take(&self) -> GlobalPorts {
        let surroundings = self
            .surroundings
            .as_ref()
            .map(|(wishes, bases)| SurroundingsPorts { wishes: wishes.writer(), bases: bases.reader() });
        let shared = GlobalSharedPorts {
            models: self.models.writer(),
            settings: self.settings.reader(),
            surroundings,
            surfaces: self.surfaces.iter().map(OutletPort::writer).collect(),
            checkpoint: self.checkpoint.writer(),
            recorder: self.recorder.recorder(),
            build_cost: None,
        };
        GlobalPorts { tools: self.tools.iter().map(ToolLink::take).collect(), shared }
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
    /// With the tools at `tools`.
    pub(super) fn new(simulation: Simulation, tools: &[Pose], plan: GlobalPlan, side: GlobalSide) -> Self {
        let spare = simulation.duplicate();
        let tools = tools.iter().map(|&pose| ToolTick { pose, ..ToolTick::default() }).collect();
        let mut last = Checkpoint { tools, ..Checkpoint::default() };
        simulation.save(&mut last.simulation);
        let saved = side.checkpoint.reader();
        Self { first: Some(simulation), spare, last, saved, plan, side, build_cost: None }
    }

    /// Measures what building a local model costs.
    pub(super) fn measured_by(mut self, build_cost: Option<Stopwatch>) -> Self {
        self.build_cost = build_cost;
        self
    }

    /// Gives the actor to `graph` in a group of its own, which is started again after a fault if the body can be copied.
    ///
    /// # Errors
    /// If the body has no surface.
    pub(super) fn join(mut self, graph: &mut RuntimeBuilder, group: RateGroup) -> Result<(), Error> {
        if self.spare.is_some() {
            graph.restartable(group, Restart::default(), move || Ok(self.make()?));
        } else {
            let actors = self.make()?;
            graph.group(group, actors);
        }
        Ok(())
    }

    /// The actor, connected; the one before is cut off.
    ///
    /// # Errors
    /// If the body has no surface, or was said to be copied and cannot be.
    fn make(&mut self) -> Result<Vec<Box<dyn Actor>>, Error> {
        // First: taking the ports again cuts off the checkpoint too.
        if self.saved.refresh() {
            self.last.clone_from(self.saved.get());
        }
        let mut ports = self.side.take();
        ports.shared.build_cost = self.build_cost.take();
        let (first, tools, can) = (self.first.take(), &self.last.tools, self.spare.is_some());
        let actor = |simulation| -> Result<_, Error> {
            Ok(GlobalActor::new(simulation, tools, self.plan.clone(), ports)?.replaceable(can))
        };
        Ok(vec![Box::new(match first {
            Some(first) => actor(first)?,
            None => actor(self.restored()?)?.going_on(),
        })])
    }

    fn restored(&self) -> Result<Simulation, Error> {
        let copy = self.spare.as_ref().and_then(Simulation::duplicate);
        let mut simulation = copy.ok_or_else(|| Error::new(ErrorKind::Fault, "the body cannot be copied"))?;
        simulation.restore(&self.last.simulation);
        Ok(simulation)
    }
}
