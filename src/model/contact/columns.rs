//! What each place of a step does to each, found only for the places that do something.

/// A table with a row and a column for each place of a step. A column is found when it is first asked for: where a tool sinks in beside the
/// elements it comes near many more places than press.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns<T> {
    /// One column after the other.
    values: Vec<T>,
    is_known: Vec<bool>,
}

impl<T: Copy + Default> Columns<T> {
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
        self.is_known.clear();
        self.is_known.reserve(places);
    }

    /// A step with so many places begins: no column is known.
    pub(super) fn begin(&mut self, places: usize) {
        self.values.resize(places * places, T::default());
        self.is_known.clear();
        self.is_known.resize(places, false);
    }

    /// What `place` does to each; `find` is to find it.
    pub(super) fn of(&mut self, place: usize, find: impl FnOnce(&mut [T])) -> &[T] {
        let places = self.is_known.len();
        let column = &mut self.values[place * places..][..places];
        if !std::mem::replace(&mut self.is_known[place], true) {
            find(column);
        }
        column
    }

    /// What a place does to one; nothing if nobody has asked for its column.
    pub(super) fn get(&self, of: usize, at: usize) -> T {
        if self.is_known[of] { self.values[of * self.is_known.len() + at] } else { T::default() }
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
                    column.copy_from_slice(&[step, 2, 3]);
                });
                assert_eq!(column, [step, 2, 3]);
            }
            assert_eq!((found, columns.get(1, 2), columns.get(0, 2)), (1, 3, 0));
        }
    }
}
