//! The basis actor: reduces the surroundings of patches in the background, those that the tool needs first.

use std::collections::VecDeque;
use std::sync::Arc;

use super::basis_store::BasisStore;
use super::cause::Cause;
use crate::error::Error;
use crate::model::surroundings::{Bases, Basis, Reduction, RestingBody};
use crate::runtime::{Actor, Nanos, Outcome, Reader, TickContext, Writer};

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

/// How long a basis takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As long as it takes; a large body's is made in parts, as a stop does not wait for more.
    Measured,
    /// What it takes on no machine in particular.
    Nominal,
    /// So long, each.
    Given(Nanos),
}

/// Computes reduced surroundings, one after the other.
///
/// # Real-time
/// Not real-time safe: a release may take a second. Its group needs a core that the haptic group does not use.
#[derive(Debug)]
pub struct BasisActor {
    resting: Arc<RestingBody>,
    store: BasisStore,
    pace: Pace,
    /// The time between two releases.
    period: Nanos,
    bases: Bases,
    /// What a release has begun and the next ones go on with.
    begun: Option<Begun>,
    /// What was made, with the time from which it is there.
    made: VecDeque<(Nanos, Made)>,
    /// Patches whose surroundings cannot be reduced: they are not tried again.
    hopeless: Vec<Vec<u32>>,
    ports: BasisPorts,
}

/// The basis of a large body: each release does a part of it.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one at a time, in an actor")]
enum Begun {
    Making(Reduction),
    /// One that was kept takes as many releases: what is on a disk decides nothing.
    Kept(Basis, usize),
}

/// A patch and its basis, if there is one.
type Made = (Vec<u32>, Result<Option<Basis>, Error>);

impl BasisActor {
    /// Of the body `resting`, with a release in each `period`; bases come from `store`, and `bases` are there already.
    pub(crate) fn new(
        resting: Arc<RestingBody>,
        store: BasisStore,
        bases: Bases,
        (pace, period): (Pace, Nanos),
        ports: BasisPorts,
    ) -> Self {
        let (begun, made, hopeless) = Default::default();
        Self { resting, store, pace, period, bases, begun, made, hopeless, ports }
    }

    /// Makes the basis of `patch`, or begins it; with the time that this takes, if that is none of the machine's.
    fn make(&mut self, patch: &[u32]) -> (Nanos, Option<Made>) {
        let Some(reduction) = Reduction::new(&self.resting, patch, self.store.states()) else {
            return (Nanos::ZERO, Some((patch.to_vec(), Ok(None))));
        };
        let cost = match self.pace {
            Pace::Measured => Nanos::ZERO,
            Pace::Nominal => Nanos::from_secs_f64(reduction.nominal()),
            Pace::Given(cost) => cost,
        };
        let in_parts = reduction.is_large() && self.pace == Pace::Measured;
        self.begun = Some(match self.store.kept(&self.resting, &reduction) {
            Some(kept) => Begun::Kept(kept, reduction.parts()),
            None => Begun::Making(reduction),
        });
        (cost, if in_parts { self.go_on() } else { std::iter::repeat_with(|| self.go_on()).flatten().next() })
    }

    /// Does the next part of what was begun; what was made, after the last.
    fn go_on(&mut self) -> Option<Made> {
        match self.begun.take()? {
            Begun::Kept(basis, 1) => Some((basis.patch().to_vec(), Ok(Some(basis)))),
            Begun::Kept(basis, parts) => {
                self.begun = Some(Begun::Kept(basis, parts - 1));
                None
            }
            Begun::Making(mut reduction) => match self.store.advance(&self.resting, &mut reduction) {
                Ok(None) => {
                    self.begun = Some(Begun::Making(reduction));
                    None
                }
                made => Some((reduction.patch().to_vec(), made)),
            },
        }
    }

    /// Makes what is wanted, as much of it as is begun before the next release; true if what is there already is wanted.
    fn grant_wishes(&mut self, ctx: &TickContext) -> bool {
        let next = ctx.scheduled + self.period;
        let mut free = self.made.back().map_or(ctx.scheduled, |&(due, _)| due.max(ctx.scheduled));
        if free >= next || !self.ports.wishes.refresh(ctx) {
            return false;
        }
        let mut has_forgotten = false;
        for patch in self.ports.wishes.get().patches.clone() {
            let is_made = self.made.iter().any(|(_, (made, _))| *made == patch);
            let is_there = self.bases.get(&patch).is_some();
            // A global model that was started again wants what is there already, and so does one that gets it over a bridge later.
            has_forgotten |= is_there;
            if is_made || is_there || self.hopeless.contains(&patch) {
                continue;
            }
            let (cost, made) = self.make(&patch);
            free = free + cost;
            self.made.extend(made.map(|made| (free, made)));
            if free >= next || self.pace == Pace::Measured {
                break;
            }
        }
        has_forgotten
    }

    /// Takes over what is there by now; true if there is a basis more.
    fn settle(&mut self, now: Nanos, outcome: &mut Outcome) -> bool {
        let before = self.bases.len();
        while let Some((_, (patch, made))) = self.made.pop_front_if(|(due, _)| *due <= now) {
            match made {
                Ok(Some(basis)) => self.bases.insert(Arc::new(basis)),
                Ok(None) => self.hopeless.push(patch),
                Err(_) => {
                    self.hopeless.push(patch);
                    *outcome = Outcome::Degraded(Cause::NoBasis.code());
                }
            }
        }
        self.bases.len() > before
    }
}

impl Actor for BasisActor {
    fn name(&self) -> &str {
        "basis"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let mut outcome = Outcome::Continue;
        let mut has_news = self.settle(ctx.scheduled, &mut outcome);
        match self.begun {
            Some(_) => {
                let made = self.go_on();
                self.made.extend(made.map(|made| (ctx.scheduled, made)));
            }
            None => has_news |= self.grant_wishes(ctx),
        }
        has_news |= self.settle(ctx.scheduled, &mut outcome);
        if has_news {
            self.ports.bases.buffer().clone_from(&self.bases);
            self.ports.bases.publish(ctx);
        }
        outcome
    }
}

#[cfg(test)]
#[path = "tests/basis.rs"]
mod tests;
