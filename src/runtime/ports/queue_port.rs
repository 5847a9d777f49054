//! Typed ports between actors for samples that all count, in order.
//!
//! Between threads they are the [ring](crate::ring); in virtual time samples become visible as values of an
//! [exchange port](crate::RuntimeBuilder::exchange) do. A release looks at a queue once: the samples that it finds then
//! are all that it gets, and their number is recorded if they come from another group.

use crate::actor::{Phase, TickContext};
use crate::ports::hot_swap::Swappable;
use crate::ports::hot_swap_queue::{Numbered, SwappableConsumer};
use crate::ports::port_state::{Looks, PortPlan, UseRecorder, WriterGroup};
use crate::ports::port_traffic::Counter;
use crate::ports::virtual_queue::{VirtualQueue, VirtualReceiver};
use crate::primitives::fenced_counter::FencedCounter;
use crate::primitives::ring::Producer;
use crate::records::port_use::PortUseKind;

pub(crate) enum WriterKind<T> {
    Threaded(Swappable<Producer<Numbered<T>>>),
    Virtual(VirtualQueue<T>),
}

pub(crate) enum ReaderKind<T> {
    Threaded(SwappableConsumer<T>),
    Virtual(VirtualReceiver<T>),
}

/// Sends samples that all count, in order, to a [`QueueReader`] in another actor.
///
/// ```
/// use palpate_runtime::{Execution, Rate, Runtime, TickContext};
///
/// let (mut writer, mut reader) = Runtime::builder(Execution::Threaded).queue(2);
/// let ctx = TickContext::by_hand(Rate::hz(1000), 4); // what the executor gives to a tick
/// assert_eq!([7, 8, 9].map(|sample| writer.push(&ctx, sample)), [true, true, false]);
/// assert_eq!((reader.pop(&ctx), reader.pop(&ctx), reader.pop(&ctx)), (Some(7), Some(8), None));
/// assert_eq!(writer.dropped(), 1);
/// ```
pub struct QueueWriter<T> {
    kind: WriterKind<T>,
    group: WriterGroup,
    attempts: FencedCounter,
    drops: FencedCounter,
    dropped: UseRecorder,
    sent: Counter,
}

/// Receives the samples of a [`QueueWriter`] in the order in which they were sent.
///
/// ```
/// use palpate_runtime::{Execution, Rate, Runtime, TickContext};
///
/// let (mut writer, mut reader) = Runtime::builder(Execution::Threaded).queue(8);
/// let ctx = TickContext::by_hand(Rate::hz(1000), 4); // what the executor gives to a tick
/// (0..3).for_each(|sample| assert!(writer.push(&ctx, sample)));
/// let taken: Vec<i32> = std::iter::from_fn(|| reader.pop(&ctx)).collect();
/// assert_eq!(taken, [0, 1, 2]);
/// ```
pub struct QueueReader<T> {
    kind: ReaderKind<T>,
    group: WriterGroup,
    looks: Looks,
    /// The number of the newest sample that was there when this release looked.
    visible: u64,
    /// The same at the last look that was recorded.
    recorded: u64,
    saw: UseRecorder,
    taken: Counter,
}

impl<T: Copy> QueueWriter<T> {
    pub(crate) fn new(plan: &PortPlan, kind: WriterKind<T>, attempts: FencedCounter, drops: FencedCounter) -> Self {
        let dropped = plan.recorder(PortUseKind::Dropped);
        let sent = plan.sides.writer.take();
        Self { kind, group: plan.group.clone(), attempts, drops, dropped, sent }
    }

    /// Sends a sample; false if the queue is full: the sample is then dropped and counted. Also false if this writer's
    /// place was [taken](crate::QueuePort::writer): nothing is sent or counted then.
    ///
    /// # Panics
    /// In a graph of another [execution](crate::Execution) than that of the builder which made the port.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock and may allocate.
    #[track_caller]
    pub fn push(&mut self, ctx: &TickContext, sample: T) -> bool {
        self.group.check_execution(ctx);
        let Some(number) = self.attempts.next() else { return false };
        self.group.set(ctx);
        let sample = Numbered { number, value: sample };
        let sent = match &mut self.kind {
            WriterKind::Threaded(producer) => producer.push(sample),
            WriterKind::Virtual(queue) => queue.push(ctx, sample),
        };
        if sent {
            self.sent.pass(ctx);
        } else {
            self.sent.drop_one();
            self.drops.next();
            if matches!(ctx.phase, Phase::Start | Phase::Release) {
                self.dropped.push(ctx, number);
            }
        }
        sent
    }

    /// Samples dropped so far because the queue was full, by the writers before this one included.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        self.drops.last()
    }
}

impl<T: Copy> QueueReader<T> {
    pub(crate) fn new(plan: &PortPlan, kind: ReaderKind<T>) -> Self {
        let saw = plan.recorder(PortUseKind::Saw);
        let taken = plan.sides.reader.take();
        Self { kind, group: plan.group.clone(), looks: Looks::default(), visible: 0, recorded: 0, saw, taken }
    }

    /// The oldest sample that this release can see, left in the queue.
    ///
    /// # Panics
    /// In a graph of another [execution](crate::Execution) than that of the builder which made the port.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock.
    #[track_caller]
    pub fn peek(&mut self, ctx: &TickContext) -> Option<T> {
        self.look(ctx);
        match &mut self.kind {
            ReaderKind::Threaded(consumer) => consumer.peek(self.visible),
            ReaderKind::Virtual(queue) => queue.peek(self.visible),
        }
    }

    /// Takes the oldest sample that this release can see: one that was there when the release looked first.
    ///
    /// # Panics
    /// In a graph of another [execution](crate::Execution) than that of the builder which made the port.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock.
    #[track_caller]
    pub fn pop(&mut self, ctx: &TickContext) -> Option<T> {
        self.look(ctx);
        let sample = match &mut self.kind {
            ReaderKind::Threaded(consumer) => consumer.pop(self.visible),
            ReaderKind::Virtual(queue) => queue.pop(self.visible),
        };
        if sample.is_some() {
            self.taken.pass(ctx);
        }
        sample
    }

    /// Decides, at the first call of a release, which samples it gets.
    #[track_caller]
    fn look(&mut self, ctx: &TickContext) {
        self.group.check_execution(ctx);
        if !self.looks.is_first(ctx) {
            return;
        }
        let newest = match &mut self.kind {
            ReaderKind::Threaded(consumer) => consumer.newest(),
            ReaderKind::Virtual(queue) => queue.newest(ctx, self.group.is(ctx)),
        };
        self.visible = newest.unwrap_or(self.visible);
        if self.visible != self.recorded && ctx.phase == Phase::Release && !self.group.is(ctx) {
            self.recorded = self.visible;
            self.saw.push(ctx, self.visible);
        }
    }
}

impl_debug!(QueueWriter<T>, "attempts": |own| own.attempts.last());

impl_debug!(QueueReader<T>, "visible": |own| own.visible);
