//! One group at work: starts, releases, faults and the stop, the same in both executions.

use super::actor::{Actor, Mode, Outcome, Phase, TickContext};
use super::deadline::Ledger;
use super::disturbance::Disturb;
use super::exchange::ExchangeWriter;
use super::live::{LiveReader, LiveWriter, live};
use super::overrun::Decision;
use super::panic_hook::{place, quietly};
use super::rate_group::RateGroup;
use super::record::{Event, TickTiming};
use super::recorder::Recorder;
use super::recording::RecordedRelease;
use super::report::{GroupReport, RuntimeFault};
use super::restart::start_context;
use super::supervisor::Flag;
use super::wake::Wake;
use crate::error::{Error, ErrorKind};
use crate::time::Nanos;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// An actor in its group.
struct Member {
    actor: Box<dyn Actor>,
    /// Kept apart: after a panic an actor is not asked anything but to stop.
    name: String,
    /// It panicked or reported a fault while the others wind down: it was stopped and is not called again.
    failed: bool,
}

/// A group with its actors, its books and its own record ring.
pub(crate) struct GroupRun {
    pub(crate) index: u16,
    pub(crate) spec: RateGroup,
    pub(crate) ledger: Ledger,
    live: LiveWriter,
    shown: LiveReader,
    /// Raised when nobody waits for this thread any more: its books are closed.
    left_behind: Option<Arc<Flag>>,
    members: Vec<Member>,
    recorder: Option<Recorder>,
    /// Where a supervisor reads how far a group is that may have to be left behind.
    books: Option<ExchangeWriter<Ledger>>,
    /// Virtual time: what disturbs the group, for the executor to take.
    pub(crate) disturb: Option<Disturb>,
    last: TickContext,
    started: usize,
    degraded_code: Option<u32>,
    winding_down: bool,
    /// After a fault the actors are stopped and nothing else, unless the group winds down.
    faulted: bool,
}

/// A release that is to run.
struct Due {
    tick: u64,
    scheduled: Nanos,
    /// Periods without a release before it.
    skipped: u64,
    mode: Mode,
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
        ledger: Ledger,
    ) -> Self {
        let last = start_context(index, &spec, &ledger, Nanos::ZERO);
        let member = |actor: Box<dyn Actor>| Member { name: actor.name().to_owned(), actor, failed: false };
        let (live, shown) = live(&spec);
        Self {
            index,
            spec,
            ledger,
            live,
            shown,
            left_behind: None,
            members: actors.into_iter().map(member).collect(),
            recorder,
            books: None,
            disturb: None,
            last,
            started: 0,
            degraded_code: None,
            winding_down: false,
            faulted: false,
        }
    }

    /// Refuses a device-paced group that has nobody to wait for its device.
    pub(crate) fn check_listener(&self) -> Result<(), Error> {
        if self.spec.watchdog().is_some() && self.members.is_empty() {
            return Err(Error::new(
                ErrorKind::Runtime,
                "is paced by a device and has no actor to wait for it; add one",
            )
            .at(format!("rate group `{}`", self.spec.name)));
        }
        Ok(())
    }

    /// In virtual time `disturb` makes it late.
    pub(crate) fn disturbed_by(mut self, disturb: Option<Disturb>) -> Self {
        self.disturb = disturb;
        self
    }

    /// Publishes the books after every release from now on.
    pub(super) fn publish_books(&mut self, books: ExchangeWriter<Ledger>) {
        self.books = Some(books);
    }

    /// Starts the actors between two releases, in the place of ones that failed.
    pub(super) fn start_at(&mut self, now: Nanos) -> Result<(), Error> {
        self.last = start_context(self.index, &self.spec, &self.ledger, now);
        self.start()
    }

    /// Goes on showing where the actors before left off.
    pub(super) fn show_on(&mut self, shown: LiveReader) {
        self.live = shown.next_writer();
        self.shown = shown;
    }

    /// Closes the books when `flag` is raised.
    pub(super) fn close_when(&mut self, flag: Arc<Flag>) {
        self.left_behind = Some(flag);
    }

    /// What shows this group while it runs.
    pub(crate) fn live(&self) -> LiveReader {
        self.shown.clone()
    }

    /// Starts the actors in order. On an error the ones started stay started: see [`undo_start`](Self::undo_start).
    pub(crate) fn start(&mut self) -> Result<(), Error> {
        let ctx = self.last;
        for Member { actor, name, .. } in &mut self.members {
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
        for member in self.members.iter_mut().take(self.started) {
            // The start's error is the one to report.
            let _ = catch_unwind(AssertUnwindSafe(|| member.actor.stop(&ctx)));
        }
    }

    /// Goes on in [`Mode::Stopping`] for as long as the group asked for; false if it did not or has done so already.
    pub(crate) fn begin_wind_down(&mut self) -> bool {
        let periods = self.spec.rate.last_release(self.spec.wind_down);
        if self.winding_down || periods == 0 {
            return false;
        }
        self.winding_down = true;
        self.faulted = false;
        self.ledger.end_after(periods);
        self.event(self.ledger.due(self.ledger.elapsed_periods()), Event::WINDING_DOWN, periods);
        true
    }

    pub(crate) fn is_winding_down(&self) -> bool {
        self.winding_down
    }

    /// Asks the first actor to wait for its device: true if that has something new.
    ///
    /// # Errors
    /// The actor's panic.
    pub(crate) fn wait_for_device(&mut self, timeout: Nanos) -> Result<bool, RuntimeFault> {
        let Some(member) = self.members.first_mut().filter(|member| !member.failed) else { return Ok(false) };
        // Unwind safe: after a panic the actor is asked whether it can go on, or stopped and dropped.
        match quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.wait(timeout)))) {
            Ok(delivered) => Ok(delivered),
            Err(panic) => {
                // It was waiting for the next release: that is the one that failed.
                self.last.scheduled = self.ledger.next_due().unwrap_or(self.last.scheduled);
                Err(self.fatal(0, Fatal::Panic(format!("{} (in wait)", text_of(&*panic)))))
            }
        }
    }

    /// Notes that the watchdog took over at the next release, or that the device is back.
    pub(crate) fn note_watchdog(&mut self, took_over: bool) {
        let next = self.ledger.elapsed_periods();
        let due = self.ledger.next_due().unwrap_or(self.last.scheduled);
        self.ledger.takeovers += u64::from(took_over);
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
        let mode = if self.winding_down { Mode::Stopping } else { self.ledger.mode() };
        self.run(Due { tick: release, scheduled, skipped, mode }, wake, start, end)
    }

    /// Runs a release that was recorded: its number, its time and its slips are given, nothing is decided.
    pub(crate) fn rerun(&mut self, recorded: &RecordedRelease) -> Result<(), RuntimeFault> {
        let RecordedRelease { tick, scheduled, slips, mode, .. } = *recorded;
        self.ledger.book(recorded);
        let (wake, latency) = (Wake::by_timer(scheduled, scheduled), self.spec.latency);
        self.run(Due { tick, scheduled, skipped: slips.into(), mode }, wake, |at| at, |at| at + latency)
    }

    fn run(
        &mut self,
        Due { tick, scheduled, skipped, mode }: Due,
        wake: Wake,
        start: impl FnOnce(Nanos) -> Nanos,
        end: impl FnOnce(Nanos) -> Nanos,
    ) -> Result<(), RuntimeFault> {
        let now = start(scheduled);
        let dt_nominal = self.last.dt_nominal;
        let first = self.ledger.released == 0;
        if mode != self.last.mode && mode != Mode::Stopping {
            self.event(scheduled, Event::MODE, if mode == Mode::Degraded { skipped } else { Event::RECOVERED });
        }
        let ctx = TickContext {
            tick,
            scheduled,
            now,
            dt_nominal,
            dt_measured: if first { dt_nominal } else { now.saturating_sub(self.last.now).as_secs_f64() },
            slips: u32::try_from(skipped).unwrap_or(u32::MAX),
            mode,
            visible_at: (scheduled + self.spec.latency).max(wake.free.unwrap_or(Nanos::ZERO)),
            group: self.index,
            phase: if self.spec.observer { Phase::Observer } else { Phase::Release },
        };
        self.last = ctx;
        let result = self.work(&ctx);
        if self.left_behind.as_ref().is_some_and(|flag| flag.is_raised()) {
            return Ok(());
        }
        let end = end(scheduled);
        let closed = self.ledger.close(tick, skipped, [wake.woke, now, end], wake.free.unwrap_or(end));
        let timing = TickTiming { mode, ..closed };
        self.live.release(&timing, &self.ledger);
        if let Some(recorder) = &mut self.recorder {
            recorder.push(timing);
        }
        if let Some(books) = &mut self.books {
            *books.buffer() = self.ledger;
            books.publish(scheduled);
        }
        result
    }

    /// All ticks, then all commits in reverse.
    fn work(&mut self, ctx: &TickContext) -> Result<(), RuntimeFault> {
        let mut current = 0;
        let mut degraded = None;
        let members = &mut self.members;
        let work = || {
            let mut note = |outcome| match outcome {
                Outcome::Continue => Ok(()),
                Outcome::Degraded(code) => {
                    degraded.get_or_insert(code);
                    Ok(())
                }
                Outcome::Fault(code) => Err(code),
            };
            for (index, member) in members.iter_mut().enumerate().filter(|(_, member)| !member.failed) {
                current = index;
                note(member.actor.tick(ctx))?;
            }
            for (index, member) in members.iter_mut().enumerate().rev().filter(|(_, member)| !member.failed) {
                current = index;
                note(member.actor.commit(ctx))?;
            }
            Ok(())
        };
        // Unwind safe: after a panic the actor is stopped and dropped, nothing else.
        match quietly(|| catch_unwind(AssertUnwindSafe(work))) {
            Ok(Ok(())) => {
                self.note_degraded(ctx, degraded);
                Ok(())
            }
            Ok(Err(code)) => Err(self.fatal(current, Fatal::Fault(code))),
            Err(panic) => Err(self.fatal(current, Fatal::Panic(text_of(&*panic)))),
        }
    }

    fn note_degraded(&mut self, ctx: &TickContext, code: Option<u32>) {
        self.ledger.degraded += u64::from(code.is_some());
        if code != self.degraded_code {
            self.degraded_code = code;
            self.event(ctx.scheduled, Event::DEGRADED, code.map_or(Event::RECOVERED, u64::from));
        }
    }

    fn fatal(&mut self, actor: usize, fatal: Fatal) -> RuntimeFault {
        self.faulted = true;
        let name = self.members[actor].name.clone();
        let may_recover = matches!(fatal, Fatal::Panic(_)) && !self.winding_down;
        let fault = self.describe(&name, actor, fatal);
        // The others go on for a while: what this one holds must not wait for that.
        if self.spec.wind_down > Nanos::ZERO && !(may_recover && self.recovers(actor)) {
            self.fail(actor);
        }
        fault
    }

    fn recovers(&mut self, actor: usize) -> bool {
        let member = &mut self.members[actor];
        quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.recover()))).unwrap_or(false)
    }

    fn describe(&mut self, name: &str, actor: usize, fatal: Fatal) -> RuntimeFault {
        let at = self.last.scheduled;
        let what = match fatal {
            Fatal::Panic(text) => {
                self.event(at, Event::PANIC, actor as u64);
                format!("panicked{}: {text}", place())
            }
            Fatal::Fault(code) => {
                self.event(at, Event::FAULT, code.into());
                format!("reported fault {code}")
            }
        };
        RuntimeFault { group: self.spec.name.clone(), actor: name.to_owned(), at, what }
    }

    fn fail(&mut self, actor: usize) {
        let ctx = self.last;
        let member = &mut self.members[actor];
        if !std::mem::replace(&mut member.failed, true) {
            // The fault that led here is the one to report.
            let _ = quietly(|| catch_unwind(AssertUnwindSafe(|| member.actor.stop(&ctx))));
        }
    }

    fn overrun(&mut self, skipped: u64) -> RuntimeFault {
        self.faulted = true;
        self.live.count(&self.ledger);
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
        self.last.phase = Phase::Observer;
        let ctx = self.last;
        self.work(&ctx)
    }

    /// Stops and drops the actors and gives the sums. A panic on the way is reported, the other actors still stop.
    pub(crate) fn finish(mut self, now: Nanos) -> (GroupReport, Option<RuntimeFault>) {
        let ctx = TickContext { now, phase: Phase::Stop, ..self.last };
        let mut fault = None;
        let names: Vec<String> = self.members.iter().map(|member| member.name.clone()).collect();
        for (index, Member { mut actor, failed, .. }) in std::mem::take(&mut self.members).into_iter().enumerate() {
            let stop = || {
                if !failed {
                    actor.stop(&ctx);
                }
            };
            let stopped = quietly(|| catch_unwind(AssertUnwindSafe(stop)));
            let dropped = quietly(|| catch_unwind(AssertUnwindSafe(move || drop(actor))));
            if let Err(panic) = stopped.and(dropped) {
                let fatal = Fatal::Panic(format!("{} (in stop)", text_of(&*panic)));
                fault.get_or_insert_with(|| self.describe(&names[index], index, fatal));
            }
        }
        let report = self.ledger.report(&self.spec);
        (report, fault)
    }
}

fn text_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no text was given".to_owned())
}
