//! What work costs the processor: CPU time of the calling thread, counted in a histogram.
//!
//! The clock is the thread's own, so that other threads and a preempting system do not count; a cold cache that they leave
//! behind does. Reading it is a system call on Linux ([`Stopwatch::reading`] says what it takes here), which a real-time
//! tick must not make: threads are not measured this way, their execution times are in the report.

use crate::primitives::histogram::{HistogramReader, HistogramWriter, histogram};
use crate::system::os::thread_cpu;
use crate::time::Nanos;

/// Counts the CPU time of pieces of work.
///
/// ```
/// use palpate_runtime::Stopwatch;
///
/// let mut stopwatch = Stopwatch::new();
/// let times = stopwatch.reader();
/// (0..10).for_each(|n| Stopwatch::around(Some(&mut stopwatch), || assert!(n < 10)));
/// assert_eq!(times.snapshot().count(), 10);
/// ```
#[derive(Debug)]
pub struct Stopwatch {
    writer: HistogramWriter,
    reader: HistogramReader,
}

impl Stopwatch {
    /// A stopwatch that has counted nothing.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[expect(clippy::new_without_default, reason = "a default that allocates 8 kB would surprise")]
    pub fn new() -> Self {
        let (writer, reader) = histogram();
        Self { writer, reader }
    }

    /// The histogram of the times counted, for any thread to read.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn reader(&self) -> HistogramReader {
        self.reader.clone()
    }

    /// Does `work` and counts what it took, if there is a stopwatch.
    ///
    /// # Real-time
    /// Bounded, wait-free; with a stopwatch it makes two system calls and is not real-time safe.
    pub fn around<T>(stopwatch: Option<&mut Self>, work: impl FnOnce() -> T) -> T {
        let Some(stopwatch) = stopwatch else { return work() };
        let begun = thread_cpu();
        let result = work();
        stopwatch.writer.record(Nanos(thread_cpu().saturating_sub(begun)));
        result
    }

    /// The time that work which does nothing is counted with on this machine: the median of a thousand.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, makes system calls.
    pub fn reading() -> Nanos {
        let mut stopwatch = Self::new();
        (0..1000).for_each(|_| Self::around(Some(&mut stopwatch), || ()));
        stopwatch.reader.snapshot().percentile(0.5)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn work_is_counted_and_only_where_there_is_a_stopwatch() {
        let mut stopwatch = Stopwatch::new();
        let reader = stopwatch.reader();
        Stopwatch::around(Some(&mut stopwatch), || {
            let begun = thread_cpu();
            while thread_cpu() - begun < 2_000_000 {
                std::hint::spin_loop();
            }
        });
        assert!(reader.snapshot().max() >= Nanos(2_000_000), "{reader:?}");
        assert_eq!(Stopwatch::around(None, || 7), 7);
        assert_eq!(reader.snapshot().count(), 1);
    }

    // Elsewhere the clock is the wall's.
    #[cfg(target_os = "linux")]
    #[test]
    fn sleep_is_no_work() {
        let mut stopwatch = Stopwatch::new();
        let slept = std::time::Duration::from_millis(100);
        Stopwatch::around(Some(&mut stopwatch), || std::thread::sleep(slept));
        assert!(stopwatch.reader().snapshot().sum() < Nanos::from_duration(slept));
    }
}
