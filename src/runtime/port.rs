//! Typed ports between actors: the newest value of a large state, and ordered samples.
//!
//! The same types in both executions. Between threads they are the [exchange](super::exchange) and the
//! [ring](super::ring); in virtual time the executor owns visibility: what a group with latency L publishes at release
//! t is visible to readers whose scheduled time is at least t + L. With L = 0 a reader at the same time sees it if it
//! ticks after the writer: later in the group, or in a later group.

use super::actor::TickContext;
use super::exchange::{ExchangeReader, ExchangeWriter};
use super::link::Linked;
use super::ring::{Consumer, Producer};
use super::sync::{AtomicU64, Ordering};
use super::virtual_port::{SharedFlight, VirtualQueue, VirtualReader, VirtualWriter};
use crate::time::Nanos;
use std::fmt;
use std::sync::Arc;

enum WriterKind<T> {
    Threaded(Linked<ExchangeWriter<T>>, VersionCounter),
    Virtual(VirtualWriter<T>),
}

enum ReaderKind<T> {
    Threaded(Linked<ExchangeReader<T>>),
    Virtual(VirtualReader<T>),
}

enum QueueWriterKind<T> {
    Threaded(Linked<Producer<T>>),
    Virtual(VirtualQueue<T>),
}

enum QueueReaderKind<T> {
    Threaded(Linked<Consumer<T>>),
    Virtual(VirtualQueue<T>),
}

/// Counts the versions of a port, on through every writer that it had.
#[derive(Clone, Debug, Default)]
pub(super) struct VersionCounter(Arc<AtomicU64>);

impl VersionCounter {
    pub(super) fn next(&self) -> u64 {
        // Relaxed, and no read-modify-write: there is one writer; one that was fenced may still count, to no effect.
        let version = self.0.load(Ordering::Relaxed) + 1;
        self.0.store(version, Ordering::Relaxed);
        version
    }
}

/// Publishes the newest value of a state.
pub struct Writer<T>(WriterKind<T>);

/// Reads the newest value of a state. The reader owns its buffer until the next successful refresh.
pub struct Reader<T>(ReaderKind<T>);

/// Sends samples that all count, in order.
pub struct QueueWriter<T>(QueueWriterKind<T>);

/// Receives samples in the order they were sent.
pub struct QueueReader<T>(QueueReaderKind<T>);

impl<T> Writer<T> {
    pub(super) fn threaded(half: Linked<ExchangeWriter<T>>, versions: VersionCounter) -> Self {
        Self(WriterKind::Threaded(half, versions))
    }

    pub(super) fn in_virtual_time(flight: &SharedFlight<T>) -> Self {
        Self(WriterKind::Virtual(VirtualWriter::new(flight)))
    }

    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn buffer(&mut self) -> &mut T {
        match &mut self.0 {
            WriterKind::Threaded(writer, _) => writer.half_mut().buffer(),
            WriterKind::Virtual(writer) => writer.buffer(),
        }
    }

    /// Makes the buffer the newest value and returns its version, counting from 1.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn publish(&mut self, ctx: &TickContext) -> u64 {
        match &mut self.0 {
            WriterKind::Threaded(writer, versions) => {
                let version = writer.half_mut().publish_as(versions.next(), ctx.scheduled);
                // Only now: a buffer half written must not be changed for another.
                writer.current();
                version
            }
            WriterKind::Virtual(writer) => writer.publish(ctx),
        }
    }
}

impl<T> Reader<T> {
    pub(super) fn threaded(half: Linked<ExchangeReader<T>>) -> Self {
        Self(ReaderKind::Threaded(half))
    }

    pub(super) fn in_virtual_time(flight: &SharedFlight<T>) -> Self {
        Self(ReaderKind::Virtual(VirtualReader::new(flight)))
    }

    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn refresh(&mut self, ctx: &TickContext) -> bool {
        match &mut self.0 {
            ReaderKind::Threaded(reader) => reader.current().refresh(),
            ReaderKind::Virtual(reader) => reader.refresh(ctx),
        }
    }

    /// The value of the last refresh, or the initial value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get(&self) -> &T {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.half().get(),
            ReaderKind::Virtual(reader) => reader.get(),
        }
    }

    /// The same to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get_mut(&mut self) -> &mut T {
        match &mut self.0 {
            ReaderKind::Threaded(reader) => reader.half_mut().get_mut(),
            ReaderKind::Virtual(reader) => reader.get_mut(),
        }
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u64 {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.half().version(),
            ReaderKind::Virtual(reader) => reader.version(),
        }
    }

    /// The scheduled time of the release that published the value; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn published(&self) -> Nanos {
        match &self.0 {
            ReaderKind::Threaded(reader) => reader.half().published(),
            ReaderKind::Virtual(reader) => reader.published(),
        }
    }
}

impl<T: Copy> QueueWriter<T> {
    pub(super) fn threaded(half: Linked<Producer<T>>) -> Self {
        Self(QueueWriterKind::Threaded(half))
    }

    pub(super) fn in_virtual_time(queue: &VirtualQueue<T>) -> Self {
        Self(QueueWriterKind::Virtual(queue.clone()))
    }

    /// Sends a sample; false if the queue is full: the sample is then dropped and counted.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn push(&mut self, ctx: &TickContext, sample: T) -> bool {
        match &mut self.0 {
            QueueWriterKind::Threaded(producer) => producer.current().push(sample),
            QueueWriterKind::Virtual(queue) => queue.push(ctx, sample),
        }
    }

    /// Samples dropped so far because the queue was full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        match &self.0 {
            QueueWriterKind::Threaded(producer) => producer.half().lost(),
            QueueWriterKind::Virtual(queue) => queue.dropped(),
        }
    }
}

impl<T: Copy> QueueReader<T> {
    pub(super) fn threaded(half: Linked<Consumer<T>>) -> Self {
        Self(QueueReaderKind::Threaded(half))
    }

    pub(super) fn in_virtual_time(queue: &VirtualQueue<T>) -> Self {
        Self(QueueReaderKind::Virtual(queue.clone()))
    }

    /// The oldest visible sample, left in the queue.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn peek(&mut self, ctx: &TickContext) -> Option<T> {
        match &mut self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.current().peek(),
            QueueReaderKind::Virtual(queue) => queue.peek(ctx),
        }
    }

    /// Takes the oldest visible sample.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn pop(&mut self, ctx: &TickContext) -> Option<T> {
        match &mut self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.current().pop(),
            QueueReaderKind::Virtual(queue) => queue.pop(ctx),
        }
    }

    /// Samples dropped so far because the queue was full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn dropped(&self) -> u64 {
        match &self.0 {
            QueueReaderKind::Threaded(consumer) => consumer.half().lost(),
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
