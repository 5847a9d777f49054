//! Ports whose halves can be taken again: what a restarted group is connected with.
//!
//! Taking a half again *fences* the one taken before: the other half is connected to the fresh one, and what the old one
//! still publishes or sends is seen by nobody. So a thread that never returns can be left behind with its ports.

use super::exchange::{ExchangeReader, ExchangeWriter, exchange};
use super::link::{Linked, Relink, linked};
use super::outlet::{OutletReader, OutletWriter};
use super::port::{Reader, VersionCounter, Writer};
use super::port_memory::PortPlan;
use super::queue_port::{QueueReader, QueueWriter};
use super::recorder::{Recorder, Registry};
use super::ring::{Consumer, Producer, ring};
use super::virtual_port::SharedFlight;
use super::virtual_queue::VirtualQueue;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Two connected halves of which each can be made anew.
pub(super) struct Pair<W, R> {
    make: Box<dyn FnMut() -> (W, R) + Send>,
    writer: Option<Linked<W>>,
    reader: Option<Linked<R>>,
    to_writer: Relink<W>,
    to_reader: Relink<R>,
}

impl<W, R> Pair<W, R> {
    fn new(mut make: impl FnMut() -> (W, R) + Send + 'static) -> Self {
        let (writer, reader) = make();
        let ((writer, to_writer), (reader, to_reader)) = (linked(writer), linked(reader));
        Self { make: Box::new(make), writer: Some(writer), reader: Some(reader), to_writer, to_reader }
    }

    pub(super) fn of_exchange<T: Send + 'static>(
        mut init: impl FnMut() -> T + Send + 'static,
    ) -> Pair<ExchangeWriter<T>, ExchangeReader<T>> {
        Pair::new(move || exchange(&mut init))
    }

    pub(super) fn of_ring<T: Copy + Send + 'static>(capacity: usize) -> Pair<Producer<T>, Consumer<T>> {
        Pair::new(move || ring(capacity))
    }

    pub(super) fn writer(&mut self) -> Linked<W> {
        if let Some(first) = self.writer.take() {
            return first;
        }
        let (writer, reader) = (self.make)();
        self.to_reader.deliver(reader);
        let (writer, to_writer) = linked(writer);
        self.to_writer = to_writer;
        writer
    }

    pub(super) fn reader(&mut self) -> Linked<R> {
        if let Some(first) = self.reader.take() {
            return first;
        }
        let (writer, reader) = (self.make)();
        self.to_writer.deliver(writer);
        let (reader, to_reader) = linked(reader);
        self.to_reader = to_reader;
        reader
    }
}

enum ExchangeParts<T> {
    Threaded { pair: Box<Pair<ExchangeWriter<T>, ExchangeReader<T>>>, versions: VersionCounter },
    Virtual(SharedFlight<T>),
}

/// An [exchange](super::RuntimeBuilder::exchange) whose halves can be taken again; clones are the same port.
///
/// # Real-time
/// The half that stays takes the new one over in its next `publish` or `refresh`. That one call is not wait-free: it
/// takes no lock and allocates nothing, but it may spin while the other half is just being taken once more.
pub struct ExchangePort<T>(Arc<(PortPlan, Mutex<ExchangeParts<T>>)>);

impl<T: Send + 'static> ExchangePort<T> {
    pub(super) fn threaded(plan: PortPlan, init: impl FnMut() -> T + Send + 'static) -> Self {
        let pair = Box::new(Pair::<ExchangeWriter<T>, ExchangeReader<T>>::of_exchange(init));
        Self(Arc::new((plan, Mutex::new(ExchangeParts::Threaded { pair, versions: VersionCounter::default() }))))
    }

    pub(super) fn in_virtual_time(plan: PortPlan, flight: SharedFlight<T>) -> Self {
        Self(Arc::new((plan, Mutex::new(ExchangeParts::Virtual(flight)))))
    }

    /// The publishing half; fences the one taken before. Versions go on.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn writer(&self) -> Writer<T> {
        let (plan, parts) = &*self.0;
        match &mut *lock(parts) {
            ExchangeParts::Threaded { pair, versions } => Writer::threaded(plan, pair.writer(), versions.clone()),
            ExchangeParts::Virtual(flight) => Writer::in_virtual_time(plan, flight),
        }
    }

    /// The reading half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn reader(&self) -> Reader<T> {
        let (plan, parts) = &*self.0;
        match &mut *lock(parts) {
            ExchangeParts::Threaded { pair, .. } => Reader::threaded(plan, pair.reader()),
            ExchangeParts::Virtual(flight) => Reader::in_virtual_time(plan, flight),
        }
    }
}

enum QueueParts<T> {
    Threaded(Box<Pair<Producer<T>, Consumer<T>>>),
    Virtual(VirtualQueue<T>),
}

/// A [queue](super::RuntimeBuilder::queue) whose halves can be taken again; clones are the same port.
///
/// # Real-time
/// The half that stays takes the new one over in its next `push`, `peek` or `pop`. That one call is not wait-free: it
/// takes no lock and allocates nothing, but it may spin while the other half is just being taken once more.
pub struct QueuePort<T>(Arc<(PortPlan, Mutex<QueueParts<T>>)>);

impl<T: Copy + Send + 'static> QueuePort<T> {
    pub(super) fn threaded(plan: PortPlan, capacity: usize) -> Self {
        let pair = Box::new(Pair::<Producer<T>, Consumer<T>>::of_ring(capacity));
        Self(Arc::new((plan, Mutex::new(QueueParts::Threaded(pair)))))
    }

    pub(super) fn in_virtual_time(plan: PortPlan, queue: VirtualQueue<T>) -> Self {
        Self(Arc::new((plan, Mutex::new(QueueParts::Virtual(queue)))))
    }

    /// The sending half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn writer(&self) -> QueueWriter<T> {
        let (plan, parts) = &*self.0;
        match &mut *lock(parts) {
            QueueParts::Threaded(pair) => QueueWriter::threaded(plan, pair.writer()),
            QueueParts::Virtual(queue) => QueueWriter::in_virtual_time(plan, queue),
        }
    }

    /// The receiving half; fences the one taken before. Samples that it had not taken are lost.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn reader(&self) -> QueueReader<T> {
        let (plan, parts) = &*self.0;
        match &mut *lock(parts) {
            QueueParts::Threaded(pair) => QueueReader::threaded(plan, pair.reader()),
            QueueParts::Virtual(queue) => QueueReader::in_virtual_time(plan, queue),
        }
    }
}

/// An [outlet](super::RuntimeBuilder::outlet) whose writer can be taken again; clones are the same port.
///
/// # Real-time
/// The half that stays takes the new one over in its next `publish` or `refresh`. That one call is not wait-free: it
/// takes no lock and allocates nothing, but it may spin while the other half is just being taken once more.
pub struct OutletPort<T>(Arc<Mutex<Pair<ExchangeWriter<T>, ExchangeReader<T>>>>, VersionCounter);

impl<T: Send + 'static> OutletPort<T> {
    pub(super) fn new(init: impl FnMut() -> T + Send + 'static) -> Self {
        let pair = Pair::<ExchangeWriter<T>, ExchangeReader<T>>::of_exchange(init);
        Self(Arc::new(Mutex::new(pair)), VersionCounter::default())
    }

    /// The actor's half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn writer(&self) -> OutletWriter<T> {
        OutletWriter::new(lock(&self.0).writer(), self.1.clone())
    }

    /// The outside half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates.
    pub fn reader(&self) -> OutletReader<T> {
        OutletReader::new(lock(&self.0).reader())
    }
}

/// A [record sink](super::RuntimeBuilder::recorder) that can be taken again; clones are the same port.
#[derive(Clone, Debug)]
pub struct RecorderPort {
    registry: Arc<Registry>,
    capacity: usize,
    ring: Arc<Mutex<Option<usize>>>,
}

impl RecorderPort {
    pub(super) fn new(registry: &Arc<Registry>, capacity: usize) -> Self {
        Self { registry: Arc::clone(registry), capacity, ring: Arc::default() }
    }

    /// The sink; fences the one taken before, whose records up to now are kept.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](super::RuntimeBuilder::restartable).
    pub fn recorder(&self) -> Recorder {
        let mut ring = lock(&self.ring);
        let (recorder, index) = self.registry.replace(*ring, self.capacity);
        *ring = Some(index);
        recorder
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic under the lock can only come from a user's `init`, which leaves the port as it was.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T> Clone for ExchangePort<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Clone for QueuePort<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Clone for OutletPort<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0), self.1.clone())
    }
}

impl<T> fmt::Debug for ExchangePort<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ExchangePort").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for QueuePort<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueuePort").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for OutletPort<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OutletPort").finish_non_exhaustive()
    }
}
