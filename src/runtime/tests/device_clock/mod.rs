//! A device with a clock of its own, for tests of device-paced groups.

use std::time::{Duration, Instant};

/// Delivers a frame every `period`, but none between two times; all counted from the first question.
#[derive(Debug)]
pub struct DeviceClock {
    period: Duration,
    silent: [Duration; 2],
    begun: Option<Instant>,
    last: Duration,
}

impl DeviceClock {
    pub fn new(period: Duration, silent: [Duration; 2]) -> Self {
        Self { period, silent, begun: None, last: Duration::ZERO }
    }

    /// Waits for a frame that was not told of yet; those that have piled up count as one.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        let begun = *self.begun.get_or_insert_with(Instant::now);
        let mut next = self.after(self.last);
        let wait = next.saturating_sub(begun.elapsed());
        std::thread::sleep(wait.min(timeout));
        if wait > timeout {
            return false;
        }
        while self.after(next) <= begun.elapsed() {
            next = self.after(next);
        }
        self.last = next;
        true
    }

    fn after(&self, time: Duration) -> Duration {
        let next = time + self.period;
        if next > self.silent[0] { next.max(self.silent[1]) } else { next }
    }
}
