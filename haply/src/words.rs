//! Words of the connections' threads: a service that comes and goes, or talks, must not fill a terminal.

use std::time::{Duration, Instant};

/// Between two lines at first; it doubles with each line that follows a silence.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// Lines that are said whatever their number.
const FREE: u64 = 6;

/// Counts what is said, and leaves out more and more of it.
#[derive(Debug, Default)]
pub(crate) struct Words {
    said: u64,
    left_out: u64,
    quiet_until: Option<Instant>,
    pause: Duration,
}

impl Words {
    /// What to add to a line of `now`, or `None` if it is better left out: the first six are said, then one after a second, two,
    /// four and so on up to a minute, with the number of those between. A minute without a line begins anew.
    pub(crate) fn speaks(&mut self, now: Instant) -> Option<String> {
        if self.quiet_until.is_some_and(|until| now > until + LONGEST_PAUSE) {
            *self = Self { left_out: self.left_out, ..Self::default() };
        }
        if self.said >= FREE && self.quiet_until.is_some_and(|until| now < until) {
            self.left_out += 1;
            return None;
        }
        self.said += 1;
        self.pause = if self.said < FREE { Duration::ZERO } else { (2 * self.pause).clamp(FIRST_PAUSE, LONGEST_PAUSE) };
        self.quiet_until = Some(now + self.pause);
        let left_out = std::mem::take(&mut self.left_out);
        Some(if left_out == 0 { String::new() } else { format!(" ({left_out} lines before it left out)") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_that_flaps_for_an_hour_fills_two_screens_at_most_and_a_quiet_one_says_all() {
        let begin = Instant::now();
        let mut words = Words::default();
        let said: Vec<String> =
            (0..36_000).filter_map(|n| words.speaks(begin + n * Duration::from_millis(100))).collect();
        assert!((60..80).contains(&said.len()), "{}", said.len());
        assert!(said[..6].iter().all(String::is_empty) && said[6] == " (9 lines before it left out)", "{said:?}");
        let later = begin + Duration::from_secs(7200);
        assert!((0..6).all(|n| words.speaks(later + n * Duration::from_secs(1)).is_some()));
    }
}
