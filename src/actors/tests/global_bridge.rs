//! The bridge beside the global actor driven by hand: which bases a machine gets that takes the place of another one, and when.

use std::sync::{Arc, Mutex};

use super::*;
use crate::actors::settings::Settings;
use crate::link::Header;
use crate::model::body::{Block, Body, Stiffness};
use crate::model::contact::Equations;
use crate::model::local::{Kind, Template};
use crate::model::mesh::Face;
use crate::model::surroundings::{Bases, Basis, RestingBody};
use crate::runtime::{Execution, Runtime};

const RATE: Rate = Rate::hz(30);
/// More than are on their way at a time while a session runs.
const KNOWN: usize = 6;

/// The global side's end of the way to a machine.
#[derive(Clone, Debug, Default)]
struct Way(Arc<Mutex<Held>>);

#[derive(Debug, Default)]
struct Held {
    /// What went with the bases.
    sent: Vec<Vec<u8>>,
    coming: VecDeque<Vec<u8>>,
    numbered: u64,
    peer: u64,
}

impl Way {
    /// The machine says which bases it has.
    fn says(&self, held: &[u64]) {
        let way = &mut *self.0.lock().unwrap();
        way.numbered += 1;
        let header = Header { epoch: 1, number: way.numbered, sent: Nanos::ZERO };
        let (friction, stiffness) = (0.5.into(), Stiffness::default());
        let mut bytes = Vec::new();
        Message::Wants { held: held.to_vec(), friction, stiffness, is_watched: false }.write(header, &mut bytes);
        way.coming.push_back(bytes);
    }

    /// The bases that were sent since it was last asked, and how many of them in front of the word that the machine may begin.
    fn bases(&self) -> (Vec<u64>, Option<usize>) {
        let (mut keys, mut ready) = (Vec::new(), None);
        for bytes in std::mem::take(&mut self.0.lock().unwrap().sent) {
            match Message::read(&bytes).unwrap().1 {
                Message::Basis { key, .. } => keys.push(key),
                Message::Ready => ready = Some(keys.len()),
                _ => {}
            }
        }
        (keys, ready)
    }
}

impl Transport for Way {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        if lane == Lane::Bulk {
            self.0.lock().unwrap().sent.push(message.to_vec());
        }
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        self.0.lock().unwrap().coming.pop_front().map(|next| *message = next).is_some()
    }

    fn peer(&mut self) -> u64 {
        self.0.lock().unwrap().peer
    }
}

/// A body with some bases, each of another patch of its top.
fn body_and_bases() -> (Block, Bases) {
    let block = Block::builder([6; 3], [0.1; 3]).fix(Face::ZMin).build().unwrap();
    let (resting, mut bases) = (RestingBody::new(&block).unwrap(), Bases::default());
    for [x, y] in [1, 2, 3].into_iter().flat_map(|x| [1, 3].map(|y| [x, y])) {
        let mut patch = Vec::new();
        block.patch(&[block.surface().at_node(block.lattice().id([x, y, 5]))[0]], [2, 2, 1], &mut patch);
        bases.insert(Basis::compute(&resting, &patch, 6).unwrap().unwrap().into());
    }
    assert_eq!(bases.len(), KNOWN);
    (block, bases)
}

#[test]
fn a_machine_in_the_place_of_another_gets_all_bases_before_it_begins_and_no_model_of_those_that_it_lacks() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (block, known) = body_and_bases();
    let template = Template::new(Kind::Predictive, [2, 2, 1], &block).unwrap();
    let (mut models, ready) = graph.exchange(move || LocalModels::new(2, || template.departing()));
    let (_made, made) = graph.exchange(Bases::default);
    let (passed, mut there) = graph.exchange(Bases::default);
    let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Predictive };
    let settings = Tunable::new(graph.parameter(first), Stiffness::times(2.0).unwrap(), Equations::default());
    let ports = GlobalBridgePorts {
        models: ready,
        bases: Some(BasesPorts { made, passed, known: known.clone() }),
        tools: [0, 1].map(|_| (Pose::default(), graph.queue(8).0)).into(),
        settings,
        surface: None,
        haptic: Rate::hz(1000),
    };
    let [left, right] = [Way::default(), Way::default()];
    let machines =
        [&left, &right].into_iter().zip(0..).map(|(way, tool)| -> Beyond { (Box::new(way.clone()), vec![tool]) });
    let mut bridge = GlobalBridge::new(machines.collect(), ports);
    bridge.start(&TickContext::by_hand(RATE, 0)).unwrap();
    let (keys, before) = right.bases();
    assert_eq!((keys.len(), before), (KNOWN, Some(KNOWN)));
    let mut release = 0;
    // How many bases the global actor may take after another release with new models, if that has changed.
    let mut passed = || {
        release += 1;
        let ctx = TickContext::by_hand(RATE, release);
        models.publish(&ctx);
        bridge.tick(&ctx);
        bridge.commit(&ctx);
        there.refresh(&ctx).then(|| there.get().len())
    };
    [&left, &right].iter().for_each(|way| way.says(&keys));
    assert_eq!([passed(), passed()], [None; 2], "all have what the global actor knows already");

    right.0.lock().unwrap().peer += 1;
    right.0.lock().unwrap().numbered = 0;
    assert_eq!([passed(), passed()], [None; 2]);
    let (sent, before) = right.bases();
    assert_eq!((sent.len(), before), (KNOWN, Some(KNOWN)), "all of them before it may begin");
    right.says(&keys[..2]);
    assert_eq!(passed(), Some(2), "the others were lost");
    right.says(&keys);
    assert_eq!([passed(), passed()], [None, Some(KNOWN)]);
}
