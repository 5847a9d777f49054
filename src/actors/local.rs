//! The local actor: turns the newest tool sample into a force at the haptic rate, by models that a global one sends.

use super::cause::Cause;
use super::messages::ToolTick;
use super::ticks::{self, ResyncTicks};
use super::tool::{LocalTool, Serving};
use crate::model::local::{LocalModel, PatchGeometry, Succession};
use crate::runtime::{Actor, GroupMode, Outcome, QueueWriter, Rate, Reader, TickContext, Writer};

/// The ports of a [`LocalActor`], besides those of its tool.
#[derive(Debug)]
pub struct LocalPorts {
    /// Newer models arrive here.
    pub models: Reader<Box<dyn LocalModel>>,
    /// The tool at every haptic tick goes there.
    pub ticks: QueueWriter<ToolTick>,
    /// The patch's geometry at the tick of each resync, if it is fed back.
    pub geometry: Option<Writer<PatchGeometry>>,
}

/// Runs the fast, small simulation of one tool.
///
/// # Real-time
/// Bounded, by eight haptic ticks a release, and real-time safe if its models are.
#[derive(Debug)]
pub struct LocalActor {
    models: Succession,
    tool: LocalTool,
    ports: LocalPorts,
    resyncs: ResyncTicks,
    begun: bool,
}

impl LocalActor {
    /// An actor for `tool` over `models`; `haptic` and `global` are the rates of the two groups.
    pub fn new(models: Succession, tool: LocalTool, [haptic, global]: [Rate; 2], ports: LocalPorts) -> Self {
        Self { models, tool, ports, resyncs: ResyncTicks::new(haptic, global), begun: false }
    }

    /// Release 0: the first sample and the first model, no force.
    fn begin(&mut self, ctx: &TickContext) {
        self.begun = true;
        self.ports.models.refresh(ctx);
        let version = self.ports.models.version() as u32;
        self.models.begin(self.tool.begin(), self.ports.models.get_mut(), version);
        self.publish_state(ctx);
    }

    /// Advances the model to this release, or as far towards it as one release may.
    fn advance(&mut self, ctx: &TickContext) {
        for left in ticks::due(ctx, self.models.now()) {
            let way = self.tool.go(left, ctx.dt_nominal);
            let served = self.models.tick(way.to);
            self.tool.feel(served, &way, &self.models.serving().contact());
            self.publish_state(ctx);
        }
    }

    /// Tells the global model where the tool and the patch are.
    fn publish_state(&mut self, ctx: &TickContext) {
        let (tick, pose) = (self.models.now(), self.tool.pose());
        if self.resyncs.has(tick)
            && let Some(geometry) = &mut self.ports.geometry
        {
            let buffer = geometry.buffer();
            buffer.tick = tick;
            if self.models.serving().geometry(buffer) {
                geometry.publish(ctx);
            }
        }
        // A full queue is counted; the global model sees the gap and interpolates over it.
        self.ports.ticks.push(ctx, ToolTick { tick, pose });
    }

    /// Commands and records the force; false if it is not finite.
    fn finish(&mut self, ctx: &TickContext) -> bool {
        let (model, tick) = (self.models.serving(), self.models.now());
        let serving = Serving {
            tick,
            kind: model.serves_as(),
            version: self.models.version(),
            age_ticks: tick.saturating_sub(model.built_at()),
            contact: model.contact(),
            points: model.contact_points(),
            area_m2: model.contact_area(),
        };
        self.tool.finish(ctx, &serving, |place, node| {
            let global = model.global_position(place).unwrap_or_default();
            [model.position(node).unwrap_or(global), global]
        })
    }
}

impl Actor for LocalActor {
    fn name(&self) -> &str {
        "local"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if ctx.mode == GroupMode::Stopping {
            // The device brings itself to rest.
            return Outcome::Continue;
        }
        self.tool.refresh(ctx);
        if !self.begun {
            self.begin(ctx);
            return Outcome::Continue;
        }
        if self.ports.models.refresh(ctx) {
            let version = self.ports.models.version() as u32;
            self.models.offer(self.ports.models.get_mut(), version);
        }
        self.advance(ctx);
        match self.finish(ctx) {
            true => Outcome::Continue,
            // The next resync brings a good model.
            false => Outcome::Degraded(Cause::LocalNotFinite.code()),
        }
    }
}
