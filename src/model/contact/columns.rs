//! What each place of a step does to each, found only for the places that do something.

use std::ops::Range;

/// A table with a row and a column for each place of a step. A column is found when it is first asked for: where a tool sinks in beside the
/// elements it comes near many more places than press. Most places do nothing to most others.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns<T> {
    /// One column after the other.
    values: Vec<T>,
    /// The places to which that of a column does something.
    affected: Vec<u32>,
    /// Where those of each column are in this list, if it is known.
    known: Vec<Option<Range<usize>>>,
}

impl<T: Copy + Default + PartialEq> Columns<T> {
    /// With room for so many places.
    pub(super) fn with_room(places: usize) -> Self {
        let mut columns = Self::default();
        columns.make_room(places);
        columns
    }

    /// Makes room for so many places.
    pub(super) fn make_room(&mut self, places: usize) {
        self.values.clear();
        self.values.reserve(places * places);
        self.affected.clear();
        self.affected.reserve(places * places);
        self.known.clear();
        self.known.reserve(places);
    }

    /// A step with so many places begins: no column is known.
    pub(super) fn begin(&mut self, places: usize) {
        self.values.resize(places * places, T::default());
        self.affected.clear();
        self.known.clear();
        self.known.resize(places, None);
    }

    /// What `place` does to each to which it does something; `find` is to find what it does to all.
    pub(super) fn of(&mut self, place: usize, find: impl FnOnce(&mut [T])) -> impl Iterator<Item = (usize, T)> {
        let places = self.known.len();
        let column = &mut self.values[place * places..][..places];
        let affected = self.known[place].get_or_insert_with(|| {
            find(column);
            let first = self.affected.len();
            self.affected.extend((0..).zip(&*column).filter(|&(_, value)| *value != T::default()).map(|(at, _)| at));
            first..self.affected.len()
        });
        self.affected[affected.clone()].iter().map(|&at| (at as usize, column[at as usize]))
    }

    /// What a place does to one; nothing if nobody has asked for its column.
    pub(super) fn get(&self, of: usize, at: usize) -> T {
        if self.known[of].is_some() { self.values[of * self.known.len() + at] } else { T::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_found_once_in_a_step_and_what_was_known_before_is_forgotten() {
        let mut columns = Columns::with_room(3);
        for step in 1..3 {
            columns.begin(3);
            assert_eq!(columns.get(1, 2), 0, "nobody asked for it");
            let mut found = 0;
            for _ in 0..2 {
                let column = columns.of(1, |column| {
                    found += 1;
                    column.copy_from_slice(&[step, 0, 3]);
                });
                assert_eq!(column.collect::<Vec<_>>(), [(0, step), (2, 3)]);
            }
            assert_eq!((found, columns.get(1, 2), columns.get(1, 1), columns.get(0, 2)), (1, 3, 0, 0));
        }
    }
}
