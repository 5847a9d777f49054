//! The bridge beside the local actors: tool ticks out, local models in.

use std::collections::VecDeque;

use super::super::cause::Cause;
use super::super::messages::{SurfaceView, ToolTick};
use super::super::settings::Settings;
use super::other_tool::OtherTool;
use super::post::Post;
use super::{MOST_MESSAGES, REPEATED, SILENCE, key_of};
use crate::devices::ElsewhereHandle;
use crate::link::{Clock, Lane, MOST_TICKS, Message, Transport};
use crate::log::LinkSample;
use crate::model::body::Stiffness;
use crate::model::local::{Image, LocalModels, Shipment};
use crate::model::surroundings::{Bases, Basis};
use crate::model::{Pose, Vec3};
use crate::runtime::{
    Actor, ActorError, Nanos, Outcome, OutletWriter, ParameterReader, QueueReader, Rate, Recorder, TickContext, Writer,
};

/// A surface that nobody has taken for so long is not asked for any more.
const WATCHED_FOR: Nanos = Nanos(500_000_000);
/// Between two questions for the time.
const ASKS_EVERY: Nanos = Nanos(50_000_000);

/// Carries tool ticks to the global side, and builds the local models that come from there.
///
/// # Real-time
/// Not real-time safe: allocates, and builds models. Its group needs no priority.
#[derive(Debug)]
pub struct HapticBridge {
    post: Post,
    tools: Vec<Tool>,
    /// The next local models.
    models: Writer<LocalModels>,
    /// The tick of the newest of this epoch.
    newest: Option<u64>,
    /// The newest that have come in this release.
    arrived: Option<Shipment>,
    image: Image,
    bases: Bases,
    /// Their keys, those that came last at the end.
    held: Vec<u64>,
    /// The global side has been told of the last.
    is_held_told: bool,
    clock: Clock,
    /// When something of this epoch came last; `None` before.
    heard: Option<Nanos>,
    asked: Option<Nanos>,
    /// The number of the peer that the epoch is of.
    peer: u64,
    settings: ParameterReader<Settings>,
    surfaces: Surfaces,
    recorder: Recorder,
}

/// What the local actor and its bridge say to each other, and what a program does.
#[derive(Debug)]
pub struct HapticBridgePorts {
    /// The ticks of each tool, and where the place of one goes whose device is at another machine.
    pub tools: Vec<(QueueReader<ToolTick>, Option<ElsewhereHandle>)>,
    /// The rate of the ticks.
    pub haptic: Rate,
    /// The next local models.
    pub models: Writer<LocalModels>,
    /// What the program wants.
    pub settings: ParameterReader<Settings>,
    /// Where the body is seen; nowhere, if the global actor shows it there itself.
    pub surfaces: Vec<OutletWriter<SurfaceView>>,
    /// Where records go.
    pub recorder: Recorder,
}

/// The body's surface as it comes over the link, for whoever looks.
#[derive(Debug)]
struct Surfaces {
    writers: Vec<OutletWriter<SurfaceView>>,
    /// Nodes that come.
    nodes: Vec<u32>,
    /// The time of the newest.
    newest: Option<Nanos>,
    /// When somebody was seen to look.
    seen: Nanos,
}

impl Surfaces {
    /// Looks whether anybody does.
    fn look(&mut self, now: Nanos) {
        if self.writers.iter().any(OutletWriter::is_taken) {
            self.seen = now;
        }
    }

    fn are_watched(&self, now: Nanos) -> bool {
        !self.writers.is_empty() && now.saturating_sub(self.seen) < WATCHED_FOR
    }

    /// Shows the nodes of the surface at their `places`, if they are all there and not overtaken. The others stay where they began.
    fn show(&mut self, ctx: &TickContext, time: Nanos, stiffness: Stiffness, places: &[[f32; 3]]) {
        let is_new = self.newest.is_none_or(|newest| time > newest) && time <= ctx.scheduled;
        if !is_new || places.len() != self.nodes.len() {
            return;
        }
        self.newest = Some(time);
        for writer in &mut self.writers {
            let view = writer.buffer();
            (view.time, view.stiffness) = (time, stiffness);
            for (&node, place) in self.nodes.iter().zip(places) {
                view.positions[node as usize] = Vec3::from(place.map(f64::from));
            }
            writer.publish(ctx);
        }
    }
}

#[derive(Debug)]
struct Tool {
    ticks: QueueReader<ToolTick>,
    /// Oldest first.
    recent: VecDeque<ToolTick>,
    /// What is heard of one whose device is at another machine.
    elsewhere: Option<OtherTool>,
}

impl Tool {
    /// The newest tick.
    fn newest(&self) -> u64 {
        self.recent.back().map_or(0, |tick| tick.tick)
    }
}

impl HapticBridge {
    /// A bridge between what is behind `ports` and what is beyond `transport`; it builds local models by the `image` of the body over there.
    pub fn new(transport: Box<dyn Transport>, image: Image, ports: HapticBridgePorts) -> Self {
        let HapticBridgePorts { tools, haptic, models, settings, surfaces, recorder } = ports;
        let nodes = if surfaces.is_empty() { Vec::new() } else { image.surface_nodes() };
        let surfaces = Surfaces { writers: surfaces, nodes, newest: None, seen: Nanos::ZERO };
        let tool = |(ticks, elsewhere): (_, Option<ElsewhereHandle>)| {
            let elsewhere = elsewhere.map(|handle| OtherTool::new(handle, haptic));
            Tool { ticks, recent: VecDeque::new(), elsewhere }
        };
        let (newest, arrived, bases, held, clock, heard, asked) = Default::default();
        let (mut post, tools) = (Post::new(transport), tools.into_iter().map(tool).collect());
        let peer = post.peer();
        Self {
            post,
            tools,
            models,
            newest,
            arrived,
            image,
            bases,
            held,
            is_held_told: true,
            clock,
            heard,
            asked,
            peer,
            settings,
            surfaces,
            recorder,
        }
    }

    /// A connection that has fallen silent, or whose peer is another one now, is over: what still comes of it is dropped.
    fn begin_epoch_after_silence(&mut self, now: Nanos) -> bool {
        let is_silent = self.heard.is_some_and(|heard| now.saturating_sub(heard) >= SILENCE);
        let peer = self.post.peer();
        if is_silent || std::mem::replace(&mut self.peer, peer) != peer {
            self.post.begin_epoch(self.post.epoch + 1);
            self.clock = Clock::default();
            self.heard = None;
            self.newest = None;
            self.others().for_each(|(_, other)| other.begin_anew());
            self.surfaces.newest = None;
        }
        self.heard.is_none()
    }

    fn send_ticks(&mut self, ctx: &TickContext) {
        for (number, tool) in (0..).zip(&mut self.tools) {
            let mut new = 0;
            while let Some(tick) = tool.ticks.pop(ctx) {
                if tool.elsewhere.is_some() {
                    // It was heard of from there.
                    continue;
                }
                if tool.recent.len() == MOST_TICKS {
                    tool.recent.pop_front();
                }
                tool.recent.push_back(tick);
                new += 1;
            }
            if new > 0 {
                let known = tool.recent.len();
                let ticks = tool.recent.range(known - known.min(REPEATED.max(new))..);
                let ticks = ticks.map(|tick| (tick.tick, tick.pose)).collect();
                self.post.send(Lane::Urgent, ctx.scheduled, &Message::Ticks { tool: number, ticks });
            }
        }
    }

    /// Says what is there and what is wanted, at once if that is news, and asks for the time.
    fn ask(&mut self, ctx: &TickContext) {
        let now = ctx.scheduled;
        let has_changed = self.settings.refresh(ctx);
        let has_arrived = !std::mem::replace(&mut self.is_held_told, true);
        self.surfaces.look(now);
        let is_due = self.asked.is_none_or(|asked| now.saturating_sub(asked) >= ASKS_EVERY);
        if is_due {
            self.asked = Some(now);
            self.post.send(Lane::Urgent, now, &Message::Ping);
            self.record(now);
        }
        if is_due || has_changed || has_arrived {
            let held = self.held.iter().rev().copied().collect();
            let Settings { friction, stiffness, .. } = self.settings.get();
            let is_watched = self.surfaces.are_watched(now);
            self.post.send(Lane::Urgent, now, &Message::Wants { held, friction, stiffness, is_watched });
        }
    }

    fn record(&mut self, time: Nanos) {
        let [sent, received, lost] = self.post.counts();
        self.recorder.push(LinkSample {
            time,
            epoch: u32::try_from(self.post.epoch).unwrap_or(u32::MAX),
            round_trip: Nanos(self.clock.round_trip_ns().unwrap_or_default()),
            clock_ahead_s: 1e-9 * self.clock.ahead_ns().unwrap_or_default(),
            clock_drift_ppm: self.clock.drift_ppm(),
            sent,
            received,
            lost,
        });
    }

    /// Takes what has come; the newest models of all, of equally old ones before the first tick the last.
    fn receive(&mut self, ctx: &TickContext) {
        let now = ctx.scheduled;
        for _ in 0..MOST_MESSAGES {
            let Some((header, message)) = self.post.receive(now, false) else { return };
            self.heard = Some(now);
            match message {
                Message::Models(shipment) => {
                    // One that was overtaken is outdated; one of a tick that has not been is none, and would never be old.
                    let tick = shipment.tick();
                    let own = self.tools.iter().filter(|tool| tool.elsewhere.is_none());
                    let sent = own.map(Tool::newest).min();
                    // Before the first tick here, all are of tick 0, however much later the body is there that others touch.
                    let is_newest = self.newest.is_none_or(|newest| tick > newest || sent == Some(0));
                    if sent.is_some_and(|sent| tick <= sent) && is_newest {
                        self.newest = Some(tick);
                        self.arrived = Some(shipment);
                    }
                }
                Message::Basis { key, basis } => self.keep(key, *basis),
                Message::Surface { time, stiffness, places } => self.surfaces.show(ctx, time, stiffness, &places),
                Message::Pong { sent, received } => {
                    self.clock.push([sent.0, received.0, header.sent.0, now.0]);
                }
                Message::Ticks { tool, ticks } => {
                    let elsewhere = self.tools.get_mut(usize::from(tool)).and_then(|tool| tool.elsewhere.as_mut());
                    if let Some(other) = elsewhere {
                        other.hear(&ticks);
                    }
                }
                // Heard before the session began, or of the other direction.
                Message::Ready | Message::Wants { .. } | Message::Ping => {}
            }
        }
    }

    /// The tools that are elsewhere, with their numbers.
    fn others(&mut self) -> impl Iterator<Item = (usize, &mut OtherTool)> {
        self.tools.iter_mut().enumerate().filter_map(|(number, tool)| Some((number, tool.elsewhere.as_mut()?)))
    }

    /// Puts the tools that are elsewhere where the first models say, unless something newer has come.
    fn place_others(&mut self) {
        let poses: Vec<Pose> = self.arrived.iter().flat_map(Shipment::poses).collect();
        for (number, other) in self.others().filter(|(_, other)| other.is_new()) {
            poses.get(number).iter().for_each(|&&pose| other.put(pose));
        }
    }

    /// Shows the tools that are elsewhere where they are in the next tick.
    fn show_others(&mut self, ctx: &TickContext) {
        self.others().for_each(|(_, other)| other.show(ctx.tick + 1));
    }

    /// Keeps a basis. One that comes again was not known to be here: it is told again.
    fn keep(&mut self, key: u64, basis: Basis) {
        if key != key_of(basis.patch()) || !self.image.has_room_for(&basis) {
            return;
        }
        self.held.retain(|held| *held != key);
        self.held.push(key);
        self.is_held_told = false;
        if self.bases.get(basis.patch()).is_none() {
            self.bases.insert(basis.into());
        }
    }

    fn publish(&mut self, ctx: &TickContext) {
        if let Some(shipment) = self.arrived.take()
            && self.image.rebuild(&shipment, &self.bases, self.models.buffer())
        {
            self.models.publish(ctx);
        }
    }
}

impl Actor for HapticBridge {
    fn name(&self) -> &str {
        "haptic bridge"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.receive(ctx);
        self.place_others();
        self.publish(ctx);
        self.post.begin();
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let is_silent = self.begin_epoch_after_silence(ctx.scheduled);
        self.send_ticks(ctx);
        self.ask(ctx);
        if is_silent { Outcome::Degraded(Cause::LinkSilent.code()) } else { Outcome::Continue }
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.receive(ctx);
        self.show_others(ctx);
        self.publish(ctx);
        Outcome::Continue
    }
}

#[cfg(test)]
#[path = "../tests/haptic_bridge.rs"]
mod tests;
