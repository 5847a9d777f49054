//! The newest-value exchange against the `triple_buffer` crate, with a mutex around two boxes beside them.
//!
//!     cargo run --release --manifest-path benches/rivals/Cargo.toml --bin exchange
//!
//! One hand-over: every word of the writer's own buffer is written in place, the buffer is published, the reader takes
//! it and adds up every word in place. All three contestants write and read the same bytes; none copies the value.
//! `one thread` does both halves in turn and so shows the cost of the code; `two threads` sends a value to another
//! thread and back through a second exchange and shows half of the round trip, which is mostly the cost of moving cache
//! lines between cores; both threads have a core of their own and, where granted, a real-time priority.

use palpate_runtime::exchange::{ExchangeReader, ExchangeWriter, exchange};
use palpate_runtime::Nanos;
use palpate_rivals::{Contestant, Effort, compete, cores, on_two_cores, print_head, print_lines};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

type Words<const N: usize> = [u64; N];

/// A writer of `N` words.
trait Send64<const N: usize>: Send + 'static {
    fn send(&mut self, fill: impl FnOnce(&mut Words<N>));
}

/// Its reader: true if there was something new, which then was read.
trait Receive64<const N: usize>: Send + 'static {
    fn receive(&mut self, read: impl FnOnce(&Words<N>)) -> bool;
}

impl<const N: usize> Send64<N> for ExchangeWriter<Words<N>> {
    #[inline]
    fn send(&mut self, fill: impl FnOnce(&mut Words<N>)) {
        fill(self.buffer());
        self.publish(Nanos(1));
    }
}

impl<const N: usize> Receive64<N> for ExchangeReader<Words<N>> {
    #[inline]
    fn receive(&mut self, read: impl FnOnce(&Words<N>)) -> bool {
        let new = self.refresh();
        if new {
            read(self.get());
        }
        new
    }
}

impl<const N: usize> Send64<N> for triple_buffer::Input<Words<N>> {
    #[inline]
    fn send(&mut self, fill: impl FnOnce(&mut Words<N>)) {
        fill(self.input_buffer_mut());
        self.publish();
    }
}

impl<const N: usize> Receive64<N> for triple_buffer::Output<Words<N>> {
    #[inline]
    fn receive(&mut self, read: impl FnOnce(&Words<N>)) -> bool {
        let new = self.update();
        if new {
            read(self.output_buffer());
        }
        new
    }
}

/// One side of the mutex variant: a box of its own, which it swaps with the one under the lock.
struct Locked<const N: usize> {
    own: Box<Words<N>>,
    shared: Arc<Mutex<(Box<Words<N>>, bool)>>,
}

impl<const N: usize> Locked<N> {
    fn pair() -> (Self, Self) {
        let empty = || Box::new([0; N]);
        let shared = Arc::new(Mutex::new((empty(), false)));
        (Self { own: empty(), shared: Arc::clone(&shared) }, Self { own: empty(), shared })
    }
}

impl<const N: usize> Send64<N> for Locked<N> {
    #[inline]
    fn send(&mut self, fill: impl FnOnce(&mut Words<N>)) {
        fill(&mut self.own);
        let mut shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::swap(&mut shared.0, &mut self.own);
        shared.1 = true;
    }
}

impl<const N: usize> Receive64<N> for Locked<N> {
    #[inline]
    fn receive(&mut self, read: impl FnOnce(&Words<N>)) -> bool {
        let mut shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        let new = std::mem::take(&mut shared.1);
        if new {
            std::mem::swap(&mut shared.0, &mut self.own);
        }
        drop(shared);
        if new {
            read(&self.own);
        }
        new
    }
}

fn sum<const N: usize>(words: &Words<N>) -> u64 {
    words.iter().fold(0, |sum, &word| sum.wrapping_add(word))
}

/// Write, publish, take, read, on this thread.
fn one_thread<const N: usize>(
    name: &'static str,
    (mut writer, mut reader): (impl Send64<N>, impl Receive64<N>),
) -> Contestant<'static> {
    let mut value = 0;
    Contestant::repeat(name, move || {
        value += 1;
        writer.send(|words| words.fill(value));
        let mut total = 0;
        let new = reader.receive(|words| total = sum(words));
        assert!(new && total == value.wrapping_mul(N as u64), "a hand-over went wrong");
    })
}

/// To another core and back; half of the round trip is reported.
fn two_threads<const N: usize, W: Send64<N>, R: Receive64<N>>(
    name: &'static str,
    make: impl Fn() -> (W, R) + 'static,
) -> Contestant<'static> {
    let run = move |count: u32| {
        let (mut there, mut received) = make();
        let (mut back, mut answered) = make();
        let took = Arc::new(Mutex::new(Duration::ZERO));
        let result = Arc::clone(&took);
        let ping = move || {
            let mut start = Instant::now();
            for value in 0..=u64::from(count) {
                there.send(|words| words.fill(value));
                let mut total = 0;
                while !answered.receive(|words| total = sum(words)) {
                    std::hint::spin_loop();
                }
                assert_eq!(total, value.wrapping_mul((N * N) as u64), "a hand-over went wrong");
                if value == 0 {
                    // Not timed so far: the other core may have woken up later.
                    start = Instant::now();
                }
            }
            *result.lock().unwrap_or_else(PoisonError::into_inner) = start.elapsed() / 2;
        };
        let pong = move || {
            for _ in 0..=count {
                let mut total = 0;
                while !received.receive(|words| total = sum(words)) {
                    std::hint::spin_loop();
                }
                back.send(|words| words.fill(total));
            }
        };
        on_two_cores(ping, pong).expect("two threads");
        *took.lock().unwrap_or_else(PoisonError::into_inner)
    };
    Contestant { name, run: Box::new(run) }
}

const TARGET: f64 = 1.1;

fn of_size<const N: usize>(effort: Effort, size: &str) {
    let ours = || exchange(|| [0; N]);
    let theirs = || triple_buffer::triple_buffer(&[0; N]);
    let lines = compete(
        effort,
        vec![
            one_thread("palpate", ours()),
            one_thread("triple_buffer", theirs()),
            one_thread("mutex", Locked::<N>::pair()),
        ],
    );
    print_lines("one thread", size, &lines, Some(TARGET));
    if cores() < 2 {
        println!("| two threads | {size} | left out: one core | | | |");
        return;
    }
    let lines = compete(
        effort,
        vec![
            two_threads("palpate", ours),
            two_threads("triple_buffer", theirs),
            two_threads("mutex", Locked::<N>::pair),
        ],
    );
    print_lines("two threads", size, &lines, Some(TARGET));
}

fn main() {
    let effort = Effort::from_arguments();
    println!("{} interleaved rounds; time of one hand-over and its ratio to triple_buffer's, medians\n", effort.rounds);
    print_head();
    of_size::<8>(effort, "64 B");
    of_size::<512>(effort, "4 kB");
    of_size::<8192>(effort, "64 kB");
}
