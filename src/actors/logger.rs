//! The logger actor: takes the records of all threads, keeps statistics and writes the log.

use std::sync::{Arc, Mutex, PoisonError};

use super::cause::Cause;
use super::granted::granted;
use super::scene_watch::SceneWatch;
use crate::error::Error;
use crate::log::{Analysis, Environment, GroupStats, Level, LogRecord, RunReport, SceneFrame, StatsCounter, TextEvent};
use crate::runtime::record::Event;
use crate::runtime::{Actor, GrantHandle, Outcome, Record, RecordDrain, TickContext};
use crate::time::Nanos;

/// The target of the event that says that a log could not be written, for programs that report the summary's
/// `log_error` instead.
pub const LOG_FAILURE: &str = "palpate::log_failure";

/// Records younger than this wait for the next drain: a slow group stamps its records with the start of a release and
/// hands them over at its end, and the log is to be in the order of time.
const HELD_BACK: Nanos = Nanos(100_000_000);

/// Where log entries go, besides the statistics.
///
/// # Real-time
/// Called by the logger alone: may allocate, block and write files. Records wait in their rings meanwhile.
pub trait LogSink: Send {
    /// Takes one record.
    ///
    /// # Errors
    /// If it cannot be kept. The first error is reported when the run ends; what follows is still offered, because a
    /// sink may have other places to keep it.
    fn record(&mut self, record: &LogRecord) -> Result<(), Error>;

    /// Takes an event in words.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn text(&mut self, event: &TextEvent) -> Result<(), Error>;

    /// Takes the statistics of a group, once per second.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn stats(&mut self, stats: &GroupStats) -> Result<(), Error>;

    /// Takes a picture of the run; without an own implementation, it is dropped.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn scene(&mut self, _: &SceneFrame) -> Result<(), Error> {
        Ok(())
    }

    /// Takes what became known of the run as a whole.
    fn environment(&mut self, environment: &Environment);

    /// Writes what is due at `log_time` and `now` (both since the start of the run).
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn flush(&mut self, log_time: Nanos, now: Nanos) -> Result<(), Error>;

    /// Ends the log.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    fn finish(&mut self) -> Result<(), Error>;
}

/// What a run left behind, filled in when the logger stops.
#[derive(Clone, Debug, Default)]
pub struct LoggerOutcome(Arc<Mutex<(RunReport, Option<Error>)>>);

impl LoggerOutcome {
    /// Takes the report and the error that ended the log before its time.
    ///
    /// # Real-time
    /// Not real-time safe: takes a lock. For the time after a run.
    pub fn take(&self) -> (RunReport, Option<Error>) {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Drains records at a low rate, on a thread without real-time priority.
///
/// # Real-time
/// Not real-time safe: takes locks, allocates and writes to its sink.
pub struct LoggerActor {
    drain: RecordDrain,
    sink: Box<dyn LogSink>,
    environment: Environment,
    grants: GrantHandle,
    grants_known: bool,
    analysis: Analysis,
    stats: Vec<StatsCounter>,
    outcome: LoggerOutcome,
    failure: Option<Error>,
    /// Taken and not yet passed on.
    records: Vec<Record>,
    log_time: Nanos,
    scene: Option<SceneWatch>,
}

impl std::fmt::Debug for LoggerActor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoggerActor").field("environment", &self.environment).finish_non_exhaustive()
    }
}

impl LoggerActor {
    /// A logger that keeps statistics and writes everything to `sink`.
    pub fn new(
        drain: RecordDrain,
        sink: impl LogSink + 'static,
        environment: Environment,
        grants: GrantHandle,
        outcome: LoggerOutcome,
    ) -> Self {
        let stats = (0..environment.groups.len() as u16).map(StatsCounter::new).collect();
        let mut analysis = Analysis::default();
        analysis.set_environment(&environment);
        Self {
            drain,
            sink: Box::new(sink),
            environment,
            grants,
            grants_known: false,
            analysis,
            stats,
            outcome,
            failure: None,
            records: Vec::new(),
            log_time: Nanos::ZERO,
            scene: None,
        }
    }

    /// Also takes pictures, one per release.
    #[must_use]
    pub fn watching(mut self, scene: Option<SceneWatch>) -> Self {
        self.scene = scene;
        self
    }

    /// Passes on the pictures from before `time`, once every record up to there has been.
    fn take_pictures(&mut self, time: Nanos) {
        while let Some(frame) = self.scene.as_mut().and_then(|scene| scene.due(time)) {
            self.keep(|sink| sink.scene(&frame));
        }
    }

    /// A sink that fails does not end the run; its report says so.
    fn keep(&mut self, write: impl FnOnce(&mut dyn LogSink) -> Result<(), Error>) {
        if let Err(error) = write(&mut *self.sink)
            && self.failure.is_none()
        {
            tracing::error!(target: LOG_FAILURE, "the log ends here: {error}");
            self.failure = Some(error);
        }
    }

    /// Takes what was recorded and passes on, in the order of time, what is older than `horizon`.
    fn take_records(&mut self, horizon: Nanos) {
        let mut records = std::mem::take(&mut self.records);
        self.drain.drain(&mut records);
        // Stable: what a thread records at one time keeps its order.
        records.sort_by_key(|record| record.stamp);
        let ready = records.partition_point(|record| record.stamp < horizon);
        // Which group a lost record was of is not known: the first one's statistics hold the sum, as the report does.
        if let Some(first) = self.stats.first_mut() {
            first.set_lost(self.drain.lost());
        }
        for record in records.drain(..ready).filter_map(|record| LogRecord::from_record(&record)) {
            self.take_pictures(record.time());
            self.log_time = self.log_time.max(record.time());
            if let Some(scene) = &mut self.scene {
                scene.see(&record, &self.environment);
            }
            match &record {
                LogRecord::Event(event) => {
                    let text = in_words(event, &self.environment.group_name(event.group));
                    match text.level {
                        Level::Info => tracing::info!(time = %text.time, "{}", text.message),
                        Level::Warning => tracing::warn!(time = %text.time, "{}", text.message),
                        Level::Error => tracing::error!(time = %text.time, "{}", text.message),
                    }
                    // The sum is one over all groups; an event of an unknown one counts for the first.
                    let group = usize::from(event.group);
                    let group = if group < self.stats.len() { group } else { 0 };
                    self.stats.get_mut(group).into_iter().for_each(|counter| counter.push_event(&text));
                    self.analysis.push_text(&text);
                    self.keep(|sink| sink.text(&text));
                    continue;
                }
                LogRecord::Tick(timing) => {
                    let counter = self.stats.get_mut(usize::from(timing.group));
                    if let Some(stats) = counter.and_then(|counter| counter.push(timing)) {
                        self.keep(|sink| sink.stats(&stats));
                    }
                }
                LogRecord::Port(used) => {
                    self.stats.get_mut(usize::from(used.group)).into_iter().for_each(StatsCounter::push_port_use);
                }
                _ => {}
            }
            self.analysis.push(&record);
            self.keep(|sink| sink.record(&record));
        }
        self.take_pictures(horizon);
        self.records = records;
    }

    fn learn_grants(&mut self) {
        if self.grants_known {
            return;
        }
        if let Some(grant) = self.grants.get() {
            self.grants_known = true;
            self.environment.granted = granted(&grant);
            self.environment.pin_groups(&grant.groups);
            self.analysis.set_environment(&self.environment);
            self.sink.environment(&self.environment);
        }
    }
}

impl Actor for LoggerActor {
    fn name(&self) -> &str {
        "logger"
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        if let Some(scene) = &mut self.scene {
            scene.take(ctx);
        }
        self.learn_grants();
        self.take_records(ctx.scheduled.saturating_sub(HELD_BACK));
        let log_time = self.log_time;
        self.keep(|sink| sink.flush(log_time, ctx.now));
        Outcome::Continue
    }

    fn stop(&mut self, _: &TickContext) {
        self.learn_grants();
        self.take_records(Nanos(u64::MAX));
        for counter in std::mem::take(&mut self.stats) {
            let stats = counter.finish(self.log_time);
            self.keep(|sink| sink.stats(&stats));
        }
        self.keep(|sink| sink.finish());
        self.analysis.set_lost(0, self.drain.lost());
        let mut outcome = self.outcome.0.lock().unwrap_or_else(PoisonError::into_inner);
        *outcome = (self.analysis.report(), self.failure.take());
    }
}

/// An event in words; the causes that palpate's own actors give are named.
fn in_words(event: &Event, group: &str) -> TextEvent {
    let mut text = TextEvent::describe(event, group);
    if matches!(event.code, Event::FAULT | Event::DEGRADED)
        && let Some(cause) = u32::try_from(event.detail).ok().and_then(Cause::describe)
    {
        text.message = format!("{group}: {cause}");
    }
    text
}
