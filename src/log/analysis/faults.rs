//! Which faults a restart answered, and which ended a group or the run.

use crate::log::records::{Level, TextEvent};

/// Rate groups whose fault is kept in words: more than any run has.
const FAULTS_KEPT: usize = 1000;

/// The faults that no restart has answered so far, the first of each rate group, and the last restart.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults {
    open: Vec<TextEvent>,
    restart: Option<TextEvent>,
}

impl Faults {
    /// Takes in an event, in time order within each group.
    pub(super) fn push(&mut self, event: &TextEvent) {
        let group = group(event);
        if event.tells_restart() {
            self.open.retain(|fault| fault.time > event.time || self::group(fault) != group);
            self.restart = Some(event.clone());
        } else if event.level == Level::Error
            && self.open.len() < FAULTS_KEPT
            && !self.open.iter().any(|fault| self::group(fault) == group)
        {
            self.open.push(event.clone());
        }
    }

    /// The first fault that no restart has answered.
    pub(super) fn first(&self) -> Option<TextEvent> {
        self.open.iter().min_by_key(|fault| fault.time).cloned()
    }

    /// The last restart.
    pub(super) fn restart(&self) -> Option<TextEvent> {
        self.restart.clone()
    }
}

/// The name of the rate group that `event` was in.
fn group(event: &TextEvent) -> Option<&str> {
    event.message.split_once(": ").map(|(group, _)| group)
}
