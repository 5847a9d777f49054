//! Compares what is computed with what was logged, while it is computed.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::fields::{first_difference, in_words};
use super::report::{Compared, Difference};
use crate::log::{JoinedRecords, LogRecord};
use crate::runtime::{Actor, Nanos, Outcome, Record, RecordDrain, TickContext};
use crate::scene::MAX_DEVICES;

/// The topics whose samples are computed, and whether the local group makes them.
const TOPICS: [(&str, bool); 6] = [
    ("/force", true),
    ("/force_commanded", true),
    ("/contact", true),
    ("/resync", true),
    ("/global", false),
    ("/probe", true),
];

/// The place of a sample in [`TOPICS`]; `None` for inputs and measurements.
fn place(record: &LogRecord) -> Option<usize> {
    match record {
        LogRecord::Force(_) => Some(0),
        LogRecord::Command(_) => Some(1),
        LogRecord::ContactPoint(_) | LogRecord::Contact(_) => Some(2),
        LogRecord::Resync(_) => Some(3),
        LogRecord::Global(_) => Some(4),
        LogRecord::Probe(_) => Some(5),
        LogRecord::Tick(_)
        | LogRecord::Actors(_)
        | LogRecord::Event(_)
        | LogRecord::Port(_)
        | LogRecord::Input(_)
        | LogRecord::Tool(_)
        | LogRecord::Link(_) => None,
    }
}

/// The place of its device. A number that no scene has comes from a damaged log, and is compared with what is not there.
fn device(record: &LogRecord) -> usize {
    usize::from(record.device()).min(MAX_DEVICES - 1)
}

/// From when on samples of the log have no counterpart, for each side: the log goes on behind its first fault.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub(super) local: Nanos,
    pub(super) global: Nanos,
    /// The last release of the local group that was repeated. The local model may lag behind it.
    pub(super) last_local: Nanos,
}

/// One topic: what was logged, and how far the computation has followed.
#[derive(Debug)]
struct Topic {
    name: &'static str,
    /// By device: each makes its samples in the order of time.
    logged: [Vec<LogRecord>; MAX_DEVICES],
    followed: [usize; MAX_DEVICES],
    computed: u64,
    identical: u64,
    last: Option<Nanos>,
    first: Option<Difference>,
}

impl Topic {
    fn new(name: &'static str) -> Self {
        let logged = std::array::from_fn(|_| Vec::new());
        Self { name, logged, followed: [0; MAX_DEVICES], computed: 0, identical: 0, last: None, first: None }
    }

    fn compare(&mut self, computed: LogRecord) {
        let device = device(&computed);
        let logged = self.logged[device].get(self.followed[device]).copied();
        self.followed[device] += 1;
        self.computed += 1;
        self.last = Some(computed.time());
        match logged.map_or(Some("count"), |logged| first_difference(&logged, &computed)) {
            None => self.identical += 1,
            Some(what) => self.note(what, logged, Some(computed)),
        }
    }

    fn note(&mut self, what: &'static str, logged: Option<LogRecord>, computed: Option<LogRecord>) {
        let Some(time) = logged.or(computed).map(|sample| sample.time()) else { return };
        let words = |sample: Option<LogRecord>| sample.map(|sample| in_words(&sample));
        let (logged, computed) = (words(logged), words(computed));
        self.first.get_or_insert(Difference { time, topic: self.name, what, logged, computed });
    }

    /// Sums up. Logged samples that nothing was computed for are a difference, but from `end` on.
    fn finish(&mut self, end: Option<Nanos>) -> Compared {
        let left =
            |(logged, &followed): (&'_ Vec<LogRecord>, &usize)| logged.get(followed..).unwrap_or_default().to_vec();
        let left: Vec<LogRecord> = self.logged.iter().zip(&self.followed).flat_map(left).collect();
        let is_owed = |sample: &&LogRecord| end.is_none_or(|end| sample.time() < end);
        let owed = left.iter().filter(is_owed).count();
        let first_owed = left.iter().filter(is_owed).min_by_key(|sample| sample.time()).copied();
        let left_out = left.len() - owed;
        if first_owed.is_some() {
            self.note("count", first_owed, None);
        }
        Compared {
            topic: self.name,
            logged: (self.logged.iter().map(Vec::len).sum::<usize>() - left_out) as u64,
            computed: self.computed,
            identical: self.identical,
            left_out: left_out as u64,
        }
    }
}

/// The logged samples, shared by the actor that compares and the replay that reports.
#[derive(Clone, Debug)]
pub(super) struct Comparison(Arc<Mutex<[Topic; TOPICS.len()]>>);

impl Default for Comparison {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(TOPICS.map(|(name, _)| Topic::new(name)))))
    }
}

impl Comparison {
    /// Adds a sample of the log, if it is one that a replay computes.
    pub(super) fn log(&self, record: &LogRecord) {
        if let Some(place) = place(record) {
            self.topics()[place].logged[device(record)].push(*record);
        }
    }

    /// Forces in the log before `time`.
    pub(super) fn forces_before(&self, time: Nanos) -> usize {
        self.topics()[0].logged.iter().flatten().filter(|sample| sample.time() < time).count()
    }

    /// How each topic compares, and the earliest difference.
    pub(super) fn finish(&self, end: Option<End>) -> ([Compared; TOPICS.len()], Option<Difference>) {
        let mut topics = self.topics();
        let last_force = topics[0].last.unwrap_or_default();
        let end_of = |end: End, is_local: bool| match is_local {
            // A sample carries the model's time. The releases behind the end go on from where the model stood.
            true if last_force < end.last_local => end.local.min(last_force + Nanos(1)),
            true => end.local,
            false => end.global,
        };
        let mut compared = [Compared::default(); TOPICS.len()];
        for ((topic, compared), (_, is_local)) in topics.iter_mut().zip(&mut compared).zip(TOPICS) {
            *compared = topic.finish(end.map(|end| end_of(end, is_local)));
        }
        let differences = topics.iter_mut().filter_map(|topic| topic.first.take());
        let first = differences.min_by_key(|difference| difference.time);
        (compared, first)
    }

    fn topics(&self) -> MutexGuard<'_, [Topic; TOPICS.len()]> {
        // Nothing that can panic half-way runs under the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes the place of the logger.
#[derive(Debug)]
pub(super) struct Comparer {
    drain: RecordDrain,
    comparison: Comparison,
    records: Vec<Record>,
    joined: JoinedRecords,
}

impl Comparer {
    pub(super) fn new(drain: RecordDrain, comparison: Comparison) -> Self {
        Self { drain, comparison, records: Vec::new(), joined: JoinedRecords::default() }
    }
}

impl Actor for Comparer {
    fn name(&self) -> &str {
        "comparer"
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        self.drain.drain(&mut self.records);
        let mut topics = self.comparison.topics();
        let joined = &mut self.joined;
        for computed in self.records.drain(..).filter_map(|record| joined.read(&record)) {
            if let Some(place) = place(&computed) {
                topics[place].compare(computed);
            }
        }
        Outcome::Continue
    }
}
