//! The global actor: advances the whole body along the tools' paths and publishes the next local models.

use super::cause::Cause;
use super::global_ports::{GlobalPorts, GlobalSharedPorts, ToolPorts};
use super::global_tool::ToolSide;
use super::messages::{ToolTick, show};
use super::model_maker::ModelMaker;
use super::next_models::NextModels;
use crate::error::Error;
use crate::log::GlobalTick;
use crate::model::contact::ToolMotion;
use crate::model::local::{Kind, ToolHistory, Windows};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::{Actor, ActorError, Nanos, Outcome, Rate, Stopwatch, TickContext};

/// The time whose tool samples a release follows at most, if two periods of its own are less (s): one that finds more
/// starts again from its newest surface and the newest tool, so that under load it does not fall behind without end.
const LONGEST_BACKLOG_S: f64 = 0.06;

/// The fewest ticks in which such a way is gone.
const LEAST_WAY: u64 = 8;

/// What a [`GlobalActor`] has to know of the session.
#[derive(Clone, Debug)]
pub struct GlobalPlan {
    /// Rate of the haptic ticks.
    pub haptic: Rate,
    /// Rate of its own releases.
    pub global: Rate,
    /// Haptic ticks that a local model may have to reach ahead.
    pub horizon: u32,
    /// Makes local models.
    pub models: ModelMaker,
    /// Of windows that may have a basis: patch nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// Bases that are there from the start.
    pub bases: Bases,
    /// The tool's samples come over a link: what has come is followed, whatever the time.
    pub linked: bool,
}

impl GlobalPlan {
    /// Haptic ticks that a release follows at most.
    fn most_ticks(&self) -> u64 {
        let seconds = (2.0 * self.global.period_s()).max(LONGEST_BACKLOG_S);
        (seconds * self.haptic.as_hz()).ceil().max(4.0) as u64
    }

    /// Ticks in which a way is gone whose samples are not followed: half a period's.
    fn way_ticks(&self) -> u64 {
        (self.most_ticks() / 4).max(LEAST_WAY)
    }

    /// How long a local model serves from its state on (s).
    fn lead_s(&self) -> f64 {
        f64::from(self.horizon) * self.haptic.period_s()
    }
}

/// Runs the slow, detailed simulation.
///
/// # Real-time
/// Allocates in its first releases and where the patch changes its size. A release follows the tool samples of two of
/// its periods at most; what is older is not made up, and the release is degraded.
#[derive(Debug)]
pub struct GlobalActor {
    simulation: Simulation,
    ports: GlobalSharedPorts,
    plan: GlobalPlan,
    tools: Vec<ToolSide>,
    next: NextModels,
    /// The newest local models that were published.
    version: u64,
    /// Something else than the tools has changed since the last models.
    is_changed: bool,
    /// It goes on where another one was.
    goes_on: bool,
    /// Another one can go on where it was.
    is_replaceable: bool,
    /// Working memory: how each tool moves in a tick.
    motions: Vec<ToolMotion>,
}

impl GlobalActor {
    /// A global model that starts with `simulation` and its tools at `tools`, also in the midst of a run.
    ///
    /// # Errors
    /// If the body's surface has no triangles.
    ///
    /// # Panics
    /// If simulation, `tools` and `ports` are not for the same number of tools.
    pub fn new(
        simulation: Simulation,
        tools: &[ToolTick],
        plan: GlobalPlan,
        ports: GlobalPorts,
    ) -> Result<Self, Error> {
        let GlobalPorts { tools: of_tools, shared } = ports;
        assert_eq!([tools.len(), of_tools.len()], [simulation.tools(); 2], "ports and places for each tool");
        let next = NextModels::new(&simulation)?;
        let has_bases = shared.surroundings.is_some();
        let side = |(index, (&tool, ports)): (usize, (&ToolTick, ToolPorts))| {
            let windows = if has_bases { Windows::new(&simulation, index, plan.patch) } else { Windows::default() };
            let history = ToolHistory::new(tool.pose, plan.haptic.period_s(), plan.lead_s());
            ToolSide::new(tool, windows, history, ports)
        };
        let tools = tools.iter().zip(of_tools).enumerate().map(side).collect();
        let (version, motions, is_changed, goes_on, is_replaceable) = (0, Vec::new(), true, false, false);
        Ok(Self { simulation, ports: shared, plan, tools, next, version, is_changed, goes_on, is_replaceable, motions })
    }

    /// One that goes on where another was. There are local models already, and what a program has changed is known from its first release on:
    /// it publishes nothing before.
    #[must_use]
    pub fn going_on(self) -> Self {
        Self { goes_on: true, ..self }
    }

    /// One that another can follow if it `can` be replaced: a state that is not finite is its fault then. Otherwise that is for good, and nothing
    /// is published any more.
    #[must_use]
    pub fn replaceable(self, can: bool) -> Self {
        Self { is_replaceable: can, ..self }
    }

    /// The haptic tick of the state.
    fn now(&self) -> u64 {
        self.tools[0].tool.tick
    }

    /// Advances along the tool samples up to `until`; what could not be followed as it was, if there is something.
    ///
    /// The work is bounded: of more than two periods the state is not followed. It goes on as it is, the tools go
    /// straight to where they were half a period ago, and from there along their samples: a period's work.
    fn follow_tools(&mut self, ctx: &TickContext, until: Nanos) -> Option<Cause> {
        self.take_arrivals(ctx);
        let newest = if self.plan.linked { self.newest_arrival() } else { self.plan.haptic.last_release(until) };
        let mut cause = None;
        if newest.saturating_sub(self.now()) > self.plan.most_ticks() {
            let before = self.begin_way();
            // A slow haptic loop may have had fewer ticks than the way has.
            let end = newest.saturating_sub(self.plan.way_ticks());
            let taken = (0..).take_while(|_| self.take_samples(end)).count();
            cause = self.go(before, taken);
        }
        loop {
            let before = self.begin_way();
            let taken = (0..self.simulation.stride()).take_while(|_| self.take_samples(newest)).count();
            if taken == 0 {
                return cause;
            }
            cause = cause.or(self.go(before, taken));
        }
    }

    fn take_arrivals(&mut self, ctx: &TickContext) {
        for side in &mut self.tools {
            side.waiting.extend(std::iter::from_fn(|| side.ports.ticks.pop(ctx)));
        }
    }

    /// The last tick that there is a sample of for every tool.
    fn newest_arrival(&self) -> u64 {
        let newest = |side: &ToolSide| side.waiting.back().map_or(side.tool.tick, |sample| sample.tick);
        self.tools.iter().map(newest).min().unwrap_or_default()
    }

    /// The way of each tool begins where it is; the tick at which that is.
    fn begin_way(&mut self) -> u64 {
        for side in &mut self.tools {
            (side.from, side.is_between) = (side.tool.pose, false);
        }
        self.now()
    }

    /// Puts every tool to the earliest tick that waits, if it is not after `newest`; returns whether there was one.
    ///
    /// The samples of all tools come in step. Where one lacks a sample that another has, it is interpolated.
    fn take_samples(&mut self, newest: u64) -> bool {
        let Some(next) = self.next_tick().filter(|&next| next <= newest) else { return false };
        let most = self.plan.way_ticks();
        let Self { tools, simulation, .. } = self;
        for (index, side) in tools.iter_mut().enumerate() {
            let sample = side.waiting.front().copied().unwrap_or(side.tool);
            let is_between = sample.tick > next;
            side.is_between |= is_between;
            let before = side.tool;
            side.tool = if is_between {
                let share = next.saturating_sub(before.tick) as f64 / (sample.tick - before.tick) as f64;
                let pose = if sample.is_put { before.pose } else { before.pose.towards(&sample.pose, share) };
                ToolTick { tick: next, pose, is_put: false }
            } else {
                side.waiting.pop_front();
                sample
            };
            if side.tool.is_put {
                simulation.lift(index);
                side.put();
                continue;
            }
            let way = ToolMotion { from: before.pose, to: side.tool.pose };
            let ticks = next.saturating_sub(before.tick).min(most);
            (1..=ticks).for_each(|i| side.history.push(way.at(i as f64 / ticks as f64)));
        }
        true
    }

    /// Advances while each tool goes its way of `taken` samples, which began at the tick `before`, in half a period's ticks at most.
    fn go(&mut self, before: u64, taken: usize) -> Option<Cause> {
        let passed = self.now().saturating_sub(before);
        let ticks = passed.min(self.plan.way_ticks());
        let stride = self.simulation.stride();
        for begin in (0..ticks).step_by(stride as usize) {
            let end = ticks.min(begin + u64::from(stride));
            let [from, to] = [begin, end].map(|tick| tick as f64 / ticks as f64);
            let part = |side: &ToolSide| ToolMotion { from: side.from, to: side.tool.pose }.part(from, to);
            self.motions.clear();
            self.motions.extend(self.tools.iter().map(part));
            self.simulation.step_all((end - begin) as u32, &self.motions);
        }
        if passed > ticks {
            // Nobody moved as the tools did here: what they will do is not to be told from it.
            self.tools.iter_mut().for_each(|side| side.history.restart(side.tool.pose));
            return Some(Cause::PathDropped);
        }
        let is_interpolated = passed > taken as u64 || self.tools.iter().any(|side| side.is_between);
        is_interpolated.then_some(Cause::SamplesLost)
    }

    /// The earliest tick that waits, once there is one of every tool.
    fn next_tick(&self) -> Option<u64> {
        let waiting = |side: &ToolSide| side.waiting.front().map(|sample| sample.tick);
        self.tools.iter().map(waiting).reduce(|a, b| Some(a?.min(b?)))?
    }

    /// Builds the next local models around the tools' contacts, or around the surface nearest to them, and where they are going.
    fn publish_models(&mut self, ctx: &TickContext) -> u64 {
        self.next.aim((&self.simulation, &mut self.tools), self.plan.lead_s());
        let has_bases = self.has_bases();
        if has_bases {
            self.next.look_beside((&self.simulation, &mut self.tools));
            self.publish_wishes(ctx);
        }
        let (kind, is_changed) = (self.ports.settings.get().model, std::mem::take(&mut self.is_changed));
        // The whole body goes on by itself.
        if kind != Kind::Full || is_changed {
            let Self { simulation, ports, plan, tools, next, .. } = self;
            let models = ports.models.buffer();
            plan.models.put(kind, simulation.body_as_made(), models);
            next.choose((simulation, tools), kind, has_bases.then_some(&plan.bases));
            Stopwatch::around(ports.build_cost.as_mut(), || {
                next.build((simulation, tools), (plan.horizon, &plan.bases, has_bases), models);
            });
            self.version = ports.models.publish(ctx);
        }
        self.version
    }

    /// True if local models take bases.
    fn has_bases(&self) -> bool {
        self.ports.surroundings.is_some() && self.ports.settings.get().model == Kind::Predictive
    }

    /// Takes what a program has changed since the last release.
    fn take_settings(&mut self, ctx: &TickContext) {
        if self.ports.settings.refresh(ctx) {
            self.ports.settings.get().put_to(&mut self.simulation);
            self.is_changed = true;
        }
    }

    /// Takes the bases that are there by now.
    fn take_bases(&mut self, ctx: &TickContext) {
        if let Some(ports) = &mut self.ports.surroundings
            && ports.bases.refresh(ctx)
        {
            self.plan.bases.clone_from(ports.bases.get());
        }
    }

    /// Asks for the bases that are missing.
    fn publish_wishes(&mut self, ctx: &TickContext) {
        if let Some(ports) = &mut self.ports.surroundings {
            let (period, lead) = (self.plan.global.period_s(), self.plan.lead_s());
            let wishes = ports.wishes.buffer();
            self.next.wish((&self.simulation, &self.tools), [period, lead], &self.plan.bases, wishes);
            if !wishes.patches.is_empty() {
                ports.wishes.publish(ctx);
            }
        }
    }

    fn publish_checkpoint(&mut self, ctx: &TickContext) {
        let checkpoint = self.ports.checkpoint.buffer();
        checkpoint.tools.clear();
        checkpoint.tools.extend(self.tools.iter().map(|side| side.tool));
        self.simulation.save(&mut checkpoint.simulation);
        self.ports.checkpoint.publish(ctx);
    }

    fn publish_surface(&mut self, ctx: &TickContext) {
        let time = self.plan.haptic.release(self.now());
        show(&mut self.ports.surfaces, ctx, time, &self.simulation);
    }
}

impl Actor for GlobalActor {
    fn name(&self) -> &str {
        "global"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        if !self.goes_on {
            self.publish_models(ctx);
        }
        self.publish_surface(ctx);
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let before = self.now();
        self.take_settings(ctx);
        self.take_bases(ctx);
        let incomplete = self.follow_tools(ctx, ctx.scheduled);
        if self.now() == before {
            // Release 0, or local models that stand still: there is nothing new to say.
            return Outcome::Continue;
        }
        for (index, side) in self.tools.iter_mut().enumerate() {
            side.take_feedback(ctx, &mut self.simulation, index);
        }
        if !self.simulation.state().is_finite() {
            let cause = Cause::GlobalNotFinite.code();
            return if self.is_replaceable { Outcome::Fault(cause) } else { Outcome::Degraded(cause) };
        }
        let version = self.publish_models(ctx);
        self.publish_surface(ctx);
        self.publish_checkpoint(ctx);
        self.ports.recorder.push(GlobalTick {
            time: ctx.scheduled,
            version: version as u32,
            first_tick: before + 1,
            last_tick: self.now(),
        });
        incomplete.map_or(Outcome::Continue, |cause| Outcome::Degraded(cause.code()))
    }
}
