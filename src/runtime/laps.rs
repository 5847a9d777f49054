//! What each actor of a group takes of a release: the clock is read where the work passes from one to the next.

use super::record::ActorTimes;
use crate::time::Nanos;

/// Measures the actors of one group.
pub(super) struct Laps {
    clock: Box<dyn Fn() -> Nanos + Send>,
    /// Whose work has been under way since when.
    current: Option<(usize, Nanos)>,
    spent: [Nanos; ActorTimes::MAX],
}

impl Laps {
    /// `clock` counts from the start of the run.
    pub(super) fn new(clock: impl Fn() -> Nanos + Send + 'static) -> Self {
        Self { clock: Box::new(clock), current: None, spent: [Nanos::ZERO; ActorTimes::MAX] }
    }

    /// The work of a release begins at `now`.
    pub(super) fn begin(&mut self, now: Nanos) {
        self.spent = [Nanos::ZERO; ActorTimes::MAX];
        self.current = Some((usize::MAX, now));
    }

    /// Actor `next` is called now; what it does until another one is called is its own.
    pub(super) fn pass_to(&mut self, next: usize) {
        match self.current {
            Some((actor, _)) if actor == next => {}
            // What the runtime does before the first is less than reading the clock would take.
            Some((usize::MAX, since)) => self.current = Some((next, since)),
            _ => {
                let now = (self.clock)();
                self.close(now);
                self.current = Some((next, now));
            }
        }
    }

    /// The work was done at `end`: what each actor took.
    pub(super) fn end(&mut self, end: Nanos) -> [Nanos; ActorTimes::MAX] {
        self.close(end);
        self.spent
    }

    fn close(&mut self, now: Nanos) {
        if let Some((actor, since)) = self.current.take() {
            self.spent[actor.min(ActorTimes::MAX - 1)].0 += now.saturating_sub(since).0;
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    // Check that device, model, model, device gives each its own, and that the parts add up to the whole.
    #[test]
    fn every_moment_belongs_to_one_actor() {
        let time = Arc::new(Mutex::new(0));
        let shown = Arc::clone(&time);
        let mut laps = Laps::new(move || Nanos(*shown.lock().unwrap()));
        let at = |ns| *time.lock().unwrap() = ns;
        for start in [100, 1000] {
            laps.begin(Nanos(start));
            laps.pass_to(0);
            at(start + 10);
            laps.pass_to(1);
            at(start + 30);
            laps.pass_to(1);
            at(start + 70);
            laps.pass_to(0);
            let spent = laps.end(Nanos(start + 75));
            assert_eq!(spent[..3], [Nanos(15), Nanos(60), Nanos(0)]);
        }
    }
}
