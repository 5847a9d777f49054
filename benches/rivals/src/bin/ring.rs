//! The single-producer single-consumer ring against the `rtrb` crate.
//!
//!     cargo run --release --manifest-path benches/rivals/Cargo.toml --bin ring
//!
//! Values are the 64-byte records that leave real-time threads, and 8-byte words. `push, pop` does one of each in turn
//! on one thread, `32 pushes, 32 pops` fills and empties a part of the ring as a tick and its logger do, `two threads`
//! streams through a ring of 1024 from one core to another (each with a real-time priority where granted). The time is that of one value.

use palpate_runtime::ring::ring;
use palpate_runtime::{Channel, Record};
use palpate_runtime::Nanos;
use palpate_rivals::{Contestant, Effort, compete, cores, on_two_cores, print_head, print_lines};
use std::hint::black_box;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

const CAPACITY: usize = 1024;
const BURST: u64 = 32;

/// What travels: made from a number that can be read back.
trait Value: Copy + Send + 'static {
    fn make(number: u64) -> Self;
    fn number(&self) -> u64;
}

impl Value for u64 {
    fn make(number: u64) -> Self {
        number
    }
    fn number(&self) -> u64 {
        *self
    }
}

impl Value for Record {
    fn make(number: u64) -> Self {
        Self { stamp: Nanos(number), channel: Channel::FIRST_USER, code: 0, index: 0, words: [number; 6] }
    }
    fn number(&self) -> u64 {
        self.words[5]
    }
}

trait Push<T>: Send + 'static {
    fn push(&mut self, value: T) -> bool;
}

trait Pop<T>: Send + 'static {
    fn pop(&mut self) -> Option<T>;
}

impl<T: Value> Push<T> for palpate_runtime::ring::Producer<T> {
    #[inline]
    fn push(&mut self, value: T) -> bool {
        palpate_runtime::ring::Producer::push(self, value)
    }
}

impl<T: Value> Pop<T> for palpate_runtime::ring::Consumer<T> {
    #[inline]
    fn pop(&mut self) -> Option<T> {
        palpate_runtime::ring::Consumer::pop(self)
    }
}

impl<T: Value> Push<T> for rtrb::Producer<T> {
    #[inline]
    fn push(&mut self, value: T) -> bool {
        rtrb::Producer::push(self, value).is_ok()
    }
}

impl<T: Value> Pop<T> for rtrb::Consumer<T> {
    #[inline]
    fn pop(&mut self) -> Option<T> {
        rtrb::Consumer::pop(self).ok()
    }
}

/// One push and one pop in turn.
fn in_turn<T: Value>(
    name: &'static str,
    (mut producer, mut consumer): (impl Push<T>, impl Pop<T>),
) -> Contestant<'static> {
    let mut number = 0;
    Contestant::repeat(name, move || {
        number += 1;
        let pushed = producer.push(T::make(black_box(number)));
        let popped = consumer.pop().map(|value| value.number());
        assert!(pushed && popped == Some(number), "a value went wrong");
    })
}

/// Many pushes, then as many pops.
fn in_bursts<T: Value>(
    name: &'static str,
    (mut producer, mut consumer): (impl Push<T>, impl Pop<T>),
) -> Contestant<'static> {
    let run = move |count: u32| {
        let start = Instant::now();
        let mut expected = 0;
        let mut total = 0;
        for _ in 0..count {
            for number in 0..BURST {
                assert!(producer.push(T::make(black_box(number))), "a value did not fit");
                expected += number;
            }
            while let Some(value) = consumer.pop() {
                total += black_box(value).number();
            }
        }
        assert_eq!(total, expected, "a value went wrong");
        start.elapsed() / BURST as u32
    };
    Contestant { name, run: Box::new(run) }
}

/// A stream from one core to another.
fn between_threads<T: Value, P: Push<T>, C: Pop<T>>(
    name: &'static str,
    make: impl Fn() -> (P, C) + 'static,
) -> Contestant<'static> {
    let run = move |count: u32| {
        let (mut producer, mut consumer) = make();
        let took = Arc::new(Mutex::new(Duration::ZERO));
        let result = Arc::clone(&took);
        let take = move || {
            let mut start = Instant::now();
            for expected in 0..=u64::from(count) {
                let value = loop {
                    match consumer.pop() {
                        Some(value) => break value,
                        None => std::hint::spin_loop(),
                    }
                };
                assert_eq!(value.number(), expected, "a value went wrong");
                if expected == 0 {
                    // Not timed so far: the other core may have woken up later.
                    start = Instant::now();
                }
            }
            *result.lock().unwrap_or_else(PoisonError::into_inner) = start.elapsed();
        };
        let give = move || {
            for number in 0..=u64::from(count) {
                while !producer.push(T::make(number)) {
                    std::hint::spin_loop();
                }
            }
        };
        on_two_cores(take, give).expect("two threads");
        *took.lock().unwrap_or_else(PoisonError::into_inner)
    };
    Contestant { name, run: Box::new(run) }
}

const TARGET: f64 = 1.2;

fn of_value<T: Value>(effort: Effort, size: &str) {
    let ours = || ring::<T>(CAPACITY);
    let theirs = || rtrb::RingBuffer::<T>::new(CAPACITY);
    let lines = compete(effort, vec![in_turn("palpate", ours()), in_turn("rtrb", theirs())]);
    print_lines("push, pop", size, &lines, Some(TARGET));
    let lines = compete(effort, vec![in_bursts("palpate", ours()), in_bursts("rtrb", theirs())]);
    print_lines("32 pushes, 32 pops", size, &lines, Some(TARGET));
    if cores() < 2 {
        println!("| two threads | {size} | left out: one core | | | |");
        return;
    }
    let lines = compete(effort, vec![between_threads("palpate", ours), between_threads("rtrb", theirs)]);
    print_lines("two threads", size, &lines, Some(TARGET));
}

fn main() {
    let effort = Effort::from_arguments();
    println!("{} interleaved rounds; time of one value and its ratio to rtrb's, medians\n", effort.rounds);
    print_head();
    of_value::<u64>(effort, "8 B");
    of_value::<Record>(effort, "64 B");
}
