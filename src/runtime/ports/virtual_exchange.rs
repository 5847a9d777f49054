//! Newest-value ports of virtual time: a publication waits until the release that may see it.
//!
//! One thread runs everything, in time order, so the locks here are never contended; they only make the halves `Send`.

use crate::actor::{Phase, TickContext};
use crate::primitives::exchange::Stamped;
use crate::primitives::sync::lock;
use crate::reexecution::script::ScriptedPort;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

struct Publication<T> {
    visible_at: Nanos,
    buffer: Box<Stamped<T>>,
}

pub(crate) struct Flight<T> {
    /// In order of publication and of visibility.
    waiting: VecDeque<Publication<T>>,
    /// Buffers that nobody needs, kept for the writer: once warm, nothing is allocated.
    free: Vec<Box<Stamped<T>>>,
    /// Readers that the port has had; the last one is in force.
    readers: u64,
    init: Box<dyn FnMut() -> T + Send>,
    /// Says which versions are taken, in a re-execution.
    script: Option<ScriptedPort>,
}

impl<T> Flight<T> {
    fn initial(&mut self) -> Box<Stamped<T>> {
        Box::new(Stamped::initial((self.init)()))
    }

    fn fresh(&mut self) -> Box<Stamped<T>> {
        self.free.pop().unwrap_or_else(|| self.initial())
    }

    /// Puts a publication in flight. What was to be visible only after it never is the newest any more: the actors of a
    /// group that is started again publish at once what those before them delayed by their latency.
    fn send(&mut self, publication: Publication<T>) {
        while let Some(overtaken) = self.waiting.pop_back_if(|older| older.visible_at > publication.visible_at) {
            self.free.push(overtaken.buffer);
        }
        self.waiting.push_back(publication);
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
    fn newest(&mut self, is_visible: impl Fn(&Publication<T>) -> bool) -> Option<Box<Stamped<T>>> {
        let visible = self.waiting.partition_point(is_visible);
        self.recycle(visible.checked_sub(1)?);
        self.waiting.pop_front().map(|newest| newest.buffer)
    }

    /// The publication of this version; older ones are overtaken.
    fn version(&mut self, version: u64) -> Option<Box<Stamped<T>>> {
        self.recycle(self.waiting.partition_point(|old| old.buffer.version < version));
        self.waiting.pop_front_if(|first| first.buffer.version == version).map(|found| found.buffer)
    }
}

pub(crate) type SharedFlight<T> = Arc<Mutex<Flight<T>>>;

pub(crate) fn flight<T: Send>(
    script: Option<ScriptedPort>,
    init: impl FnMut() -> T + Send + 'static,
) -> SharedFlight<T> {
    let flight = Flight { waiting: VecDeque::new(), free: Vec::new(), readers: 0, init: Box::new(init), script };
    Arc::new(Mutex::new(flight))
}

pub(crate) struct VirtualWriter<T> {
    shared: SharedFlight<T>,
    buffer: Box<Stamped<T>>,
}

impl<T> VirtualWriter<T> {
    pub(crate) fn new(shared: &SharedFlight<T>) -> Self {
        let buffer = lock(shared).fresh();
        Self { shared: Arc::clone(shared), buffer }
    }

    pub(crate) fn buffer(&mut self) -> &mut T {
        &mut self.buffer.value
    }

    pub(crate) fn publish_as(&mut self, version: u64, ctx: &TickContext) {
        let mut flight = lock(&self.shared);
        self.buffer.version = version;
        self.buffer.published = ctx.scheduled;
        flight.recycle_unreachable(ctx.now);
        let fresh = flight.fresh();
        let buffer = std::mem::replace(&mut self.buffer, fresh);
        flight.send(Publication { visible_at: ctx.visible_at, buffer });
        if let Some(script) = &flight.script {
            script.produced(version);
        }
    }
}

pub(crate) struct VirtualReader<T> {
    shared: SharedFlight<T>,
    buffer: Box<Stamped<T>>,
    /// Its number among the readers of the port.
    number: u64,
}

impl<T> VirtualReader<T> {
    /// Fences the reader before, if there was one; what was published up to now was for that one.
    pub(crate) fn new(shared: &SharedFlight<T>) -> Self {
        let mut flight = lock(shared);
        let buffer = flight.initial();
        if flight.readers > 0 {
            let count = flight.waiting.len();
            flight.recycle(count);
        }
        flight.readers += 1;
        Self { shared: Arc::clone(shared), buffer, number: flight.readers }
    }

    /// `own` if the release's own group writes the port.
    pub(crate) fn refresh(&mut self, ctx: &TickContext, own: bool) -> bool {
        let mut flight = lock(&self.shared);
        if flight.readers != self.number {
            return false;
        }
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

    /// The value of the last refresh.
    pub(crate) fn held(&self) -> &Stamped<T> {
        &self.buffer
    }

    /// The value of the last refresh, to change.
    pub(crate) fn held_mut(&mut self) -> &mut Stamped<T> {
        &mut self.buffer
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::time::Rate;
    use proptest::prelude::*;

    fn at(now: u64, visible_at: u64) -> TickContext {
        let (now, visible_at) = (Nanos(now), Nanos(visible_at));
        TickContext { now, scheduled: now, visible_at, ..TickContext::by_hand(Rate::hz(1000), 0) }
    }

    #[test]
    fn a_reader_that_is_taken_again_begins_with_the_initial_value_and_fences_the_one_before() {
        let shared = flight(None, || 5_u64);
        let (mut writer, mut old) = (VirtualWriter::new(&shared), VirtualReader::new(&shared));
        for version in 1..=4 {
            *writer.buffer() = 10 * version;
            writer.publish_as(version, &at(version, version));
            assert!(old.refresh(&at(version, version), false));
        }
        *writer.buffer() = 50;
        writer.publish_as(5, &at(5, 5));
        let mut reader = VirtualReader::new(&shared);
        assert!(!reader.refresh(&at(5, 5), false));
        assert_eq!((reader.held().value, reader.held().version, reader.held().published), (5, 0, Nanos::ZERO));
        *writer.buffer() = 60;
        writer.publish_as(6, &at(6, 6));
        assert!(!old.refresh(&at(6, 6), false) && reader.refresh(&at(6, 6), false));
        assert_eq!((reader.held().value, reader.held().version), (60, 6));
    }

    proptest! {
        #[test]
        fn a_reader_sees_the_newest_visible_version_in_whatever_order_they_become_visible(
            steps in prop::collection::vec((0_u64..3, 0_u64..6, any::<bool>()), 1..80),
        ) {
            let shared = flight(None, || 0);
            let (mut writer, mut reader) = (VirtualWriter::new(&shared), VirtualReader::new(&shared));
            let (mut now, mut published) = (0, Vec::new());
            for (pause, latency, looks) in steps {
                now += pause;
                if looks {
                    let visible = published.iter().filter(|(_, at)| *at <= now).map(|(version, _)| *version).max();
                    let before = reader.held().version;
                    let expected = visible.unwrap_or(0).max(before);
                    prop_assert_eq!(reader.refresh(&at(now, now), false), expected > before);
                    prop_assert_eq!((reader.held().version, reader.held().value), (expected, expected));
                } else {
                    let version = published.len() as u64 + 1;
                    *writer.buffer() = version;
                    writer.publish_as(version, &at(now, now + latency));
                    published.push((version, now + latency));
                }
            }
        }
    }
}
