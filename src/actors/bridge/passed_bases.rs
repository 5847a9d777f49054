//! The bases on their way from the basis actor to the global one: what the haptic machines lack is not there yet.

use std::sync::Arc;

use super::key_of;
use super::machine::Machine;
use crate::model::surroundings::{Bases, Basis};
use crate::runtime::{Reader, TickContext, Writer};

/// The way of the bases from their maker to the global actor.
#[derive(Debug)]
pub struct BasesPorts {
    /// All that are made.
    pub made: Reader<Bases>,
    /// Those that local models may be built with.
    pub passed: Writer<Bases>,
    /// Those that are there before the start.
    pub known: Bases,
}

/// Passes a basis on to the global actor when the machines have it. A model in a window whose basis is not there yet would serve without:
/// a basis takes longer over the link than the model that needs it, and longer still where packets are lost.
#[derive(Debug)]
pub(super) struct PassedBases {
    ports: BasesPorts,
    /// All that there are, in the order in which they came: the first were wanted first.
    pub(super) made: Vec<Arc<Basis>>,
    passed: Bases,
}

impl PassedBases {
    pub(super) fn new(ports: BasesPorts) -> Self {
        // The first ones are sent before the session begins, and the global actor has them.
        let (made, passed) = (ports.known.iter().cloned().collect(), ports.known.clone());
        Self { ports, made, passed }
    }

    /// Takes what has been made; true if something has, or if the same has been published again.
    pub(super) fn take(&mut self, ctx: &TickContext) -> bool {
        let has_news = self.ports.made.refresh(ctx);
        if has_news {
            let is_new = |basis: &&Arc<Basis>| !self.made.iter().any(|known| Arc::ptr_eq(known, basis));
            let new: Vec<_> = self.ports.made.get().iter().filter(is_new).cloned().collect();
            self.made.extend(new);
        }
        has_news
    }

    /// Passes on what none of the `machines` lacks by now, and all of it again if it is to be `told` again.
    pub(super) fn pass(&mut self, ctx: &TickContext, machines: &[Machine], told: bool) {
        let Self { made, passed, .. } = self;
        let before = passed.len();
        for basis in made.iter() {
            let is_there = || {
                let key = key_of(basis.patch());
                !machines.iter().any(|machine| machine.lacks(key, ctx.scheduled))
            };
            if passed.get(basis.patch()).is_none() && is_there() {
                passed.insert(basis.clone());
            }
        }
        if told || passed.len() > before {
            self.publish(ctx);
        }
    }

    /// Takes back what `machine` lacks, which says what it has for the first time: until the rest is there, models are to do without, or be of
    /// other windows.
    pub(super) fn take_back(&mut self, ctx: &TickContext, machine: &Machine) {
        let before = self.passed.len();
        self.passed.retain(|basis| machine.bases.has(key_of(basis.patch())));
        if self.passed.len() < before {
            self.publish(ctx);
        }
    }

    fn publish(&mut self, ctx: &TickContext) {
        self.ports.passed.buffer().clone_from(&self.passed);
        self.ports.passed.publish(ctx);
    }
}
