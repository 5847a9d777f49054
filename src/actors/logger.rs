//! The logger actor: takes the records of all threads, keeps statistics and writes the log.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use super::believed::Disbelieved;
use super::cause::Cause;
use super::log_sink::{LogSink, Loss};
use super::scene_watch::SceneWatch;
use super::throttle::Throttle;
use crate::error::{Error, ErrorKind};
use crate::log::{
    Analysis, Environment, JoinedRecords, Level, LogRecord, LoggedExecution, RunReport, StatsCounter, TextEvent,
};
use crate::runtime::Nanos;
use crate::runtime::{
    Actor, GrantHandle, GroupGrant, Outcome, OutletReader, Record, RecordDrain, RecordGap, SystemGrant, TickContext,
};
use crate::runtime::{Event, InputUse, PortUse};

/// The target of the event that says that a log could not be written, for programs that report the summary's
/// `log_error` instead.
pub const LOG_FAILURE: &str = "palpate::log_failure";

/// Records younger than this wait for the next drain: a group stamps its records with the start of a release and hands
/// them over at its end, and the log is to be in the order of time.
const HELD_BACK: Nanos = Nanos(100_000_000);

/// A release that takes longer is waited for, such as that of a basis, but no longer than this: a group that is stuck
/// is not to keep the log of the others in memory, where it is lost if the process is killed.
const LONGEST_HELD_BACK: Nanos = Nanos(1_000_000_000);

/// The outcome of a run, filled in when the logger stops.
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
    start_known: bool,
    analysis: Analysis,
    stats: Vec<StatsCounter>,
    outcome: LoggerOutcome,
    failure: Option<Error>,
    /// Taken and not yet passed on, but for the first `passed`.
    records: Vec<Record>,
    passed: usize,
    joined: JoinedRecords,
    /// Records that the sink could not keep.
    lost_by_sink: u64,
    /// The sink panicked: it is not called any more.
    sink_failed: bool,
    log_time: Nanos,
    scene: Option<SceneWatch>,
    /// What was not believed of each device.
    disbelieved: Vec<OutletReader<Disbelieved>>,
    throttle: Throttle,
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
        let mut analysis = Analysis::bounded();
        analysis.set_environment(&environment);
        Self {
            drain,
            sink: Box::new(sink),
            environment,
            grants,
            grants_known: false,
            start_known: false,
            analysis,
            stats,
            outcome,
            failure: None,
            records: Vec::new(),
            passed: 0,
            joined: JoinedRecords::default(),
            lost_by_sink: 0,
            sink_failed: false,
            log_time: Nanos::ZERO,
            scene: None,
            disbelieved: Vec::new(),
            throttle: Throttle::default(),
        }
    }

    /// Also takes pictures, one per release.
    #[must_use]
    pub fn watching(mut self, scene: Option<SceneWatch>) -> Self {
        self.scene = scene;
        self
    }

    /// Also says in words what was not believed of each device.
    #[must_use]
    pub(crate) fn telling(mut self, disbelieved: Vec<OutletReader<Disbelieved>>) -> Self {
        self.disbelieved = disbelieved;
        self
    }

    /// An event in words, with the place and the limit if a device told what cannot be.
    fn in_words(&mut self, event: &Event) -> TextEvent {
        let mut text = in_words(event, &self.environment.group_name(event.group));
        if event.code == Event::DEGRADED && event.detail == u64::from(Cause::DeviceImpossible.code()) {
            for (number, reader) in self.disbelieved.iter_mut().enumerate() {
                if reader.refresh() {
                    let name = self.environment.devices.get(number).map_or("", String::as_str);
                    let wrong = reader.get();
                    let colon = if name.is_empty() { "" } else { ": " };
                    text.message = format!("{}; {name}{colon}{wrong} ({} so far)", text.message, wrong.count);
                }
            }
        }
        text
    }

    /// Passes on the pictures from before `time`, once every record up to there has been.
    fn take_pictures(&mut self, time: Nanos) {
        while let Some(frame) = self.scene.as_mut().and_then(|scene| scene.due(time)) {
            self.keep(|sink| sink.scene(&frame));
        }
    }

    /// A sink that fails does not end the run; its report says so.
    fn keep(&mut self, write: impl FnOnce(&mut dyn LogSink) -> Result<(), Error>) {
        if self.sink_failed {
            self.lost_by_sink += 1;
            return;
        }
        // What was half-way done in a sink that panicked is not looked at again.
        let result = catch_unwind(AssertUnwindSafe(|| write(&mut *self.sink))).unwrap_or_else(|_| {
            self.sink_failed = true;
            self.lost_by_sink += 1;
            Err(Error::new(ErrorKind::Fault, "what writes the log panicked"))
        });
        if let Err(error) = result
            && self.failure.is_none()
        {
            tracing::error!(target: LOG_FAILURE, "the log ends here: {error}");
            self.failure = Some(error);
        }
    }

    /// Takes what was recorded and passes on, in the order of time, what nothing older can follow any more; `all` of it after the last release.
    fn take_records(&mut self, ctx: &TickContext, all: bool) {
        // More than none only after a panic: what was passed on then is not passed on twice.
        self.records.drain(..std::mem::take(&mut self.passed));
        let at_work = self.drain.drain(&mut self.records);
        let horizon = if all { Nanos(u64::MAX) } else { settled(ctx.scheduled, at_work) };
        // Stable: what a thread records at one time keeps its order.
        self.records.sort_by_key(|record| record.stamp);
        if let Some(RecordGap { records, from }) = self.drain.take_gap() {
            self.tell(&Loss { records, from, to: ctx.now.max(from), why: "the logger came late" });
        }
        let ready = self.records.partition_point(|record| record.stamp < horizon);
        self.note_lost();
        while self.passed < ready {
            let record = self.records[self.passed];
            self.passed += 1;
            if let Some(record) = self.joined.read(&record) {
                self.pass_on(&record);
            }
        }
        self.take_pictures(horizon);
        self.records.drain(..std::mem::take(&mut self.passed));
        self.take_loss();
    }

    fn pass_on(&mut self, record: &LogRecord) {
        self.take_pictures(record.time());
        if let Some(scene) = &mut self.scene {
            scene.see(record, &self.environment);
        }
        self.log_time = self.log_time.max(record.time());
        match record {
            LogRecord::Event(event) => {
                let text = self.in_words(event);
                if let Some(times) = self.throttle.speaks(kind(event)) {
                    match text.level {
                        Level::Info => tracing::info!(time = %text.time, "{}{times}", text.message),
                        Level::Warning => tracing::warn!(time = %text.time, "{}{times}", text.message),
                        Level::Error => tracing::error!(time = %text.time, "{}{times}", text.message),
                    }
                }
                self.text(event.group, &text);
                return;
            }
            LogRecord::Tick(timing) => {
                let counter = self.stats.get_mut(usize::from(timing.group));
                if let Some(stats) = counter.and_then(|counter| counter.push(timing)) {
                    self.keep(|sink| sink.stats(&stats));
                }
            }
            LogRecord::Port(PortUse { group, .. }) | LogRecord::Input(InputUse { group, .. }) => {
                self.stats.get_mut(usize::from(*group)).into_iter().for_each(StatsCounter::push_port_use);
            }
            _ => {}
        }
        self.analysis.push(record);
        self.keep(|sink| sink.record(record));
    }

    fn text(&mut self, group: u16, text: &TextEvent) {
        // The sum is one over all groups; an event of an unknown one counts for the first.
        let group = if usize::from(group) < self.stats.len() { usize::from(group) } else { 0 };
        self.stats.get_mut(group).into_iter().for_each(|counter| counter.push_event(text));
        self.analysis.push_text(text);
        self.keep(|sink| sink.text(text));
    }

    /// Tells in the log and in the report what is missing.
    fn tell(&mut self, loss: &Loss) {
        let text = loss.in_words();
        tracing::warn!(target: LOG_FAILURE, "{}", text.message);
        self.text(0, &text);
    }

    fn take_loss(&mut self) {
        if self.sink_failed {
            return;
        }
        while let Some(loss) = self.sink.take_loss() {
            self.lost_by_sink += loss.records;
            self.note_lost();
            self.tell(&loss);
        }
    }

    /// Which group a lost record was of is not known: the first one's statistics hold the sum, as the report does.
    fn note_lost(&mut self) {
        let lost = self.lost();
        self.stats.first_mut().into_iter().for_each(|first| first.set_lost(lost));
    }

    fn lost(&self) -> u64 {
        self.drain.lost() + self.lost_by_sink
    }

    /// Takes what is known only once it runs: when time zero was, before anything is written by it, and what the system has granted.
    fn learn(&mut self, now: Nanos) {
        let mut is_more = false;
        if !std::mem::replace(&mut self.start_known, true) && self.environment.execution != LoggedExecution::Virtual {
            self.environment.execution = LoggedExecution::began(now);
            is_more = true;
        }
        if let Some(grant) = self.grants.get().filter(|_| !self.grants_known) {
            self.grants_known = true;
            self.environment.granted = granted(&grant);
            self.environment.pin_groups(&grant.groups);
            is_more = true;
        }
        if is_more {
            self.analysis.set_environment(&self.environment);
            let environment = self.environment.clone();
            if !self.sink_failed {
                self.keep(|sink| {
                    sink.environment(&environment);
                    Ok(())
                });
            }
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
        self.learn(ctx.now);
        self.take_records(ctx, false);
        let log_time = self.log_time;
        if !self.sink_failed {
            self.keep(|sink| sink.flush(log_time, ctx.now));
        }
        Outcome::Continue
    }

    fn stop(&mut self, ctx: &TickContext) {
        self.learn(ctx.now);
        self.take_records(ctx, true);
        if !self.sink_failed {
            self.keep(|sink| {
                sink.ending();
                Ok(())
            });
        }
        self.take_loss();
        for counter in std::mem::take(&mut self.stats) {
            let stats = counter.finish(self.log_time);
            self.keep(|sink| sink.stats(&stats));
        }
        if !self.sink_failed {
            self.keep(|sink| sink.finish());
        }
        self.take_loss();
        self.analysis.set_lost(0, self.lost());
        let mut outcome = self.outcome.0.lock().unwrap_or_else(PoisonError::into_inner);
        *outcome = (self.analysis.report(), self.failure.take());
    }
}

/// Before which nothing will be recorded any more, as far as anybody waits for it: `at_work` is when the oldest release was due that may.
fn settled(now: Nanos, at_work: Nanos) -> Nanos {
    now.saturating_sub(HELD_BACK).min(at_work.max(now.saturating_sub(LONGEST_HELD_BACK)))
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

/// What events have in common that are said less and less often: the group, the code, the cause or that it has ended.
fn kind(event: &Event) -> (u16, u32, u64) {
    let has_cause = event.code == Event::DEGRADED || event.detail == Event::RECOVERED;
    (event.group, event.code.code(), if has_cause { event.detail } else { 0 })
}

/// The grant as text: the machine, what the process got, and a line per rate group.
fn granted(grant: &SystemGrant) -> BTreeMap<String, String> {
    let machine = format!("{}, clock {}, {} cores", kernel(&grant.kernel), grant.clock_source, grant.cores);
    let mut map: BTreeMap<String, String> = [("machine".to_owned(), machine)].into();
    if !grant.virtual_time {
        map.insert("memory".to_owned(), format!("mlockall {}", grant.mlock));
        map.insert("timer slack".to_owned(), grant.timer_slack.clone());
        map.insert("idle states".to_owned(), grant.idle_states.clone());
        map.extend(grant.groups.iter().map(|group| (group.name.clone(), group_in_words(group))));
    }
    map
}

/// System and release, without the build's own story.
fn kernel(kernel: &str) -> String {
    kernel.split_whitespace().take(2).collect::<Vec<_>>().join(" ")
}

fn group_in_words(group: &GroupGrant) -> String {
    let priority = if group.priority > 0 { format!(" {}", group.priority) } else { String::new() };
    let cpu = group.cpu.map_or("any cpu".to_owned(), |cpu| format!("cpu {cpu}"));
    let refused = if group.refused.is_empty() { String::new() } else { format!("; {}", group.refused) };
    format!("{}{priority} on {cpu}, {}{refused}", group.policy, group.wait)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_waits_for_a_release_that_takes_long_but_not_for_one_that_is_stuck() {
        let ms = |ms: u64| Nanos(ms * 1_000_000);
        assert_eq!(settled(ms(5000), Nanos(u64::MAX)), ms(4900));
        assert_eq!(settled(ms(5000), ms(4990)), ms(4900));
        assert_eq!(settled(ms(5000), ms(4600)), ms(4600));
        assert_eq!(settled(ms(5000), ms(10)), ms(4000));
        assert_eq!(settled(ms(50), ms(10)), Nanos::ZERO);
    }
}
