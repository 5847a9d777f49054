//! The basis actor: reduces the surroundings of patches in the background, those that the tool needs first.

use std::sync::Arc;

use super::basis_store::BasisStore;
use super::cause::Cause;
use crate::model::surroundings::{Bases, SpringGraph};
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
/// Not real-time safe: a release may take seconds. Its group needs a core that the haptic group does not use.
#[derive(Debug)]
pub struct BasisActor {
    springs: Arc<SpringGraph>,
    store: BasisStore,
    /// Bases that one release computes at most.
    most: usize,
    bases: Bases,
    /// Patches whose surroundings cannot be reduced: they are not tried again.
    hopeless: Vec<Vec<u32>>,
    ports: BasisPorts,
}

impl BasisActor {
    /// Of a body with `springs`; bases come from `store`, `bases` are there already, and one release computes
    /// `most` at most.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(springs: Arc<SpringGraph>, store: BasisStore, bases: Bases, most: usize, ports: BasisPorts) -> Self {
        Self { springs, store, most, bases, hopeless: Vec::new(), ports }
    }
}

impl Actor for BasisActor {
    fn name(&self) -> &str {
        "basis"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if !self.ports.wishes.refresh(ctx) {
            return Outcome::Continue;
        }
        let mut outcome = Outcome::Continue;
        let (mut computed, mut known) = (0, 0);
        for patch in &self.ports.wishes.get().patches {
            if computed == self.most {
                break;
            }
            if self.bases.get(patch).is_some() {
                known += 1;
                continue;
            }
            if self.hopeless.contains(patch) {
                continue;
            }
            match self.store.get(&self.springs, patch) {
                Ok(Some(basis)) => {
                    self.bases.insert(Arc::new(basis));
                    computed += 1;
                }
                Ok(None) => self.hopeless.push(patch.clone()),
                Err(_) => {
                    self.hopeless.push(patch.clone());
                    outcome = Outcome::Degraded(Cause::NoBasis.code());
                }
            }
        }
        // A global model that was started again wants what is there already.
        if computed + known > 0 {
            self.ports.bases.buffer().clone_from(&self.bases);
            self.ports.bases.publish(ctx);
        }
        outcome
    }
}
