//! Which of the loads on a body are one load.

use super::columns::Columns;
use super::row::Row;

/// What presses around each place of a step: places within the spread of a load are one load.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearness {
    /// How much of the load at a place counts as one at each; zero for itself, for another tool's, and for a place that does not sink in.
    shares: Columns<f64>,
    /// What presses at each place (N s).
    loads: Vec<f64>,
    /// What presses around it, on the same tool (N s).
    beside: Vec<f64>,
    /// No place sinks in.
    is_none: bool,
}

impl Nearness {
    /// With room for so many places.
    pub(super) fn with_room(places: usize) -> Self {
        let list = || Vec::with_capacity(places);
        Self { shares: Columns::with_room(places), loads: list(), beside: list(), is_none: true }
    }

    /// Of `rows`, with the impulses that they have: places do not move within a step, so that what a load counts as elsewhere is found once,
    /// when it first changes.
    pub(super) fn find(&mut self, rows: &[Row]) {
        for list in [&mut self.loads, &mut self.beside] {
            list.clear();
            list.resize(rows.len(), 0.0);
        }
        self.is_none = rows.iter().all(|row| row.sinking.is_none());
        if !self.is_none {
            self.shares.begin(rows.len());
            (0..rows.len()).for_each(|place| self.change(rows, place));
        }
    }

    /// True if no place sinks in.
    pub(super) fn is_none(&self) -> bool {
        self.is_none
    }

    /// The impulse at a place has changed.
    pub(super) fn change(&mut self, rows: &[Row], place: usize) {
        let row = &rows[place];
        let load = row.impulse.dot(&row.normal);
        let more = load - self.loads[place];
        if self.is_none || more == 0.0 {
            return;
        }
        self.loads[place] = load;
        let share = |(other, near): (usize, &Row)| match &near.sinking {
            Some((_, grain)) if other != place && near.tool == row.tool => {
                grain.nearness((near.place - row.place).norm_squared())
            }
            _ => 0.0,
        };
        let shares = self.shares.of(place, |shares| {
            shares.iter_mut().zip(rows.iter().enumerate()).for_each(|(to, near)| *to = share(near));
        });
        shares.for_each(|(at, share)| self.beside[at] += share * more);
    }

    /// How much of a load at one place counts as one at another; all of it at itself.
    pub(super) fn share(&self, of: usize, at: usize) -> f64 {
        if of == at {
            1.0
        } else if self.is_none {
            0.0
        } else {
            self.shares.get(of, at)
        }
    }

    /// What presses at a place (N s), as of its last change.
    pub(super) fn own(&self, place: usize) -> f64 {
        self.loads[place]
    }

    /// What presses around a place on the same tool, beside its own load (N s).
    pub(super) fn beside(&self, place: usize) -> f64 {
        self.beside[place]
    }

    /// What presses at and around a place (N s).
    pub(super) fn load(&self, place: usize) -> f64 {
        self.loads[place] + self.beside[place]
    }
}
