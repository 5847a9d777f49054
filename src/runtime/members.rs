//! The actors of one group: every call to them is caught, and one that fails is out for the rest.

use super::actor::{Actor, Outcome, TickContext};
use super::laps::Laps;
use super::panic_hook::{quietly, text_of};
use crate::error::{GraphError, GraphErrorKind};
use crate::time::Nanos;
use std::panic::{AssertUnwindSafe, catch_unwind};

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
pub(super) enum Fatal {
    Panic(String),
    Fault(u32),
}

/// The actor with this number did it.
pub(super) type Broken = (usize, Fatal);

/// The actors in the order of their ticks.
pub(super) struct Members(Vec<Member>);

impl Members {
    pub(super) fn new(actors: Vec<Box<dyn Actor>>) -> Self {
        let member = |actor: Box<dyn Actor>| {
            let name = actor.name().to_owned();
            Member { actor, name, started: false, failed: false, recovered: false }
        };
        Self(actors.into_iter().map(member).collect())
    }

    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn all_failed(&self) -> bool {
        self.0.iter().all(|member| member.failed)
    }

    pub(super) fn name(&self, index: usize) -> &str {
        &self.0[index].name
    }

    /// Starts the actors in order. On an error the ones started stay started: see [`undo_start`](Self::undo_start).
    pub(super) fn start(&mut self, ctx: &TickContext, group: &str) -> Result<(), GraphError> {
        for Member { actor, name, started, .. } in &mut self.0 {
            let place = || format!("rate group `{group}`, actor `{name}`");
            // Noted first: an actor that fails half-way may hold something to give back.
            *started = true;
            match catch_unwind(AssertUnwindSafe(|| actor.start(ctx))) {
                Ok(result) => result.map_err(|error| GraphError::from_actor(error).at(place()))?,
                Err(panic) => {
                    let message = format!("panicked in start: {}", text_of(&*panic));
                    return Err(GraphError::new(GraphErrorKind::Actor, message).at(place()));
                }
            }
        }
        Ok(())
    }

    /// Stops the actors that were started, when another one's start failed.
    pub(super) fn undo_start(&mut self, ctx: &TickContext) {
        for member in self.0.iter_mut().filter(|member| member.started) {
            // The start's error is the one to report.
            let _ = catch_unwind(AssertUnwindSafe(|| member.actor.stop(ctx)));
        }
    }

    /// Asks the first actor to wait for its device: true if that has something new.
    pub(super) fn wait(&mut self, timeout: Nanos) -> Result<bool, Broken> {
        let Some(member) = self.0.first_mut().filter(|member| !member.failed) else { return Ok(false) };
        // Unwind safe: after a panic the actor is asked whether it can go on, or stopped and dropped.
        quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.wait(timeout))))
            .map_err(|panic| (0, Fatal::Panic(format!("{} (in wait)", text_of(&*panic)))))
    }

    /// All ticks, then all commits in reverse; the first code of a degraded result, if there was one.
    pub(super) fn work(&mut self, ctx: &TickContext, mut laps: Option<&mut Laps>) -> Result<Option<u32>, Broken> {
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
                laps.iter_mut().for_each(|laps| laps.pass_to(index));
            };
            for (index, member) in members.iter_mut().enumerate().filter(|(_, member)| !member.failed) {
                call(index);
                note(member.actor.tick(ctx))?;
            }
            for (index, member) in members.iter_mut().enumerate().rev().filter(|(_, member)| !member.failed) {
                call(index);
                note(member.actor.commit(ctx))?;
            }
            Ok(())
        };
        // Unwind safe: after a panic the actor is stopped and dropped, nothing else.
        match quietly(|| catch_unwind(AssertUnwindSafe(work))) {
            Ok(Ok(())) => Ok(degraded),
            Ok(Err(code)) => Err((current, Fatal::Fault(code))),
            Err(panic) => Err((current, Fatal::Panic(text_of(&*panic)))),
        }
    }

    /// An actor has panicked: true if it can go on without what failed. It is asked once.
    pub(super) fn recovers(&mut self, index: usize) -> bool {
        let member = &mut self.0[index];
        if std::mem::replace(&mut member.recovered, true) {
            return false;
        }
        quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.recover()))).unwrap_or(false)
    }

    /// Stops an actor before the others: what it holds must not wait for them.
    pub(super) fn fail(&mut self, index: usize, ctx: &TickContext) {
        let member = &mut self.0[index];
        if !std::mem::replace(&mut member.failed, true) {
            // The fault that led here is the one to report.
            let _ = quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.stop(ctx))));
        }
    }

    /// Stops and drops the next actor; `None` after the last. An error is its panic, the others still stop.
    pub(super) fn stop_next(&mut self, ctx: &TickContext) -> Option<Result<(), (String, Fatal)>> {
        if self.0.is_empty() {
            return None;
        }
        let Member { mut actor, name, failed, .. } = self.0.remove(0);
        let stop = || {
            if !failed {
                actor.stop(ctx);
            }
        };
        let stopped = quietly(|| catch_unwind(AssertUnwindSafe(stop)));
        let dropped = quietly(|| catch_unwind(AssertUnwindSafe(move || drop(actor))));
        let broken = stopped.and(dropped);
        Some(broken.map_err(|panic| (name, Fatal::Panic(format!("{} (in stop)", text_of(&*panic))))))
    }
}
