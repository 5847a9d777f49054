//! One group at work: starts, releases, faults and the stop, the same in both executions.

use super::actor::{Actor, Mode, Outcome, TickContext};
use super::deadline::Ledger;
use super::disturbance::Disturb;
use super::overrun::Decision;
use super::rate_group::RateGroup;
use super::record::Event;
use super::recorder::Recorder;
use super::report::{GroupReport, RuntimeFault};
use super::wake::Wake;
use crate::error::{Error, ErrorKind};
use crate::time::Nanos;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A group with its actors, its books and its own record ring.
pub(crate) struct GroupRun {
    pub(crate) index: u16,
    pub(crate) spec: RateGroup,
    pub(crate) ledger: Ledger,
    actors: Vec<Box<dyn Actor>>,
    /// Kept apart: after a panic an actor is not asked anything but to stop.
    names: Vec<String>,
    recorder: Option<Recorder>,
    /// Virtual time: what disturbs the group, for the executor to take.
    pub(crate) disturb: Option<Disturb>,
    last: TickContext,
    started: usize,
    degraded: u64,
    degraded_code: Option<u32>,
    takeovers: u64,
    /// After a fault the actors are stopped and nothing else.
    faulted: bool,
}

/// Why a release ended early.
enum Fatal {
    Panic(String),
    Fault(u32),
}

impl GroupRun {
    pub(crate) fn new(
        index: u16,
        spec: RateGroup,
        actors: Vec<Box<dyn Actor>>,
        recorder: Option<Recorder>,
        until: Option<Nanos>,
    ) -> Self {
        let dt = spec.rate.period_s();
        let last = TickContext {
            tick: 0,
            scheduled: Nanos::ZERO,
            now: Nanos::ZERO,
            dt_nominal: dt,
            dt_measured: dt,
            slips: 0,
            mode: Mode::Normal,
            visible_at: Nanos::ZERO,
        };
        let names = actors.iter().map(|actor| actor.name().to_owned()).collect();
        let ledger = Ledger::new(index, &spec, until);
        Self {
            index,
            spec,
            ledger,
            actors,
            names,
            recorder,
            disturb: None,
            last,
            started: 0,
            degraded: 0,
            degraded_code: None,
            takeovers: 0,
            faulted: false,
        }
    }

    /// In virtual time `disturb` makes it late.
    pub(crate) fn disturbed_by(mut self, disturb: Option<Disturb>) -> Self {
        self.disturb = disturb;
        self
    }

    /// Starts the actors in order. On an error the ones started stay started: see [`undo_start`](Self::undo_start).
    pub(crate) fn start(&mut self) -> Result<(), Error> {
        let ctx = self.last;
        for (actor, name) in self.actors.iter_mut().zip(&self.names) {
            let place = || format!("rate group `{}`, actor `{name}`", self.spec.name);
            // Counted first: an actor that fails half-way may hold something to give back.
            self.started += 1;
            match catch_unwind(AssertUnwindSafe(|| actor.start(&ctx))) {
                Ok(result) => result.map_err(|error| error.at(place()))?,
                Err(panic) => {
                    let message = format!("panicked in start: {}", text_of(&*panic));
                    return Err(Error::new(ErrorKind::Fault, message).at(place()));
                }
            }
        }
        Ok(())
    }

    /// Stops the actors that were started, when another one's start failed.
    pub(crate) fn undo_start(&mut self) {
        let ctx = self.last;
        for actor in self.actors.iter_mut().take(self.started) {
            // The start's error is the one to report.
            let _ = catch_unwind(AssertUnwindSafe(|| actor.stop(&ctx)));
        }
    }

    /// Asks the first actor to wait for its device; `None` if it panicked.
    pub(crate) fn wait_for_device(&mut self, timeout: Nanos) -> Option<bool> {
        let Some(actor) = self.actors.first_mut() else { return Some(false) };
        // Unwind safe: after a panic the actor is not asked to wait again.
        match catch_unwind(AssertUnwindSafe(|| actor.wait(timeout))) {
            Ok(delivered) => Some(delivered),
            Err(_) => {
                let due = self.ledger.next_due().unwrap_or(self.last.scheduled);
                self.event(due, Event::PANIC, 0);
                None
            }
        }
    }

    /// Notes that the watchdog took over at the next release, or that the device is back.
    pub(crate) fn note_watchdog(&mut self, took_over: bool) {
        let next = self.ledger.elapsed_periods();
        let due = self.ledger.next_due().unwrap_or(self.last.scheduled);
        self.takeovers += u64::from(took_over);
        self.event(due, Event::WATCHDOG, if took_over { next } else { Event::RECOVERED });
    }

    /// Runs what is to run after a wait: at most one release.
    ///
    /// `start` reads the clock when the work begins and `end` when it is done; both get the scheduled time.
    pub(crate) fn release(
        &mut self,
        wake: Wake,
        start: impl FnOnce(Nanos) -> Nanos,
        end: impl FnOnce(Nanos) -> Nanos,
    ) -> Result<(), RuntimeFault> {
        let (release, skipped) = match self.ledger.decide(&wake) {
            Decision::Run { release, skipped } => (release, skipped),
            Decision::Stop { skipped } => return Err(self.overrun(skipped)),
        };
        let scheduled = self.ledger.due(release);
        let now = start(scheduled);
        let dt_nominal = self.last.dt_nominal;
        let first = self.ledger.released == 0;
        let mode = self.ledger.mode();
        if mode != self.last.mode {
            self.event(scheduled, Event::MODE, if mode == Mode::Degraded { skipped } else { Event::RECOVERED });
        }
        let ctx = TickContext {
            tick: release,
            scheduled,
            now,
            dt_nominal,
            dt_measured: if first { dt_nominal } else { now.saturating_sub(self.last.now).as_secs_f64() },
            slips: u32::try_from(skipped).unwrap_or(u32::MAX),
            mode,
            visible_at: (scheduled + self.spec.latency).max(wake.free.unwrap_or(Nanos::ZERO)),
        };
        self.last = ctx;
        let result = self.work(&ctx);
        let end = end(scheduled);
        let timing = self.ledger.close(release, skipped, [wake.woke, now, end], wake.free.unwrap_or(end));
        if let Some(recorder) = &mut self.recorder {
            recorder.push(timing);
        }
        result
    }

    /// All ticks, then all commits in reverse.
    fn work(&mut self, ctx: &TickContext) -> Result<(), RuntimeFault> {
        let mut current = 0;
        let mut degraded = None;
        let actors = &mut self.actors;
        // Unwind safe: after a panic the actors are stopped and dropped, nothing else.
        let done = catch_unwind(AssertUnwindSafe(|| {
            let mut note = |outcome| match outcome {
                Outcome::Continue => Ok(()),
                Outcome::Degraded(code) => {
                    degraded.get_or_insert(code);
                    Ok(())
                }
                Outcome::Fault(code) => Err(code),
            };
            for (index, actor) in actors.iter_mut().enumerate() {
                current = index;
                note(actor.tick(ctx))?;
            }
            for (index, actor) in actors.iter_mut().enumerate().rev() {
                current = index;
                note(actor.commit(ctx))?;
            }
            Ok(())
        }));
        match done {
            Ok(Ok(())) => {
                self.note_degraded(ctx, degraded);
                Ok(())
            }
            Ok(Err(code)) => Err(self.fatal(current, Fatal::Fault(code))),
            Err(panic) => Err(self.fatal(current, Fatal::Panic(text_of(&*panic)))),
        }
    }

    fn note_degraded(&mut self, ctx: &TickContext, code: Option<u32>) {
        self.degraded += u64::from(code.is_some());
        if code != self.degraded_code {
            self.degraded_code = code;
            self.event(ctx.scheduled, Event::DEGRADED, code.map_or(Event::RECOVERED, u64::from));
        }
    }

    fn fatal(&mut self, actor: usize, fatal: Fatal) -> RuntimeFault {
        self.faulted = true;
        let at = self.last.scheduled;
        let what = match fatal {
            Fatal::Panic(text) => {
                self.event(at, Event::PANIC, actor as u64);
                format!("panicked: {text}")
            }
            Fatal::Fault(code) => {
                self.event(at, Event::FAULT, code.into());
                format!("reported fault {code}")
            }
        };
        RuntimeFault { group: self.spec.name.clone(), actor: self.names[actor].clone(), at, what }
    }

    fn overrun(&mut self, skipped: u64) -> RuntimeFault {
        self.faulted = true;
        let at = self.ledger.due(self.ledger.elapsed_periods() - 1);
        self.event(at, Event::STOPPED, skipped);
        let what = format!("stopped by its overrun policy with {skipped} releases due at once");
        RuntimeFault { group: self.spec.name.clone(), actor: String::new(), at, what }
    }

    fn event(&mut self, stamp: Nanos, code: u32, detail: u64) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push(Event { stamp, group: self.index, code, detail });
        }
    }

    /// An observer's last tick, at `now`, after all others have ended; none after a fault of its own.
    pub(crate) fn last_tick(&mut self, now: Nanos) -> Result<(), RuntimeFault> {
        if self.faulted {
            return Ok(());
        }
        let tick = self.ledger.elapsed_periods();
        let dt_measured = now.saturating_sub(self.last.now).as_secs_f64();
        self.last = TickContext { tick, scheduled: now, now, dt_measured, slips: 0, visible_at: now, ..self.last };
        let ctx = self.last;
        self.work(&ctx)
    }

    /// Stops and drops the actors and gives the sums. A panic on the way is reported, the other actors still stop.
    pub(crate) fn finish(mut self, now: Nanos) -> (GroupReport, Option<RuntimeFault>) {
        let ctx = TickContext { now, ..self.last };
        let mut fault = None;
        for (index, mut actor) in std::mem::take(&mut self.actors).into_iter().enumerate() {
            let stopped = catch_unwind(AssertUnwindSafe(|| actor.stop(&ctx)));
            let dropped = catch_unwind(AssertUnwindSafe(move || drop(actor)));
            if let Err(panic) = stopped.and(dropped) {
                fault.get_or_insert_with(|| self.fatal(index, Fatal::Panic(format!("{} (in stop)", text_of(&*panic)))));
            }
        }
        let report = GroupReport {
            name: self.spec.name,
            rate: self.spec.rate,
            released: self.ledger.released,
            skipped: self.ledger.skipped.total(),
            slips: self.ledger.skipped,
            elapsed_periods: self.ledger.elapsed_periods(),
            missed_deadlines: self.ledger.missed,
            degraded: self.degraded,
            in_degraded_mode: self.ledger.in_degraded_mode,
            watchdog_takeovers: self.takeovers,
        };
        (report, fault)
    }
}

fn text_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no text was given".to_owned())
}
