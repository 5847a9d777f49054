//! The newest-value hand-over between two threads, wait-free on both sides.
//!
//! Three slots: the writer owns one, the reader owns one, the third is in flight. Publishing and refreshing each swap
//! an owned slot with the one in flight in a single atomic instruction. The reader never sees a half-written value, and
//! neither side ever waits, clones, allocates or drops.
//!
//! It keeps only the newest value: what the reader did not fetch in time is overwritten. Use a [`ring`](crate::ring)
//! where every value counts. It costs three copies of the value in memory, made in their places one after the other,
//! and the buffer that the writer gets back holds an old value, not the one before.
//!
//! Actors get their ports from the [builder](crate::RuntimeBuilder), which uses this type for threads and delays
//! publications in virtual time. On its own:
//!
//! ```
//! use palpate_runtime::exchange::exchange;
//! use palpate_runtime::Nanos;
//!
//! let (mut writer, mut reader) = exchange(|| [0.0; 1000]);
//! writer.buffer()[0] = 1.5;
//! writer.publish(Nanos(7));
//! assert!(reader.refresh());
//! assert_eq!((reader.get()[0], reader.version(), reader.published()), (1.5, 1, Nanos(7)));
//! assert!(!reader.refresh());
//! ```

use crate::primitives::sync::{AtomicUsize, CachePadded, Ordering, UnsafeCell};
use crate::time::Nanos;
use std::marker::PhantomData;
use std::sync::Arc;

/// Set in [`Shared::in_flight`] when the slot holds a value that the reader has not taken.
const NEW: usize = 4;
const INDEX: usize = 3;

/// A value with its version, counting from 1, and the time that it was published at.
pub(crate) struct Stamped<T> {
    pub(crate) value: T,
    pub(crate) version: u64,
    pub(crate) published: Nanos,
}

impl<T> Stamped<T> {
    /// What is there before the first publication.
    pub(crate) fn initial(value: T) -> Self {
        Self { value, version: 0, published: Nanos::ZERO }
    }
}

type Slot<T> = CachePadded<UnsafeCell<Stamped<T>>>;

struct Shared<T> {
    slots: [Slot<T>; 3],
    /// The index of the slot that neither side owns, and [`NEW`].
    in_flight: CachePadded<AtomicUsize>,
    #[cfg(all(test, loom))]
    ordering: Ordering,
}

// SAFETY: a slot is reached only by the side that owns its index, and indices change hands by an atomic swap; the value
// itself crosses threads, hence `T: Send`.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// Fills the slots where they are to stay: three of them on the way there are more than the stack of a thread may
    /// hold. An `init` that panics leaves the values before it undropped.
    fn in_place(mut init: impl FnMut() -> T) -> Arc<Self> {
        let shared = Arc::<Self>::new_uninit();
        // Nobody else has it yet.
        let place = Arc::as_ptr(&shared).cast::<Self>().cast_mut();
        for index in 0..3 {
            // SAFETY: the place is that of a slot, ours alone, and is written once.
            unsafe { fill(&raw mut (*place).slots[index], &mut init) };
        }
        // SAFETY: as above; with these fields all of them are written.
        unsafe {
            (&raw mut (*place).in_flight).write(CachePadded(AtomicUsize::new(1)));
            #[cfg(all(test, loom))]
            (&raw mut (*place).ordering).write(Ordering::AcqRel);
            shared.assume_init()
        }
    }

    /// Puts `slot` in flight and returns the slot that was.
    ///
    /// Release: the other side's swap, which takes the slot, sees all that was written to it (the writer's value; the
    /// reader's last use of the slot before the writer overwrites it). Acquire: the same for the slot that comes back.
    fn swap(&self, slot: usize) -> usize {
        #[cfg(all(test, loom))]
        let ordering = self.ordering;
        #[cfg(not(all(test, loom)))]
        let ordering = Ordering::AcqRel;
        self.in_flight.swap(slot, ordering)
    }
}

/// Makes an exchange whose three slots are filled by `init`.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn exchange<T: Send>(init: impl FnMut() -> T) -> (ExchangeWriter<T>, ExchangeReader<T>) {
    pair(Shared::in_place(init))
}

/// Writes a slot into its place, with a frame of its own: what the compiler keeps on the stack for it is one value.
#[inline(never)]
unsafe fn fill<T>(place: *mut Slot<T>, init: &mut impl FnMut() -> T) {
    // SAFETY: the caller owns the place.
    #[cfg(loom)]
    unsafe {
        place.write(CachePadded(UnsafeCell::new(Stamped::initial(init()))));
    }
    // Field by field: without optimization each of the wrappers would be a further copy on the stack.
    #[cfg(not(loom))]
    // SAFETY: the caller owns the place, and no field is read or dropped. The padding wraps one field, which begins
    // where it does, and the cell is transparent.
    unsafe {
        let stamped = place.cast::<Stamped<T>>();
        (&raw mut (*stamped).value).write(init());
        (&raw mut (*stamped).version).write(0);
        (&raw mut (*stamped).published).write(Nanos::ZERO);
    }
}

fn pair<T>(shared: Arc<Shared<T>>) -> (ExchangeWriter<T>, ExchangeReader<T>) {
    let writer = ExchangeWriter { shared: Arc::clone(&shared), slot: 0, version: 0 };
    (writer, ExchangeReader { shared, slot: 2, lends: PhantomData })
}

/// The publishing side of an [`exchange`].
pub struct ExchangeWriter<T> {
    shared: Arc<Shared<T>>,
    slot: usize,
    version: u64,
}

impl<T> ExchangeWriter<T> {
    /// The buffer to write the next value into; it holds an old value, of no particular age.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn buffer(&mut self) -> &mut T {
        // SAFETY: `slot` is ours until the next swap, and `&mut self` keeps the reference from outliving that.
        self.shared.slots[self.slot].with_mut(|slot| unsafe { &mut (*slot).value })
    }

    /// Makes the buffer the newest value and returns its version, counting from 1.
    ///
    /// # Real-time
    /// Wait-free (one atomic swap), real-time safe.
    #[inline]
    pub fn publish(&mut self, stamp: Nanos) -> u64 {
        self.publish_as(self.version + 1, stamp)
    }

    /// As [`publish`](Self::publish), with the version counted by the caller.
    #[inline]
    pub(crate) fn publish_as(&mut self, version: u64, stamp: Nanos) -> u64 {
        self.version = version;
        self.shared.slots[self.slot].with_mut(|slot| {
            // SAFETY: `slot` is ours until the swap below.
            unsafe {
                (*slot).version = version;
                (*slot).published = stamp;
            }
        });
        self.slot = self.shared.swap(self.slot | NEW) & INDEX;
        version
    }

    /// True if the reader has taken the newest value, or there is none yet: while it is false nobody has looked since.
    ///
    /// # Real-time
    /// Wait-free (one load), real-time safe.
    #[inline]
    pub fn is_taken(&self) -> bool {
        // Relaxed: nothing is read or written on the strength of it.
        self.shared.in_flight.load(Ordering::Relaxed) & NEW == 0
    }
}

impl_debug!(ExchangeWriter<T>, "version": |own| own.version);

/// The reading side of an [`exchange`]. It owns its buffer until the next successful refresh.
///
/// It lends out its value, so threads may share it only if they may share that: a `Cell` can go from thread to thread
/// through an exchange, and cannot be looked at by two.
///
/// ```compile_fail,E0277
/// fn share_between_threads<T: Sync>(_: &T) {}
///
/// let (_, reader) = palpate_runtime::exchange::exchange(|| std::cell::Cell::new(0));
/// share_between_threads(&reader);
/// ```
pub struct ExchangeReader<T> {
    shared: Arc<Shared<T>>,
    slot: usize,
    /// A reader is `Sync` where `T` is. What is shared would be so with `T: Send` alone, which is all that a hand-over
    /// needs.
    lends: PhantomData<T>,
}

impl<T> ExchangeReader<T> {
    /// Takes the newest value if there is one that was not taken yet; returns whether there was.
    ///
    /// # Real-time
    /// Wait-free (one load, at most one atomic swap), real-time safe.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        // Only this side clears NEW, so a slot seen as new is still new, or newer, when it is swapped.
        if !self.has_news() {
            return false;
        }
        self.slot = self.shared.swap(self.slot) & INDEX;
        true
    }

    /// True if there is a value that was not taken yet.
    #[inline]
    pub(crate) fn has_news(&self) -> bool {
        // Relaxed: only a hint whether to swap; the swap synchronises with the publication.
        self.shared.in_flight.load(Ordering::Relaxed) & NEW != 0
    }

    /// The value of the last refresh, or the initial value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn get(&self) -> &T {
        &self.held().value
    }

    /// The value of the last refresh, to change or to swap out: the reader owns the buffer until the next refresh.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn get_mut(&mut self) -> &mut T {
        &mut self.held_mut().value
    }

    /// Takes over what the reader of another exchange holds, with its version and its stamp; that one gets ours.
    ///
    /// # Real-time
    /// Wait-free, real-time safe: it moves two values.
    pub(crate) fn adopt(&mut self, other: &mut Self) {
        std::mem::swap(self.held_mut(), other.held_mut());
    }

    /// The version of the value, counting from 1; 0 before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn version(&self) -> u64 {
        self.held().version
    }

    /// The stamp that the value was published with; zero before the first.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn published(&self) -> Nanos {
        self.held().published
    }

    #[inline]
    pub(crate) fn held(&self) -> &Stamped<T> {
        // SAFETY: `slot` is ours until the next swap, which needs `&mut self`.
        self.shared.slots[self.slot].with(|slot| unsafe { &*slot })
    }

    #[inline]
    pub(crate) fn held_mut(&mut self) -> &mut Stamped<T> {
        // SAFETY: `slot` is ours until the next swap, and `&mut self` keeps the reference from outliving that.
        self.shared.slots[self.slot].with_mut(|slot| unsafe { &mut *slot })
    }
}

impl_debug!(ExchangeReader<T>, "version": |own| own.version());

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn the_reader_gets_the_newest_value_once() {
        let (mut writer, mut reader) = exchange(|| 0);
        // Check that nothing is new before the first publication
        assert!(!reader.refresh() && writer.is_taken());
        assert_eq!((*reader.get(), reader.version()), (0, 0));
        for value in [10, 20, 30] {
            *writer.buffer() = value;
            writer.publish(Nanos(value));
        }
        // Check that older values are skipped and the newest is taken once
        assert!(!writer.is_taken() && reader.refresh() && writer.is_taken());
        assert_eq!((*reader.get(), reader.version(), reader.published()), (30, 3, Nanos(30)));
        assert!(!reader.refresh());
        assert_eq!(*reader.get(), 30);
    }

    #[test]
    fn what_may_be_sent_goes_through_and_what_may_be_shared_is_shared() {
        fn send<T: Send>(_: &T) {}
        fn sync<T: Sync>(_: &T) {}
        // Check that a value need not be shareable to be handed over; that such a reader cannot be shared does not
        // compile
        let (writer, reader) = exchange(|| std::cell::Cell::new(0));
        send(&writer);
        send(&reader);
        let (writer, reader) = exchange(|| 0);
        sync(&writer);
        sync(&reader);
    }

    // Check that no slot is dropped before its time, and each once.
    #[test]
    fn every_slot_is_dropped_once() {
        let one = Arc::new(());
        let halves = exchange(|| Arc::clone(&one));
        assert_eq!(Arc::strong_count(&one), 4);
        drop(halves);
        assert_eq!(Arc::strong_count(&one), 1);
    }

    #[test]
    fn boxes_can_be_swapped_out_through_the_reader() {
        let (mut writer, mut reader) = exchange(|| Box::new(0));
        **writer.buffer() = 5;
        writer.publish(Nanos::ZERO);
        let mut mine = Box::new(9);
        assert!(reader.refresh());
        std::mem::swap(&mut mine, reader.get_mut());
        // Check that each side holds what the other had
        assert_eq!((*mine, **reader.get()), (5, 9));
    }

    #[test]
    fn a_value_is_never_torn_between_two_threads() {
        const LAST: u64 = 20_000;
        let (mut writer, mut reader) = exchange(|| [0_u64; 64]);
        let thread = std::thread::spawn(move || {
            for n in 1..=LAST {
                writer.buffer().fill(n);
                writer.publish(Nanos(n));
            }
        });
        let mut version = 0;
        while version < LAST {
            if reader.refresh() {
                // Check that versions grow and that value, version and stamp belong together
                assert!(reader.version() > version);
                version = reader.version();
                assert!(reader.get().iter().all(|&x| x == version));
                assert_eq!(reader.published(), Nanos(version));
            }
            std::thread::yield_now();
        }
        thread.join().unwrap();
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;
    use crate::primitives::sync::check;

    fn model(ordering: Ordering) {
        check(move || {
            let mut shared = Shared::in_place(|| 0);
            Arc::get_mut(&mut shared).unwrap().ordering = ordering;
            let (mut writer, mut reader) = pair(shared);
            let thread = loom::thread::spawn(move || {
                for n in 1..=3 {
                    *writer.buffer() = n;
                    writer.publish(Nanos(n));
                }
            });
            let mut version = 0;
            for _ in 0..3 {
                if reader.refresh() {
                    assert!(reader.version() > version);
                    version = reader.version();
                }
                assert_eq!(*reader.get(), version);
                *reader.get_mut() = version;
            }
            thread.join().unwrap();
            reader.refresh();
            assert_eq!((*reader.get(), reader.version()), (3, 3));
        });
    }

    #[test]
    fn loom_every_interleaving_hands_over_whole_values() {
        model(Ordering::AcqRel);
    }

    #[test]
    #[should_panic(expected = "Causality violation")]
    fn loom_catches_a_relaxed_exchange() {
        model(Ordering::Relaxed);
    }
}
