//! What ran ahead for one tool, for the others: they expect the same of all tools, and of the body.

use super::moving::Moving;
use crate::body::{State, Stiffness};
use crate::contact::{Law, ToolMotion};

/// The states of a run ahead, with what it began from.
#[derive(Debug, Default)]
pub(super) struct Recorded {
    /// Of every tool in every step.
    motions: Vec<ToolMotion>,
    law: Law,
    stiffness: Stiffness,
    /// The first so many are of this run; what follows is memory for a longer one.
    states: Vec<State>,
    count: usize,
    /// Runs so far.
    pub(super) begun: usize,
}

impl Recorded {
    /// True if a run from `now` along `motions` under the law of `whole` would show the same.
    pub(super) fn is_of(&self, motions: &Vec<ToolMotion>, now: &State, whole: &Moving) -> bool {
        let first = self.states[..self.count].first();
        let is_same_law = self.law == whole.law && self.stiffness == whole.body.stiffness();
        is_same_law && self.motions == *motions && first == Some(now)
    }

    /// A run along `motions` begins.
    pub(super) fn begin(&mut self, motions: Vec<ToolMotion>, whole: &Moving) {
        (self.motions, self.law, self.stiffness, self.count) = (motions, whole.law, whole.body.stiffness(), 0);
        self.begun += 1;
    }

    /// Adds the next state.
    pub(super) fn push(&mut self, state: &State) {
        match self.states.get_mut(self.count) {
            Some(place) => place.clone_from(state),
            None => self.states.push(state.clone()),
        }
        self.count += 1;
    }

    /// The run came to no end, or was one of another part of the body.
    pub(super) fn forget(&mut self) {
        self.count = 0;
    }

    /// Its states in order.
    pub(super) fn states(&self) -> impl Iterator<Item = &State> {
        self.states[..self.count].iter()
    }
}
