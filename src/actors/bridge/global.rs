//! The bridge beside the global actor: tool ticks in, local models and bases out.

use std::collections::BTreeMap;

use super::super::messages::ToolTick;
use super::post::Post;
use super::{MOST_MESSAGES, key_of};
use crate::actors::messages::SurfaceView;
use crate::actors::tunable::Tunable;
use crate::link::{Lane, Message, Transport};
use crate::model::Pose;
use crate::model::body::Stiffness;
use crate::model::contact::Friction;
use crate::model::local::{LocalModels, Parcel, Shipment};
use crate::runtime::{Actor, ActorError, Nanos, Outcome, OutletReader, QueueWriter, Reader, TickContext};

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
    settings: Tunable,
    /// What the haptic side wants friction and stiffness to be, if it has said so.
    wanted: Option<(Friction, Stiffness)>,
    /// The body as it is to be seen on the other side, and the nodes that are.
    surface: Option<(OutletReader<SurfaceView>, Vec<u32>)>,
    is_watched: bool,
}

/// What the global actor and its bridge say to each other.
#[derive(Debug)]
pub struct GlobalBridgePorts {
    /// The next local models: such as are [built elsewhere](crate::model::local::Template::departing).
    pub models: Reader<LocalModels>,
    /// Where the ticks of each tool go.
    pub ticks: Vec<QueueWriter<ToolTick>>,
    /// What the haptic side may change.
    pub settings: Tunable,
    /// The body as it is to be seen on the other side, and the nodes that are; `None` where that sees it anyway.
    pub surface: Option<(OutletReader<SurfaceView>, Vec<u32>)>,
}

/// What the haptic side has.
#[derive(Debug, Default)]
struct SentBases {
    /// When each was sent.
    on_the_way: BTreeMap<u64, Nanos>,
    held: Vec<u64>,
}

impl GlobalBridge {
    /// A bridge between the global actor behind `ports` and what is beyond `transport`.
    pub fn new(transport: Box<dyn Transport>, ports: GlobalBridgePorts) -> Self {
        let GlobalBridgePorts { models, ticks, settings, surface } = ports;
        let (post, newest) = (Post::new(transport), vec![0; ticks.len()]);
        let (bases, wanted, is_watched) = Default::default();
        Self { post, models, ticks, newest, bases, settings, wanted, surface, is_watched }
    }

    fn send_models(&mut self, ctx: &TickContext) {
        let Self { post, models, bases, .. } = self;
        if models.refresh(ctx) {
            let shipment = Shipment::of(models.get());
            bases.send(post, shipment.parcels(), ctx.scheduled);
            post.send(Lane::Models, ctx.scheduled, &Message::Models(shipment));
        }
    }

    fn send_surface(&mut self, now: Nanos) {
        if let Some((surface, nodes)) = self.surface.as_mut().filter(|_| self.is_watched)
            && surface.refresh()
        {
            let SurfaceView { time, positions, stiffness } = surface.get();
            let place = |&node: &u32| positions[node as usize].data.0[0].map(|coordinate| coordinate as f32);
            let places = nodes.iter().map(place).collect();
            self.post.send(Lane::Pictures, now, &Message::Surface { time: *time, stiffness: *stiffness, places });
        }
    }

    /// Sets friction and stiffness as the haptic side wants them, when it wants others than before.
    fn tune(&mut self, wanted: (Friction, Stiffness)) {
        if self.wanted.replace(wanted) == Some(wanted) {
            return;
        }
        let (friction, stiffness) = wanted;
        let set = [self.settings.set_friction(friction), self.settings.set_stiffness(stiffness.factor())];
        for why in set.into_iter().filter_map(Result::err) {
            tracing::warn!("the haptic side wants what cannot be: {why}");
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
                Message::Wants { held, friction, stiffness, is_watched } => {
                    self.bases.held = held;
                    self.tune((friction, stiffness));
                    self.is_watched = is_watched;
                }
                Message::Ping => {
                    let answer = Message::Pong { sent: header.sent, received: ctx.scheduled };
                    self.post.send(Lane::Urgent, ctx.scheduled, &answer);
                }
                // Of the other direction.
                Message::Models(_) | Message::Basis { .. } | Message::Pong { .. } | Message::Surface { .. } => {}
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
        self.send_surface(ctx.scheduled);
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
    use crate::actors::settings::Settings;
    use crate::link::{Conditions, VirtualLink};
    use crate::model::body::Block;
    use crate::model::contact::Equations;
    use crate::model::local::{Kind, Template};
    use crate::model::mesh::Face;
    use crate::runtime::{Execution, Runtime};

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
    fn the_haptic_side_sets_what_it_may_and_nothing_else() {
        let mut graph = Runtime::builder(Execution::Virtual);
        let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Hold };
        let most = Stiffness::times(2.0).unwrap();
        let settings = Tunable::new(graph.parameter(first), most, Equations::default());
        let block = Block::builder([3; 3], [0.02; 3]).fix(Face::ZMin).build().unwrap();
        let template = Template::new(Kind::Hold, [2; 3], &block).unwrap();
        let (_, models) = graph.exchange(move || LocalModels::new(1, || template.departing()));
        let ports = GlobalBridgePorts { models, ticks: Vec::new(), settings: settings.clone(), surface: None };
        let [_, end] = VirtualLink::ends(Conditions::default());
        let mut bridge = GlobalBridge::new(Box::new(end), ports);
        let mut tuned = |friction: f64, factor: f64| {
            bridge.tune((friction.into(), Stiffness::times(factor).unwrap()));
            let Settings { friction, stiffness, .. } = settings.value();
            (friction.kinetic, stiffness.factor())
        };
        assert_eq!(tuned(0.3, 1.5), (0.3, 1.5));
        assert_eq!(tuned(0.2, 2.5), (0.2, 1.5), "stiffer than its steps bear");
        assert_eq!(tuned(1e9, 1.1), (0.2, 1.1), "rougher than anything is");
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
