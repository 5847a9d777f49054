//! A wait-free single-producer single-consumer ring for values that all count, in order.
//!
//! A full ring drops the new value and counts it; it never waits. Each side caches the other's index and reads the
//! shared one only when the cached one says full or empty, so that a push and a pop usually touch one shared line each
//! (as in Rigtorp's SPSCQueue and in rtrb).
//!
//! ```
//! let (mut producer, mut consumer) = palpate_runtime::ring::ring(3);
//! assert_eq!(consumer.capacity(), 4);
//! assert!(producer.push(7));
//! assert_eq!((consumer.peek(), consumer.pop(), consumer.pop()), (Some(7), Some(7), None));
//! ```

use crate::primitives::sync::{AtomicU64, AtomicUsize, CachePadded, Ordering, UnsafeCell};
use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::mem::MaybeUninit;
use std::ptr::NonNull;
use std::sync::Arc;

/// How many bytes ahead of the slot in hand the producer fetches a line: about what a tick writes into one ring, so that
/// the lines of a tick, which the reader or the memory has by then, are there when it begins. Measured: 15 ns of 60 a
/// tick.
const WRITE_AHEAD: usize = 256;
/// How many bytes ahead the consumer fetches one: its lines come from the other core's cache, which takes as long as to
/// read some lines of words.
const READ_AHEAD: usize = 512;
/// What the processor fetches at once.
const LINE: usize = 64;

/// A place for a value.
struct Slot<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: slots in head..tail are read by the consumer only, the others are written by the producer only, and the
// indices that move this border are atomics; values cross threads, hence `T: Send`.
unsafe impl<T: Send> Sync for Slot<T> {}
// SAFETY: as above; a value in a slot is a value.
unsafe impl<T: Send> Send for Slot<T> {}

/// The memory of a ring's slots, which begins with a cache line: a value as large as a line then lies in one.
struct Buffer<T> {
    start: NonNull<Slot<T>>,
    len: usize,
}

// SAFETY: it owns slots, and nothing is reached through it but by the two sides; see `Slot`.
unsafe impl<T: Send> Send for Buffer<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Buffer<T> {}

impl<T> Buffer<T> {
    fn layout(len: usize) -> Layout {
        let slots = Layout::array::<Slot<T>>(len).and_then(|slots| slots.align_to(align_of::<CachePadded<()>>()));
        slots.unwrap_or_else(|_| panic!("a ring of {len} values is larger than any memory"))
    }

    fn new(len: usize) -> Self {
        let layout = Self::layout(len);
        if layout.size() == 0 {
            return Self { start: NonNull::dangling(), len };
        }
        // SAFETY: the size is not zero.
        let memory = unsafe { alloc(layout) }.cast::<Slot<T>>();
        let Some(start) = NonNull::new(memory) else { handle_alloc_error(layout) };
        for index in 0..len {
            // SAFETY: inside of what was allocated, and nobody else has it yet. Volatile: where memory is not locked, a
            // page that nothing was written to would be faulted in by the first push to it, and the compiler may leave
            // out a write that nothing reads.
            unsafe {
                let slot = start.add(index);
                slot.write(Slot(UnsafeCell::new(MaybeUninit::uninit())));
                slot.as_ref().0.with_mut(|slot| slot.write_volatile(MaybeUninit::zeroed()));
            }
        }
        Self { start, len }
    }
}

impl<T> Drop for Buffer<T> {
    fn drop(&mut self) {
        let layout = Self::layout(self.len);
        // SAFETY: both sides are gone, the slots were all written, and the memory came with this layout.
        unsafe {
            NonNull::slice_from_raw_parts(self.start, self.len).drop_in_place();
            if layout.size() > 0 {
                dealloc(self.start.as_ptr().cast(), layout);
            }
        }
    }
}

/// The slots of a ring. Each side has their address of its own: to fetch it from what both share costs a cache miss in
/// a tick that begins cold.
struct Slots<T> {
    start: NonNull<Slot<T>>,
    /// A power of two.
    len: usize,
    buffer: Arc<Buffer<T>>,
}

// SAFETY: as for the buffer that it keeps.
unsafe impl<T: Send> Send for Slots<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Slots<T> {}

struct Shared {
    /// Values taken so far, wrapping; written by the consumer.
    head: CachePadded<AtomicUsize>,
    /// Values pushed so far, wrapping; written by the producer.
    tail: CachePadded<AtomicUsize>,
    /// Values dropped because the ring was full; written by the producer.
    lost: CachePadded<AtomicU64>,
    #[cfg(all(test, loom))]
    release: Ordering,
}

impl<T> Slots<T> {
    fn new(capacity: usize) -> Self {
        let buffer = Arc::new(Buffer::new(rounded(capacity)));
        Self { start: buffer.start, len: buffer.len, buffer }
    }

    #[inline]
    fn len(&self) -> usize {
        self.len
    }

    #[inline]
    fn at(&self, index: usize) -> &UnsafeCell<MaybeUninit<T>> {
        // SAFETY: the index is masked to what was allocated and written, which lives as long as `buffer`.
        unsafe { &self.start.add(index & (self.len - 1)).as_ref().0 }
    }

    fn share(&self) -> Self {
        Self { start: self.start, len: self.len, buffer: Arc::clone(&self.buffer) }
    }
}

/// Asks for the cache lines of slots before their turn comes; nothing waits for them. Each side asks only for slots that
/// are its own by the index of the other that it knows: a line fetched from under the other side's hands has to travel
/// back, and that costs a stream between two cores more than the fetch saves.
#[derive(Clone, Copy)]
struct Prefetch {
    /// Whether the processor knows how to fetch a line as its owner. A line fetched to be shared would be of no use to
    /// the producer: its write would have to wait for the other core after all.
    to_own: bool,
}

impl Prefetch {
    fn new() -> Self {
        #[cfg(all(target_arch = "x86_64", not(loom), not(miri)))]
        let to_own = {
            use core::arch::x86_64::__cpuid;
            // PREFETCHW, as AMD and Intel document it.
            __cpuid(0x8000_0000).eax >= 0x8000_0001 && __cpuid(0x8000_0001).ecx & 1 << 8 != 0
        };
        #[cfg(not(all(target_arch = "x86_64", not(loom), not(miri))))]
        let to_own = false;
        Self { to_own }
    }

    /// How many slots ahead of `index` to fetch what lies `bytes` ahead; `None` but for one slot in a line.
    #[inline]
    fn ahead<T>(index: usize, bytes: usize) -> Option<usize> {
        let size = const { if size_of::<T>() == 0 { LINE } else { size_of::<T>() } };
        // A power of two, rounded down: slots that do not fill lines evenly are asked for a little more often.
        let in_line = if size < LINE { 1 << (LINE / size).ilog2() } else { 1 };
        (index & (in_line - 1) == 0).then_some(bytes.div_ceil(size))
    }

    #[inline]
    fn to_write<T>(self, slot: &UnsafeCell<MaybeUninit<T>>) {
        #[cfg(all(target_arch = "x86_64", not(loom), not(miri)))]
        if self.to_own {
            slot.with(|slot| {
                // SAFETY: a hint that the processor knows; it reads and writes nothing, and the address is a slot's.
                unsafe { core::arch::asm!("prefetchw [{}]", in(reg) slot, options(nostack, preserves_flags)) };
            });
        }
        #[cfg(not(all(target_arch = "x86_64", not(loom), not(miri))))]
        let _ = (self.to_own, slot);
    }

    #[inline]
    fn to_read<T>(slot: &UnsafeCell<MaybeUninit<T>>) {
        #[cfg(all(target_arch = "x86_64", not(loom), not(miri)))]
        slot.with(|slot| {
            use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: a hint that every processor of this kind knows; the address is a slot's.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(slot.cast()) };
        });
        #[cfg(not(all(target_arch = "x86_64", not(loom), not(miri))))]
        let _ = slot;
    }
}

impl Shared {
    fn new() -> Self {
        Self {
            head: CachePadded(AtomicUsize::new(0)),
            tail: CachePadded(AtomicUsize::new(0)),
            lost: CachePadded(AtomicU64::new(0)),
            #[cfg(all(test, loom))]
            release: Ordering::Release,
        }
    }

    /// The ordering of a store that hands slots over; loom's tests weaken it to see that they notice.
    fn release(&self) -> Ordering {
        #[cfg(all(test, loom))]
        return self.release;
        #[cfg(not(all(test, loom)))]
        Ordering::Release
    }
}

/// The capacity that a ring asked for `capacity` gets: the next power of two.
pub(crate) fn rounded(capacity: usize) -> usize {
    capacity.max(1).next_power_of_two()
}

/// Makes a ring for at least `capacity` values, rounded up to a power of two.
///
/// # Real-time
/// Not real-time safe: allocates.
pub fn ring<T: Copy + Send>(capacity: usize) -> (Producer<T>, Consumer<T>) {
    pair(Slots::new(capacity), Shared::new())
}

fn pair<T>(slots: Slots<T>, shared: Shared) -> (Producer<T>, Consumer<T>) {
    let shared = Arc::new(shared);
    (
        Producer { slots: slots.share(), shared: Arc::clone(&shared), tail: 0, head: 0, prefetch: Prefetch::new() },
        Consumer { slots, shared, head: 0, tail: 0 },
    )
}

/// The pushing side of a [`ring`].
pub struct Producer<T> {
    slots: Slots<T>,
    shared: Arc<Shared>,
    tail: usize,
    /// The consumer's index when it was last read: never ahead of the true one.
    head: usize,
    prefetch: Prefetch,
}

impl<T: Copy> Producer<T> {
    /// Appends a value; false if the ring is full: the value is then dropped and counted.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn push(&mut self, value: T) -> bool {
        if self.tail.wrapping_sub(self.head) == self.slots.len() {
            // Acquire: with the consumer's release of `head`, so that its read of the slot is over before we overwrite.
            self.head = self.shared.head.load(Ordering::Acquire);
            if self.tail.wrapping_sub(self.head) == self.slots.len() {
                // No read-modify-write: this is its only writer. Release: with the acquire in `sums`, so that a loss is
                // not seen before the pushes that came before it.
                self.shared.lost.store(self.shared.lost.load(Ordering::Relaxed) + 1, Ordering::Release);
                return false;
            }
        }
        self.slots.at(self.tail).with_mut(|slot| {
            // SAFETY: the slot is outside head..tail, so the consumer does not touch it until `tail` is stored.
            unsafe { (*slot).write(value) };
        });
        self.tail = self.tail.wrapping_add(1);
        if let Some(ahead) = Prefetch::ahead::<T>(self.tail, WRITE_AHEAD)
            && self.tail.wrapping_sub(self.head) + ahead < self.slots.len()
        {
            self.prefetch.to_write(self.slots.at(self.tail.wrapping_add(ahead)));
        }
        // Release: with the consumer's acquire of `tail`, so that it sees the value just written.
        self.shared.tail.store(self.tail, self.shared.release());
        true
    }
}

impl_debug!(Producer<T>, "capacity": |own| own.slots.len());

/// What a producer has done up to one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sums {
    /// Values pushed in all.
    pub(crate) pushed: u64,
    /// Values lost because the ring was full.
    pub(crate) lost: u64,
    /// Values pushed and not taken.
    pub(crate) left: usize,
}

/// The taking side of a [`ring`].
pub struct Consumer<T> {
    slots: Slots<T>,
    shared: Arc<Shared>,
    head: usize,
    /// The producer's index when it was last read: never ahead of the true one.
    tail: usize,
}

impl<T: Copy> Consumer<T> {
    /// The oldest value, left in the ring.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn peek(&mut self) -> Option<T> {
        if self.head == self.tail {
            // Acquire: with the producer's release of `tail`, so that we see the values it wrote before.
            self.tail = self.shared.tail.load(Ordering::Acquire);
            if self.head == self.tail {
                return None;
            }
        }
        // SAFETY: the slot is inside head..tail, so it was written and the producer leaves it alone until `head` is
        // stored.
        Some(self.slots.at(self.head).with(|slot| unsafe { (*slot).assume_init() }))
    }

    /// Takes the oldest value.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub fn pop(&mut self) -> Option<T> {
        let value = self.peek()?;
        self.head = self.head.wrapping_add(1);
        if let Some(ahead) = Prefetch::ahead::<T>(self.head, READ_AHEAD)
            && ahead < self.tail.wrapping_sub(self.head)
        {
            Prefetch::to_read(self.slots.at(self.head.wrapping_add(ahead)));
        }
        // Release: with the producer's acquire of `head`, so that our read of the slot is over before it overwrites.
        self.shared.head.store(self.head, self.shared.release());
        Some(value)
    }

    /// The value pushed last, left in the ring; `None` if there is nothing to take.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub(crate) fn newest(&mut self) -> Option<T> {
        if self.available() == 0 {
            return None;
        }
        // SAFETY: as in `peek`, for the last slot of head..tail.
        Some(self.slots.at(self.tail.wrapping_sub(1)).with(|slot| unsafe { (*slot).assume_init() }))
    }

    /// What the producer has done up to one moment.
    ///
    /// # Real-time
    /// Lock-free: it looks again if a value is pushed meanwhile, which ends when the ring is full.
    pub(crate) fn sums(&mut self) -> Sums {
        loop {
            let left = self.available();
            // Acquire: with the release in `push`; a loss behind a further push lets the next look find that push.
            let lost = self.shared.lost.load(Ordering::Acquire);
            if self.available() == left {
                return Sums { pushed: self.tail as u64, lost, left };
            }
        }
    }

    /// The number of values that there are to take now.
    ///
    /// # Real-time
    /// Wait-free (one load), real-time safe.
    #[inline]
    pub fn available(&mut self) -> usize {
        // Acquire: as in `peek`.
        self.tail = self.shared.tail.load(Ordering::Acquire);
        self.tail.wrapping_sub(self.head)
    }

    /// The number of values that fit into the ring.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn capacity(&self) -> usize {
        self.slots.len()
    }

    /// Values dropped so far because the ring was full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn lost(&self) -> u64 {
        self.shared.lost.load(Ordering::Relaxed)
    }
}

impl_debug!(Consumer<T>, "capacity": |own| own.slots.len());

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::VecDeque;

    proptest! {
        #[test]
        fn a_ring_behaves_like_a_bounded_queue(capacity in 1_usize..9, pushes in prop::collection::vec(any::<bool>(), 0..200)) {
            let (mut producer, mut consumer) = ring(capacity);
            let mut queue = VecDeque::new();
            let (mut lost, mut attempts) = (0, 0);
            for (n, push) in pushes.into_iter().enumerate() {
                if push {
                    let fits = queue.len() < consumer.capacity();
                    attempts += 1;
                    prop_assert_eq!(producer.push(n), fits);
                    if fits { queue.push_back(n) } else { lost += 1 }
                } else {
                    prop_assert_eq!(consumer.peek(), queue.front().copied());
                    prop_assert_eq!(consumer.newest(), queue.back().copied());
                    prop_assert_eq!(consumer.pop(), queue.pop_front());
                }
                prop_assert_eq!(consumer.lost(), lost);
                let expected = Sums { pushed: attempts - lost, lost, left: queue.len() };
                prop_assert_eq!(consumer.sums(), expected);
            }
        }
    }

    #[test]
    fn the_slots_begin_with_a_cache_line() {
        fn begins<T: Copy + Send>() -> usize {
            Slots::<T>::new(4).start.addr().get() % 64
        }
        assert_eq!((begins::<u8>(), begins::<[u64; 8]>(), begins::<[u8; 3]>(), begins::<u128>()), (0, 0, 0, 0));
        // Check that values without a size need no memory
        let (mut producer, mut consumer) = ring(2);
        assert!(producer.push(()) && producer.push(()) && !producer.push(()));
        assert_eq!((consumer.pop(), consumer.pop(), consumer.pop()), (Some(()), Some(()), None));
    }

    #[test]
    fn a_line_is_asked_for_once_and_so_many_bytes_ahead() {
        let asked = |ahead: fn(usize, usize) -> Option<usize>| {
            let all: Vec<_> = (0..64).filter_map(|index| ahead(index, 256)).collect();
            // Check that the distance is the same everywhere
            assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
            (all.len(), all[0])
        };
        assert_eq!(asked(Prefetch::ahead::<u64>), (8, 32));
        assert_eq!(asked(Prefetch::ahead::<[u64; 3]>), (32, 11));
        assert_eq!(asked(Prefetch::ahead::<[u64; 8]>), (64, 4));
        assert_eq!(asked(Prefetch::ahead::<[u64; 100]>), (64, 1));
        assert_eq!(asked(Prefetch::ahead::<()>), (64, 4));
    }

    #[test]
    fn two_threads_see_every_value_once_and_in_order() {
        const COUNT: u64 = 50_000;
        let (mut producer, mut consumer) = ring(64);
        let thread = std::thread::spawn(move || {
            for n in 0..COUNT {
                while !producer.push(n) {
                    std::thread::yield_now();
                }
            }
        });
        let mut next = 0;
        while next < COUNT {
            match consumer.pop() {
                Some(value) => {
                    // Check that no value is missing, doubled or out of order
                    assert_eq!(value, next);
                    next += 1;
                }
                None => std::thread::yield_now(),
            }
        }
        thread.join().unwrap();
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;
    use crate::primitives::sync::check;

    fn model(release: Ordering) {
        check(move || {
            let (mut producer, mut consumer) = pair(Slots::new(2), Shared { release, ..Shared::new() });
            let thread = loom::thread::spawn(move || (1..=3_u64).filter(|&n| producer.push(n)).count());
            let mut last = 0;
            let mut taken = 0;
            let mut take = |consumer: &mut Consumer<u64>| {
                if let Some(value) = consumer.pop() {
                    assert!(value > last);
                    last = value;
                    taken += 1;
                }
            };
            take(&mut consumer);
            take(&mut consumer);
            let pushed = thread.join().unwrap();
            take(&mut consumer);
            take(&mut consumer);
            assert_eq!(taken, pushed);
            assert_eq!(pushed as u64 + consumer.lost(), 3);
        });
    }

    #[test]
    fn loom_every_interleaving_keeps_order_and_count() {
        model(Ordering::Release);
    }

    #[test]
    #[should_panic(expected = "Causality violation")]
    fn loom_catches_a_relaxed_ring() {
        model(Ordering::Relaxed);
    }
}
