//! The global actor: advances the whole body along the tool's path and publishes the next local model.

use super::cause::Cause;
use super::messages::{Checkpoint, SurfaceView, ToolTick};
use crate::error::Error;
use crate::log::GlobalTick;
use crate::model::contact::ToolMotion;
use crate::model::geometry::NearestTriangle;
use crate::model::local::{LocalModel, PatchGeometry, ResyncView};
use crate::model::simulation::Simulation;
use crate::runtime::{Actor, Outcome, OutletWriter, QueueReader, Reader, Recorder, Stopwatch, TickContext, Writer};
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
    /// What building the next local model costs, if that is measured.
    pub build_cost: Option<Stopwatch>,
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
}

impl GlobalActor {
    /// A global model that starts with `simulation` and the tool at `tool`, also in the midst of a run; haptic ticks come
    /// at rate `haptic`.
    ///
    /// # Errors
    /// If the body's surface has no triangles.
    pub fn new(simulation: Simulation, tool: ToolTick, haptic: Rate, ports: GlobalPorts) -> Result<Self, Error> {
        let nearest = NearestTriangle::new(simulation.body().surface(), &simulation.state().positions)?;
        Ok(Self { simulation, nearest, ports, haptic, tool })
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
                self.simulation.tick(path.part(share(i), share(i + 1)));
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

    /// Builds the next local model around the contact, or around the surface nearest to the tool.
    fn publish_model(&mut self, ctx: &TickContext) -> u64 {
        let triangle = self.simulation.contact().triangle;
        let triangle =
            triangle.unwrap_or_else(|| self.nearest.find(&self.simulation.state().positions, &self.tool.position));
        let resync = ResyncView { global: &self.simulation, tick: self.tool.tick, triangle };
        let model = self.ports.models.buffer();
        Stopwatch::around(self.ports.build_cost.as_mut(), || model.rebuild(resync));
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
