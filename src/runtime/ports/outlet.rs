//! The newest value for a thread outside the graph, such as a renderer: visible at once in both executions.

use crate::actor::TickContext;
use crate::ports::hot_swap::{Swappable, swappable};
use crate::ports::port_traffic::{Counter, Sides};
use crate::primitives::exchange::{ExchangeReader, ExchangeWriter, exchange};
use crate::primitives::fenced_counter::FencedCounter;
use crate::time::Nanos;

/// The actor's side of an outlet.
#[derive(Debug)]
pub struct OutletWriter<T>(Swappable<ExchangeWriter<T>>, FencedCounter, Counter);

/// The outside thread's side of an outlet. It owns its buffer until the next successful refresh.
///
/// ```
/// use palpate_runtime::{Execution, Rate, Runtime, TickContext};
///
/// let (mut writer, mut reader) = Runtime::builder(Execution::Threaded).outlet(|| 0.0);
/// *writer.buffer() = 1.5;
/// writer.publish(&TickContext::by_hand(Rate::hz(30), 0)); // in a tick
/// assert!(reader.refresh()); // on a thread of the program's own
/// assert_eq!(*reader.get(), 1.5);
/// ```
///
/// It lends out its value: threads may share it only if they may share that.
///
/// ```compile_fail,E0277
/// fn share_between_threads<T: Sync>(_: &T) {}
///
/// let mut graph = palpate_runtime::Runtime::builder(palpate_runtime::Execution::Virtual);
/// let (_, reader) = graph.outlet(|| std::cell::Cell::new(0));
/// share_between_threads(&reader);
/// ```
#[derive(Debug)]
pub struct OutletReader<T>(Swappable<ExchangeReader<T>>, Counter);

pub(crate) fn outlet<T: Send>(sides: &Sides, init: impl FnMut() -> T) -> (OutletWriter<T>, OutletReader<T>) {
    let (writer, reader) = exchange(init);
    let writer = OutletWriter::new(swappable(writer).0, FencedCounter::default(), sides.writer.take());
    (writer, OutletReader::new(swappable(reader).0, sides.reader.take()))
}

impl<T> OutletWriter<T> {
    pub(crate) fn new(half: Swappable<ExchangeWriter<T>>, versions: FencedCounter, sent: Counter) -> Self {
        Self(half, versions, sent)
    }

    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn buffer(&mut self) -> &mut T {
        self.0.half_mut().buffer()
    }

    /// Makes the buffer the newest value and returns its version, counting from 1; 0 if this writer's place was
    /// [taken](crate::OutletPort::writer): nothing is published then.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn publish(&mut self, ctx: &TickContext) -> u64 {
        let Some(version) = self.1.next() else { return 0 };
        self.0.publish_as(version, ctx.scheduled);
        self.2.pass(ctx);
        version
    }

    /// True if the outside thread has taken the newest value, or there is none for it yet, as after its place was
    /// [taken](crate::OutletPort::reader): while it is false nobody has looked since.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_taken(&self) -> bool {
        self.0.has_delivery() || self.0.half().is_taken()
    }
}

impl<T> OutletReader<T> {
    pub(crate) fn new(half: Swappable<ExchangeReader<T>>, taken: Counter) -> Self {
        Self(half, taken)
    }

    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// # Real-time
    /// Wait-free, real-time safe; never disturbs the writer.
    pub fn refresh(&mut self) -> bool {
        let fresh = self.0.refresh();
        if fresh {
            self.1.pass_outside();
        }
        fresh
    }

    /// The value of the last refresh, or the initial value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get(&self) -> &T {
        self.0.half().get()
    }

    /// The value of the last refresh, to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get_mut(&mut self) -> &mut T {
        self.0.half_mut().get_mut()
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u64 {
        self.0.half().version()
    }

    /// The scheduled time of the release that published the value; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn published(&self) -> Nanos {
        self.0.half().published()
    }
}
