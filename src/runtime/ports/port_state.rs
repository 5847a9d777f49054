//! What every half of a port remembers besides its values: whether this release has looked, whose the other half is, and
//! what has been recorded.

use crate::actor::{Phase, TickContext};
use crate::executor::Execution;
use crate::ports::port_traffic::Sides;
use crate::primitives::sync::{AtomicUsize, Ordering, lock};
use crate::records::input::InputUse;
use crate::records::port_use::{PortUse, PortUseKind};
use crate::records::recorder::{Recorder, Registry};
use std::sync::{Arc, Mutex};

/// A port, whoever holds its halves: its number and who wants to know what it shows.
#[derive(Debug)]
pub(crate) struct PortPlan {
    port: u32,
    registry: Arc<Registry>,
    /// Whether its uses are recorded: from its beginning on or not at all.
    recorded: bool,
    uses: Mutex<Vec<UseRing>>,
    pub(crate) group: WriterGroup,
    pub(crate) sides: Sides,
}

/// Where the uses of one kind go.
#[derive(Debug)]
struct UseRing {
    kind: PortUseKind,
    /// The number of the ring of the half that was taken last.
    index: usize,
    /// Uses before that half's first one.
    before: u64,
}

impl PortPlan {
    pub(crate) fn new(execution: Execution, port: u32, registry: &Arc<Registry>) -> Self {
        let (registry, recorded) = (Arc::clone(registry), registry.wanted());
        let group = WriterGroup::new(execution, port);
        Self { port, registry, recorded, uses: Mutex::default(), group, sides: Sides::new() }
    }

    /// Records the uses of this kind, for one half; fences the recorder of the one taken before and goes on with its
    /// numbers. What a fenced half still does leaves no record and no gap.
    pub(crate) fn recorder(&self, kind: PortUseKind) -> UseRecorder {
        if !self.recorded {
            return UseRecorder { port: self.port, kind, sequence: 0, recorder: None };
        }
        let mut uses = lock(&self.uses);
        let at = uses.iter().position(|ring| ring.kind == kind);
        let new = self.registry.replace(at.map(|at| uses[at].index), RECORDS);
        let sequence = at.map_or(0, |at| uses[at].before) + new.before;
        let ring = UseRing { kind, index: new.index, before: sequence };
        match at {
            Some(at) => uses[at] = ring,
            None => uses.push(ring),
        }
        UseRecorder { port: self.port, kind, sequence, recorder: Some(new.recorder) }
    }
}

/// Records of one half of a port between two drains: at one per release, four seconds of 1 kHz.
const RECORDS: usize = 4096;

/// Tells the first look of a release from those that follow. A release looks at a port once: what it saw is then one
/// fact that can be recorded, and a value that arrives while it runs waits for the next one.
#[derive(Debug, Default)]
pub(crate) struct Looks(Option<(Phase, u64)>);

impl Looks {
    /// True at the first call of a release.
    pub(crate) fn is_first(&mut self, ctx: &TickContext) -> bool {
        let current = Some((ctx.phase, ctx.tick));
        let first = self.0 != current;
        self.0 = current;
        first
    }
}

/// The group that writes a port, told by the writer to the reader.
#[derive(Clone, Debug)]
pub(crate) struct WriterGroup {
    writer: Arc<AtomicUsize>,
    /// What the port was made for, and its number.
    execution: Execution,
    port: u32,
}

impl WriterGroup {
    const UNKNOWN: usize = usize::MAX;

    pub(crate) fn new(execution: Execution, port: u32) -> Self {
        Self { writer: Arc::new(AtomicUsize::new(Self::UNKNOWN)), execution, port }
    }

    /// Refuses a graph of the other execution than the port's. An actor does not say which ports it holds, so this is
    /// seen at the first use; the panic is the actor's, which names the place.
    #[inline]
    #[track_caller]
    pub(crate) fn check_execution(&self, ctx: &TickContext) {
        if ctx.execution.is_some_and(|execution| execution != self.execution) {
            self.refuse();
        }
    }

    #[cold]
    #[track_caller]
    fn refuse(&self) -> ! {
        let (port, own) = (self.port, self.execution);
        let why = match own {
            Execution::Threaded => "so no latency delays what it shows",
            Execution::Virtual => "where it takes locks",
        };
        panic!(
            "port {port} is one of a graph with Execution::{own:?} and is used in another, {why}; make it with the builder of this graph"
        );
    }

    /// Called by the writer before each publication.
    pub(crate) fn set(&self, ctx: &TickContext) {
        // Relaxed: the reader asks only after it has taken a publication, and taking it synchronises with the writer's
        // release of it, which comes after this store.
        self.writer.store(ctx.group.into(), Ordering::Relaxed);
    }

    /// True if what the reader has taken was written by the group that is called. Before the first publication there is
    /// nothing that another group could have shown.
    pub(crate) fn is(&self, ctx: &TickContext) -> bool {
        // Relaxed: as in `set`.
        let writer = self.writer.load(Ordering::Relaxed);
        writer == usize::from(ctx.group) || writer == Self::UNKNOWN
    }
}

/// Records the uses of one kind of one half of a port.
#[derive(Debug)]
pub(crate) struct UseRecorder {
    port: u32,
    kind: PortUseKind,
    sequence: u64,
    recorder: Option<Recorder>,
}

impl UseRecorder {
    /// Records a value from outside.
    pub(crate) fn push_input(&mut self, ctx: &TickContext, value: [u64; 5]) {
        let Some(recorder) = &mut self.recorder else { return };
        let (port, sequence) = (self.port, self.sequence);
        self.sequence += 1;
        recorder.push(InputUse { time: ctx.scheduled, group: ctx.group, port, sequence, value });
    }

    pub(crate) fn push(&mut self, ctx: &TickContext, count: u64) {
        let Some(recorder) = &mut self.recorder else { return };
        let (port, kind, sequence) = (self.port, self.kind, self.sequence);
        // Counted also if the ring is full: the gap shows it.
        self.sequence += 1;
        recorder.push(PortUse { time: ctx.scheduled, group: ctx.group, port, kind, tick: ctx.tick, count, sequence });
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::Recording;
    use crate::time::{Nanos, Rate};

    fn at(tick: u64) -> TickContext {
        TickContext {
            tick,
            scheduled: Nanos(tick),
            phase: Phase::Release,
            ..TickContext::by_hand(Rate::hz(1000), tick)
        }
    }

    #[test]
    fn uses_are_numbered_on_through_every_half_and_a_fenced_one_leaves_none() {
        let registry = Registry::new();
        let mut drain = registry.drain();
        let plan = PortPlan::new(Execution::Threaded, 3, &registry);
        let mut halves = vec![plan.recorder(PortUseKind::Took)];
        let mut other = plan.recorder(PortUseKind::Dropped);
        let mut records = Vec::new();
        for n in 1..=9 {
            halves.last_mut().unwrap().push(&at(n), n);
            other.push(&at(n), 2 * n);
            if n % 3 == 0 {
                let fresh = plan.recorder(PortUseKind::Took);
                // Check that what a fenced half saw later is not among the records
                halves.iter_mut().for_each(|fenced| fenced.push(&at(100), 100));
                halves.push(fresh);
            }
            if n % 2 == 0 {
                drain.drain(&mut records);
            }
        }
        drain.drain(&mut records);
        let uses: Vec<PortUse> = records.iter().filter_map(PortUse::from_record).collect();
        assert_eq!((uses.len(), uses.iter().filter(|used| used.count == 100).count()), (18, 0));
        Recording::from_records(&records).check(|group| group.to_string()).unwrap();
    }

    #[test]
    fn a_port_made_before_the_drain_records_nothing_however_often_its_halves_are_taken() {
        let registry = Registry::new();
        let plan = PortPlan::new(Execution::Threaded, 0, &registry);
        let mut drain = registry.drain();
        plan.recorder(PortUseKind::Saw).push(&at(1), 1);
        let mut records = Vec::new();
        drain.drain(&mut records);
        assert!(records.is_empty());
    }
}
