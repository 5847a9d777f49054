//! Which bases a haptic machine has, and which are on their way to it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::key_of;
use super::post::Post;
use crate::link::{Lane, Message};
use crate::model::local::Parcel;
use crate::model::surroundings::Basis;
use crate::runtime::Nanos;

/// A basis that is not there after so long in which no other came is sent again: a slow line is no reason to send more.
const SENT_AGAIN: Nanos = Nanos(3_000_000_000);
/// Bases that are on their way at the same time while a session runs: more would wait for one another, and the first ones are wanted first.
pub(super) const MOST_ON_THE_WAY: usize = 4;

/// A machine that says that it has more is not believed.
const MOST_BELIEVED: usize = 1 << 16;

/// What a haptic machine has.
#[derive(Debug, Default)]
pub(super) struct SentBases {
    /// When each was sent.
    on_the_way: BTreeMap<u64, Nanos>,
    /// When it last told of a new one; none before it has told anything.
    told: Option<Nanos>,
    /// What it has said that it has, by key.
    held: BTreeSet<u64>,
}

impl SentBases {
    /// Sends what the machine lacks of the bases that were `made`, in that order, but those first that `parcels` need; `most` are on their
    /// way at a time.
    pub(super) fn send<'a>(
        &mut self,
        post: &mut Post,
        parcels: impl Iterator<Item = &'a Parcel>,
        made: &[Arc<Basis>],
        most: usize,
        now: Nanos,
    ) {
        self.give_up_late(now);
        let needed = parcels.filter_map(|parcel| parcel.bases().get(parcel.patch()?));
        for basis in needed.chain(made) {
            let key = key_of(basis.patch());
            if self.begin(key, most, now) {
                post.send_with(Lane::Bulk, now, |header, bytes| Message::write_basis(key, basis, header, bytes));
            }
        }
    }

    /// The machine says that it has the bases of these `keys`; true if it has not said so of all of them before.
    pub(super) fn arrived(&mut self, keys: impl IntoIterator<Item = u64>, now: Nanos) -> bool {
        let before = self.held.len();
        let room = MOST_BELIEVED.saturating_sub(before);
        self.held.extend(keys.into_iter().take(room));
        let is_news = self.held.len() > before;
        if is_news || self.told.is_none() {
            self.told = Some(now);
        }
        is_news
    }

    /// True if the machine has not said yet what it has.
    pub(super) fn are_unknown(&self) -> bool {
        self.told.is_none()
    }

    /// True if the machine has said that it has the basis of that name.
    pub(super) fn has(&self, key: u64) -> bool {
        self.held.contains(&key)
    }

    /// What has arrived is on its way no longer, nor what has not for so long that it must be lost.
    fn give_up_late(&mut self, now: Nanos) {
        let Self { on_the_way, told, held } = self;
        let is_late = |sent: Nanos| told.is_some_and(|told| now.saturating_sub(told.max(sent)) >= SENT_AGAIN);
        on_the_way.retain(|key, sent| !held.contains(key) && !is_late(*sent));
    }

    /// True if the basis of that name is to be sent now, with `most` on their way: from then on it is.
    fn begin(&mut self, key: u64, most: usize, now: Nanos) -> bool {
        let Self { on_the_way, held, .. } = self;
        let begins = on_the_way.len() < most && !on_the_way.contains_key(&key) && !held.contains(&key);
        if begins {
            on_the_way.insert(key, now);
        }
        begins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_line_on_which_others_come_is_no_reason_to_send_one_again() {
        let seconds = |s: u64| Nanos(s * 1_000_000_000);
        let mut bases = SentBases::default();
        assert!(bases.begin(0, MOST_ON_THE_WAY, Nanos::ZERO) && bases.arrived([7], seconds(2)));
        let mut sent_again = |at: Nanos| {
            bases.give_up_late(at);
            bases.begin(0, MOST_ON_THE_WAY, at)
        };
        assert_eq!([4, 5].map(|s| sent_again(seconds(s))), [false, true]);
        assert!(!bases.arrived([7], seconds(6)), "that is no news");
    }

    /// Whether each basis is sent, by a model that is published 30 times a second and knows so many; in which of a hundred periods.
    fn sent(bases: &mut SentBases, known: u64) -> Vec<(u64, u64)> {
        let mut sent = Vec::new();
        for period in 0..100 {
            let now = Nanos(period * 33_333_333);
            bases.give_up_late(now);
            sent.extend((0..known).filter(|&key| bases.begin(key, MOST_ON_THE_WAY, now)).map(|key| (period, key)));
        }
        sent
    }

    #[test]
    fn a_basis_that_is_lost_is_sent_again_and_no_other() {
        let again = 91; // the first period 3 s after the first
        let holding = |held: &[u64]| {
            let mut bases = SentBases::default();
            bases.arrived(held.iter().copied(), Nanos::ZERO);
            bases
        };
        assert_eq!(sent(&mut holding(&[]), 2), [(0, 0), (0, 1), (again, 0), (again, 1)]);
        assert_eq!(sent(&mut holding(&[0]), 2), [(0, 1), (again, 1)]);
        assert_eq!(
            sent(&mut SentBases::default(), 2),
            [(0, 0), (0, 1)],
            "one that has told nothing does not listen yet"
        );
    }

    #[test]
    fn few_are_on_their_way_at_a_time() {
        let mut bases = SentBases::default();
        let begun = |bases: &mut SentBases| {
            (0..9).filter(|&key| bases.begin(key, MOST_ON_THE_WAY, Nanos::ZERO)).collect::<Vec<_>>()
        };
        assert_eq!(begun(&mut bases), [0, 1, 2, 3]);
        bases.arrived([1, 2], Nanos(1));
        bases.give_up_late(Nanos(1));
        assert_eq!(begun(&mut bases), [4, 5]);
    }
}
