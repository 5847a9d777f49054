//! Typed ports between actors for samples that all count, in order.
//!
//! Between threads they are the [ring](super::ring); in virtual time samples become visible as values of an
//! [exchange port](super::RuntimeBuilder::exchange) do. A release looks at a queue once: the samples that it finds then
//! are all that it gets, and their number is recorded if they come from another group.

use super::actor::{Phase, TickContext};
use super::link::Linked;
use super::port_memory::{Looks, PortPlan, UseRecorder, WriterGroup};
use super::port_use::PortUseKind;
use super::ring::{Consumer, Producer};
use super::virtual_queue::VirtualQueue;
use std::fmt;

enum WriterKind<T> {
    Threaded(Linked<Producer<T>>),
    Virtual(VirtualQueue<T>),
}

enum ReaderKind<T> {
    Threaded(Linked<Consumer<T>>),
    Virtual(VirtualQueue<T>),
}

/// Sends samples that all count, in order.
pub struct QueueWriter<T> {
    kind: WriterKind<T>,
    group: WriterGroup,
    attempts: u64,
    dropped: UseRecorder,
}

/// Receives samples in the order they were sent.
pub struct QueueReader<T> {
    kind: ReaderKind<T>,
    group: WriterGroup,
    looks: Looks,
    /// Samples taken so far.
    taken: u64,
    /// Samples that had been sent when this release looked.
    visible: u64,
    /// The same at the last look that was recorded.
    recorded: u64,
    saw: UseRecorder,
}

impl<T: Copy> QueueWriter<T> {
    pub(super) fn threaded(plan: &PortPlan, half: Linked<Producer<T>>) -> Self {
        Self::of(plan, WriterKind::Threaded(half))
    }

    pub(super) fn in_virtual_time(plan: &PortPlan, queue: &VirtualQueue<T>) -> Self {
        Self::of(plan, WriterKind::Virtual(queue.clone()))
    }

    fn of(plan: &PortPlan, kind: WriterKind<T>) -> Self {
        let dropped = plan.recorder(PortUseKind::Dropped);
        Self { kind, group: plan.group.clone(), attempts: 0, dropped }
    }

    /// Sends a sample; false if the queue is full: the sample is then dropped and counted.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock and may allocate.
    pub fn push(&mut self, ctx: &TickContext, sample: T) -> bool {
        self.group.set(ctx);
        self.attempts += 1;
        let sent = match &mut self.kind {
            WriterKind::Threaded(producer) => producer.current().push(sample),
            WriterKind::Virtual(queue) => queue.push(ctx, sample, self.attempts),
        };
        if !sent && matches!(ctx.phase, Phase::Start | Phase::Release) {
            self.dropped.push(ctx, self.attempts);
        }
        sent
    }

    /// Samples dropped so far because the queue was full.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock.
    pub fn dropped(&self) -> u64 {
        match &self.kind {
            WriterKind::Threaded(producer) => producer.half().lost(),
            WriterKind::Virtual(queue) => queue.dropped(),
        }
    }
}

impl<T: Copy> QueueReader<T> {
    pub(super) fn threaded(plan: &PortPlan, half: Linked<Consumer<T>>) -> Self {
        Self::of(plan, ReaderKind::Threaded(half), 0)
    }

    pub(super) fn in_virtual_time(plan: &PortPlan, queue: &VirtualQueue<T>) -> Self {
        Self::of(plan, ReaderKind::Virtual(queue.clone()), queue.skip_all())
    }

    /// `taken` samples have been sent before and are no concern of this reader.
    fn of(plan: &PortPlan, kind: ReaderKind<T>, taken: u64) -> Self {
        let saw = plan.recorder(PortUseKind::Saw);
        let group = plan.group.clone();
        Self { kind, group, looks: Looks::default(), taken, visible: taken, recorded: taken, saw }
    }

    /// The oldest sample that this release can see, left in the queue.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock.
    pub fn peek(&mut self, ctx: &TickContext) -> Option<T> {
        self.look(ctx);
        if self.taken >= self.visible {
            return None;
        }
        match &mut self.kind {
            ReaderKind::Threaded(consumer) => consumer.half_mut().peek(),
            ReaderKind::Virtual(queue) => queue.peek(),
        }
    }

    /// Takes the oldest sample that this release can see: one that was there when the release looked first.
    ///
    /// # Real-time
    /// On threads wait-free, real-time safe; in virtual time it takes an uncontended lock.
    pub fn pop(&mut self, ctx: &TickContext) -> Option<T> {
        self.look(ctx);
        if self.taken >= self.visible {
            return None;
        }
        let sample = match &mut self.kind {
            ReaderKind::Threaded(consumer) => consumer.half_mut().pop(),
            ReaderKind::Virtual(queue) => queue.pop(),
        };
        self.taken += u64::from(sample.is_some());
        sample
    }

    /// Decides, at the first call of a release, which samples it gets.
    fn look(&mut self, ctx: &TickContext) {
        if !self.looks.is_first(ctx) {
            return;
        }
        self.visible = match &mut self.kind {
            ReaderKind::Threaded(consumer) => self.taken + consumer.current().available() as u64,
            ReaderKind::Virtual(queue) => queue.visible(ctx, self.group.is(ctx), self.taken),
        };
        if self.visible != self.recorded && ctx.phase == Phase::Release && !self.group.is(ctx) {
            self.recorded = self.visible;
            self.saw.push(ctx, self.visible);
        }
    }
}

impl<T> fmt::Debug for QueueWriter<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueueWriter").field("attempts", &self.attempts).finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for QueueReader<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueueReader").field("taken", &self.taken).finish_non_exhaustive()
    }
}
