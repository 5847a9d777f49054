//! The disturbances of a session's rate groups, kept until there is a graph to give them to.

use std::fmt;

use crate::runtime::{Disturbance, RuntimeBuilder};

/// Says what goes wrong with the release of this number.
type Source = Box<dyn FnMut(u64) -> Disturbance + Send>;

/// What disturbs which group.
#[derive(Default)]
pub(super) struct Disturbed(Vec<(String, Source)>);

impl Disturbed {
    pub(super) fn add(&mut self, group: String, disturbance: impl FnMut(u64) -> Disturbance + Send + 'static) {
        self.0.push((group, Box::new(disturbance)));
    }

    /// Hands everything over; the graph refuses what cannot be.
    pub(super) fn apply(self, graph: &mut RuntimeBuilder) {
        for (group, source) in self.0 {
            graph.disturb(group, source);
        }
    }
}

impl fmt::Debug for Disturbed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.0.iter().map(|(group, _)| group)).finish()
    }
}
