//! What every half of a port remembers besides its values: whether this release has looked, whose the other half is, and
//! what has been recorded.

use super::actor::{Phase, TickContext};
use super::port_use::{PortUse, PortUseKind};
use super::recorder::{Recorder, Registry};
use super::sync::{AtomicUsize, Ordering};
use std::sync::Arc;

/// A port, whoever holds its halves: its number and who wants to know what it shows.
#[derive(Debug)]
pub(super) struct PortPlan {
    port: u32,
    registry: Arc<Registry>,
    pub(super) group: WriterGroup,
}

impl PortPlan {
    pub(super) fn new(port: u32, registry: &Arc<Registry>) -> Self {
        Self { port, registry: Arc::clone(registry), group: WriterGroup::new() }
    }

    /// Records the uses of this kind, for one half.
    pub(super) fn recorder(&self, kind: PortUseKind) -> UseRecorder {
        let recorder = self.registry.wanted().then(|| self.registry.recorder(RECORDS));
        UseRecorder { port: self.port, kind, sequence: 0, recorder }
    }
}

/// Records of one half of a port between two drains: at one per release, four seconds of 1 kHz.
const RECORDS: usize = 4096;

/// Tells the first look of a release from those that follow. A release looks at a port once: what it saw is then one
/// fact that can be recorded, and a value that arrives while it runs waits for the next one.
#[derive(Debug, Default)]
pub(super) struct Looks(Option<(Phase, u64)>);

impl Looks {
    /// True at the first call of a release.
    pub(super) fn is_first(&mut self, ctx: &TickContext) -> bool {
        let current = Some((ctx.phase, ctx.tick));
        let first = self.0 != current;
        self.0 = current;
        first
    }
}

/// The group that writes a port, told by the writer to the reader.
#[derive(Clone, Debug)]
pub(super) struct WriterGroup(Arc<AtomicUsize>);

impl WriterGroup {
    const UNKNOWN: usize = usize::MAX;

    pub(super) fn new() -> Self {
        Self(Arc::new(AtomicUsize::new(Self::UNKNOWN)))
    }

    /// Called by the writer before each publication.
    pub(super) fn set(&self, ctx: &TickContext) {
        // Relaxed: the reader asks only after it has taken a publication, and taking it synchronises with the writer's
        // release of it, which comes after this store.
        self.0.store(ctx.group.into(), Ordering::Relaxed);
    }

    /// True if what the reader has taken was written by the group that is called. Before the first publication there is
    /// nothing that another group could have shown.
    pub(super) fn is(&self, ctx: &TickContext) -> bool {
        // Relaxed: as in `set`.
        let writer = self.0.load(Ordering::Relaxed);
        writer == usize::from(ctx.group) || writer == Self::UNKNOWN
    }
}

/// Records the uses of one kind of one half of a port.
#[derive(Debug)]
pub(super) struct UseRecorder {
    port: u32,
    kind: PortUseKind,
    sequence: u64,
    recorder: Option<Recorder>,
}

impl UseRecorder {
    pub(super) fn push(&mut self, ctx: &TickContext, count: u64) {
        let Some(recorder) = &mut self.recorder else { return };
        let (port, kind, sequence) = (self.port, self.kind, self.sequence);
        // Counted also if the ring is full: the gap shows it.
        self.sequence += 1;
        recorder.push(PortUse { time: ctx.scheduled, group: ctx.group, port, kind, tick: ctx.tick, count, sequence });
    }
}
