//! The global actor: advances the whole body along the tool's path and publishes the next local model.

use super::cause::Cause;
use super::messages::{Checkpoint, SurfaceView, ToolTick};
use crate::error::Error;
use crate::log::GlobalTick;
use crate::model::contact::ToolMotion;
use crate::model::forecast::ToolHistory;
use crate::model::geometry::NearestTriangle;
use crate::model::local::{LocalModel, PatchGeometry, ResyncView};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::{Actor, Outcome, OutletWriter, QueueReader, Reader, Recorder, TickContext, Writer};
use crate::time::{Nanos, Rate};

/// The ports of a [`GlobalActor`].
#[derive(Debug)]
pub struct GlobalPorts {
    /// The tool at every haptic tick.
    pub ticks: QueueReader<ToolTick>,
    /// The patch's geometry at the tick of the resync, if it is fed back.
    pub geometry: Option<Reader<PatchGeometry>>,
    /// The next local model.
    pub models: Writer<Box<dyn LocalModel>>,
    /// The newest surface for a program that draws.
    pub surface: OutletWriter<SurfaceView>,
    /// The newest good state, for a restart.
    pub checkpoint: OutletWriter<Checkpoint>,
    /// Records.
    pub recorder: Recorder,
}

/// Runs the slow, detailed simulation.
///
/// # Real-time
/// Allocates in its first releases and where the patch changes its size. Its work grows with the tool samples that
/// wait.
#[derive(Debug)]
pub struct GlobalActor {
    simulation: Simulation,
    nearest: NearestTriangle,
    ports: GlobalPorts,
    haptic: Rate,
    /// The tool at the last tick taken: the state's own time.
    tool: ToolTick,
    history: ToolHistory,
    /// Triangles that the next model's window has to hold.
    triangles: Vec<u32>,
    horizon: u32,
    bases: Bases,
    springs: Option<std::sync::Arc<crate::model::surroundings::SpringGraph>>,
    size: [usize; 3],
}

/// The window holds what the tool is expected over for this long: two periods of 30 Hz and the time to catch up (s).
const WINDOW_LEAD_S: f64 = 75e-3;
/// Places on that way that are looked at.
const LOOKS: u32 = 3;

impl GlobalActor {
    /// A global model that starts with `simulation` and the tool at `tool`, also in the midst of a run; haptic ticks come
    /// at rate `haptic`.
    ///
    /// # Errors
    /// If the body's surface has no triangles.
    pub fn new(simulation: Simulation, tool: ToolTick, haptic: Rate, horizon: u32, springs: Option<std::sync::Arc<crate::model::surroundings::SpringGraph>>, size: [usize; 3], ports: GlobalPorts) -> Result<Self, Error> {
        let nearest = NearestTriangle::new(simulation.body().surface(), &simulation.state().positions)?;
        let history = ToolHistory::new(tool.position, haptic.period_s());
        Ok(Self { simulation, nearest, ports, haptic, tool, history, triangles: Vec::new(), horizon, bases: Bases::default(), springs, size })
    }

    /// Advances along every tool sample up to `until`; returns whether all of them were there.
    fn follow_tool(&mut self, ctx: &TickContext, until: Nanos) -> bool {
        let mut complete = true;
        while let Some(next) = self.ports.ticks.peek(ctx).filter(|next| self.haptic.release(next.tick) <= until) {
            self.ports.ticks.pop(ctx);
            let gap = next.tick.saturating_sub(self.tool.tick);
            complete &= gap <= 1;
            let path = ToolMotion { from: self.tool.position, to: next.position };
            for i in 0..gap {
                let share = |i: u64| i as f64 / gap as f64;
                let part = path.part(share(i), share(i + 1));
                self.simulation.tick(part);
                self.history.push(part.to);
            }
            self.tool = next;
        }
        complete
    }

    /// Takes the patch's geometry in place of the global model's own, if it belongs to the same tick.
    fn take_feedback(&mut self, ctx: &TickContext) {
        if let Some(reader) = &mut self.ports.geometry {
            reader.refresh(ctx);
            let geometry = reader.get();
            if geometry.tick == self.tool.tick && geometry.is_usable() {
                geometry.write_to(&mut self.simulation);
            }
        }
    }

    /// Builds the next local model around the contact, or around the surface nearest to the tool, and where it is going.
    fn publish_model(&mut self, ctx: &TickContext) -> u64 {
        let tool = self.history.forecast();
        self.nearest.refit(&self.simulation.state().positions);
        let present = self.simulation.contact().triangle.unwrap_or_else(|| self.nearest.find(&tool.position));
        self.triangles.clear();
        self.triangles.push(present);
        for part in 1..=LOOKS {
            let ahead = WINDOW_LEAD_S * f64::from(part) / f64::from(LOOKS);
            self.triangles.push(self.nearest.find(&tool.unbraked(ahead)));
        }
        if let Some(springs) = &self.springs {
            let mut patch = Vec::new();
            self.simulation.body().patch(&self.triangles, self.size, &mut patch);
            if self.bases.get(&patch).is_none()
                && let Ok(Some(basis)) = crate::model::surroundings::Basis::compute(springs, &patch, 50)
            {
                self.bases.insert(std::sync::Arc::new(basis));
            }
        }
        let resync = ResyncView {
            global: &mut self.simulation,
            tick: self.tool.tick,
            triangles: &self.triangles,
            tool,
            horizon: self.horizon,
            bases: &self.bases,
        };
        self.ports.models.buffer().rebuild(resync);
        self.ports.models.publish(ctx)
    }

    fn publish_checkpoint(&mut self, ctx: &TickContext) {
        let checkpoint = self.ports.checkpoint.buffer();
        checkpoint.tool = self.tool;
        checkpoint.state.clone_from(self.simulation.state());
        checkpoint.contact = *self.simulation.contact();
        self.ports.checkpoint.publish(ctx);
    }

    fn publish_surface(&mut self, ctx: &TickContext) {
        let view = self.ports.surface.buffer();
        view.time = self.haptic.release(self.tool.tick);
        view.positions.clone_from(&self.simulation.state().positions);
        self.ports.surface.publish(ctx);
    }
}

impl Actor for GlobalActor {
    fn name(&self) -> &str {
        "global"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), Error> {
        self.publish_model(ctx);
        self.publish_surface(ctx);
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let before = self.tool.tick;
        let complete = self.follow_tool(ctx, ctx.scheduled);
        if self.tool.tick == before {
            // Release 0, or a local model that stands still: there is nothing new to say.
            return Outcome::Continue;
        }
        self.take_feedback(ctx);
        if !self.simulation.state().is_finite() {
            return Outcome::Degraded(Cause::GlobalNotFinite.code());
        }
        let version = self.publish_model(ctx);
        self.publish_surface(ctx);
        self.publish_checkpoint(ctx);
        self.ports.recorder.push(GlobalTick {
            time: ctx.scheduled,
            version: version as u32,
            first_tick: before + 1,
            last_tick: self.tool.tick,
        });
        if complete { Outcome::Continue } else { Outcome::Degraded(Cause::SamplesLost.code()) }
    }
}
