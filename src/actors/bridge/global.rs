//! The bridge beside the global actor: tool ticks in, local models and bases out.

use std::collections::BTreeMap;

use super::super::messages::ToolTick;
use super::post::Post;
use super::{MOST_MESSAGES, key_of};
use crate::link::{Lane, Message, Transport};
use crate::model::Pose;
use crate::model::local::{LocalModels, Parcel, Shipment};
use crate::runtime::{Actor, ActorError, Nanos, Outcome, QueueWriter, Reader, TickContext};

/// A basis that is not there after so long is sent again.
const SENT_AGAIN: Nanos = Nanos(3_000_000_000);
/// Bases that are on their way at the same time: more would wait for one another, and the first ones are wanted first.
const MOST_ON_THE_WAY: usize = 4;

/// Carries local models to the haptic side, and the tool ticks that come from there to the global actor.
///
/// # Real-time
/// Not real-time safe: allocates.
#[derive(Debug)]
pub struct GlobalBridge {
    post: Post,
    /// The next local models: such as are [built elsewhere](crate::model::local::Template::departing).
    models: Reader<LocalModels>,
    /// Where the ticks of each tool go.
    ticks: Vec<QueueWriter<ToolTick>>,
    /// The newest tick of each tool.
    newest: Vec<u64>,
    bases: SentBases,
}

/// What the haptic side has.
#[derive(Debug, Default)]
struct SentBases {
    /// When each was sent.
    on_the_way: BTreeMap<u64, Nanos>,
    held: Vec<u64>,
}

impl GlobalBridge {
    /// A bridge for the tools whose ticks go to `ticks`, and whose next local models come by `models`: such as are
    /// [built elsewhere](crate::model::local::Template::departing).
    pub fn new(transport: Box<dyn Transport>, models: Reader<LocalModels>, ticks: Vec<QueueWriter<ToolTick>>) -> Self {
        let newest = vec![0; ticks.len()];
        Self { post: Post::new(transport), models, ticks, newest, bases: SentBases::default() }
    }

    fn send_models(&mut self, ctx: &TickContext) {
        let Self { post, models, bases, .. } = self;
        if models.refresh(ctx) {
            let shipment = Shipment::of(models.get());
            bases.send(post, shipment.parcels(), ctx.scheduled);
            post.send(Lane::Models, ctx.scheduled, &Message::Models(shipment));
        }
    }

    fn receive(&mut self, ctx: &TickContext) {
        for _ in 0..MOST_MESSAGES {
            let epoch = self.post.epoch;
            let Some((header, message)) = self.post.receive(ctx.scheduled, true) else { return };
            if self.post.epoch != epoch {
                // The haptic side has begun anew: what it has is not known.
                self.bases = SentBases::default();
            }
            match message {
                Message::Ticks { tool, ticks } => self.pass(ctx, tool.into(), ticks),
                Message::Held(keys) => self.bases.held = keys,
                Message::Ping => {
                    let answer = Message::Pong { sent: header.sent, received: ctx.scheduled };
                    self.post.send(Lane::Urgent, ctx.scheduled, &answer);
                }
                // Of the other direction.
                Message::Models(_) | Message::Basis { .. } | Message::Pong { .. } => {}
            }
        }
    }

    /// Passes on what is new of `ticks`: most of them came before.
    fn pass(&mut self, ctx: &TickContext, tool: usize, ticks: Vec<(u64, Pose)>) {
        let (Some(onward), Some(newest)) = (self.ticks.get_mut(tool), self.newest.get_mut(tool)) else { return };
        for (tick, pose) in ticks {
            if tick > *newest {
                *newest = tick;
                // A full queue is counted; the global model sees the gap and interpolates over it.
                onward.push(ctx, ToolTick { tick, pose });
            }
        }
    }
}

impl SentBases {
    /// Sends what the haptic side lacks of the bases that `parcels` know, those that they need themselves first.
    fn send(&mut self, post: &mut Post, parcels: &[Parcel], now: Nanos) {
        self.give_up_late(now);
        let needed = parcels.iter().filter_map(|parcel| parcel.bases().get(parcel.patch()?)).map(|basis| &**basis);
        // They all know the same.
        let known = parcels.iter().take(1).flat_map(|parcel| parcel.bases().iter());
        for basis in needed.chain(known) {
            let key = key_of(basis.patch());
            if self.begin(key, now) {
                post.send_with(Lane::Bulk, now, |header, bytes| Message::write_basis(key, basis, header, bytes));
            }
        }
    }

    /// What has arrived is on its way no longer, nor what has not for so long that it must be lost.
    fn give_up_late(&mut self, now: Nanos) {
        let Self { on_the_way, held } = self;
        on_the_way.retain(|key, sent| !held.contains(key) && now.saturating_sub(*sent) < SENT_AGAIN);
    }

    /// True if the basis of that name is to be sent now: from then on it is on its way.
    fn begin(&mut self, key: u64, now: Nanos) -> bool {
        let Self { on_the_way, held } = self;
        let begins = on_the_way.len() < MOST_ON_THE_WAY && !on_the_way.contains_key(&key) && !held.contains(&key);
        if begins {
            on_the_way.insert(key, now);
        }
        begins
    }
}

impl Actor for GlobalBridge {
    fn name(&self) -> &str {
        "global bridge"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.send_models(ctx);
        Ok(())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        self.send_models(ctx);
        Outcome::Continue
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        self.receive(ctx);
        Outcome::Continue
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each basis is sent, by a model that is published 30 times a second and knows so many; in which of a hundred periods.
    fn sent(bases: &mut SentBases, known: u64) -> Vec<(u64, u64)> {
        let mut sent = Vec::new();
        for period in 0..100 {
            let now = Nanos(period * 33_333_333);
            bases.give_up_late(now);
            sent.extend((0..known).filter(|&key| bases.begin(key, now)).map(|key| (period, key)));
        }
        sent
    }

    #[test]
    fn a_basis_that_is_lost_is_sent_again_and_no_other() {
        let again = 91; // the first period 3 s after the first
        assert_eq!(sent(&mut SentBases::default(), 2), [(0, 0), (0, 1), (again, 0), (again, 1)]);
        let mut holding = SentBases { held: vec![0], ..SentBases::default() };
        assert_eq!(sent(&mut holding, 2), [(0, 1), (again, 1)]);
    }

    #[test]
    fn few_are_on_their_way_at_a_time() {
        let mut bases = SentBases::default();
        let begun = |bases: &mut SentBases| (0..9).filter(|&key| bases.begin(key, Nanos::ZERO)).collect::<Vec<_>>();
        assert_eq!(begun(&mut bases), [0, 1, 2, 3]);
        bases.held = vec![1, 2];
        bases.give_up_late(Nanos(1));
        assert_eq!(begun(&mut bases), [4, 5]);
    }
}
