//! Compares what is computed with what was logged, while it is computed.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::report::{Compared, Difference, ReplayReport};
use crate::log::{CommandSample, ForceSample, LogRecord};
use crate::runtime::{Actor, Outcome, Record, RecordDrain, RuntimeFault, TickContext};
use crate::time::Nanos;

/// What is compared of a sample.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time: Nanos,
    force_n: [f64; 3],
    model_version: u32,
}

impl Sample {
    /// The first thing that differs, by its bits: -0.0 is not 0.0, and a NaN is itself.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        if self.time != other.time {
            Some("time")
        } else if self.force_n.map(f64::to_bits) != other.force_n.map(f64::to_bits) {
            Some("force_n")
        } else if self.model_version != other.model_version {
            Some("model_version")
        } else {
            None
        }
    }

    fn in_words(&self) -> String {
        format!("{:?} N (t = {} s, model {})", self.force_n, self.time.as_secs_f64(), self.model_version)
    }
}

impl From<&ForceSample> for Sample {
    fn from(r: &ForceSample) -> Self {
        Self { time: r.time, force_n: r.force_n, model_version: r.model_version }
    }
}

impl From<&CommandSample> for Sample {
    fn from(r: &CommandSample) -> Self {
        Self { time: r.time, force_n: r.force_n, model_version: 0 }
    }
}

/// One topic: what was logged, and how far the computation has followed.
#[derive(Debug)]
struct Topic {
    name: &'static str,
    logged: Vec<Sample>,
    computed: u64,
    identical: u64,
    first: Option<Difference>,
}

impl Topic {
    fn new(name: &'static str) -> Self {
        Self { name, logged: Vec::new(), computed: 0, identical: 0, first: None }
    }

    fn compare(&mut self, computed: Sample) {
        let logged = self.logged.get(self.computed as usize).copied();
        self.computed += 1;
        match logged.map_or(Some("count"), |logged| logged.difference(&computed)) {
            None => self.identical += 1,
            Some(what) => self.note(what, logged, Some(computed)),
        }
    }

    fn note(&mut self, what: &'static str, logged: Option<Sample>, computed: Option<Sample>) {
        let Some(time) = logged.or(computed).map(|sample| sample.time) else { return };
        let words = |sample: Option<Sample>| sample.map(|sample| sample.in_words());
        let (logged, computed) = (words(logged), words(computed));
        self.first.get_or_insert(Difference { time, topic: self.name, what, logged, computed });
    }

    /// Sums up. Of a log that was cut at a fault the samples past the last computed one do not count.
    fn finish(&mut self, is_cut: bool) -> Compared {
        if is_cut {
            self.logged.truncate(self.computed as usize);
        }
        let left = self.logged.get(self.computed as usize).copied();
        if left.is_some() {
            self.note("count", left, None);
        }
        Compared { logged: self.logged.len() as u64, computed: self.computed, identical: self.identical }
    }
}

#[derive(Debug)]
struct Topics {
    force: Topic,
    commanded: Topic,
}

/// The logged forces, shared by the actor that compares and the replay that reports.
#[derive(Clone, Debug)]
pub(crate) struct Comparison(Arc<Mutex<Topics>>);

impl Comparison {
    pub(super) fn new() -> Self {
        let (force, commanded) = (Topic::new("/force"), Topic::new("/force_commanded"));
        Self(Arc::new(Mutex::new(Topics { force, commanded })))
    }

    pub(super) fn log_force(&self, sample: &ForceSample) {
        self.topics().force.logged.push(sample.into());
    }

    pub(super) fn log_command(&self, sample: &CommandSample) {
        self.topics().commanded.logged.push(sample.into());
    }

    fn compare(&self, record: &LogRecord) {
        match record {
            LogRecord::Force(sample) => self.topics().force.compare(sample.into()),
            LogRecord::Command(sample) => self.topics().commanded.compare(sample.into()),
            _ => {}
        }
    }

    pub(super) fn report(&self, logged_fault: Option<(Nanos, String)>, fault: Option<RuntimeFault>) -> ReplayReport {
        let mut topics = self.topics();
        let force = topics.force.finish(logged_fault.is_some());
        let commanded = topics.commanded.finish(logged_fault.is_some());
        let differences = [topics.force.first.take(), topics.commanded.first.take()];
        let first_difference = differences.into_iter().flatten().min_by_key(|difference| difference.time);
        ReplayReport { force, commanded, first_difference, logged_fault, fault }
    }

    fn topics(&self) -> MutexGuard<'_, Topics> {
        // Nothing that can panic half-way runs under the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes the place of the logger.
#[derive(Debug)]
pub(crate) struct Comparer {
    drain: RecordDrain,
    comparison: Comparison,
    records: Vec<Record>,
}

impl Comparer {
    pub(crate) fn new(drain: RecordDrain, comparison: Comparison) -> Self {
        Self { drain, comparison, records: Vec::new() }
    }
}

impl Actor for Comparer {
    fn name(&self) -> &str {
        "comparer"
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        self.drain.drain(&mut self.records);
        let records = self.records.drain(..).filter_map(|record| LogRecord::from_record(&record));
        records.for_each(|record| self.comparison.compare(&record));
        Outcome::Continue
    }
}
