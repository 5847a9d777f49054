//! The bridge beside the local actors: tool ticks out, local models in.

use std::collections::VecDeque;

use super::super::cause::Cause;
use super::super::messages::ToolTick;
use super::post::Post;
use super::{MOST_MESSAGES, SILENCE, key_of};
use crate::link::{Clock, Lane, MOST_TICKS, Message, Transport};
use crate::log::LinkSample;
use crate::model::local::{Image, LocalModels, Shipment};
use crate::model::surroundings::{Bases, Basis};
use crate::runtime::{Actor, ActorError, Nanos, Outcome, QueueReader, Recorder, TickContext, Writer};

/// Ticks that a message has at least, if there are so many: those before the newest are repeated.
const REPEATED: usize = 8;
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
    clock: Clock,
    /// When something of this epoch came last; `None` before.
    heard: Option<Nanos>,
    asked: Option<Nanos>,
    /// The number of the peer that the epoch is of.
    peer: u64,
    recorder: Recorder,
}

#[derive(Debug)]
struct Tool {
    ticks: QueueReader<ToolTick>,
    /// Oldest first.
    recent: VecDeque<ToolTick>,
}

impl HapticBridge {
    /// A bridge for the tools whose ticks come by `ticks`, which builds `models` by the `image` of the body over there.
    pub fn new(
        transport: Box<dyn Transport>,
        ticks: Vec<QueueReader<ToolTick>>,
        models: Writer<LocalModels>,
        image: Image,
        recorder: Recorder,
    ) -> Self {
        let tool = |ticks| Tool { ticks, recent: VecDeque::new() };
        let (newest, arrived, bases, clock, heard, asked) = Default::default();
        let (mut post, tools) = (Post::new(transport), ticks.into_iter().map(tool).collect());
        let peer = post.peer();
        Self { post, tools, models, newest, arrived, image, bases, clock, heard, asked, peer, recorder }
    }

    /// A connection that has fallen silent, or whose peer is another one now, is over: what still comes of it is dropped.
    fn begin_epoch_after_silence(&mut self, now: Nanos) -> bool {
        let is_silent = self.heard.is_some_and(|heard| now.saturating_sub(heard) >= SILENCE);
        let peer = self.post.peer();
        if is_silent || std::mem::replace(&mut self.peer, peer) != peer {
            self.post.begin_epoch(self.post.epoch + 1);
            self.heard = None;
            self.newest = None;
        }
        self.heard.is_none()
    }

    fn send_ticks(&mut self, ctx: &TickContext) {
        for (number, tool) in (0..).zip(&mut self.tools) {
            let mut new = 0;
            while let Some(tick) = tool.ticks.pop(ctx) {
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

    fn ask(&mut self, now: Nanos) {
        if self.asked.is_none_or(|asked| now.saturating_sub(asked) >= ASKS_EVERY) {
            self.asked = Some(now);
            self.post.send(Lane::Urgent, now, &Message::Ping);
            let held = self.bases.iter().map(|basis| key_of(basis.patch())).collect();
            self.post.send(Lane::Urgent, now, &Message::Held(held));
            self.record(now);
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

    /// Takes what has come; the newest models of all.
    fn receive(&mut self, now: Nanos) {
        for _ in 0..MOST_MESSAGES {
            let Some((header, message)) = self.post.receive(now, false) else { return };
            self.heard = Some(now);
            match message {
                Message::Models(shipment) => {
                    // One that was overtaken is outdated; one of a tick that has not been is none, and would never be old.
                    let tick = shipment.tick();
                    let sent = |tool: &Tool| tool.recent.back().map_or(0, |tick| tick.tick);
                    let has_been = self.tools.iter().map(sent).min().is_some_and(|sent| tick <= sent);
                    if has_been && self.newest.is_none_or(|newest| tick > newest) {
                        self.newest = Some(tick);
                        self.arrived = Some(shipment);
                    }
                }
                Message::Basis { key, basis } => self.keep(key, *basis),
                Message::Pong { sent, received } => {
                    self.clock.push([sent.0, received.0, header.sent.0, now.0]);
                }
                // Of the other direction.
                Message::Ticks { .. } | Message::Held(_) | Message::Ping => {}
            }
        }
    }

    fn keep(&mut self, key: u64, basis: Basis) {
        let is_new = self.bases.get(basis.patch()).is_none();
        if is_new && key == key_of(basis.patch()) && self.image.has_room_for(&basis) {
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
        self.receive(ctx.scheduled);
        self.publish(ctx);
        self.post.begin();
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let is_silent = self.begin_epoch_after_silence(ctx.scheduled);
        self.send_ticks(ctx);
        self.ask(ctx.scheduled);
        if is_silent { Outcome::Degraded(Cause::LinkSilent.code()) } else { Outcome::Continue }
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.receive(ctx.scheduled);
        self.publish(ctx);
        Outcome::Continue
    }
}
