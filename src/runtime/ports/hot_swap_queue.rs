//! The receiving half of a queue on threads: it drains the ring of a sender whose place was taken before it goes on to the
//! next, so that no sample is lost with its sender.

use crate::ports::hot_swap::Swappable;
use crate::primitives::ring::Consumer;

/// A sample with the number of the attempt that sent it: numbers go on from ring to ring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbered<T> {
    pub(crate) number: u64,
    pub(crate) value: T,
}

/// A receiving half that outlives its sender.
#[derive(Debug)]
pub(crate) struct SwappableConsumer<T> {
    link: Swappable<Consumer<Numbered<T>>>,
    /// The ring before, as long as samples are left in it.
    previous: Option<Consumer<Numbered<T>>>,
}

impl<T: Copy> SwappableConsumer<T> {
    pub(crate) fn new(link: Swappable<Consumer<Numbered<T>>>) -> Self {
        Self { link, previous: None }
    }

    /// The number of the newest sample in the ring in force, if it has any; a ring that is drained is left here, and
    /// only here.
    pub(crate) fn newest(&mut self) -> Option<u64> {
        if let Some(drained) = self.previous.take_if(|previous| previous.available() == 0) {
            self.link.give_back(drained);
        }
        if self.previous.is_none() {
            self.take_delivery();
        }
        self.in_force().newest().map(|sample| sample.number)
    }

    /// The oldest sample, if its number is at most `up_to`; left in the queue.
    pub(crate) fn peek(&mut self, up_to: u64) -> Option<T> {
        self.in_force().peek().filter(|sample| sample.number <= up_to).map(|sample| sample.value)
    }

    /// Takes the oldest sample, if its number is at most `up_to`.
    pub(crate) fn pop(&mut self, up_to: u64) -> Option<T> {
        let value = self.peek(up_to)?;
        self.in_force().pop();
        Some(value)
    }

    fn in_force(&mut self) -> &mut Consumer<Numbered<T>> {
        self.previous.as_mut().unwrap_or(self.link.half_mut())
    }

    fn take_delivery(&mut self) {
        let Some(fresh) = self.link.delivery() else { return };
        let mut replaced = self.link.replace(fresh);
        match replaced.available() {
            0 => self.link.give_back(replaced),
            _ => self.previous = Some(replaced),
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::ports::hot_swap::swappable;
    use crate::primitives::ring::{Producer, ring};

    fn send(producer: &mut Producer<Numbered<u64>>, numbers: impl IntoIterator<Item = u64>) {
        for number in numbers {
            assert!(producer.push(Numbered { number, value: 10 * number }));
        }
    }

    fn take(consumer: &mut SwappableConsumer<u64>) -> Vec<u64> {
        let Some(newest) = consumer.newest() else { return Vec::new() };
        std::iter::from_fn(|| consumer.pop(newest)).collect()
    }

    #[test]
    fn what_a_fenced_sender_left_comes_before_what_the_next_one_sends() {
        let (mut first, consumer) = ring(8);
        let (link, mut swapper) = swappable(consumer);
        let mut consumer = SwappableConsumer::new(link);
        send(&mut first, 1..=2);
        assert_eq!(take(&mut consumer), [10, 20]);
        send(&mut first, 3..=4);
        let (mut second, next) = ring(8);
        swapper.deliver(next);
        send(&mut second, 5..=6);
        // Check that a look is one fact: here of the old ring, then of the new one
        assert_eq!(take(&mut consumer), [30, 40]);
        assert_eq!(take(&mut consumer), [50, 60]);
        // Check that nothing comes from a ring that was left
        send(&mut first, [7]);
        assert_eq!(take(&mut consumer), [] as [u64; 0]);
        // Check that further deliveries come through, also while a ring is being drained
        send(&mut second, [8]);
        let (mut third, next) = ring(8);
        swapper.deliver(next);
        assert_eq!(consumer.newest(), Some(8));
        send(&mut third, [9]);
        let (_fourth, next) = ring(8);
        swapper.deliver(next);
        assert_eq!(consumer.pop(8), Some(80));
        assert_eq!((take(&mut consumer), take(&mut consumer)), (vec![90], vec![]));
    }

    #[test]
    fn a_look_bounds_what_is_taken() {
        let (mut producer, consumer) = ring(8);
        let mut consumer = SwappableConsumer::new(swappable(consumer).0);
        send(&mut producer, [1, 3]);
        assert_eq!(consumer.newest(), Some(3));
        send(&mut producer, [4]);
        assert_eq!(
            (consumer.peek(3), consumer.pop(3), consumer.pop(3), consumer.pop(3)),
            (Some(10), Some(10), Some(30), None)
        );
    }
}
