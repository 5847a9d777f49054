//! Queues of virtual time: a sample waits until the release that may see it.
//!
//! One thread runs everything, in time order, so the lock here is never contended; it only makes the halves `Send`.

use crate::actor::{Phase, TickContext};
use crate::ports::hot_swap_queue::Numbered;
use crate::primitives::ring::rounded;
use crate::primitives::sync::lock;
use crate::reexecution::script::ScriptedPort;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

struct Samples<T> {
    /// In the order in which they were sent and become visible.
    waiting: VecDeque<(Nanos, Numbered<T>)>,
    capacity: usize,
    /// Receivers that the port has had; the last one is in force.
    receivers: u64,
    script: Option<ScriptedPort>,
}

/// The port, and its sending half.
pub(crate) struct VirtualQueue<T>(Arc<Mutex<Samples<T>>>);

impl<T> Clone for VirtualQueue<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Copy> VirtualQueue<T> {
    pub(crate) fn new(script: Option<ScriptedPort>, capacity: usize) -> Self {
        // The same capacity as the ring that takes its place between threads.
        let capacity = rounded(capacity);
        let waiting = VecDeque::with_capacity(capacity);
        Self(Arc::new(Mutex::new(Samples { waiting, capacity, receivers: 0, script })))
    }

    /// The number counts the attempts.
    pub(crate) fn push(&self, ctx: &TickContext, sample: Numbered<T>) -> bool {
        let mut samples = lock(&self.0);
        let script = samples.script.as_ref().filter(|_| matches!(ctx.phase, Phase::Start | Phase::Release));
        // How full a recorded queue was is a matter of the threads then: what was dropped is in the script.
        let fits = script.map_or(samples.waiting.len() < samples.capacity, |script| !script.drops(sample.number));
        if fits {
            // No sample overtakes another, also not one of a group that is started again and publishes at once.
            let last = samples.waiting.back().map_or(Nanos::ZERO, |last| last.0);
            samples.waiting.push_back((ctx.visible_at.max(last), sample));
            if let Some(script) = &samples.script {
                script.produced(sample.number);
            }
        }
        fits
    }

    /// The receiving half; fences the one before, whose samples are lost.
    pub(crate) fn receiver(&self) -> VirtualReceiver<T> {
        let mut samples = lock(&self.0);
        if samples.receivers > 0 {
            samples.waiting.clear();
        }
        samples.receivers += 1;
        VirtualReceiver { queue: self.clone(), number: samples.receivers }
    }
}

/// The receiving half.
pub(crate) struct VirtualReceiver<T> {
    queue: VirtualQueue<T>,
    /// Its number among the receivers of the port.
    number: u64,
}

impl<T: Copy> VirtualReceiver<T> {
    /// What `act` finds, if this is the receiver in force.
    fn with<R>(&self, act: impl FnOnce(&mut Samples<T>) -> Option<R>) -> Option<R> {
        let mut samples = lock(&self.queue.0);
        if samples.receivers == self.number { act(&mut samples) } else { None }
    }

    /// The number of the newest sample that this release may see, if there is one; `own` if its own group sends them.
    pub(crate) fn newest(&self, ctx: &TickContext, own: bool) -> Option<u64> {
        self.with(|samples| match &samples.script {
            _ if own => samples.waiting.back().map(|last| last.1.number),
            Some(script) if ctx.phase == Phase::Release => Some(script.saw(ctx)),
            _ => {
                let visible = samples.waiting.partition_point(|sample| sample.0 <= ctx.now);
                samples.waiting.get(visible.checked_sub(1)?).map(|last| last.1.number)
            }
        })
    }

    /// The oldest sample, if its number is at most `up_to`; left in the queue.
    pub(crate) fn peek(&self, up_to: u64) -> Option<T> {
        self.with(|samples| samples.waiting.front().filter(|first| first.1.number <= up_to).map(|first| first.1.value))
    }

    /// Takes the oldest sample, if its number is at most `up_to`.
    pub(crate) fn pop(&self, up_to: u64) -> Option<T> {
        self.with(|samples| samples.waiting.pop_front_if(|first| first.1.number <= up_to).map(|first| first.1.value))
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::time::Rate;

    fn at(now: u64, visible_at: u64) -> TickContext {
        TickContext { now: Nanos(now), visible_at: Nanos(visible_at), ..TickContext::by_hand(Rate::hz(1000), 0) }
    }

    fn numbered(number: u64) -> Numbered<u64> {
        Numbered { number, value: number }
    }

    #[test]
    fn a_sample_that_may_be_seen_at_once_waits_for_the_ones_before_it() {
        let queue = VirtualQueue::new(None, 8);
        let receiver = queue.receiver();
        for (number, visible_at) in [(1, 10), (2, 5), (3, 12)] {
            assert!(queue.push(&at(4, visible_at), numbered(number)));
        }
        let newest = |now| receiver.newest(&at(now, now), false);
        assert_eq!((newest(9), newest(10), newest(11), newest(12)), (None, Some(2), Some(2), Some(3)));
    }

    #[test]
    fn a_receiver_that_is_taken_again_gets_what_is_sent_from_then_on_and_fences_the_one_before() {
        let queue = VirtualQueue::new(None, 8);
        let old = queue.receiver();
        assert!(queue.push(&at(1, 1), numbered(1)));
        let fresh = queue.receiver();
        assert!(queue.push(&at(2, 2), numbered(2)));
        assert_eq!((old.newest(&at(2, 2), false), old.pop(9)), (None, None));
        assert_eq!(
            (fresh.newest(&at(2, 2), false), fresh.peek(1), fresh.pop(2), fresh.pop(2)),
            (Some(2), None, Some(2), None)
        );
    }
}
