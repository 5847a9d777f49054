//! The basis actor: reduces the surroundings of patches in the background, those that the tool needs first.

use std::sync::Arc;

use super::basis_store::BasisStore;
use super::cause::Cause;
use crate::error::Error;
use crate::model::surroundings::{Bases, Basis, Reduction, RestingBody};
use crate::runtime::{Actor, Outcome, Reader, TickContext, Writer};

/// Patches whose surroundings are wanted.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Node ids of each patch in increasing order, the most urgent first.
    pub patches: Vec<Vec<u32>>,
}

/// The ports of a [`BasisActor`].
#[derive(Debug)]
pub struct BasisPorts {
    /// What the global actor wants.
    pub wishes: Reader<Wishes>,
    /// All that are there.
    pub bases: Writer<Bases>,
}

/// Computes reduced surroundings.
///
/// # Real-time
/// Not real-time safe: a release may take a second. Its group needs a core that the haptic group does not use.
#[derive(Debug)]
pub struct BasisActor {
    resting: Arc<RestingBody>,
    store: BasisStore,
    pace: Pace,
    bases: Bases,
    /// What a release has begun and the next ones go on with.
    begun: Option<Reduction>,
    /// Patches whose surroundings cannot be reduced: they are not tried again.
    hopeless: Vec<Vec<u32>>,
    ports: BasisPorts,
}

impl BasisActor {
    /// Of the body `resting`; bases come from `store`, and `bases` are there already.
    pub(crate) fn new(
        resting: Arc<RestingBody>,
        store: BasisStore,
        bases: Bases,
        pace: Pace,
        ports: BasisPorts,
    ) -> Self {
        Self { resting, store, pace, bases, begun: None, hopeless: Vec::new(), ports }
    }

    /// Goes on with what was begun. For a large body it does one part only: a stop does not wait for more.
    fn go_on(&mut self) -> Result<Option<Basis>, Error> {
        while let Some(reduction) = &mut self.begun {
            let advanced = reduction.advance(&self.resting);
            if !matches!(advanced, Ok(None)) {
                self.begun = None;
                let basis = advanced?;
                basis.iter().for_each(|basis| self.store.keep(&self.resting, basis));
                return Ok(basis);
            }
            if reduction.is_large() && self.pace == Pace::OneByOne {
                break;
            }
        }
        Ok(None)
    }

    /// The basis of `patch`, if it can be had in this release.
    fn get(&mut self, patch: &[u32]) -> Result<Option<Basis>, Error> {
        if let Some(basis) = self.store.read(&self.resting, patch) {
            return Ok(Some(basis));
        }
        self.begun = Reduction::new(&self.resting, patch, self.store.size);
        if self.begun.is_none() {
            self.hopeless.push(patch.to_vec());
        }
        self.go_on()
    }

    /// Keeps what was made for `patch`; true if there is a basis more.
    fn settle(&mut self, patch: Vec<u32>, made: Result<Option<Basis>, Error>, outcome: &mut Outcome) -> bool {
        match made {
            Ok(basis) => basis.map(|basis| self.bases.insert(Arc::new(basis))).is_some(),
            Err(_) => {
                self.hopeless.push(patch);
                *outcome = Outcome::Degraded(Cause::NoBasis.code());
                false
            }
        }
    }

    fn publish(&mut self, ctx: &TickContext) {
        self.ports.bases.buffer().clone_from(&self.bases);
        self.ports.bases.publish(ctx);
    }
}

/// How many bases a release makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// All that are wanted: in virtual time they take as long as they are said to.
    All,
    /// One, or a part of one for a large body: what is wanted changes meanwhile.
    OneByOne,
}

impl Actor for BasisActor {
    fn name(&self) -> &str {
        "basis"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let (mut outcome, mut has_news) = (Outcome::Continue, false);
        if let Some(patch) = self.begun.as_ref().map(|reduction| reduction.patch().to_vec()) {
            let made = self.go_on();
            has_news = self.settle(patch, made, &mut outcome);
        } else if self.ports.wishes.refresh(ctx) {
            for patch in self.ports.wishes.get().patches.clone() {
                if self.bases.get(&patch).is_some() {
                    // A global model that was started again wants what is there already.
                    has_news = true;
                    continue;
                }
                if self.hopeless.contains(&patch) {
                    continue;
                }
                let made = self.get(&patch);
                let is_tried = made.is_ok();
                has_news |= self.settle(patch, made, &mut outcome);
                if is_tried && self.pace == Pace::OneByOne {
                    break;
                }
            }
        }
        if has_news {
            self.publish(ctx);
        }
        outcome
    }
}
