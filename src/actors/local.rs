//! The local actor: turns the newest tool samples into forces at the haptic rate, by models that a global one sends.

use super::cause::Cause;
use super::messages::ToolTick;
use super::ticks::{self, ResyncTicks};
use super::tool::{LocalTool, Serving};
use crate::model::local::{LocalModel, LocalModels, PatchGeometry, Succession, Ways};
use crate::runtime::{Actor, GroupMode, Outcome, QueueWriter, Rate, Reader, TickContext, Writer};

/// The ports of one tool of a [`LocalActor`], besides those that it has by itself.
#[derive(Debug)]
pub struct LocalPorts {
    /// The tool at every haptic tick goes there.
    pub ticks: QueueWriter<ToolTick>,
    /// The patch's geometry at the tick of each resync, if it is fed back.
    pub geometry: Option<Writer<PatchGeometry>>,
}

/// One tool, and what it says to the global model.
#[derive(Debug)]
pub struct LocalSide {
    /// The tool.
    pub tool: LocalTool,
    /// Where it says it.
    pub ports: LocalPorts,
}

/// The local models of all tools, and where newer ones arrive.
#[derive(Debug)]
pub struct LocalSource {
    /// Those that serve, and their successors.
    pub models: Succession,
    /// Newer ones.
    pub arrivals: Reader<LocalModels>,
}

impl LocalSide {
    /// Tells the global model where the tool is at the end of `tick`, and where the patch of its model is if there is a resync.
    fn publish_state(&mut self, ctx: &TickContext, tick: u64, resync: Option<&dyn LocalModel>) {
        if let Some(model) = resync
            && let Some(geometry) = &mut self.ports.geometry
        {
            let buffer = geometry.buffer();
            buffer.tick = tick;
            if model.geometry(buffer) {
                geometry.publish(ctx);
            }
        }
        // A full queue is counted; the global model sees the gap and interpolates over it.
        self.ports.ticks.push(ctx, ToolTick { tick, pose: self.tool.pose(), is_put: false });
    }

    /// Commands and records the force on the tool, of that `number`, after the last tick; false if it is not finite.
    fn finish(&mut self, ctx: &TickContext, tick: u64, number: usize, models: &Succession) -> bool {
        let model = models.serving().of(number);
        let serving = Serving {
            tick,
            kind: model.serves_as(number),
            version: models.version(),
            age_ticks: ctx.tick.saturating_sub(model.built_at()),
            contact: model.contact(number),
            points: model.contact_points(number),
            area_m2: model.contact_area(number),
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
    source: LocalSource,
    ways: Ways,
    resyncs: ResyncTicks,
    begun: bool,
}

impl LocalActor {
    /// An actor for the tools of `sides`, in the order of their devices, whose models come from `source`; `haptic` and `global` are the
    /// rates of the two groups.
    pub fn new(sides: Vec<LocalSide>, source: LocalSource, [haptic, global]: [Rate; 2]) -> Self {
        let ways = Ways::new(sides.len());
        Self { sides, source, ways, resyncs: ResyncTicks::new(haptic, global), begun: false }
    }

    /// Release 0: the first samples and the first models, no force.
    fn begin(&mut self, ctx: &TickContext) {
        self.begun = true;
        self.sides.iter_mut().for_each(|side| {
            side.tool.begin();
        });
        let LocalSource { models, arrivals } = &mut self.source;
        arrivals.refresh(ctx);
        let version = arrivals.version() as u32;
        models.begin(arrivals.get_mut(), version);
        self.publish_states(ctx);
    }

    /// Takes what has come since the last release.
    fn take_arrivals(&mut self, ctx: &TickContext) {
        let LocalSource { models, arrivals } = &mut self.source;
        if arrivals.refresh(ctx) {
            let version = arrivals.version() as u32;
            models.offer(arrivals.get_mut(), version, &self.ways);
        }
    }

    /// Advances the models by one tick, the first of those that are `left`.
    fn advance(&mut self, ctx: &TickContext, left: u64) {
        self.ways.go(self.sides.iter_mut().map(|side| side.tool.go(left, ctx.dt_nominal)));
        let models = &mut self.source.models;
        models.tick(&self.ways, left == 1);
        for (number, (side, way)) in self.sides.iter_mut().zip(self.ways.of(self.ways.now())).enumerate() {
            side.tool.feel(models.served(number), way, &models.serving().of(number).contact(number));
        }
        self.publish_states(ctx);
    }

    fn publish_states(&mut self, ctx: &TickContext) {
        let tick = self.ways.now();
        let is_resync = self.resyncs.has(tick);
        let models = self.source.models.serving();
        for (number, side) in self.sides.iter_mut().enumerate() {
            side.publish_state(ctx, tick, is_resync.then(|| models.of(number)));
        }
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
        self.take_arrivals(ctx);
        ticks::due(ctx, self.ways.now()).for_each(|left| self.advance(ctx, left));
        let now = self.ways.now();
        let mut is_finite = true;
        for (number, side) in self.sides.iter_mut().enumerate() {
            is_finite &= side.finish(ctx, now, number, &self.source.models);
        }
        match is_finite {
            true => Outcome::Continue,
            // The next resync brings a good model.
            false => Outcome::Degraded(Cause::LocalNotFinite.code()),
        }
    }
}
