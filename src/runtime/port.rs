//! Typed ports between actors: the newest value of a large state, and ordered samples.
//!
//! The same types in both executions. Between threads they are the [exchange](super::exchange) and the
//! [ring](super::ring); in virtual time the executor owns visibility: what a group with latency L publishes at release
//! t is visible to readers whose work begins at t + L or later, which is their scheduled time unless a
//! [disturbance](super::Disturbance) delays them. With L = 0 a reader at the same time sees it if it ticks after the writer:
//! later in the group, or in a later group.

use super::actor::TickContext;
use super::exchange::{ExchangeReader, ExchangeWriter, exchange};
use super::ring::{Consumer, Producer, ring};
use super::virtual_port::{self, VirtualQueue, VirtualReader, VirtualWriter};
use crate::time::Nanos;
use std::fmt;

enum WriterKind<T> {
    Threaded(ExchangeWriter<T>),
    Virtual(VirtualWriter<T>),
}

enum ReaderKind<T> {
    Threaded(ExchangeReader<T>),
    Virtual(VirtualReader<T>),
}

enum QueueWriterKind<T> {
    Threaded(Producer<T>),
    Virtual(VirtualQueue<T>),
}

enum QueueReaderKind<T> {
    Threaded(Consumer<T>),
    Virtual(VirtualQueue<T>),
}

/// Publishes the newest value of a state.
pub struct Writer<T>(WriterKind<T>);

/// Reads the newest value of a state. The reader owns its buffer until the next successful refresh.
pub struct Reader<T>(ReaderKind<T>);

/// Sends samples that all count, in order.
pub struct QueueWriter<T>(QueueWriterKind<T>);

/// Receives samples in the order they were sent.
pub struct QueueReader<T>(QueueReaderKind<T>);

pub(super) fn threaded_exchange<T: Send>(init: impl FnMut() -> T) -> (Writer<T>, Reader<T>) {
    let (writer, reader) = exchange(init);
    (Writer(WriterKind::Threaded(writer)), Reader(ReaderKind::Threaded(reader)))
}

pub(super) fn virtual_exchange<T: Send>(init: impl FnMut() -> T + Send + 'static) -> (Writer<T>, Reader<T>) {
    let (writer, reader) = virtual_port::exchange(init);
    (Writer(WriterKind::Virtual(writer)), Reader(ReaderKind::Virtual(reader)))
}

pub(super) fn threaded_queue<T: Copy + Send>(capacity: usize) -> (QueueWriter<T>, QueueReader<T>) {
    let (producer, consumer) = ring(capacity);
    (QueueWriter(QueueWriterKind::Threaded(producer)), QueueReader(QueueReaderKind::Threaded(consumer)))
}

pub(super) fn virtual_queue<T: Copy + Send>(capacity: usize) -> (QueueWriter<T>, QueueReader<T>) {
    let queue = VirtualQueue::new(capacity);
    (QueueWriter(QueueWriterKind::Virtual(queue.clone())), QueueReader(QueueReaderKind::Virtual(queue)))
}

impl<T> Writer<T> {
    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn buffer(&mut self) -> &mut T {
        match &mut self.0 {
            WriterKind::Threaded(writer) => writer.buffer(),
            WriterKind::Virtual(writer) => writer.buffer(),
        }
    }

    /// Makes the buffer the newest value and returns its version, counting from 1.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn publish(&mut self, ctx: &TickContext) -> u64 {
        match &mut self.0 {
            WriterKind::Threaded(writer) => writer.publish(ctx.scheduled),
            WriterKind::Virtual(writer) => writer.publish(ctx),
        }
    }
}

impl<T> Reader<T> {
    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn refresh(&mut self, ctx: &TickContext) -> bool {
        match &mut self.0 {
            ReaderKind::Threaded(reader) => reader.refresh(),
            ReaderKind::Virtual(reader) => reader.refresh(ctx),
        }
    }

    /// The value of the last refresh, or the initial value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get(&self) -> &T {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.get(),
            ReaderKind::Virtual(reader) => reader.get(),
        }
    }

    /// The same to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get_mut(&mut self) -> &mut T {
        match &mut self.0 {
            ReaderKind::Threaded(reader) => reader.get_mut(),
            ReaderKind::Virtual(reader) => reader.get_mut(),
        }
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u64 {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.version(),
            ReaderKind::Virtual(reader) => reader.version(),
        }
    }

    /// The scheduled time of the release that published the value; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn published(&self) -> Nanos {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.published(),
            ReaderKind::Virtual(reader) => reader.published(),
        }
    }
}

impl<T: Copy> QueueWriter<T> {
    /// Sends a sample; false if the queue is full: the sample is then dropped and counted.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn push(&mut self, ctx: &TickContext, sample: T) -> bool {
        match &mut self.0 {
            QueueWriterKind::Threaded(producer) => producer.push(sample),
            QueueWriterKind::Virtual(queue) => queue.push(ctx, sample),
        }
    }

    /// Samples dropped so far because the queue was full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        match &self.0 {
            QueueWriterKind::Threaded(producer) => producer.lost(),
            QueueWriterKind::Virtual(queue) => queue.dropped(),
        }
    }
}

impl<T: Copy> QueueReader<T> {
    /// The oldest visible sample, left in the queue.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn peek(&mut self, ctx: &TickContext) -> Option<T> {
        match &mut self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.peek(),
            QueueReaderKind::Virtual(queue) => queue.peek(ctx),
        }
    }

    /// Takes the oldest visible sample.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn pop(&mut self, ctx: &TickContext) -> Option<T> {
        match &mut self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.pop(),
            QueueReaderKind::Virtual(queue) => queue.pop(ctx),
        }
    }

    /// Samples dropped so far because the queue was full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        match &self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.lost(),
            QueueReaderKind::Virtual(queue) => queue.dropped(),
        }
    }
}

impl<T> fmt::Debug for Writer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for Reader<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reader").field("version", &self.version()).finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for QueueWriter<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueueWriter").finish_non_exhaustive()
    }
}

impl<T> fmt::Debug for QueueReader<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueueReader").finish_non_exhaustive()
    }
}
