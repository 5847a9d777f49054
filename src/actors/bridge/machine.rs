//! A haptic machine, as the global side knows it.

use std::sync::Arc;

use super::numbering::Numbering;
use super::post::Post;
use super::sent_bases::{MOST_ON_THE_WAY, SentBases};
use super::{FIRST_EPOCH, SILENCE};
use crate::actors::settings::Settings;
use crate::actors::tunable::Tunable;
use crate::link::{Header, Lane, Message, Transport};
use crate::model::body::Stiffness;
use crate::model::contact::Friction;
use crate::model::local::{LocalModels, Parcel, Shipment};
use crate::model::surroundings::Basis;
use crate::runtime::Nanos;

/// A haptic machine and the tools whose devices are there.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) post: Post,
    /// Its tools.
    pub(super) tools: Vec<usize>,
    pub(super) numbering: Numbering,
    pub(super) bases: SentBases,
    /// It was told that the bases are there that it begins with.
    is_ready: bool,
    /// There is no other machine.
    is_alone: bool,
    /// What it wants friction and stiffness to be, and what one that has changed nothing wants.
    wanted: (Friction, Stiffness),
    unchanged: (Friction, Stiffness),
    /// The number of the message by which it said so last: another one that comes later may have been overtaken.
    said: u64,
    /// It was told that it wants what cannot be.
    is_warned: bool,
    /// Somebody looks at the surface there.
    pub(super) is_watched: bool,
    /// When a sample of a tool came last, and the newest tick of any, as it is counted there.
    pub(super) heard: Nanos,
    pub(super) newest: u64,
    /// The number of the peer behind the transport.
    peer: u64,
}

impl Machine {
    /// The machine of `tools` beyond `transport`, which is alone or not, and wants what there is in `settings` until it says otherwise.
    pub(super) fn new(transport: Box<dyn Transport>, tools: Vec<usize>, is_alone: bool, settings: &Tunable) -> Self {
        let mut post = Post::new(transport);
        let Settings { friction, stiffness, .. } = settings.value();
        let (peer, wanted) = (post.peer(), (friction, stiffness));
        let (bases, is_ready, said, is_warned, is_watched, heard, newest) = Default::default();
        let numbering = Numbering::new(is_alone);
        Self {
            post,
            tools,
            numbering,
            bases,
            is_ready,
            is_alone,
            wanted,
            unchanged: wanted,
            said,
            is_warned,
            is_watched,
            heard,
            newest,
            peer,
        }
    }

    /// True if another one has taken its place: it counts and knows nothing of what the one before did.
    pub(super) fn is_another(&mut self) -> bool {
        let peer = self.post.peer();
        let is_another = std::mem::replace(&mut self.peer, peer) != peer;
        if is_another {
            self.post.begin_epoch(FIRST_EPOCH);
            self.numbering.begin_anew();
            (self.bases, self.is_ready) = (SentBases::default(), false);
            (self.wanted, self.said, self.is_watched, self.newest) = (self.unchanged, 0, false, 0);
        }
        is_another
    }

    /// The next message of it, which may be the first of a newer epoch.
    pub(super) fn receive(&mut self, now: Nanos) -> Option<(Header, Message)> {
        let epoch = self.post.epoch;
        let (header, message) = self.post.receive(now, true)?;
        if self.post.epoch != epoch {
            // It has begun anew: what it has is not known.
            (self.bases, self.said) = (SentBases::default(), 0);
        }
        Some((header, message))
    }

    /// Sends what it lacks of the bases that were `made`, those first that local models of its tools need: few at a time, but all of them
    /// while its session has not begun.
    pub(super) fn send_bases(&mut self, models: &LocalModels, made: &[Arc<Basis>], now: Nanos) {
        let most = if self.is_ready { MOST_ON_THE_WAY } else { usize::MAX };
        let serves_it = |parcel: &&Parcel| self.tools.iter().any(|&tool| models.hosts()[tool] == parcel.tool());
        self.bases.send(&mut self.post, models.parcels().filter(serves_it), made, most, now);
    }

    /// Tells it once, behind the bases that were sent so far, that its session may begin.
    pub(super) fn say_ready(&mut self, now: Nanos) {
        if !std::mem::replace(&mut self.is_ready, true) {
            self.post.send(Lane::Bulk, now, &Message::Ready);
        }
    }

    /// True if it lacks the basis of that name. One that has fallen silent lacks nothing, unless it is the only one.
    pub(super) fn lacks(&self, key: u64, now: Nanos) -> bool {
        let is_there = self.is_alone || now.saturating_sub(self.heard) < SILENCE;
        is_there && !self.bases.has(key)
    }

    /// Sends what local models of its tools are built from. Models in which its tools rest because nothing comes from it are as old there as
    /// its last sample.
    pub(super) fn send_models(&mut self, mut shipment: Shipment, now: Nanos) {
        shipment.set_tick(self.numbering.there(shipment.tick()).min(self.newest));
        self.post.send(Lane::Models, now, &Message::Models(shipment));
    }

    /// True if nothing has been said since that has a higher `number`.
    pub(super) fn is_newest_said(&mut self, number: u64) -> bool {
        let is_newest = number > self.said;
        self.said = self.said.max(number);
        is_newest
    }

    /// Sets friction and stiffness as the machine wants them, each when it wants another one than before. What cannot be is told once.
    pub(super) fn tune(&mut self, settings: &Tunable, wanted: (Friction, Stiffness)) {
        let before = std::mem::replace(&mut self.wanted, wanted);
        let (friction, stiffness) = wanted;
        let set = [
            (friction != before.0).then(|| settings.set_friction(friction)),
            (stiffness != before.1).then(|| settings.set_stiffness(stiffness.factor())),
        ];
        for why in set.into_iter().flatten().filter_map(Result::err) {
            if !std::mem::replace(&mut self.is_warned, true) {
                tracing::warn!("the haptic side wants what cannot be: {why}; more like it is not told");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Conditions, VirtualLink};
    use crate::model::contact::Equations;
    use crate::model::local::Kind;
    use crate::runtime::{Execution, Runtime};

    /// Of a body that may become twice as stiff.
    fn settings() -> Tunable {
        let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Hold };
        let parameter = Runtime::builder(Execution::Virtual).parameter(first);
        Tunable::new(parameter, Stiffness::times(2.0).unwrap(), Equations::default())
    }

    #[test]
    fn it_sets_what_it_may_and_nothing_else() {
        let settings = settings();
        let [_, end] = VirtualLink::ends(Conditions::default());
        let mut machine = Machine::new(Box::new(end), vec![0], true, &settings);
        let mut tuned = |friction: f64, factor: f64| {
            machine.tune(&settings, (friction.into(), Stiffness::times(factor).unwrap()));
            let Settings { friction, stiffness, .. } = settings.value();
            (friction.kinetic, stiffness.factor())
        };
        assert_eq!(tuned(0.3, 1.5), (0.3, 1.5));
        assert_eq!(tuned(0.2, 2.5), (0.2, 1.5), "stiffer than its steps bear");
        assert_eq!(tuned(1e9, 1.1), (0.2, 1.1), "rougher than anything is");
    }

    #[test]
    fn what_was_overtaken_is_not_heard_and_another_machine_begins_to_count_anew() {
        let settings = settings();
        let [_, end] = VirtualLink::ends(Conditions::default());
        let mut machine = Machine::new(Box::new(end), vec![0], true, &settings);
        assert_eq!([3, 2, 3, 7].map(|number| machine.is_newest_said(number)), [true, false, false, true]);
        machine.peer += 1;
        assert!(machine.is_another() && machine.is_newest_said(1));
    }

    #[test]
    fn one_that_changes_nothing_leaves_what_another_has_changed() {
        let settings = settings();
        let [here, there] = VirtualLink::ends(Conditions::default());
        let mut machines =
            [(here, 0), (there, 1)].map(|(end, tool)| Machine::new(Box::new(end), vec![tool], false, &settings));
        let mut says = |machine: usize, friction: f64, factor: f64| {
            machines[machine].tune(&settings, (friction.into(), Stiffness::times(factor).unwrap()));
            let Settings { friction, stiffness, .. } = settings.value();
            (friction.kinetic, stiffness.factor())
        };
        let friction = [(0, 0.2), (1, 0.5), (0, 0.2), (1, 0.4), (0, 0.2)].map(|(one, mu)| says(one, mu, 1.0));
        assert_eq!(friction, [0.2, 0.2, 0.2, 0.4, 0.4].map(|mu| (mu, 1.0)));
        assert_eq!([says(0, 0.2, 1.5), says(1, 0.3, 1.0)], [(0.4, 1.5), (0.3, 1.5)], "the one setting, not the other");
    }
}
