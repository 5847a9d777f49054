//! Which bases a haptic machine has, and which are on their way to it.

use std::collections::BTreeMap;

use super::key_of;
use super::post::Post;
use crate::link::{Lane, Message};
use crate::model::local::Parcel;
use crate::runtime::Nanos;

/// A basis that is not there after so long is sent again.
const SENT_AGAIN: Nanos = Nanos(3_000_000_000);
/// Bases that are on their way at the same time: more would wait for one another, and the first ones are wanted first.
const MOST_ON_THE_WAY: usize = 4;

/// What a haptic machine has.
#[derive(Debug, Default)]
pub(super) struct SentBases {
    /// When each was sent.
    on_the_way: BTreeMap<u64, Nanos>,
    /// What it says that it has, by key.
    pub(super) held: Vec<u64>,
}

impl SentBases {
    /// Sends what the machine lacks of the bases that `parcels` know, those that they need themselves first.
    pub(super) fn send(&mut self, post: &mut Post, parcels: &[Parcel], now: Nanos) {
        self.give_up_late(now);
        let needed = parcels.iter().filter_map(|parcel| parcel.bases().get(parcel.patch()?)).map(|basis| &**basis);
        // They all know the same.
        let known = parcels.iter().take(1).flat_map(|parcel| parcel.bases().iter());
        for basis in needed.chain(known) {
            let key = key_of(basis.patch());
            if self.begin(key, now) {
                post.send_with(Lane::Bulk, now, |header, bytes| Message::write_basis(key, basis, header, bytes));
            }
        }
    }

    /// What has arrived is on its way no longer, nor what has not for so long that it must be lost.
    fn give_up_late(&mut self, now: Nanos) {
        let Self { on_the_way, held } = self;
        on_the_way.retain(|key, sent| !held.contains(key) && now.saturating_sub(*sent) < SENT_AGAIN);
    }

    /// True if the basis of that name is to be sent now: from then on it is on its way.
    fn begin(&mut self, key: u64, now: Nanos) -> bool {
        let Self { on_the_way, held } = self;
        let begins = on_the_way.len() < MOST_ON_THE_WAY && !on_the_way.contains_key(&key) && !held.contains(&key);
        if begins {
            on_the_way.insert(key, now);
        }
        begins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each basis is sent, by a model that is published 30 times a second and knows so many; in which of a hundred periods.
    fn sent(bases: &mut SentBases, known: u64) -> Vec<(u64, u64)> {
        let mut sent = Vec::new();
        for period in 0..100 {
            let now = Nanos(period * 33_333_333);
            bases.give_up_late(now);
            sent.extend((0..known).filter(|&key| bases.begin(key, now)).map(|key| (period, key)));
        }
        sent
    }

    #[test]
    fn a_basis_that_is_lost_is_sent_again_and_no_other() {
        let again = 91; // the first period 3 s after the first
        assert_eq!(sent(&mut SentBases::default(), 2), [(0, 0), (0, 1), (again, 0), (again, 1)]);
        let mut holding = SentBases { held: vec![0], ..SentBases::default() };
        assert_eq!(sent(&mut holding, 2), [(0, 1), (again, 1)]);
    }

    #[test]
    fn few_are_on_their_way_at_a_time() {
        let mut bases = SentBases::default();
        let begun = |bases: &mut SentBases| (0..9).filter(|&key| bases.begin(key, Nanos::ZERO)).collect::<Vec<_>>();
        assert_eq!(begun(&mut bases), [0, 1, 2, 3]);
        bases.held = vec![1, 2];
        bases.give_up_late(Nanos(1));
        assert_eq!(begun(&mut bases), [4, 5]);
    }
}
