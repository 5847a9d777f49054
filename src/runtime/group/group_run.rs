//! One group at work: starts, releases, faults and the stop, the same in both executions.

use crate::accounting::ledger::Ledger;
use crate::accounting::overrun::Decision;
use crate::accounting::timeline::Wake;
use crate::actor::{Actor, GroupMode, Phase, TickContext};
use crate::error::GraphError;
use crate::executor::Execution;
use crate::group::lease::Lease;
use crate::group::members::{ActorTimer, Fatal, Members};
use crate::group::panic_hook::place;
use crate::primitives::exchange::ExchangeWriter;
use crate::rate_group::RateGroup;
use crate::records::record::{Event, EventCode};
use crate::records::recorder::Recorder;
use crate::records::timing::{ActorTimes, RecordedRelease, TickTiming};
use crate::reports::live::{LiveReader, LiveWriter, live};
use crate::reports::report::{GroupReport, RuntimeFault, RuntimeFaultKind};
use crate::time::Nanos;
use std::sync::Arc;

/// A group with its actors, its books and its own record ring.
pub(crate) struct GroupRun {
    pub(crate) index: u16,
    pub(crate) spec: RateGroup,
    pub(crate) ledger: Ledger,
    live: LiveWriter,
    /// What shows the group while it runs.
    pub(crate) shown: LiveReader,
    /// Who keeps the books, if a supervisor may take them away.
    pub(crate) lease: Option<Arc<Lease>>,
    members: Members,
    /// Threads: what each of several actors takes.
    timer: Option<ActorTimer>,
    recorder: Option<Recorder>,
    /// Where a supervisor reads how far a group is that may have to be left behind.
    pub(crate) books: Option<ExchangeWriter<Ledger>>,
    last: TickContext,
    degraded_code: Option<u32>,
    /// Its overrun policy has stopped the run.
    overran: bool,
    /// After a fault the actors are stopped and nothing else, unless the group winds down.
    faulted: bool,
}

/// A release that is to run.
struct Due {
    tick: u64,
    scheduled: Nanos,
    /// Periods without a release before it.
    skipped: u64,
    mode: GroupMode,
}

/// What becomes of a group after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AfterFault {
    /// Its actors are made anew.
    Restart,
    /// The fault stops the run, and the group winds down without the actor that failed.
    GoOn,
    /// The fault stops the run, and the group ends at once.
    End,
}

impl GroupRun {
    pub(crate) fn new(
        execution: Execution,
        index: u16,
        spec: RateGroup,
        actors: Vec<Box<dyn Actor>>,
        recorder: Option<Recorder>,
        ledger: Ledger,
    ) -> Self {
        let start = start_context(index, &spec, &ledger, Nanos::ZERO);
        let last = TickContext { execution: Some(execution), ..start };
        let (live, shown) = live(&spec);
        Self {
            index,
            spec,
            ledger,
            live,
            shown,
            lease: None,
            members: Members::new(actors),
            timer: None,
            recorder,
            books: None,
            last,
            degraded_code: None,
            overran: false,
            faulted: false,
        }
    }

    /// The names of the actors, in the order of their ticks.
    pub(crate) fn actor_names(&self) -> Vec<String> {
        self.members.names()
    }

    /// Refuses a device-paced group that has nobody to wait for its device.
    pub(crate) fn check_listener(&self) -> Result<(), GraphError> {
        if self.spec.watchdog().is_some() && self.members.count() == 0 {
            let wrong = "is paced by a device and has no actor to wait for it; add one";
            return Err(GraphError::refused(wrong).in_group(&self.spec.name));
        }
        Ok(())
    }

    /// Starts the actors between two releases, in the place of ones that failed.
    pub(crate) fn start_at(&mut self, now: Nanos) -> Result<(), GraphError> {
        let execution = self.last.execution;
        self.last = TickContext { execution, ..start_context(self.index, &self.spec, &self.ledger, now) };
        self.start()
    }

    /// Goes on showing where the actors before left off.
    pub(crate) fn show_on(&mut self, shown: LiveReader) {
        self.live = shown.next_writer();
        self.shown = shown;
    }

    /// Records what each actor takes, if somebody reads records and there are several; `clock` counts from the start of
    /// the run.
    pub(crate) fn time_actors(&mut self, clock: impl Fn() -> Nanos + Send + 'static) {
        if self.recorder.is_some() && self.members.count() > 1 {
            self.timer = Some(ActorTimer::new(clock));
        }
    }

    /// Starts the actors in order. On an error the ones started stay started: see [`undo_start`](Self::undo_start).
    pub(crate) fn start(&mut self) -> Result<(), GraphError> {
        self.members.start(&self.last, &self.spec.name)
    }

    /// Stops the actors that were started, when another one's start failed.
    pub(crate) fn undo_start(&mut self) {
        self.members.undo_start(&self.last);
    }

    /// Goes on in [`GroupMode::Stopping`] from `now` for as long as the group asked for; false if it did not or has
    /// done so already.
    pub(crate) fn begin_wind_down(&mut self, now: Nanos) -> bool {
        let periods = self.spec.rate.last_release(self.spec.wind_down);
        if self.ledger.winding_down || periods == 0 {
            return false;
        }
        self.faulted = false;
        self.event(self.ledger.due(self.ledger.elapsed_periods()).max(now), Event::WINDING_DOWN, periods);
        self.ledger.wind_down(now, periods);
        true
    }

    /// Decides what comes after a fault, the same in both executions; a wind-down has then begun.
    pub(crate) fn after_fault(&mut self, now: Nanos, restartable: bool, stop_requested: bool) -> AfterFault {
        if self.ledger.winding_down {
            // What has already begun to come to rest is not begun anew.
            return if self.members.all_failed() { AfterFault::End } else { AfterFault::GoOn };
        }
        // A policy that stops the run at an overrun means what it says.
        if restartable && !stop_requested && !self.overran {
            return AfterFault::Restart;
        }
        if self.begin_wind_down(now) { AfterFault::GoOn } else { AfterFault::End }
    }

    /// Asks the first actor to wait for its device: true if that has something new.
    ///
    /// # Errors
    /// The actor's panic.
    pub(crate) fn wait_for_device(&mut self, timeout: Nanos) -> Result<bool, RuntimeFault> {
        self.members.wait(timeout).map_err(|(index, fatal)| {
            // It was waiting for the next release: that is the one that failed.
            self.last.scheduled = self.ledger.next_due().unwrap_or(self.last.scheduled);
            self.fatal(index, fatal)
        })
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
        let mode = if self.ledger.winding_down { GroupMode::Stopping } else { self.ledger.mode() };
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
        self.recorder.iter_mut().for_each(|recorder| recorder.begin_release(scheduled));
        let now = start(scheduled);
        let dt_nominal = self.last.dt_nominal;
        let first = self.ledger.released == 0;
        if mode != self.last.mode && mode != GroupMode::Stopping {
            self.event(scheduled, Event::MODE, if mode == GroupMode::Degraded { skipped } else { Event::RECOVERED });
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
            actor: 0,
            phase: if self.spec.observer { Phase::Observer } else { Phase::Release },
            execution: self.last.execution,
        };
        self.last = ctx;
        self.timer.iter_mut().for_each(|timer| timer.begin(now));
        let result = self.work(&ctx);
        if self.lease.as_ref().is_some_and(|lease| !lease.begin_booking()) {
            return Ok(());
        }
        let end = end(scheduled);
        let closed = self.ledger.close(tick, skipped, [wake.woke, now, end], wake.free.unwrap_or(end));
        let timing = TickTiming { mode, ..closed };
        self.live.release(&timing, &self.ledger);
        if let Some(recorder) = &mut self.recorder {
            recorder.push(timing);
            if let Some(timer) = &mut self.timer {
                let actors = self.members.count().min(ActorTimes::MAX) as u8;
                recorder.push(ActorTimes { group: self.index, scheduled, actors, spent: timer.end(end) });
            }
        }
        self.recorder.iter_mut().for_each(Recorder::end_release);
        if let Some(books) = &mut self.books {
            *books.buffer() = self.ledger;
            books.publish(scheduled);
        }
        if let Some(lease) = &self.lease {
            lease.end_booking();
        }
        result
    }

    fn work(&mut self, ctx: &TickContext) -> Result<(), RuntimeFault> {
        match self.members.work(ctx, self.timer.as_mut()) {
            Ok(degraded) => {
                self.note_degraded(ctx, degraded);
                Ok(())
            }
            Err((index, fatal)) => Err(self.fatal(index, fatal)),
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
        let name = self.members.name(actor).to_owned();
        let is_panic = matches!(fatal, Fatal::Panic(_));
        let fault = self.describe(name, actor, fatal);
        // The others go on for a while.
        if self.spec.wind_down > Nanos::ZERO && !(is_panic && self.members.recovers(actor)) {
            self.members.fail(actor, &self.last);
        }
        fault
    }

    fn describe(&mut self, actor: String, index: usize, fatal: Fatal) -> RuntimeFault {
        let at = self.last.scheduled;
        let (kind, what) = match fatal {
            Fatal::Panic(text) => {
                self.event(at, Event::PANIC, index as u64);
                (RuntimeFaultKind::Panic, format!("panicked{}: {text}", place()))
            }
            Fatal::Fault(code) => {
                self.event(at, Event::FAULT, code.into());
                (RuntimeFaultKind::Reported(code), format!("reported fault {code}"))
            }
        };
        RuntimeFault { group: self.spec.name.clone(), actor, at, kind, what }
    }

    fn overrun(&mut self, skipped: u64) -> RuntimeFault {
        self.faulted = true;
        self.overran = true;
        self.live.count(&self.ledger);
        let at = self.ledger.due(self.ledger.elapsed_periods() - 1);
        self.event(at, Event::STOPPED, skipped);
        let what = format!("stopped by its overrun policy with {skipped} releases due at once");
        RuntimeFault::of_group(&self.spec.name, at, RuntimeFaultKind::Overrun { skipped }, what)
    }

    fn event(&mut self, stamp: Nanos, code: EventCode, detail: u64) {
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
        let mut index = 0;
        while let Some(stopped) = self.members.stop_next(&ctx) {
            if let Err((name, fatal)) = stopped {
                fault.get_or_insert_with(|| self.describe(name, index, fatal));
            }
            index += 1;
        }
        let report = self.ledger.report(&self.spec);
        (report, fault)
    }
}

/// Starts all actors in group order; if one fails, stops those already started.
pub(crate) fn start_actors(groups: &mut [GroupRun]) -> Result<(), GraphError> {
    for index in 0..groups.len() {
        if let Err(error) = groups[index].start() {
            groups[..=index].iter_mut().for_each(GroupRun::undo_start);
            return Err(error);
        }
    }
    Ok(())
}

/// The context of a start at `now`, before release 0 or between two releases.
fn start_context(group: u16, spec: &RateGroup, ledger: &Ledger, now: Nanos) -> TickContext {
    TickContext {
        tick: ledger.elapsed_periods(),
        scheduled: now,
        now,
        visible_at: now,
        group,
        phase: Phase::Start,
        ..TickContext::by_hand(spec.rate(), 0)
    }
}
