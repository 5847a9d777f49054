//! Typed ports between actors for the newest value of a large state.
//!
//! The same types in both executions. Between threads they are the [exchange](super::exchange); in virtual time the
//! executor owns visibility: what a group with latency L publishes at release t is visible to readers in other groups
//! whose scheduled time is at least t + L. With L = 0 a reader at the same time sees it if its group comes later. Within
//! the group it is visible at once, to the actors that tick after the writer.
//!
//! A release looks at a port once. What it took from another group is recorded, so that the run can be
//! [re-executed](super::Recording).

use super::actor::{Phase, TickContext};
use super::exchange::{ExchangeReader, ExchangeWriter, exchange};
use super::port_memory::{Looks, UseRecorder, WriterGroup};
use super::port_use::PortUseKind;
use super::recorder::Registry;
use super::script::ScriptedPort;
use super::virtual_port::{self, VirtualReader, VirtualWriter};
use crate::time::Nanos;
use std::fmt;

/// A port that is about to be made: its number and who wants to know what it shows.
pub(super) struct PortPlan<'a> {
    pub(super) port: u32,
    pub(super) registry: &'a Registry,
    /// Says what the port shows, in a re-execution.
    pub(super) script: Option<ScriptedPort>,
}

enum WriterKind<T> {
    Threaded(ExchangeWriter<T>),
    Virtual(VirtualWriter<T>),
}

enum ReaderKind<T> {
    Threaded(ExchangeReader<T>),
    Virtual(VirtualReader<T>),
}

/// Publishes the newest value of a state.
pub struct Writer<T> {
    kind: WriterKind<T>,
    group: WriterGroup,
}

/// Reads the newest value of a state. The reader owns its buffer until the next successful refresh.
pub struct Reader<T> {
    kind: ReaderKind<T>,
    group: WriterGroup,
    looks: Looks,
    took: UseRecorder,
}

pub(super) fn threaded_exchange<T: Send>(plan: PortPlan<'_>, init: impl FnMut() -> T) -> (Writer<T>, Reader<T>) {
    let (writer, reader) = exchange(init);
    pair(plan.registry, plan.port, WriterKind::Threaded(writer), ReaderKind::Threaded(reader))
}

pub(super) fn virtual_exchange<T: Send>(
    plan: PortPlan<'_>,
    init: impl FnMut() -> T + Send + 'static,
) -> (Writer<T>, Reader<T>) {
    let (writer, reader) = virtual_port::exchange(plan.script, init);
    pair(plan.registry, plan.port, WriterKind::Virtual(writer), ReaderKind::Virtual(reader))
}

fn pair<T>(registry: &Registry, port: u32, writer: WriterKind<T>, reader: ReaderKind<T>) -> (Writer<T>, Reader<T>) {
    let group = WriterGroup::new();
    let took = UseRecorder::new(registry, port, PortUseKind::Took);
    (Writer { kind: writer, group: group.clone() }, Reader { kind: reader, group, looks: Looks::default(), took })
}

impl<T> Writer<T> {
    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn buffer(&mut self) -> &mut T {
        match &mut self.kind {
            WriterKind::Threaded(writer) => writer.buffer(),
            WriterKind::Virtual(writer) => writer.buffer(),
        }
    }

    /// Makes the buffer the newest value and returns its version, counting from 1.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn publish(&mut self, ctx: &TickContext) -> u64 {
        self.group.set(ctx);
        match &mut self.kind {
            WriterKind::Threaded(writer) => writer.publish(ctx.scheduled),
            WriterKind::Virtual(writer) => writer.publish(ctx),
        }
    }
}

impl<T> Reader<T> {
    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// A release looks once: further calls in the same release return false.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn refresh(&mut self, ctx: &TickContext) -> bool {
        if !self.looks.is_first(ctx) {
            return false;
        }
        let fresh = match &mut self.kind {
            ReaderKind::Threaded(reader) => reader.refresh(),
            ReaderKind::Virtual(reader) => reader.refresh(ctx, self.group.is(ctx)),
        };
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
        match &self.kind {
            ReaderKind::Threaded(reader) => reader.get(),
            ReaderKind::Virtual(reader) => reader.get(),
        }
    }

    /// The same to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn get_mut(&mut self) -> &mut T {
        match &mut self.kind {
            ReaderKind::Threaded(reader) => reader.get_mut(),
            ReaderKind::Virtual(reader) => reader.get_mut(),
        }
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn version(&self) -> u64 {
        match &self.kind {
            ReaderKind::Threaded(reader) => reader.version(),
            ReaderKind::Virtual(reader) => reader.version(),
        }
    }

    /// The scheduled time of the release that published the value; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn published(&self) -> Nanos {
        match &self.kind {
            ReaderKind::Threaded(reader) => reader.published(),
            ReaderKind::Virtual(reader) => reader.published(),
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
