//! Ports of virtual time: a publication waits until the release that may see it.
//!
//! One thread runs everything, in time order, so the locks here are never contended; they only make the halves `Send`.

use super::actor::TickContext;
use super::ring::rounded;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

struct Versioned<T> {
    value: T,
    version: u64,
    published: Nanos,
}

struct Publication<T> {
    visible_at: Nanos,
    buffer: Box<Versioned<T>>,
}

struct Flight<T> {
    /// In order of publication, hence of visibility.
    waiting: VecDeque<Publication<T>>,
    /// Buffers that nobody needs, kept for the writer: once warm, nothing is allocated.
    free: Vec<Box<Versioned<T>>>,
    init: Box<dyn FnMut() -> T + Send>,
}

impl<T> Flight<T> {
    fn fresh(&mut self) -> Box<Versioned<T>> {
        self.free
            .pop()
            .unwrap_or_else(|| Box::new(Versioned { value: (self.init)(), version: 0, published: Nanos::ZERO }))
    }

    /// Takes back what no reader can get any more: time only moves on, and at `now` a newer one is visible.
    fn recycle(&mut self, now: Nanos) {
        while self.waiting.get(1).is_some_and(|second| second.visible_at <= now) {
            self.free.extend(self.waiting.pop_front().map(|old| old.buffer));
        }
    }
}

type SharedFlight<T> = Arc<Mutex<Flight<T>>>;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic while the lock is held can only come from a user's `init`, which leaves the queues whole.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn exchange<T: Send>(init: impl FnMut() -> T + Send + 'static) -> (VirtualWriter<T>, VirtualReader<T>) {
    let mut flight = Flight { waiting: VecDeque::new(), free: Vec::new(), init: Box::new(init) };
    let (back, front) = (flight.fresh(), flight.fresh());
    let shared = Arc::new(Mutex::new(flight));
    (VirtualWriter { shared: Arc::clone(&shared), buffer: back, version: 0 }, VirtualReader { shared, buffer: front })
}

pub(super) struct VirtualWriter<T> {
    shared: SharedFlight<T>,
    buffer: Box<Versioned<T>>,
    version: u64,
}

impl<T> VirtualWriter<T> {
    pub(super) fn buffer(&mut self) -> &mut T {
        &mut self.buffer.value
    }

    pub(super) fn publish(&mut self, ctx: &TickContext) -> u64 {
        self.version += 1;
        self.buffer.version = self.version;
        self.buffer.published = ctx.scheduled;
        let mut flight = lock(&self.shared);
        flight.recycle(ctx.now);
        let fresh = flight.fresh();
        let buffer = std::mem::replace(&mut self.buffer, fresh);
        flight.waiting.push_back(Publication { visible_at: ctx.visible_at, buffer });
        self.version
    }
}

pub(super) struct VirtualReader<T> {
    shared: SharedFlight<T>,
    buffer: Box<Versioned<T>>,
}

impl<T> VirtualReader<T> {
    pub(super) fn refresh(&mut self, ctx: &TickContext) -> bool {
        let mut flight = lock(&self.shared);
        flight.recycle(ctx.now);
        let Some(newest) = flight.waiting.pop_front_if(|first| first.visible_at <= ctx.now) else {
            return false;
        };
        let old = std::mem::replace(&mut self.buffer, newest.buffer);
        flight.free.push(old);
        true
    }

    pub(super) fn get(&self) -> &T {
        &self.buffer.value
    }

    pub(super) fn get_mut(&mut self) -> &mut T {
        &mut self.buffer.value
    }

    pub(super) fn version(&self) -> u64 {
        self.buffer.version
    }

    pub(super) fn published(&self) -> Nanos {
        self.buffer.published
    }
}

struct Samples<T> {
    waiting: VecDeque<(Nanos, T)>,
    capacity: usize,
    dropped: u64,
}

pub(super) struct VirtualQueue<T>(Arc<Mutex<Samples<T>>>);

impl<T> Clone for VirtualQueue<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Copy> VirtualQueue<T> {
    pub(super) fn new(capacity: usize) -> Self {
        // The same capacity as the ring that takes its place between threads.
        let capacity = rounded(capacity);
        Self(Arc::new(Mutex::new(Samples { waiting: VecDeque::with_capacity(capacity), capacity, dropped: 0 })))
    }

    pub(super) fn push(&self, ctx: &TickContext, value: T) -> bool {
        let mut samples = lock(&self.0);
        let fits = samples.waiting.len() < samples.capacity;
        if fits {
            samples.waiting.push_back((ctx.visible_at, value));
        } else {
            samples.dropped += 1;
        }
        fits
    }

    pub(super) fn peek(&self, ctx: &TickContext) -> Option<T> {
        lock(&self.0).waiting.front().filter(|sample| sample.0 <= ctx.now).map(|sample| sample.1)
    }

    pub(super) fn pop(&self, ctx: &TickContext) -> Option<T> {
        lock(&self.0).waiting.pop_front_if(|sample| sample.0 <= ctx.now).map(|sample| sample.1)
    }

    pub(super) fn dropped(&self) -> u64 {
        lock(&self.0).dropped
    }
}
