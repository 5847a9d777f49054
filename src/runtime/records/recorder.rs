//! How records leave an actor: a ring per source, drained by a logger that merges them by time.
//!
//! A release stamps what it records with the time at which it was due, however long it takes. A group therefore says when one is at work,
//! and a logger that wants the order of time waits for what such a release may still record.

use crate::primitives::ring::{Consumer, Producer, Sums, ring};
use crate::primitives::sync::{AtomicBool, AtomicU64, CachePadded, Ordering, lock};
use crate::records::record::Record;
use crate::time::Nanos;
use std::sync::{Arc, Mutex};

/// All rings of a graph. The lock is taken when a ring is added and by the logger, never by a real-time tick.
#[derive(Debug)]
pub(crate) struct Registry {
    rings: Mutex<Rings>,
    /// Whether anybody wants the records.
    wanted: AtomicBool,
}

#[derive(Debug, Default)]
struct Rings {
    all: Vec<Source>,
    /// What was left in rings that were replaced, and how many records those had lost.
    kept: Vec<Record>,
    lost: u64,
    /// Not told yet.
    gap: Option<RecordGap>,
}

/// A ring and what was learnt of it in the drains so far.
#[derive(Debug)]
struct Source {
    ring: Consumer<Record>,
    at_work: Arc<AtWork>,
    /// Lost records that are part of a gap.
    told: u64,
    /// The stamp of the last record taken.
    newest: Nanos,
}

/// When the release was due that is at work; [`IDLE`] if none is.
type AtWork = CachePadded<AtomicU64>;

const IDLE: u64 = u64::MAX;

impl Source {
    fn new(ring: Consumer<Record>, at_work: Arc<AtWork>) -> Self {
        Self { ring, at_work, told: 0, newest: Nanos::ZERO }
    }

    /// Takes what there is, and says what was lost.
    fn drain(&mut self, records: &mut Vec<Record>) -> Option<RecordGap> {
        // No more than is there now: a fast producer cannot keep the logger here, and what follows a gap is left.
        let count = self.ring.available();
        let is_full = count == self.ring.capacity();
        let before = self.newest;
        records.extend(std::iter::from_fn(|| self.ring.pop()).take(count));
        if let Some(last) = records.last().filter(|_| count > 0) {
            self.newest = last.stamp;
        }
        let lost = self.ring.lost();
        let gap = RecordGap { records: lost - self.told, from: if is_full { self.newest } else { before } };
        self.told = lost;
        (gap.records > 0).then_some(gap)
    }
}

/// Records lost because a ring was full when they were pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordGap {
    /// The number of records that were lost.
    pub records: u64,
    /// The stamp of the last record before them; they end at the drain that told of them at the latest.
    pub from: Nanos,
}

impl Rings {
    fn note(&mut self, gap: Option<RecordGap>) {
        let Some(gap) = gap else { return };
        let known = self.gap.get_or_insert(RecordGap { records: 0, from: gap.from });
        *known = RecordGap { records: known.records + gap.records, from: known.from.min(gap.from) };
    }
}

/// A ring in the place of another.
#[derive(Debug)]
pub(crate) struct NewRing {
    pub(crate) recorder: Recorder,
    /// Its number, to replace it.
    pub(crate) index: usize,
    /// How many records were pushed into the one before, lost ones included, until it was replaced.
    pub(crate) before: u64,
}

impl Registry {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self { rings: Mutex::default(), wanted: AtomicBool::new(false) })
    }

    pub(crate) fn recorder(&self, capacity: usize) -> Recorder {
        self.replace(None, capacity).recorder
    }

    /// A new ring in place of number `old`, whose records up to now are kept: what its recorder still pushes is seen by
    /// nobody.
    pub(crate) fn replace(&self, old: Option<usize>, capacity: usize) -> NewRing {
        let (producer, consumer) = ring(capacity);
        let at_work = Arc::new(CachePadded(AtomicU64::new(IDLE)));
        let source = Source::new(consumer, Arc::clone(&at_work));
        let mut rings = lock(&self.rings);
        let index = old.unwrap_or(rings.all.len());
        let mut before = 0;
        if old.is_some() {
            let mut replaced = std::mem::replace(&mut rings.all[index], source);
            // At one moment: the recorder may be at work on a thread that was left behind.
            let Sums { pushed, lost, left } = replaced.ring.sums();
            let wanted = self.wanted();
            rings.kept.extend(std::iter::from_fn(|| replaced.ring.pop()).take(if wanted { left } else { 0 }));
            let untold = lost - replaced.told;
            rings.note((wanted && untold > 0).then_some(RecordGap { records: untold, from: replaced.newest }));
            rings.lost += lost;
            before = pushed + lost;
        } else {
            rings.all.push(source);
        }
        NewRing { recorder: Recorder { ring: producer, at_work }, index, before }
    }

    pub(crate) fn drain(self: &Arc<Self>) -> RecordDrain {
        // Relaxed: set while the graph is built, read before and after its threads run.
        self.wanted.store(true, Ordering::Relaxed);
        RecordDrain(Arc::clone(self))
    }

    pub(crate) fn wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Records dropped because a ring was full; without a drain none is lost, since nobody asked.
    pub(crate) fn lost(&self) -> u64 {
        if !self.wanted() {
            return 0;
        }
        let rings = lock(&self.rings);
        rings.lost + rings.all.iter().map(|source| source.ring.lost()).sum::<u64>()
    }
}

/// A record sink of one actor.
///
/// ```
/// use palpate_runtime::{Event, Execution, Nanos, Runtime};
///
/// let mut graph = Runtime::builder(Execution::Threaded);
/// let (mut recorder, mut drain) = (graph.recorder(16), graph.drain());
/// recorder.push(Event { stamp: Nanos(5), group: 0, code: 300.into(), detail: 42 }); // in a tick
/// let mut records = Vec::new();
/// drain.drain(&mut records); // in a logger
/// assert_eq!(Event::from_record(&records[0]).map(|event| event.detail), Some(42));
/// ```
#[derive(Debug)]
pub struct Recorder {
    ring: Producer<Record>,
    at_work: Arc<AtWork>,
}

impl Recorder {
    /// Records something; a full ring drops and counts it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn push(&mut self, record: impl Into<Record>) {
        self.ring.push(record.into());
    }

    /// A release is at work that was due at `scheduled`: it may still record at that stamp or later.
    #[inline]
    pub(crate) fn begin_release(&mut self, scheduled: Nanos) {
        // Relaxed: a drain that does not see it yet takes it for one that begins after the drain.
        self.at_work.store(scheduled.0, Ordering::Relaxed);
    }

    /// It has recorded everything.
    #[inline]
    pub(crate) fn end_release(&mut self) {
        // Release: with the acquire in `drain`, so that whoever sees this also finds the records in their rings.
        self.at_work.store(IDLE, Ordering::Release);
    }
}

/// Takes the records of all recorders of a graph and of every group's own timing and events.
#[derive(Debug)]
pub struct RecordDrain(Arc<Registry>);

impl RecordDrain {
    /// Appends what was recorded since the last call, in the order of the stamps; equal stamps keep the order in which
    /// the recorders were made. Returns when the oldest release was due that is at work: it may still record at that
    /// stamp or later, but no other that has begun. `Nanos(u64::MAX)` if none is at work.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for loggers.
    pub fn drain(&mut self, records: &mut Vec<Record>) -> Nanos {
        let first = records.len();
        let rings = &mut *lock(&self.0.rings);
        // Before the rings: what ends meanwhile has recorded more than is taken here.
        let at_work = rings.all.iter().map(|source| source.at_work.load(Ordering::Acquire)).min();
        records.append(&mut rings.kept);
        for index in 0..rings.all.len() {
            let gap = rings.all[index].drain(records);
            rings.note(gap);
        }
        records[first..].sort_by_key(|record| record.stamp);
        Nanos(at_work.unwrap_or(IDLE))
    }

    /// Records lost so far because a ring was full.
    ///
    /// # Real-time
    /// Takes a lock: for loggers.
    pub fn lost(&self) -> u64 {
        self.0.lost()
    }

    /// The gap that was found in the drains since the last call, of all recorders together; `None` if nothing was lost.
    ///
    /// # Real-time
    /// Takes a lock: for loggers.
    pub fn take_gap(&mut self) -> Option<RecordGap> {
        lock(&self.0.rings).gap.take()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::ports::restartable::RecorderPort;
    use crate::records::record::Event;

    fn event(stamp: u64, code: u32) -> Event {
        Event { stamp: Nanos(stamp), group: 0, code: code.into(), detail: 0 }
    }

    #[test]
    fn records_are_merged_by_stamp_and_ties_keep_their_order() {
        let registry = Registry::new();
        let mut a = registry.recorder(8);
        let mut drain = registry.drain();
        let mut b = registry.recorder(2);
        for (stamp, code) in [(1, 10), (3, 11), (3, 12)] {
            a.push(event(stamp, code));
        }
        for (stamp, code) in [(2, 20), (3, 21), (4, 22)] {
            b.push(event(stamp, code));
        }
        let mut records = Vec::new();
        drain.drain(&mut records);
        let codes: Vec<u32> = records.iter().filter_map(Event::from_record).map(|e| e.code.code()).collect();
        assert_eq!(codes, [10, 20, 11, 12, 21]);
        assert_eq!(drain.lost(), 1);
    }

    // Check that a gap is told once, from the last record before it, and that what follows it is not taken for what
    // came before.
    #[test]
    fn a_gap_begins_with_the_last_record_before_it() {
        let registry = Registry::new();
        let mut drain = registry.drain();
        let (mut a, mut b) = (registry.recorder(2), registry.recorder(4));
        (1..=4).for_each(|stamp| a.push(event(stamp, 0)));
        (1..=3).for_each(|stamp| b.push(event(stamp, 0)));
        let mut records = Vec::new();
        drain.drain(&mut records);
        assert_eq!(drain.take_gap(), Some(RecordGap { records: 2, from: Nanos(2) }));
        a.push(event(5, 0));
        drain.drain(&mut records);
        assert_eq!((drain.take_gap(), drain.lost(), records.len()), (None, 2, 6));
    }

    #[test]
    fn the_oldest_release_that_is_at_work_is_told() {
        let registry = Registry::new();
        let mut drain = registry.drain();
        let port = RecorderPort::new(&registry, 4);
        let (mut slow, mut quick) = (port.recorder(), registry.recorder(4));
        let mut at_work = || drain.drain(&mut Vec::new());
        assert_eq!(at_work(), Nanos(u64::MAX));
        slow.begin_release(Nanos(5));
        quick.begin_release(Nanos(7));
        assert_eq!(at_work(), Nanos(5));
        quick.end_release();
        assert_eq!(at_work(), Nanos(5));
        // Check that nobody waits for one that was left behind
        let _next = port.recorder();
        assert_eq!(at_work(), Nanos(u64::MAX));
    }

    #[test]
    fn a_replaced_ring_keeps_its_records_and_tells_how_many_there_were() {
        let registry = Registry::new();
        let mut drain = registry.drain();
        let NewRing { recorder: mut old, index, .. } = registry.replace(None, 4);
        old.push(event(1, 1));
        let mut records = Vec::new();
        drain.drain(&mut records);
        for code in 2..=6 {
            old.push(event(u64::from(code), code));
        }
        let NewRing { recorder: mut fresh, index: same, before } = registry.replace(Some(index), 4);
        // Check that taken, left and lost ones count, and that the ring takes the place of the other
        assert_eq!((same, before, drain.lost()), (index, 6, 1));
        old.push(event(7, 7));
        fresh.push(event(8, 8));
        drain.drain(&mut records);
        let codes: Vec<u32> = records.iter().filter_map(Event::from_record).map(|e| e.code.code()).collect();
        assert_eq!(codes, [1, 2, 3, 4, 5, 8]);
        assert_eq!(lock(&registry.rings).all.len(), 1);
    }
}
