//! Typed ports between actors for the newest value of a large state.
//!
//! The same types in both executions. Between threads they are the [exchange](crate::exchange); in virtual time the
//! executor owns visibility: what a group with latency L publishes at release t is visible to readers in other groups
//! whose work begins at t + L or later, which is their scheduled time unless a [disturbance](crate::Disturbance) delays
//! them. With L = 0 a reader at the same time sees it if its group comes later. Within the group it is visible at once, to
//! the actors that tick after the writer.
//!
//! A release looks at a port once. What it took from another group is recorded, so that the run can be
//! [re-executed](crate::Recording).

use crate::actor::{Phase, TickContext};
use crate::ports::hot_swap::Swappable;
use crate::ports::port_state::{Looks, PortPlan, UseRecorder, WriterGroup};
use crate::ports::port_traffic::Counter;
use crate::ports::virtual_exchange::{VirtualReader, VirtualWriter};
use crate::primitives::exchange::{ExchangeReader, ExchangeWriter, Stamped};
use crate::primitives::fenced_counter::FencedCounter;
use crate::records::port_use::PortUseKind;
use crate::time::Nanos;

pub(crate) enum WriterKind<T> {
    Threaded(Swappable<ExchangeWriter<T>>),
    Virtual(VirtualWriter<T>),
}

pub(crate) enum ReaderKind<T> {
    Threaded(Swappable<ExchangeReader<T>>),
    Virtual(VirtualReader<T>),
}

/// Publishes the newest value of a large state to a [`Reader`] in another actor.
///
/// ```
/// use palpate_runtime::{Execution, Rate, Runtime, TickContext};
///
/// let (mut writer, mut reader) = Runtime::builder(Execution::Threaded).exchange(|| [0.0; 3]);
/// let ctx = TickContext::by_hand(Rate::hz(1000), 4); // what the executor gives to a tick
/// writer.buffer()[2] = 0.5;
/// writer.publish(&ctx);
/// assert!(reader.refresh(&ctx));
/// assert_eq!((reader.get()[2], reader.version(), reader.published()), (0.5, 1, ctx.scheduled));
/// ```
pub struct Writer<T> {
    kind: WriterKind<T>,
    versions: FencedCounter,
    group: WriterGroup,
    sent: Counter,
}

/// Reads the newest value of a state that a [`Writer`] in another actor publishes. The reader owns its buffer until the
/// next successful refresh.
///
/// ```
/// use palpate_runtime::{Execution, Rate, Runtime, TickContext};
///
/// let (mut writer, mut reader) = Runtime::builder(Execution::Threaded).exchange(|| 0.0);
/// let tick = |n| TickContext::by_hand(Rate::hz(1000), n); // what the executor gives to a tick
/// assert!(!reader.refresh(&tick(4))); // nothing has been published: the initial value stays
/// *writer.buffer() = 2.5;
/// writer.publish(&tick(4));
/// assert!(reader.refresh(&tick(5)) && *reader.get() == 2.5);
/// ```
pub struct Reader<T> {
    kind: ReaderKind<T>,
    group: WriterGroup,
    looks: Looks,
    took: UseRecorder,
    taken: Counter,
}

impl<T> Writer<T> {
    pub(crate) fn new(plan: &PortPlan, kind: WriterKind<T>, versions: FencedCounter) -> Self {
        Self { kind, versions, group: plan.group.clone(), sent: plan.sides.writer.take() }
    }

    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn buffer(&mut self) -> &mut T {
        match &mut self.kind {
            WriterKind::Threaded(writer) => writer.half_mut().buffer(),
            WriterKind::Virtual(writer) => writer.buffer(),
        }
    }

    /// Makes the buffer the newest value and returns its version, counting from 1; 0 if this writer's place was
    /// [taken](crate::ExchangePort::writer): nothing is published then.
    ///
    /// # Panics
    /// In a graph of another [execution](crate::Execution) than that of the builder which made the port.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock and may allocate.
    #[track_caller]
    pub fn publish(&mut self, ctx: &TickContext) -> u64 {
        self.group.check_execution(ctx);
        let Some(version) = self.versions.next() else { return 0 };
        self.group.set(ctx);
        match &mut self.kind {
            WriterKind::Threaded(writer) => writer.publish_as(version, ctx.scheduled),
            WriterKind::Virtual(writer) => writer.publish_as(version, ctx),
        }
        self.sent.pass(ctx);
        version
    }
}

impl<T> Reader<T> {
    pub(crate) fn new(plan: &PortPlan, kind: ReaderKind<T>) -> Self {
        let took = plan.recorder(PortUseKind::Took);
        let taken = plan.sides.reader.take();
        Self { kind, group: plan.group.clone(), looks: Looks::default(), took, taken }
    }

    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// A release looks once: further calls in the same release return false.
    ///
    /// # Panics
    /// In a graph of another [execution](crate::Execution) than that of the builder which made the port.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock and may allocate.
    #[track_caller]
    pub fn refresh(&mut self, ctx: &TickContext) -> bool {
        self.group.check_execution(ctx);
        if !self.looks.is_first(ctx) {
            return false;
        }
        let fresh = match &mut self.kind {
            ReaderKind::Threaded(reader) => reader.refresh(),
            ReaderKind::Virtual(reader) => reader.refresh(ctx, self.group.is(ctx)),
        };
        if fresh {
            self.taken.pass(ctx);
        }
        if fresh && ctx.phase == Phase::Release && !self.group.is(ctx) {
            self.took.push(ctx, self.version());
        }
        fresh
    }

    /// The value of the last refresh, or the initial value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get(&self) -> &T {
        &self.held().value
    }

    /// The value of the last refresh, to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get_mut(&mut self) -> &mut T {
        match &mut self.kind {
            ReaderKind::Threaded(reader) => reader.half_mut().get_mut(),
            ReaderKind::Virtual(reader) => &mut reader.held_mut().value,
        }
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u64 {
        self.held().version
    }

    /// The scheduled time of the release that published the value; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn published(&self) -> Nanos {
        self.held().published
    }

    fn held(&self) -> &Stamped<T> {
        match &self.kind {
            ReaderKind::Threaded(reader) => reader.half().held(),
            ReaderKind::Virtual(reader) => reader.held(),
        }
    }
}

impl_debug!(Writer<T>);

impl_debug!(Reader<T>, "version": |own| own.version());
