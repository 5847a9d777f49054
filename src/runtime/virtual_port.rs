//! Newest-value ports of virtual time: a publication waits until the release that may see it.
//!
//! One thread runs everything, in time order, so the locks here are never contended; they only make the halves `Send`.

use super::actor::{Phase, TickContext};
use super::script::ScriptedPort;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

struct Versioned<T> {
    value: T,
    version: u64,
    published: Nanos,
}

struct Publication<T> {
    visible_at: Nanos,
    buffer: Box<Versioned<T>>,
}

pub(super) struct Flight<T> {
    /// Publications so far: versions go on through every writer that the port had.
    versions: u64,
    /// In order of publication, hence of visibility.
    waiting: VecDeque<Publication<T>>,
    /// Buffers that nobody needs, kept for the writer: once warm, nothing is allocated.
    free: Vec<Box<Versioned<T>>>,
    init: Box<dyn FnMut() -> T + Send>,
    /// Says which versions are taken, in a re-execution.
    script: Option<ScriptedPort>,
}

impl<T> Flight<T> {
    fn fresh(&mut self) -> Box<Versioned<T>> {
        self.free
            .pop()
            .unwrap_or_else(|| Box::new(Versioned { value: (self.init)(), version: 0, published: Nanos::ZERO }))
    }

    /// Takes back the oldest `count` publications.
    fn recycle(&mut self, count: usize) {
        self.free.extend(self.waiting.drain(..count).map(|old| old.buffer));
    }

    /// Takes back what no reader can get any more: time only moves on, and at `now` a newer one is visible. In a
    /// re-execution, what is older than the version that is taken next.
    fn recycle_unreachable(&mut self, now: Nanos) {
        let count = match self.script.as_ref().and_then(ScriptedPort::next_count) {
            Some(version) => self.waiting.partition_point(|old| old.buffer.version < version),
            None => self.waiting.partition_point(|old| old.visible_at <= now).saturating_sub(1),
        };
        self.recycle(count);
    }

    /// The newest publication for which `is_visible` holds; it holds for older ones too.
    fn newest(&mut self, is_visible: impl Fn(&Publication<T>) -> bool) -> Option<Box<Versioned<T>>> {
        let visible = self.waiting.partition_point(is_visible);
        self.recycle(visible.checked_sub(1)?);
        self.waiting.pop_front().map(|newest| newest.buffer)
    }

    /// The publication of this version; older ones are overtaken.
    fn version(&mut self, version: u64) -> Option<Box<Versioned<T>>> {
        self.recycle(self.waiting.partition_point(|old| old.buffer.version < version));
        self.waiting.pop_front_if(|first| first.buffer.version == version).map(|found| found.buffer)
    }
}

pub(super) type SharedFlight<T> = Arc<Mutex<Flight<T>>>;

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic while the lock is held can only come from a user's `init`, which leaves the queues whole.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn flight<T: Send>(
    script: Option<ScriptedPort>,
    init: impl FnMut() -> T + Send + 'static,
) -> SharedFlight<T> {
    let flight = Flight { versions: 0, waiting: VecDeque::new(), free: Vec::new(), init: Box::new(init), script };
    Arc::new(Mutex::new(flight))
}

pub(super) struct VirtualWriter<T> {
    shared: SharedFlight<T>,
    buffer: Box<Versioned<T>>,
}

impl<T> VirtualWriter<T> {
    pub(super) fn new(shared: &SharedFlight<T>) -> Self {
        let buffer = lock(shared).fresh();
        Self { shared: Arc::clone(shared), buffer }
    }

    pub(super) fn buffer(&mut self) -> &mut T {
        &mut self.buffer.value
    }

    pub(super) fn publish(&mut self, ctx: &TickContext) -> u64 {
        let mut flight = lock(&self.shared);
        flight.versions += 1;
        let version = flight.versions;
        self.buffer.version = version;
        self.buffer.published = ctx.scheduled;
        flight.recycle_unreachable(ctx.now);
        let fresh = flight.fresh();
        let buffer = std::mem::replace(&mut self.buffer, fresh);
        flight.waiting.push_back(Publication { visible_at: ctx.visible_at, buffer });
        if let Some(script) = &flight.script {
            script.produced(version);
        }
        version
    }
}

pub(super) struct VirtualReader<T> {
    shared: SharedFlight<T>,
    buffer: Box<Versioned<T>>,
}

impl<T> VirtualReader<T> {
    pub(super) fn new(shared: &SharedFlight<T>) -> Self {
        let buffer = lock(shared).fresh();
        Self { shared: Arc::clone(shared), buffer }
    }

    /// `own` if the release's own group writes the port.
    pub(super) fn refresh(&mut self, ctx: &TickContext, own: bool) -> bool {
        let mut flight = lock(&self.shared);
        let found = match &flight.script {
            _ if own => flight.newest(|_| true),
            Some(script) if ctx.phase == Phase::Release => {
                let version = script.took(ctx);
                version.and_then(|version| flight.version(version))
            }
            _ => flight.newest(|publication| publication.visible_at <= ctx.now),
        };
        let Some(newest) = found else { return false };
        let old = std::mem::replace(&mut self.buffer, newest);
        flight.free.push(old);
        true
    }

    pub(super) fn get(&self) -> &T {
        &self.buffer.value
    }

    pub(super) fn get_mut(&mut self) -> &mut T {
        &mut self.buffer.value
    }

    pub(super) fn version(&self) -> u64 {
        self.buffer.version
    }

    pub(super) fn published(&self) -> Nanos {
        self.buffer.published
    }
}
