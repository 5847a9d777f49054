//! Which group of virtual time wakes next: the earliest, and at equal times the one that was added first.

use crate::time::Nanos;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// When each group wakes.
#[derive(Debug)]
pub(crate) struct Schedule {
    wakes: Vec<Option<Nanos>>,
    /// What was put in, in order; an entry that is not what `wakes` says is out of date.
    queue: BinaryHeap<Reverse<(Nanos, usize)>>,
}

impl Schedule {
    pub(crate) fn new(groups: usize) -> Self {
        Self { wakes: vec![None; groups], queue: BinaryHeap::with_capacity(2 * groups) }
    }

    /// Group `index` wakes at this time, or never.
    pub(crate) fn put(&mut self, index: usize, wake: Option<Nanos>) {
        if self.wakes[index] != wake {
            self.wakes[index] = wake;
            self.queue.extend(wake.map(|wake| Reverse((wake, index))));
        }
    }

    /// Who wakes next, and when.
    pub(crate) fn first(&mut self) -> Option<(Nanos, usize)> {
        while let Some(&Reverse((wake, index))) = self.queue.peek() {
            if self.wakes[index] == Some(wake) {
                return Some((wake, index));
            }
            self.queue.pop();
        }
        None
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        // Check against a search of all groups: few times, so that most of them are equal, in any order of changes.
        #[test]
        fn the_order_is_that_of_a_search_through_all_groups(
            groups in 1_usize..12,
            changes in prop::collection::vec((0_usize..12, prop::option::weighted(0.9, 0_u64..6), any::<bool>()), 1..400),
        ) {
            let mut schedule = Schedule::new(groups);
            let mut wakes = vec![None; groups];
            for (index, wake, takes) in changes {
                let search = wakes.iter().enumerate().filter_map(|(index, wake)| Some(((*wake)?, index))).min();
                prop_assert_eq!(schedule.first(), search);
                // What runs is put in again; or any other group changes.
                let index = search.filter(|_| takes).map_or(index % groups, |(_, first)| first);
                wakes[index] = wake.map(Nanos);
                schedule.put(index, wakes[index]);
            }
        }
    }
}
