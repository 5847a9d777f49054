//! Queues of virtual time: a sample waits until the release that may see it.
//!
//! One thread runs everything, in time order, so the lock here is never contended; it only makes the halves `Send`.

use super::actor::{Phase, TickContext};
use super::ring::rounded;
use super::script::ScriptedPort;
use super::virtual_port::lock;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

struct Samples<T> {
    /// In the order in which they were sent and become visible.
    waiting: VecDeque<(Nanos, T)>,
    capacity: usize,
    sent: u64,
    dropped: u64,
    script: Option<ScriptedPort>,
}

pub(super) struct VirtualQueue<T>(Arc<Mutex<Samples<T>>>);

impl<T> Clone for VirtualQueue<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Copy> VirtualQueue<T> {
    pub(super) fn new(script: Option<ScriptedPort>, capacity: usize) -> Self {
        // The same capacity as the ring that takes its place between threads.
        let capacity = rounded(capacity);
        let waiting = VecDeque::with_capacity(capacity);
        Self(Arc::new(Mutex::new(Samples { waiting, capacity, sent: 0, dropped: 0, script })))
    }

    /// `attempt` counts the calls.
    pub(super) fn push(&self, ctx: &TickContext, value: T, attempt: u64) -> bool {
        let mut samples = lock(&self.0);
        let script = samples.script.as_ref().filter(|_| matches!(ctx.phase, Phase::Start | Phase::Release));
        // How full a recorded queue was is a matter of the threads then: what was dropped is in the script.
        let fits = script.map_or(samples.waiting.len() < samples.capacity, |script| !script.drops(attempt));
        if fits {
            samples.sent += 1;
            samples.waiting.push_back((ctx.visible_at, value));
            if let Some(script) = &samples.script {
                script.produced(samples.sent);
            }
        } else {
            samples.dropped += 1;
        }
        fits
    }

    /// How many samples have been sent that this release may see, `taken` of them taken already; `own` if its own group
    /// sends them.
    pub(super) fn visible(&self, ctx: &TickContext, own: bool, taken: u64) -> u64 {
        let samples = lock(&self.0);
        if own {
            return samples.sent;
        }
        match &samples.script {
            Some(script) if ctx.phase == Phase::Release => script.saw(ctx).max(taken),
            _ => taken + samples.waiting.partition_point(|sample| sample.0 <= ctx.now) as u64,
        }
    }

    pub(super) fn peek(&self) -> Option<T> {
        lock(&self.0).waiting.front().map(|sample| sample.1)
    }

    pub(super) fn pop(&self) -> Option<T> {
        lock(&self.0).waiting.pop_front().map(|sample| sample.1)
    }

    /// Drops what waits, for a reader that takes the place of another; returns how many samples have been sent.
    pub(super) fn skip_all(&self) -> u64 {
        let mut samples = lock(&self.0);
        samples.waiting.clear();
        samples.sent
    }

    pub(super) fn dropped(&self) -> u64 {
        lock(&self.0).dropped
    }
}
