//! Says the same thing once, then less and less often: what goes on and off must not fill a terminal.

use std::collections::BTreeMap;

/// What was said how often, by group, code and cause of the event.
#[derive(Debug, Default)]
pub(super) struct Throttle(BTreeMap<(u16, u32, u64), u64>);

impl Throttle {
    /// What to add to the words for the n-th event of a kind, or `None` if they are better left out: it is said the first
    /// three times, then the 10th, the 100th and so on, each with the count.
    pub(super) fn speaks(&mut self, kind: (u16, u32, u64)) -> Option<String> {
        let count = self.0.entry(kind).or_default();
        *count += 1;
        match *count {
            1..=3 => Some(String::new()),
            count => is_power_of_ten(count).then(|| format!(" ({count} times so far)")),
        }
    }
}

fn is_power_of_ten(count: u64) -> bool {
    10_u64.pow(count.ilog10()) == count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_a_thousand_times_is_said_six_times() {
        let mut throttle = Throttle::default();
        let said: Vec<String> = (0..1000).filter_map(|_| throttle.speaks((0, 1, 7))).collect();
        assert_eq!(said, ["", "", "", " (10 times so far)", " (100 times so far)", " (1000 times so far)"]);
        assert_eq!(throttle.speaks((0, 1, 8)), Some(String::new()), "of another kind");
    }
}
