//! A file with a thread of its own that writes it: a slow disk, or one that never answers, holds up nobody else.
//!
//! What is given waits in memory. It is not bounded here: who gives looks at [`Backlog::waiting`] and stops in time, at a
//! place where the format allows it.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The largest piece that is written at once (bytes): progress is seen by the piece.
const PIECE_BYTES: usize = 1 << 16;
/// The writing thread needs little.
const STACK_BYTES: usize = 1 << 18;

#[derive(Debug, Default)]
struct State {
    waiting: VecDeque<Vec<u8>>,
    given: u64,
    written: u64,
    /// Nothing more will be given.
    closed: bool,
    /// The thread is gone.
    ended: bool,
    /// Why, if it was before its time; taken once.
    error: Option<io::Error>,
    failed: bool,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing that can panic half-way runs under the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }
}

/// The giving side: a [`Write`] that takes everything at once, unless writing has failed.
///
/// # Real-time
/// Not real-time safe: takes a lock and allocates. For a logger.
#[derive(Debug)]
pub struct Backlog {
    shared: Arc<Shared>,
    /// Since the last flush.
    own: Vec<u8>,
}

/// The progress of the thread that writes a [`Backlog`].
#[derive(Clone, Debug)]
pub struct BacklogProgress(Arc<Shared>);

impl Backlog {
    /// Starts the thread that writes `output`.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn new(output: impl Write + Send + 'static) -> io::Result<Self> {
        let shared = Arc::<Shared>::default();
        let end =
            End { shared: Arc::clone(&shared), result: Err(io::Error::other("the thread that writes it panicked")) };
        let thread = std::thread::Builder::new().name("log-writer".to_owned()).stack_size(STACK_BYTES);
        thread.spawn(move || write_all(end, output))?;
        Ok(Self { shared, own: Vec::new() })
    }

    /// A view of the progress of the writing, which stays valid after `self` was given away.
    pub fn progress(&self) -> BacklogProgress {
        BacklogProgress(Arc::clone(&self.shared))
    }
}

impl Write for Backlog {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.own.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let mut state = self.shared.lock();
        if state.failed {
            let gone = || io::Error::other("it was given up after an earlier error");
            return Err(state.error.take().unwrap_or_else(gone));
        }
        if !self.own.is_empty() {
            state.given += self.own.len() as u64;
            state.waiting.push_back(std::mem::take(&mut self.own));
            self.shared.changed.notify_all();
        }
        Ok(())
    }
}

impl Drop for Backlog {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.changed.notify_all();
    }
}

impl BacklogProgress {
    /// The number of bytes given that are not written yet.
    pub fn waiting(&self) -> u64 {
        let state = self.0.lock();
        state.given - state.written
    }

    /// The number of bytes given so far.
    pub fn given(&self) -> u64 {
        self.0.lock().given
    }

    /// The number of bytes that the output has taken.
    pub fn written(&self) -> u64 {
        self.0.lock().written
    }

    /// The error that ended the writing; once.
    pub fn take_error(&self) -> Option<io::Error> {
        self.0.lock().error.take()
    }

    /// Waits until at most `bytes` are waiting. False if nothing was written for `stalled`, or if `total` has passed.
    pub fn wait_for(&self, bytes: u64, stalled: Duration, total: Duration) -> bool {
        self.wait_until(stalled, total, |state| state.given - state.written <= bytes)
    }

    /// Waits until the writing thread has ended, which it does after the [`Backlog`] was dropped and all was written. False
    /// if nothing was written for `stalled`, or if `total` has passed.
    pub fn wait_for_end(&self, stalled: Duration, total: Duration) -> bool {
        self.wait_until(stalled, total, |state| state.ended)
    }

    fn wait_until(&self, stalled: Duration, total: Duration, is_over: impl Fn(&State) -> bool) -> bool {
        let begun = Instant::now();
        let mut state = self.0.lock();
        let mut progress = (state.written, begun);
        while !is_over(&state) && !state.failed {
            let now = Instant::now();
            if state.written != progress.0 {
                progress = (state.written, now);
            }
            let left = total.saturating_sub(now - begun).min(stalled.saturating_sub(now - progress.1));
            if left.is_zero() {
                return false;
            }
            state = self.0.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }
}

/// Says that the thread has ended, however it did.
struct End {
    shared: Arc<Shared>,
    result: io::Result<()>,
}

impl Drop for End {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.ended = true;
        if let Err(error) = std::mem::replace(&mut self.result, Ok(())) {
            state.failed = true;
            state.error = Some(error);
            state.waiting.clear();
        }
        self.shared.changed.notify_all();
    }
}

fn write_all(mut end: End, mut output: impl Write) {
    let shared = Arc::clone(&end.shared);
    let result = loop {
        let Some(block) = next(&shared) else { break output.flush() };
        if let Err(error) = write_block(&shared, &mut output, &block) {
            break Err(error);
        }
    };
    end.result = result;
}

fn next(shared: &Shared) -> Option<Vec<u8>> {
    let mut state = shared.lock();
    loop {
        if let Some(block) = state.waiting.pop_front() {
            return Some(block);
        }
        if state.closed {
            return None;
        }
        state = shared.wait(state);
    }
}

fn write_block(shared: &Shared, output: &mut impl Write, block: &[u8]) -> io::Result<()> {
    let mut rest = block;
    while !rest.is_empty() {
        match output.write(&rest[..rest.len().min(PIECE_BYTES)]) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => {
                rest = &rest[count..];
                shared.lock().written += count as u64;
                shared.changed.notify_all();
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    // A killed process loses nothing that was handed over.
    output.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Duration = Duration::from_secs(60);

    /// Takes a piece for every message, fails when nobody sends any more.
    struct Gated(std::sync::mpsc::Receiver<()>, Arc<Mutex<Vec<u8>>>);

    impl Write for Gated {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.recv().map_err(|_| io::Error::from(io::ErrorKind::StorageFull))?;
            self.1.lock().unwrap().extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_is_given_waits_and_is_written_in_order() {
        let (go, gate) = std::sync::mpsc::channel();
        let disk = Arc::default();
        let mut backlog = Backlog::new(Gated(gate, Arc::clone(&disk))).unwrap();
        let progress = backlog.progress();
        for byte in 0..4_u8 {
            backlog.write_all(&[byte; 100]).unwrap();
            backlog.flush().unwrap();
        }
        assert_eq!((progress.given(), progress.waiting()), (400, 400));
        go.send(()).unwrap();
        assert!(progress.wait_for(300, LONG, LONG));
        // Check that a disk that takes nothing ends the wait
        assert!(!progress.wait_for(200, Duration::from_millis(20), LONG));
        assert!(!progress.wait_for(200, LONG, Duration::from_millis(20)));
        (0..3).for_each(|_| go.send(()).unwrap());
        drop(backlog);
        assert!(progress.wait_for_end(LONG, LONG));
        let expected: Vec<u8> = (0..4_u8).flat_map(|byte| [byte; 100]).collect();
        assert_eq!(*disk.lock().unwrap(), expected);
    }

    #[test]
    fn an_error_comes_with_the_next_flush_and_frees_what_was_waiting() {
        let (go, gate) = std::sync::mpsc::channel();
        let mut backlog = Backlog::new(Gated(gate, Arc::default())).unwrap();
        let progress = backlog.progress();
        backlog.write_all(&[0; 100]).unwrap();
        backlog.flush().unwrap();
        drop(go);
        assert!(progress.wait_for_end(LONG, LONG));
        backlog.write_all(&[0; 100]).unwrap();
        assert_eq!(backlog.flush().unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(backlog.flush().is_err() && progress.written() == 0);
    }

    #[test]
    fn a_panic_of_the_output_is_an_error() {
        struct Panics;
        impl Write for Panics {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                panic!("no disk")
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut backlog = Backlog::new(Panics).unwrap();
        let progress = backlog.progress();
        backlog.write_all(&[0]).unwrap();
        backlog.flush().unwrap();
        assert!(progress.wait_for_end(LONG, LONG));
        assert!(progress.take_error().unwrap().to_string().contains("panicked"));
    }
}
