//! What goes through a port and who holds its halves, counted by the halves and readable at any moment.

use crate::actor::TickContext;
use crate::primitives::sync::{AtomicU64, AtomicUsize, CachePadded, Ordering, lock};
use std::sync::{Arc, Mutex};

/// The holder of a half before its first use.
const UNSEEN: usize = usize::MAX;
/// An actor's number in its group takes this many bits of a place.
const ACTOR_BITS: u32 = 16;

/// What one half counts. Each has its own: one that was fenced counts on where nobody looks.
#[derive(Debug)]
struct Counts {
    place: AtomicUsize,
    passed: AtomicU64,
    dropped: AtomicU64,
}

/// One side of a port, whoever holds its half.
#[derive(Clone, Debug)]
pub(crate) struct Side(Arc<SideState>);

#[derive(Debug)]
struct SideState {
    holders: AtomicUsize,
    /// What the halves before have passed and dropped, and the counts of the one in force.
    counts: Mutex<(u64, u64, Arc<CachePadded<Counts>>)>,
}

/// What a side has seen so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Traffic {
    /// Group and actor that used the half last.
    pub(crate) place: Option<(usize, usize)>,
    pub(crate) passed: u64,
    pub(crate) dropped: u64,
}

fn counts() -> Arc<CachePadded<Counts>> {
    let (passed, dropped) = (AtomicU64::new(0), AtomicU64::new(0));
    Arc::new(CachePadded(Counts { place: AtomicUsize::new(UNSEEN), passed, dropped }))
}

impl Side {
    pub(crate) fn new() -> Self {
        Self(Arc::new(SideState { holders: AtomicUsize::new(0), counts: Mutex::new((0, 0, counts())) }))
    }

    /// The counter of the half that is taken now; the one taken before counts for nobody any more.
    pub(crate) fn take(&self) -> Counter {
        let mut now = lock(&self.0.counts);
        now.0 += now.2.passed.load(Ordering::Relaxed);
        now.1 += now.2.dropped.load(Ordering::Relaxed);
        now.2 = counts();
        self.0.holders.fetch_add(1, Ordering::Relaxed);
        Counter { side: Arc::clone(&self.0), counts: Arc::clone(&now.2) }
    }

    /// False if the half was never taken or nobody has it any more.
    pub(crate) fn is_held(&self) -> bool {
        self.0.holders.load(Ordering::Relaxed) > 0
    }

    pub(crate) fn traffic(&self) -> Traffic {
        let now = lock(&self.0.counts);
        let place = now.2.place.load(Ordering::Relaxed);
        Traffic {
            place: (place != UNSEEN).then_some((place >> ACTOR_BITS, place & ((1 << ACTOR_BITS) - 1))),
            passed: now.0 + now.2.passed.load(Ordering::Relaxed),
            dropped: now.1 + now.2.dropped.load(Ordering::Relaxed),
        }
    }
}

/// Counts for one half.
#[derive(Debug)]
pub(crate) struct Counter {
    side: Arc<SideState>,
    counts: Arc<CachePadded<Counts>>,
}

impl Drop for Counter {
    fn drop(&mut self) {
        self.side.holders.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Counter {
    /// Counts a value that an actor has passed through the half.
    ///
    /// # Real-time
    /// Wait-free (plain loads and stores), real-time safe.
    #[inline]
    pub(crate) fn pass(&self, ctx: &TickContext) {
        // A context made by hand has no place in the graph.
        if ctx.execution.is_some() {
            let place = usize::from(ctx.group) << ACTOR_BITS | usize::from(ctx.actor);
            self.counts.place.store(place, Ordering::Relaxed);
        }
        self.pass_outside();
    }

    /// Counts a value that a thread outside the graph has passed.
    ///
    /// # Real-time
    /// Wait-free (plain loads and stores), real-time safe.
    #[inline]
    pub(crate) fn pass_outside(&self) {
        // Relaxed: statistics, and this half alone stores.
        self.counts.passed.store(self.counts.passed.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    }

    /// Counts a value for which there was no room.
    ///
    /// # Real-time
    /// Wait-free (plain loads and stores), real-time safe.
    #[inline]
    pub(crate) fn drop_one(&self) {
        self.counts.dropped.store(self.counts.dropped.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    }
}

/// Both sides of a port.
#[derive(Clone, Debug)]
pub(crate) struct Sides {
    pub(crate) writer: Side,
    pub(crate) reader: Side,
}

impl Sides {
    pub(crate) fn new() -> Self {
        Self { writer: Side::new(), reader: Side::new() }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::executor::Execution;
    use crate::time::Rate;

    #[test]
    fn a_side_sums_up_its_halves_and_a_fenced_one_has_no_part_in_it() {
        let side = Side::new();
        assert!(!side.is_held());
        let execution = Some(Execution::Threaded);
        let ctx = TickContext { group: 3, actor: 7, execution, ..TickContext::by_hand(Rate::hz(10), 0) };
        let fenced = side.take();
        (0..2).for_each(|_| fenced.pass(&ctx));
        let next = side.take();
        fenced.pass(&ctx);
        next.pass(&ctx);
        next.drop_one();
        assert_eq!(side.traffic(), Traffic { place: Some((3, 7)), passed: 3, dropped: 1 });
        drop(fenced);
        assert!(side.is_held());
        drop(next);
        assert!(!side.is_held());
    }
}
