//! A half of a port whose other half can be made anew while this one stays: how a restarted group is connected again.
//!
//! The surviving half belongs to a group that may be real-time, the fresh half is made by the supervisor. It travels
//! through an [exchange](crate::exchange), and the half that it replaces travels back in the slot that it came in, so that
//! the surviving side is wait-free and frees nothing.
//!
//! Nothing that was published or sent before is lost on the way: what the surviving half has in hand goes over into the
//! fresh one.

use crate::primitives::exchange::{ExchangeReader, ExchangeWriter, exchange};
use crate::primitives::ring::Producer;
use crate::time::Nanos;

/// What travels between the supervisor and the surviving half.
#[derive(Debug)]
struct Parcel<H> {
    fresh: Option<H>,
    /// What the fresh half has replaced, to be freed by the supervisor.
    replaced: Option<H>,
}

/// The surviving half, of type `H`.
#[derive(Debug)]
pub(crate) struct Swappable<H> {
    half: H,
    inbox: ExchangeReader<Parcel<H>>,
}

/// The supervisor's end: delivers fresh halves.
#[derive(Debug)]
pub(crate) struct Swapper<H> {
    inbox: ExchangeWriter<Parcel<H>>,
}

/// Makes `half` replaceable.
pub(crate) fn swappable<H: Send>(half: H) -> (Swappable<H>, Swapper<H>) {
    let (writer, reader) = exchange(|| Parcel { fresh: None, replaced: None });
    (Swappable { half, inbox: reader }, Swapper { inbox: writer })
}

impl<H> Swappable<H> {
    /// The half in force: the one delivered last. When one has come, `hand_over` moves what the old half, its first
    /// argument, has in hand to the fresh one.
    ///
    /// # Real-time
    /// Wait-free, real-time safe: one load, and once per restart an atomic swap and what `hand_over` does.
    #[inline]
    pub(crate) fn current(&mut self, hand_over: impl FnOnce(&mut H, &mut H)) -> &mut H {
        if let Some(mut fresh) = self.delivery() {
            hand_over(&mut self.half, &mut fresh);
            let replaced = self.replace(fresh);
            self.give_back(replaced);
        }
        &mut self.half
    }

    /// The half in use, without a look at the inbox.
    #[inline]
    pub(crate) fn half(&self) -> &H {
        &self.half
    }

    /// As [`half`](Self::half), to change.
    #[inline]
    pub(crate) fn half_mut(&mut self) -> &mut H {
        &mut self.half
    }

    /// True if a half has come that is not in force yet.
    pub(crate) fn has_delivery(&self) -> bool {
        self.inbox.has_news()
    }

    /// The half that has come, if one has.
    #[inline]
    pub(crate) fn delivery(&mut self) -> Option<H> {
        if self.inbox.refresh() { self.inbox.get_mut().fresh.take() } else { None }
    }

    /// Puts `fresh` in force; what it replaces has to be [given back](Self::give_back) before the next delivery is
    /// taken.
    pub(crate) fn replace(&mut self, fresh: H) -> H {
        std::mem::replace(&mut self.half, fresh)
    }

    /// Leaves what a delivery has replaced to the supervisor, who frees it when it delivers again.
    pub(crate) fn give_back(&mut self, replaced: H) {
        // Nothing is there to be dropped: the supervisor empties a slot before it is sent.
        self.inbox.get_mut().replaced = Some(replaced);
    }
}

impl<T> Swappable<ExchangeWriter<T>> {
    /// Publishes the buffer to the reader that is there now, also if that one has come since the buffer was handed out.
    ///
    /// # Real-time
    /// Wait-free, real-time safe; once per restart of the reader it moves the value from one buffer into another.
    #[inline]
    pub(crate) fn publish_as(&mut self, version: u64, stamp: Nanos) {
        let half = self.current(|old, fresh| std::mem::swap(old.buffer(), fresh.buffer()));
        half.publish_as(version, stamp);
    }
}

impl<T> Swappable<ExchangeReader<T>> {
    /// Takes the newest value, the last one of a writer whose place was taken included; what was taken before stays
    /// until there is another.
    ///
    /// # Real-time
    /// Wait-free, real-time safe; once per restart of the writer it moves the value from one buffer into another.
    #[inline]
    pub(crate) fn refresh(&mut self) -> bool {
        let mut last = false;
        let half = self.current(|old, fresh| {
            last = old.refresh();
            fresh.adopt(old);
        });
        half.refresh() || last
    }
}

impl<T: Copy> Swappable<Producer<T>> {
    /// Sends a value to the consumer that is there now; false if its ring is full.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[inline]
    pub(crate) fn push(&mut self, value: T) -> bool {
        self.current(|_, _| ()).push(value)
    }
}

impl<H> Swapper<H> {
    /// Delivers `fresh`; returns the half that was delivered before if nobody has taken it.
    pub(crate) fn deliver(&mut self, fresh: H) -> Option<H> {
        self.inbox.buffer().fresh = Some(fresh);
        self.inbox.publish(Nanos::ZERO);
        // The slot that comes back holds what was not taken, or what was replaced by what was.
        let back = self.inbox.buffer();
        back.replaced = None;
        back.fresh.take()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::primitives::ring::ring;
    use std::sync::Arc;

    #[test]
    fn the_newest_delivery_is_in_force_and_replaced_halves_come_back() {
        let (mut port, mut swapper) = swappable(Arc::new(0));
        let current = |port: &mut Swappable<Arc<i32>>| **port.current(|_, _| ());
        assert_eq!(current(&mut port), 0);
        assert_eq!(swapper.deliver(Arc::new(1)), None);
        let newest = Arc::new(2);
        // Check that what nobody took goes back to whoever delivered it
        assert_eq!(swapper.deliver(Arc::clone(&newest)), Some(Arc::new(1)));
        assert_eq!(**port.half(), 0);
        assert_eq!(current(&mut port), 2);
        assert_eq!(swapper.deliver(Arc::new(3)), None);
        assert_eq!(current(&mut port), 3);
        // Check that the replaced half is not freed where it was used, but by a later delivery
        assert_eq!(Arc::strong_count(&newest), 2);
        for n in 4..6 {
            assert_eq!(swapper.deliver(Arc::new(n)), None);
            assert_eq!(current(&mut port), n);
        }
        assert_eq!(Arc::strong_count(&newest), 1);
    }

    #[test]
    fn what_is_in_a_buffer_when_the_reader_changes_is_published_to_the_new_one() {
        let (writer, _old) = exchange(|| 0);
        let (mut writer, mut swapper) = swappable(writer);
        *writer.half_mut().buffer() = 7;
        let (fresh, mut reader) = exchange(|| 0);
        swapper.deliver(fresh);
        writer.publish_as(5, Nanos(9));
        assert!(reader.refresh());
        assert_eq!((*reader.get(), reader.version(), reader.published()), (7, 5, Nanos(9)));
    }

    #[test]
    fn a_reader_keeps_its_value_when_the_writer_changes_and_takes_the_last_one_of_the_old() {
        let (mut old, reader) = exchange(|| 0);
        let (mut reader, mut swapper) = swappable(reader);
        for (value, deliver) in [(1, false), (2, true)] {
            *old.buffer() = value;
            old.publish_as(value, Nanos(value));
            if deliver {
                break;
            }
            assert!(reader.refresh());
        }
        let (mut fresh, fresh_reader) = exchange(|| 0);
        swapper.deliver(fresh_reader);
        // Check that what the old writer published last is taken, once, and stays
        assert_eq!((reader.refresh(), reader.refresh()), (true, false));
        assert_eq!((*reader.half().get(), reader.half().version(), reader.half().published()), (2, 2, Nanos(2)));
        *fresh.buffer() = 3;
        fresh.publish_as(3, Nanos(3));
        assert!(reader.refresh());
        assert_eq!((*reader.half().get(), reader.half().version()), (3, 3));
    }

    #[test]
    fn a_sender_whose_receiver_changes_all_the_time_keeps_its_order_and_its_link() {
        const LAST: u64 = 20_000;
        let (producer, mut consumer) = ring(4);
        let (mut producer, mut swapper) = swappable(producer);
        let thread = std::thread::spawn(move || {
            (1..=LAST).for_each(|n| {
                producer.push(n);
                if n % 64 == 0 {
                    std::thread::yield_now();
                }
            });
            producer
        });
        let mut last = 0;
        while !thread.is_finished() {
            while let Some(n) = consumer.pop() {
                assert!(n > last);
                last = n;
            }
            let (fresh, next) = ring(4);
            swapper.deliver(fresh);
            consumer = next;
        }
        let mut producer = thread.join().unwrap();
        // Check that the link still stands, with room for a value
        while consumer.pop().is_some() {}
        assert!(producer.push(LAST + 1));
        assert_eq!(std::iter::from_fn(|| consumer.pop()).last(), Some(LAST + 1));
    }
}

#[cfg(all(test, loom))]
mod loom_tests {
    use super::*;
    use crate::primitives::sync::check;

    #[test]
    fn loom_the_publication_after_two_deliveries_reaches_the_newest_reader() {
        check(|| {
            let (writer, _old) = exchange(|| 0_u64);
            let (mut writer, mut swapper) = swappable(writer);
            let thread = loom::thread::spawn(move || {
                for n in 1..=2 {
                    *writer.half_mut().buffer() = n;
                    writer.publish_as(n, Nanos(n));
                }
                writer
            });
            let (first, _untaken) = exchange(|| 0_u64);
            swapper.deliver(first);
            let (second, mut reader) = exchange(|| 0_u64);
            swapper.deliver(second);
            if reader.refresh() {
                assert_eq!(*reader.get(), reader.version());
            }
            let mut writer = thread.join().unwrap();
            *writer.half_mut().buffer() = 3;
            writer.publish_as(3, Nanos(3));
            assert!(reader.refresh());
            assert_eq!((*reader.get(), reader.version()), (3, 3));
        });
    }
}
