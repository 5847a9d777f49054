//! Ports whose halves can be taken again: what a restarted group is connected with.
//!
//! Taking a half again *fences* the one taken before: the other half is connected to the fresh one, and what the old one
//! still publishes, sends or records is seen by nobody and counted nowhere. So a thread that never returns can be left
//! behind with its ports.

use crate::executor::Execution;
use crate::ports::exchange_port::{self, Reader, Writer};
use crate::ports::hot_swap::{Swappable, Swapper, swappable};
use crate::ports::hot_swap_queue::{Numbered, SwappableConsumer};
use crate::ports::outlet::{OutletReader, OutletWriter};
use crate::ports::port_state::PortPlan;
use crate::ports::port_traffic::Sides;
use crate::ports::queue_port::{self, QueueReader, QueueWriter};
use crate::ports::virtual_exchange::{SharedFlight, VirtualReader, VirtualWriter, flight};
use crate::ports::virtual_queue::VirtualQueue;
use crate::primitives::exchange::{ExchangeReader, ExchangeWriter, exchange};
use crate::primitives::fenced_counter::FencedCounter;
use crate::primitives::ring::{Consumer, Producer, ring};
use crate::primitives::sync::lock;
use crate::records::recorder::{Recorder, Registry};
use crate::reexecution::script::ScriptedPort;
use std::sync::{Arc, Mutex};

/// Two connected halves of which each can be made anew.
pub(crate) struct Pair<W, R> {
    make: Box<dyn FnMut() -> (W, R) + Send>,
    /// Moves on to a writer what a reader of the writer before has not taken.
    carry: fn(R, &mut W),
    writer: Option<Swappable<W>>,
    reader: Option<Swappable<R>>,
    to_writer: Swapper<W>,
    to_reader: Swapper<R>,
}

impl<W: Send, R: Send> Pair<W, R> {
    fn new(mut make: impl FnMut() -> (W, R) + Send + 'static, carry: fn(R, &mut W)) -> Self {
        let (writer, reader) = make();
        let ((writer, to_writer), (reader, to_reader)) = (swappable(writer), swappable(reader));
        Self { make: Box::new(make), carry, writer: Some(writer), reader: Some(reader), to_writer, to_reader }
    }

    /// The writer, and its `numbers`: those of the one before are fenced.
    pub(crate) fn writer(&mut self, numbers: &mut FencedCounter) -> (Swappable<W>, FencedCounter) {
        if let Some(first) = self.writer.take() {
            return (first, numbers.succeed());
        }
        let (mut writer, reader) = (self.make)();
        // Fenced first: whatever has a number then is found in the old half, or was never published.
        let own = numbers.succeed();
        if let Some(untaken) = self.to_reader.deliver(reader) {
            (self.carry)(untaken, &mut writer);
        }
        let (writer, to_writer) = swappable(writer);
        self.to_writer = to_writer;
        (writer, own)
    }

    pub(crate) fn reader(&mut self) -> Swappable<R> {
        if let Some(first) = self.reader.take() {
            return first;
        }
        let (writer, reader) = (self.make)();
        // One that nobody took has nothing in hand.
        let _ = self.to_writer.deliver(writer);
        let (reader, to_reader) = swappable(reader);
        self.to_reader = to_reader;
        reader
    }
}

pub(crate) type ExchangePair<T> = Pair<ExchangeWriter<T>, ExchangeReader<T>>;
pub(crate) type RingPair<T> = Pair<Producer<Numbered<T>>, Consumer<Numbered<T>>>;

pub(crate) fn exchange_pair<T: Send + 'static>(mut init: impl FnMut() -> T + Send + 'static) -> ExchangePair<T> {
    Pair::new(
        move || exchange(&mut init),
        |mut untaken, writer| {
            if untaken.refresh() {
                std::mem::swap(untaken.get_mut(), writer.buffer());
                writer.publish_as(untaken.version(), untaken.published());
            }
        },
    )
}

pub(crate) fn ring_pair<T: Copy + Send + 'static>(capacity: usize) -> RingPair<T> {
    Pair::new(
        move || ring(capacity),
        // They fit: both rings have the same capacity.
        |mut untaken, producer| while untaken.pop().is_some_and(|sample| producer.push(sample)) {},
    )
}

enum ExchangeParts<T> {
    Threaded(Box<ExchangePair<T>>),
    Virtual(SharedFlight<T>),
}

struct Exchange<T> {
    plan: PortPlan,
    parts: ExchangeParts<T>,
    versions: FencedCounter,
}

/// An [exchange](crate::RuntimeBuilder::exchange) whose halves can be taken again; clones are the same port.
///
/// Taking a half again is the same in both executions:
///
/// - A new writer goes on with the versions. The reader that stays keeps its value, and still gets what was published
///   before and not taken yet.
/// - A new reader begins as at the start of the run, with the initial value and version 0, and gets everything that is
///   published from then on. What was published before may be in use by the one that it replaces, and is not
///   shown again.
///
/// # Real-time
/// The half that stays takes the new one over in its next `publish` or `refresh`. That call is wait-free like any
/// other, and moves one value from buffer to buffer.
pub struct ExchangePort<T>(Arc<Mutex<Exchange<T>>>);

impl<T: Send + 'static> ExchangePort<T> {
    pub(crate) fn new(
        execution: Execution,
        plan: PortPlan,
        script: Option<ScriptedPort>,
        init: impl FnMut() -> T + Send + 'static,
    ) -> Self {
        let parts = match execution {
            Execution::Virtual => ExchangeParts::Virtual(flight(script, init)),
            Execution::Threaded => ExchangeParts::Threaded(Box::new(exchange_pair(init))),
        };
        Self(Arc::new(Mutex::new(Exchange { plan, parts, versions: FencedCounter::default() })))
    }

    /// The publishing half; fences the one taken before. Versions go on.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn writer(&self) -> Writer<T> {
        let Exchange { plan, parts, versions } = &mut *lock(&self.0);
        match parts {
            ExchangeParts::Threaded(pair) => {
                let (half, versions) = pair.writer(versions);
                Writer::new(plan, exchange_port::WriterKind::Threaded(half), versions)
            }
            ExchangeParts::Virtual(flight) => {
                let half = exchange_port::WriterKind::Virtual(VirtualWriter::new(flight));
                Writer::new(plan, half, versions.succeed())
            }
        }
    }

    /// The reading half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn reader(&self) -> Reader<T> {
        let Exchange { plan, parts, .. } = &mut *lock(&self.0);
        let half = match parts {
            ExchangeParts::Threaded(pair) => exchange_port::ReaderKind::Threaded(pair.reader()),
            ExchangeParts::Virtual(flight) => exchange_port::ReaderKind::Virtual(VirtualReader::new(flight)),
        };
        Reader::new(plan, half)
    }
}

enum QueueParts<T> {
    Threaded(Box<RingPair<T>>),
    Virtual(VirtualQueue<T>),
}

struct Queue<T> {
    plan: PortPlan,
    parts: QueueParts<T>,
    attempts: FencedCounter,
    drops: FencedCounter,
}

/// A [queue](crate::RuntimeBuilder::queue) whose halves can be taken again; clones are the same port.
///
/// Taking a half again is the same in both executions:
///
/// - A new sender goes on with the counts. The receiver that stays gets all samples, those of the sender before first.
/// - A new receiver gets the samples that are sent from then on.
///
/// # Real-time
/// The half that stays takes the new one over in its next `push`, `peek` or `pop`, which is wait-free like any other.
pub struct QueuePort<T>(Arc<Mutex<Queue<T>>>);

impl<T: Copy + Send + 'static> QueuePort<T> {
    pub(crate) fn new(execution: Execution, plan: PortPlan, script: Option<ScriptedPort>, capacity: usize) -> Self {
        let parts = match execution {
            Execution::Virtual => QueueParts::Virtual(VirtualQueue::new(script, capacity)),
            Execution::Threaded => QueueParts::Threaded(Box::new(ring_pair(capacity))),
        };
        let queue = Queue { plan, parts, attempts: FencedCounter::default(), drops: FencedCounter::default() };
        Self(Arc::new(Mutex::new(queue)))
    }

    /// The sending half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn writer(&self) -> QueueWriter<T> {
        let Queue { plan, parts, attempts, drops } = &mut *lock(&self.0);
        let (half, attempts) = match parts {
            QueueParts::Threaded(pair) => {
                let (half, attempts) = pair.writer(attempts);
                (queue_port::WriterKind::Threaded(half), attempts)
            }
            QueueParts::Virtual(queue) => (queue_port::WriterKind::Virtual(queue.clone()), attempts.succeed()),
        };
        QueueWriter::new(plan, half, attempts, drops.succeed())
    }

    /// The receiving half; fences the one taken before. Samples that it had not taken are lost.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn reader(&self) -> QueueReader<T> {
        let Queue { plan, parts, .. } = &mut *lock(&self.0);
        let half = match parts {
            QueueParts::Threaded(pair) => queue_port::ReaderKind::Threaded(SwappableConsumer::new(pair.reader())),
            QueueParts::Virtual(queue) => queue_port::ReaderKind::Virtual(queue.receiver()),
        };
        QueueReader::new(plan, half)
    }
}

struct Outlet<T> {
    pair: ExchangePair<T>,
    versions: FencedCounter,
    sides: Sides,
}

/// An [outlet](crate::RuntimeBuilder::outlet) whose halves can be taken again, as those of an [`ExchangePort`]; clones
/// are the same port.
///
/// # Real-time
/// The half that stays takes the new one over in its next `publish` or `refresh`. That call is wait-free like any
/// other, and moves one value from buffer to buffer.
pub struct OutletPort<T>(Arc<Mutex<Outlet<T>>>);

impl<T: Send + 'static> OutletPort<T> {
    pub(crate) fn new(sides: Sides, init: impl FnMut() -> T + Send + 'static) -> Self {
        Self(Arc::new(Mutex::new(Outlet { pair: exchange_pair(init), versions: FencedCounter::default(), sides })))
    }

    /// The actor's half; fences the one taken before. Versions go on.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn writer(&self) -> OutletWriter<T> {
        let Outlet { pair, versions, sides } = &mut *lock(&self.0);
        let (half, versions) = pair.writer(versions);
        OutletWriter::new(half, versions, sides.writer.take())
    }

    /// The outside half; fences the one taken before.
    ///
    /// # Real-time
    /// Takes a lock and allocates.
    pub fn reader(&self) -> OutletReader<T> {
        let Outlet { pair, sides, .. } = &mut *lock(&self.0);
        OutletReader::new(pair.reader(), sides.reader.take())
    }
}

/// A [record sink](crate::RuntimeBuilder::recorder) that can be taken again; clones are the same port.
#[derive(Clone, Debug)]
pub struct RecorderPort {
    registry: Arc<Registry>,
    capacity: usize,
    ring: Arc<Mutex<Option<usize>>>,
}

impl RecorderPort {
    pub(crate) fn new(registry: &Arc<Registry>, capacity: usize) -> Self {
        Self { registry: Arc::clone(registry), capacity, ring: Arc::default() }
    }

    /// The sink; fences the one taken before, whose records up to now are kept.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for [factories](crate::RuntimeBuilder::restartable).
    pub fn recorder(&self) -> Recorder {
        let mut ring = lock(&self.ring);
        let new = self.registry.replace(*ring, self.capacity);
        *ring = Some(new.index);
        new.recorder
    }
}

/// Clones of a port are the same port, whatever it carries.
macro_rules! shared_port {
    ($port:ident) => {
        impl<T> Clone for $port<T> {
            fn clone(&self) -> Self {
                Self(Arc::clone(&self.0))
            }
        }

        impl_debug!($port<T>);
    };
}

shared_port!(ExchangePort);
shared_port!(QueuePort);
shared_port!(OutletPort);
