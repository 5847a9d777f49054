//! The actors of one group: every call to them is caught, and one that fails is out for the rest.

use crate::actor::{Actor, Outcome, TickContext};
use crate::error::{GraphError, GraphErrorKind};
use crate::group::panic_hook::{caught, guarded};
use crate::records::timing::ActorTimes;
use crate::time::Nanos;

/// An actor in its group.
struct Member {
    actor: Box<dyn Actor>,
    /// Kept apart: after a panic an actor is not asked anything but to stop.
    name: String,
    started: bool,
    /// It panicked or reported a fault while the others wind down: it was stopped and is not called again.
    failed: bool,
    /// It panicked and went on for the wind-down: the next panic is its last.
    recovered: bool,
}

/// What an actor did that ends a release early.
pub(crate) enum Fatal {
    Panic(String),
    Fault(u32),
}

/// The actor with this number did it.
pub(crate) type Broken = (usize, Fatal);

/// The actors in the order of their ticks.
pub(crate) struct Members(Vec<Member>);

impl Members {
    pub(crate) fn new(actors: Vec<Box<dyn Actor>>) -> Self {
        let member = |actor: Box<dyn Actor>| {
            let name = guarded(|| actor.name().to_owned()).unwrap_or_else(|text| format!("nameless: {text}"));
            Member { actor, name, started: false, failed: false, recovered: false }
        };
        Self(actors.into_iter().map(member).collect())
    }

    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn all_failed(&self) -> bool {
        self.0.iter().all(|member| member.failed)
    }

    pub(crate) fn names(&self) -> Vec<String> {
        self.0.iter().map(|member| member.name.clone()).collect()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        &self.0[index].name
    }

    /// Starts the actors in order. On an error the ones started stay started: see [`undo_start`](Self::undo_start).
    pub(crate) fn start(&mut self, ctx: &TickContext, group: &str) -> Result<(), GraphError> {
        for (index, Member { actor, name, started, .. }) in self.0.iter_mut().enumerate() {
            let ctx = &of_actor(ctx, index);
            let place = || format!("rate group `{group}`, actor `{name}`");
            // Noted first: an actor that fails half-way may hold something to give back.
            *started = true;
            let panicked =
                |text| GraphError::new(GraphErrorKind::Actor, format!("panicked in start: {text}")).at(place());
            let result = caught(|| actor.start(ctx)).map_err(panicked)?;
            result.map_err(|error| GraphError::from_actor(error).at(place()))?;
        }
        Ok(())
    }

    /// Stops the actors that were started, when another one's start failed.
    pub(crate) fn undo_start(&mut self, ctx: &TickContext) {
        for member in self.0.iter_mut().filter(|member| member.started) {
            // The start's error is the one to report.
            let _ = caught(|| member.actor.stop(ctx));
        }
    }

    /// Asks the first actor to wait for its device: true if that has something new.
    pub(crate) fn wait(&mut self, timeout: Nanos) -> Result<bool, Broken> {
        let Some(member) = self.0.first_mut().filter(|member| !member.failed) else { return Ok(false) };
        guarded(|| member.actor.wait(timeout)).map_err(|text| (0, Fatal::Panic(format!("{text} (in wait)"))))
    }

    /// All ticks, then all commits in reverse; the first code of a degraded result, if there was one.
    pub(crate) fn work(
        &mut self,
        ctx: &TickContext,
        mut timer: Option<&mut ActorTimer>,
    ) -> Result<Option<u32>, Broken> {
        let mut current = 0;
        let mut degraded = None;
        let members = &mut self.0;
        let work = || {
            let mut note = |outcome| match outcome {
                Outcome::Continue => Ok(()),
                Outcome::Degraded(code) => {
                    degraded.get_or_insert(code);
                    Ok(())
                }
                Outcome::Fault(code) => Err(code),
            };
            let mut call = |index| {
                current = index;
                timer.iter_mut().for_each(|timer| timer.pass_to(index));
            };
            for (index, member) in members.iter_mut().enumerate().filter(|(_, member)| !member.failed) {
                call(index);
                note(member.actor.tick(&of_actor(ctx, index)))?;
            }
            for (index, member) in members.iter_mut().enumerate().rev().filter(|(_, member)| !member.failed) {
                call(index);
                note(member.actor.commit(&of_actor(ctx, index)))?;
            }
            Ok(())
        };
        match guarded(work) {
            Ok(Ok(())) => Ok(degraded),
            Ok(Err(code)) => Err((current, Fatal::Fault(code))),
            Err(text) => Err((current, Fatal::Panic(text))),
        }
    }

    /// An actor has panicked: true if it can go on without what failed. It is asked once.
    pub(crate) fn recovers(&mut self, index: usize) -> bool {
        let member = &mut self.0[index];
        if std::mem::replace(&mut member.recovered, true) {
            return false;
        }
        guarded(|| member.actor.recover()).unwrap_or(false)
    }

    /// Stops an actor before the others: what it holds must not wait for them.
    pub(crate) fn fail(&mut self, index: usize, ctx: &TickContext) {
        let member = &mut self.0[index];
        if !std::mem::replace(&mut member.failed, true) {
            // The fault that led here is the one to report.
            let _ = guarded(|| member.actor.stop(ctx));
        }
    }

    /// Stops and drops the next actor; `None` after the last. An error is its panic, the others still stop.
    pub(crate) fn stop_next(&mut self, ctx: &TickContext) -> Option<Result<(), (String, Fatal)>> {
        if self.0.is_empty() {
            return None;
        }
        let Member { mut actor, name, failed, .. } = self.0.remove(0);
        let stop = || {
            if !failed {
                actor.stop(ctx);
            }
        };
        let stopped = guarded(stop);
        let dropped = guarded(move || drop(actor));
        Some(stopped.and(dropped).map_err(|text| (name, Fatal::Panic(format!("{text} (in stop)")))))
    }
}

/// Actors that nobody stops any more, on a thread that was left behind or after a start that failed, are contained to
/// the end.
impl Drop for Members {
    fn drop(&mut self) {
        for member in self.0.drain(..) {
            let _ = guarded(move || drop(member.actor));
        }
    }
}

/// The context of a call of the actor with this number.
fn of_actor(ctx: &TickContext, index: usize) -> TickContext {
    TickContext { actor: index as u16, ..*ctx }
}

/// Measures the actors of one group.
pub(crate) struct ActorTimer {
    clock: Box<dyn Fn() -> Nanos + Send>,
    /// Whose work has been under way since when.
    current: Option<(usize, Nanos)>,
    spent: [Nanos; ActorTimes::MAX],
}

impl ActorTimer {
    /// `clock` counts from the start of the run.
    pub(crate) fn new(clock: impl Fn() -> Nanos + Send + 'static) -> Self {
        Self { clock: Box::new(clock), current: None, spent: [Nanos::ZERO; ActorTimes::MAX] }
    }

    /// The work of a release begins at `now`.
    pub(crate) fn begin(&mut self, now: Nanos) {
        self.spent = [Nanos::ZERO; ActorTimes::MAX];
        self.current = Some((usize::MAX, now));
    }

    /// Actor `next` is called now; what it does until another one is called is its own. Those that are not told apart
    /// are one, between which no clock is read.
    pub(crate) fn pass_to(&mut self, next: usize) {
        let next = next.min(ActorTimes::MAX - 1);
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
    pub(crate) fn end(&mut self, end: Nanos) -> [Nanos; ActorTimes::MAX] {
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

    // Check that a hundred actors are timed with as many looks at the clock as the twelve that are told apart.
    #[test]
    fn actors_that_are_not_told_apart_cost_no_look_at_the_clock() {
        let looks = |actors: usize| {
            let looks = Arc::new(Mutex::new(0));
            let counted = Arc::clone(&looks);
            let mut timer = ActorTimer::new(move || {
                *counted.lock().unwrap() += 1;
                Nanos(*counted.lock().unwrap())
            });
            timer.begin(Nanos(0));
            (0..actors).chain((0..actors).rev()).for_each(|actor| timer.pass_to(actor));
            let spent = timer.end(Nanos(1000));
            assert_eq!(spent.iter().map(|spent| spent.0).sum::<u64>(), 1000);
            *looks.lock().unwrap()
        };
        assert_eq!((looks(2), looks(12), looks(100)), (2, 22, 22));
    }

    // Check that device, model, model, device gives each its own, and that the parts add up to the whole.
    #[test]
    fn every_moment_belongs_to_one_actor() {
        let time = Arc::new(Mutex::new(0));
        let shown = Arc::clone(&time);
        let mut timer = ActorTimer::new(move || Nanos(*shown.lock().unwrap()));
        let at = |ns| *time.lock().unwrap() = ns;
        for start in [100, 1000] {
            timer.begin(Nanos(start));
            timer.pass_to(0);
            at(start + 10);
            timer.pass_to(1);
            at(start + 30);
            timer.pass_to(1);
            at(start + 70);
            timer.pass_to(0);
            let spent = timer.end(Nanos(start + 75));
            assert_eq!(spent[..3], [Nanos(15), Nanos(60), Nanos(0)]);
        }
    }
}
