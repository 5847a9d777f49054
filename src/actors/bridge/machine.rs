//! A haptic machine, as the global side knows it.

use super::FIRST_EPOCH;
use super::numbering::Numbering;
use super::post::Post;
use super::sent_bases::SentBases;
use crate::actors::settings::Settings;
use crate::actors::tunable::Tunable;
use crate::link::{Lane, Message, Transport};
use crate::model::body::Stiffness;
use crate::model::contact::Friction;
use crate::model::local::Shipment;
use crate::runtime::Nanos;

/// A haptic machine and the tools whose devices are there.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) post: Post,
    /// Its tools.
    pub(super) tools: Vec<usize>,
    pub(super) numbering: Numbering,
    pub(super) bases: SentBases,
    /// What it wants friction and stiffness to be, and what one that has changed nothing wants.
    wanted: (Friction, Stiffness),
    unchanged: (Friction, Stiffness),
    /// Somebody looks at the surface there.
    pub(super) is_watched: bool,
    /// When a sample of a tool came last.
    pub(super) heard: Nanos,
    /// The number of the peer behind the transport.
    peer: u64,
    is_alone: bool,
}

impl Machine {
    /// The machine of `tools` beyond `transport`, which is alone or not, and wants what there is in `settings` until it says otherwise.
    pub(super) fn new(transport: Box<dyn Transport>, tools: Vec<usize>, is_alone: bool, settings: &Tunable) -> Self {
        let mut post = Post::new(transport);
        let Settings { friction, stiffness, .. } = settings.value();
        let (peer, wanted) = (post.peer(), (friction, stiffness));
        let (bases, is_watched, heard) = Default::default();
        let numbering = Numbering::new(is_alone);
        Self { post, tools, numbering, bases, wanted, unchanged: wanted, is_watched, heard, peer, is_alone }
    }

    /// True if another one has taken its place: it counts and knows nothing of what the one before did.
    pub(super) fn is_another(&mut self) -> bool {
        let peer = self.post.peer();
        let is_another = std::mem::replace(&mut self.peer, peer) != peer;
        if is_another {
            self.post.begin_epoch(FIRST_EPOCH);
            (self.bases, self.numbering) = (SentBases::default(), Numbering::new(self.is_alone));
            (self.wanted, self.is_watched) = (self.unchanged, false);
        }
        is_another
    }

    /// The next message of it, which may be the first of a newer epoch.
    pub(super) fn receive(&mut self, now: Nanos) -> Option<(Nanos, Message)> {
        let epoch = self.post.epoch;
        let (header, message) = self.post.receive(now, true)?;
        if self.post.epoch != epoch {
            // It has begun anew: what it has is not known.
            self.bases = SentBases::default();
        }
        Some((header.sent, message))
    }

    /// Sends what local models of its tools are built from, and the bases that it lacks for them.
    pub(super) fn send_models(&mut self, mut shipment: Shipment, now: Nanos) {
        self.bases.send(&mut self.post, shipment.parcels(), now);
        shipment.set_tick(self.numbering.there(shipment.tick()));
        self.post.send(Lane::Models, now, &Message::Models(shipment));
    }

    /// Sets friction and stiffness as the machine wants them, when it wants others than before.
    pub(super) fn tune(&mut self, settings: &Tunable, wanted: (Friction, Stiffness)) {
        if std::mem::replace(&mut self.wanted, wanted) == wanted {
            return;
        }
        let (friction, stiffness) = wanted;
        let set = [settings.set_friction(friction), settings.set_stiffness(stiffness.factor())];
        for why in set.into_iter().filter_map(Result::err) {
            tracing::warn!("the haptic side wants what cannot be: {why}");
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

    #[test]
    fn it_sets_what_it_may_and_nothing_else() {
        let mut graph = Runtime::builder(Execution::Virtual);
        let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Hold };
        let most = Stiffness::times(2.0).unwrap();
        let settings = Tunable::new(graph.parameter(first), most, Equations::default());
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
    fn one_that_changes_nothing_leaves_what_another_has_changed() {
        let mut graph = Runtime::builder(Execution::Virtual);
        let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Hold };
        let settings = Tunable::new(graph.parameter(first), Stiffness::times(2.0).unwrap(), Equations::default());
        let [here, there] = VirtualLink::ends(Conditions::default());
        let mut machines =
            [(here, 0), (there, 1)].map(|(end, tool)| Machine::new(Box::new(end), vec![tool], false, &settings));
        let mut says = |machine: usize, friction: f64| {
            machines[machine].tune(&settings, (friction.into(), Stiffness::default()));
            settings.value().friction.kinetic
        };
        assert_eq!([says(0, 0.2), says(1, 0.5), says(0, 0.2), says(1, 0.4), says(0, 0.2)], [0.2, 0.2, 0.2, 0.4, 0.4]);
    }
}
