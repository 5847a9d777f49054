//! The local actor: turns the newest tool samples into forces at the haptic rate, by models that a global one sends.

use super::cause::Cause;
use super::messages::ToolTick;
use super::ticks::{self, ResyncTicks};
use super::tool::{LocalTool, Serving};
use crate::model::local::{LocalModel, PatchGeometry, Succession, Ways};
use crate::runtime::{Actor, GroupMode, Outcome, QueueWriter, Rate, Reader, TickContext, Writer};

/// The ports of one tool of a [`LocalActor`], besides those that it has by itself.
#[derive(Debug)]
pub struct LocalPorts {
    /// Newer models arrive here.
    pub models: Reader<Box<dyn LocalModel>>,
    /// The tool at every haptic tick goes there.
    pub ticks: QueueWriter<ToolTick>,
    /// The patch's geometry at the tick of each resync, if it is fed back.
    pub geometry: Option<Writer<PatchGeometry>>,
}

/// One tool with the models that serve it.
#[derive(Debug)]
pub struct LocalSide {
    /// The models.
    pub models: Succession,
    /// The tool.
    pub tool: LocalTool,
    /// What they say to the global one.
    pub ports: LocalPorts,
}

impl LocalSide {
    /// Release 0: the first sample and the first model.
    fn begin(&mut self, ctx: &TickContext) {
        self.ports.models.refresh(ctx);
        self.tool.begin();
        let version = self.ports.models.version() as u32;
        self.models.begin(self.ports.models.get_mut(), version);
    }

    /// Takes what has come since the last release.
    fn take_arrivals(&mut self, ctx: &TickContext, ways: &Ways) {
        if self.ports.models.refresh(ctx) {
            let version = self.ports.models.version() as u32;
            self.models.offer(self.ports.models.get_mut(), version, ways);
        }
    }

    /// Tells the global model where the tool is at the end of `tick`, and where the patch is if there is a resync.
    fn publish_state(&mut self, ctx: &TickContext, tick: u64, is_resync: bool) {
        if is_resync && let Some(geometry) = &mut self.ports.geometry {
            let buffer = geometry.buffer();
            buffer.tick = tick;
            if self.models.serving().geometry(buffer) {
                geometry.publish(ctx);
            }
        }
        // A full queue is counted; the global model sees the gap and interpolates over it.
        self.ports.ticks.push(ctx, ToolTick { tick, pose: self.tool.pose() });
    }

    /// Commands and records the force after the last tick; false if it is not finite.
    fn finish(&mut self, ctx: &TickContext, tick: u64) -> bool {
        let model = self.models.serving();
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

/// Runs the fast, small simulations around the tools. Every model knows the way of all tools: where they meet it resolves them together.
///
/// # Real-time
/// Bounded, by eight haptic ticks a release, and real-time safe if its models are.
#[derive(Debug)]
pub struct LocalActor {
    sides: Vec<LocalSide>,
    ways: Ways,
    resyncs: ResyncTicks,
    begun: bool,
}

impl LocalActor {
    /// An actor for the tools of `sides`, in the order of their devices; `haptic` and `global` are the rates of the two groups.
    pub fn new(sides: Vec<LocalSide>, [haptic, global]: [Rate; 2]) -> Self {
        let ways = Ways::new(sides.len());
        Self { sides, ways, resyncs: ResyncTicks::new(haptic, global), begun: false }
    }

    /// Release 0: no force.
    fn begin(&mut self, ctx: &TickContext) {
        self.begun = true;
        self.sides.iter_mut().for_each(|side| side.begin(ctx));
        self.publish_states(ctx);
    }

    /// Advances the models by one tick, the first of those that are `left`.
    fn advance(&mut self, ctx: &TickContext, left: u64) {
        self.ways.go(self.sides.iter_mut().map(|side| side.tool.go(left, ctx.dt_nominal)));
        let mut may_catch_up = true;
        for (side, way) in self.sides.iter_mut().zip(self.ways.of(self.ways.now())) {
            let is_behind = side.models.is_behind(&self.ways);
            let served = side.models.tick(&self.ways, may_catch_up);
            may_catch_up &= !is_behind;
            side.tool.feel(served, way, &side.models.serving().contact());
        }
        self.publish_states(ctx);
    }

    fn publish_states(&mut self, ctx: &TickContext) {
        let tick = self.ways.now();
        let is_resync = self.resyncs.has(tick);
        self.sides.iter_mut().for_each(|side| side.publish_state(ctx, tick, is_resync));
    }
}

impl Actor for LocalActor {
    fn name(&self) -> &str {
        "local"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if ctx.mode == GroupMode::Stopping {
            // The devices bring themselves to rest.
            return Outcome::Continue;
        }
        self.sides.iter_mut().for_each(|side| side.tool.refresh(ctx));
        if !self.begun {
            self.begin(ctx);
            return Outcome::Continue;
        }
        self.sides.iter_mut().for_each(|side| side.take_arrivals(ctx, &self.ways));
        ticks::due(ctx, self.ways.now()).for_each(|left| self.advance(ctx, left));
        let now = self.ways.now();
        let mut is_finite = true;
        for side in &mut self.sides {
            is_finite &= side.finish(ctx, now);
        }
        match is_finite {
            true => Outcome::Continue,
            // The next resync brings a good model.
            false => Outcome::Degraded(Cause::LocalNotFinite.code()),
        }
    }
}
