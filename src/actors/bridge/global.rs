//! The bridge beside the global actor: tool ticks in, local models and bases out.

use std::collections::VecDeque;

use super::super::messages::ToolTick;
use super::machine::Machine;
use super::passed_bases::{BasesPorts, PassedBases};
use super::{MOST_MESSAGES, REPEATED};
use crate::actors::messages::SurfaceView;
use crate::actors::tunable::Tunable;
use crate::link::{Lane, Message, Transport};
use crate::model::Pose;
use crate::model::local::{LocalModels, Shipment};
use crate::runtime::{Actor, ActorError, Nanos, Outcome, OutletReader, QueueWriter, Rate, Reader, TickContext};

/// The tools of a machine from which nothing has come for so long rest where they are, while those of others go on.
const RESTS_AFTER: Nanos = Nanos(50_000_000);
/// One that has rested goes to where it is meanwhile in so long.
const RETURNS_IN: Nanos = Nanos(16_000_000);
/// A sample that is counted so much later than it comes is none.
const AHEAD_AT_MOST: Nanos = Nanos(100_000_000);

/// Carries local models to the haptic machines, the tool ticks that come from there to the global actor, and those of the tools of one
/// machine to the others.
///
/// # Real-time
/// Not real-time safe: allocates.
#[derive(Debug)]
pub struct GlobalBridge {
    machines: Vec<Machine>,
    /// The next local models: such as are [built elsewhere](crate::model::local::Template::departing).
    models: Reader<LocalModels>,
    /// None where local models take no bases.
    bases: Option<PassedBases>,
    /// What is sent and passed on is to be looked at again: a machine may lack others than before.
    are_bases_due: bool,
    tools: Vec<Onward>,
    settings: Tunable,
    /// The body as it is to be seen on the other side, and the nodes that are.
    surface: Option<(OutletReader<SurfaceView>, Vec<u32>)>,
    haptic: Rate,
    /// What is received in this release is not received later than it begins.
    is_prompt: bool,
}

/// What the global actor and its bridge say to each other.
#[derive(Debug)]
pub struct GlobalBridgePorts {
    /// The next local models: such as are [built elsewhere](crate::model::local::Template::departing).
    pub models: Reader<LocalModels>,
    /// The way of the bases, if local models take any.
    pub bases: Option<BasesPorts>,
    /// Where each tool is at the start, and where its ticks go.
    pub tools: Vec<(Pose, QueueWriter<ToolTick>)>,
    /// What the haptic side may change.
    pub settings: Tunable,
    /// The body as it is to be seen on the other side, and the nodes that are; `None` where that sees it anyway.
    pub surface: Option<(OutletReader<SurfaceView>, Vec<u32>)>,
    /// The rate of the ticks.
    pub haptic: Rate,
}

/// A haptic machine: the way to it, and the tools whose devices are there.
pub type Beyond = (Box<dyn Transport>, Vec<usize>);

/// One tool on its way to the global actor, and to the machines that have other tools.
#[derive(Debug)]
struct Onward {
    ticks: QueueWriter<ToolTick>,
    /// The last that was passed on.
    newest: ToolTick,
    /// The last that were passed on, oldest first.
    recent: VecDeque<ToolTick>,
    /// Some were in this release.
    is_new: bool,
    /// The next one is of another machine, whose tool never went from where this one is.
    is_put: bool,
    /// Its machine has fallen silent.
    is_resting: bool,
}

impl Onward {
    fn new((pose, ticks): (Pose, QueueWriter<ToolTick>)) -> Self {
        let newest = ToolTick { pose, ..ToolTick::default() };
        let (recent, is_new, is_put, is_resting) = Default::default();
        Self { ticks, newest, recent, is_new, is_put, is_resting }
    }

    /// Passes `tick` on. A full queue is counted; the global model sees the gap and interpolates over it.
    fn pass(&mut self, ctx: &TickContext, tick: ToolTick) {
        self.newest = tick;
        self.ticks.push(ctx, tick);
        if self.recent.len() == REPEATED {
            self.recent.pop_front();
        }
        self.recent.push_back(tick);
        self.is_new = true;
    }

    /// Passes on what has come, unless it is older than what was passed on: most of it came before. After a rest of its tool a way of some
    /// ticks is left to it: nobody goes there in one.
    fn take(&mut self, ctx: &TickContext, tick: u64, pose: Pose, return_ticks: u64) {
        let returns = self.is_resting && !self.is_put;
        if tick < self.newest.tick + if returns { return_ticks } else { 1 } {
            return;
        }
        self.is_resting = false;
        let is_put = std::mem::take(&mut self.is_put);
        self.pass(ctx, ToolTick { tick, pose, is_put });
    }

    /// Lets it rest where it is until `tick`.
    fn rest(&mut self, ctx: &TickContext, tick: u64) {
        self.is_resting = true;
        if tick > self.newest.tick {
            self.pass(ctx, ToolTick { tick, is_put: false, ..self.newest });
        }
    }
}

/// When samples are received, in ticks of the clock here.
struct Reception {
    now: u64,
    /// So many ticks a second has.
    second: u64,
    /// A sample that is counted later is none.
    latest: u64,
    /// In so many a tool that has rested goes to where it is.
    return_ticks: u64,
    is_prompt: bool,
}

impl Reception {
    /// Takes the samples of a tool that have come from its machine.
    fn take(&self, ctx: &TickContext, machine: &mut Machine, tool: &mut Onward, ticks: Vec<(u64, Pose)>) {
        let Some(&(newest, _)) = ticks.last() else { return };
        machine.heard = ctx.scheduled;
        if self.is_prompt || machine.numbering.is_new() {
            machine.numbering.hear(newest, self.now, self.second);
        }
        machine.newest = machine.newest.max(newest);
        let counted = ticks.into_iter().map(|(tick, pose)| (machine.numbering.here(tick), pose));
        for (tick, pose) in counted.filter(|(tick, _)| *tick <= self.latest) {
            tool.take(ctx, tick, pose, self.return_ticks);
        }
    }
}

impl GlobalBridge {
    /// A bridge between the global actor behind `ports` and the `machines` whose tools it has, each of which is at one of them.
    pub fn new(machines: Vec<Beyond>, ports: GlobalBridgePorts) -> Self {
        let GlobalBridgePorts { models, bases, tools, settings, surface, haptic } = ports;
        let bases = bases.map(PassedBases::new);
        let is_alone = machines.len() == 1;
        let machine = |(transport, tools)| Machine::new(transport, tools, is_alone, &settings);
        let machines = machines.into_iter().map(machine).collect();
        let tools = tools.into_iter().map(Onward::new).collect();
        Self { machines, models, bases, are_bases_due: true, tools, settings, surface, haptic, is_prompt: false }
    }

    /// Sends the bases that the machines lack, and passes on what they have.
    fn send_bases(&mut self, ctx: &TickContext) {
        let Self { machines, models, bases, are_bases_due, .. } = self;
        if let Some(bases) = bases {
            let are_told = bases.take(ctx);
            if std::mem::take(are_bases_due) || are_told {
                for machine in machines.iter_mut() {
                    machine.send_bases(models.get(), &bases.made, ctx.scheduled);
                }
                bases.pass(ctx, machines, are_told);
            }
        }
        machines.iter_mut().for_each(|machine| machine.say_ready(ctx.scheduled));
    }

    fn send_models(&mut self, ctx: &TickContext) {
        let Self { machines, models, are_bases_due, .. } = self;
        self.is_prompt = !models.refresh(ctx);
        if !self.is_prompt {
            *are_bases_due = true;
            for machine in machines {
                machine.send_models(Shipment::of_tools(models.get(), &machine.tools), ctx.scheduled);
            }
        }
    }

    fn send_surface(&mut self, now: Nanos) {
        let Self { machines, surface, haptic, .. } = self;
        let mut watching = machines.iter_mut().filter(|machine| machine.is_watched).peekable();
        if watching.peek().is_some()
            && let Some((surface, nodes)) = surface
            && surface.refresh()
        {
            let &SurfaceView { time, ref positions, stiffness } = surface.get();
            let place = |&node: &u32| positions[node as usize].data.0[0].map(|coordinate| coordinate as f32);
            let mut message = Message::Surface { time, stiffness, places: nodes.iter().map(place).collect() };
            let tick = haptic.last_release(time);
            for machine in watching {
                if let Message::Surface { time, .. } = &mut message {
                    *time = haptic.release(machine.numbering.there(tick));
                }
                machine.post.send(Lane::Pictures, now, &message);
            }
        }
    }

    fn receive(&mut self, ctx: &TickContext) {
        let haptic = self.haptic;
        let clock = Reception {
            now: haptic.last_release(ctx.now),
            second: haptic.as_hz() as u64,
            latest: if self.machines.len() == 1 { u64::MAX } else { haptic.last_release(ctx.now + AHEAD_AT_MOST) },
            return_ticks: haptic.last_release(RETURNS_IN).max(1),
            is_prompt: self.is_prompt,
        };
        let Self { machines, tools, settings, bases, are_bases_due, .. } = self;
        for machine in machines {
            if machine.is_another() {
                *are_bases_due = true;
                machine.tools.iter().for_each(|&tool| tools[tool].is_put = true);
            }
            for _ in 0..MOST_MESSAGES {
                let Some((header, message)) = machine.receive(ctx.scheduled) else { break };
                match message {
                    Message::Ticks { tool, ticks } if machine.tools.contains(&tool.into()) => {
                        clock.take(ctx, machine, &mut tools[usize::from(tool)], ticks);
                    }
                    Message::Wants { held, friction, stiffness, is_watched } => {
                        if machine.is_newest_said(header.number) {
                            let is_first = machine.bases.are_unknown();
                            *are_bases_due |= machine.bases.arrived(held, ctx.scheduled);
                            if is_first && let Some(bases) = bases {
                                bases.take_back(ctx, machine);
                            }
                            machine.tune(settings, (friction, stiffness));
                            machine.is_watched = is_watched;
                        }
                    }
                    Message::Ping => {
                        let answer = Message::Pong { sent: header.sent, received: ctx.scheduled };
                        machine.post.send(Lane::Urgent, ctx.scheduled, &answer);
                    }
                    // Of the other direction, or of a tool that it has not.
                    Message::Ticks { .. }
                    | Message::Models(_)
                    | Message::Basis { .. }
                    | Message::Ready
                    | Message::Pong { .. }
                    | Message::Surface { .. } => {}
                }
            }
        }
    }

    /// Lets the tools of machines that have fallen silent rest where they are, if others go on.
    fn rest(&mut self, ctx: &TickContext) {
        let Self { machines, tools, .. } = self;
        if machines.len() == 1 {
            return;
        }
        let newest = tools.iter().map(|tool| tool.newest.tick).max().unwrap_or_default();
        let is_silent = |machine: &&Machine| ctx.scheduled.saturating_sub(machine.heard) >= RESTS_AFTER;
        for &tool in machines.iter().filter(is_silent).flat_map(|machine| &machine.tools) {
            tools[tool].rest(ctx, newest);
        }
    }

    /// Tells each machine where the tools of the others are.
    fn send_ticks(&mut self, now: Nanos) {
        let Self { machines, tools, .. } = self;
        for (number, onward) in tools.iter_mut().enumerate() {
            if std::mem::take(&mut onward.is_new) {
                // One that has said nothing yet has no ticks to count by.
                let others = machines.iter_mut().filter(|machine| !machine.tools.contains(&number));
                for machine in others.filter(|machine| !machine.numbering.is_new()) {
                    let ticks = onward.recent.iter().map(|tick| (machine.numbering.there(tick.tick), tick.pose));
                    // Of before its first tick nothing is told.
                    let ticks = ticks.filter(|&(tick, _)| tick > 0).collect();
                    let message = Message::Ticks { tool: number as u16, ticks };
                    machine.post.send(Lane::Urgent, now, &message);
                }
            }
        }
    }
}

impl Actor for GlobalBridge {
    fn name(&self) -> &str {
        "global bridge"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.send_models(ctx);
        self.send_bases(ctx);
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.send_models(ctx);
        self.send_bases(ctx);
        self.send_surface(ctx.scheduled);
        Outcome::Continue
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.receive(ctx);
        self.rest(ctx);
        self.send_ticks(ctx.scheduled);
        Outcome::Continue
    }
}

#[cfg(test)]
#[path = "../tests/global_bridge.rs"]
mod tests;
