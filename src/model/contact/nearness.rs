//! Which of the loads on a body are one load.

use super::row::Row;

/// What presses around each place of a step: places within the spread of a load are one load.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearness {
    /// How much of the load at each place counts as one at each, one after the other for a load at each; zero for itself, for another
    /// tool's, and for a place that does not sink in.
    shares: Vec<f64>,
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
        let shares = Vec::with_capacity(places * places);
        Self { shares, loads: Vec::with_capacity(places), beside: Vec::with_capacity(places), is_none: true }
    }

    /// Of `rows`, with the impulses that they have: places do not move within a step, so that it is found once for all sweeps.
    pub(super) fn find(&mut self, rows: &[Row]) {
        for list in [&mut self.loads, &mut self.beside] {
            list.clear();
            list.resize(rows.len(), 0.0);
        }
        self.shares.clear();
        self.is_none = rows.iter().all(|row| row.sinking.is_none());
        if self.is_none {
            return;
        }
        for (place, row) in rows.iter().enumerate() {
            let share = |(other, near): (usize, &Row)| match &near.sinking {
                Some((_, grain)) if other != place && near.tool == row.tool => {
                    grain.nearness((near.place - row.place).norm_squared())
                }
                _ => 0.0,
            };
            self.shares.extend(rows.iter().enumerate().map(share));
        }
        for (place, row) in rows.iter().enumerate() {
            self.change(place, row.impulse.dot(&row.normal));
        }
    }

    /// True if no place sinks in.
    pub(super) fn is_none(&self) -> bool {
        self.is_none
    }

    /// What presses at a place is `load` (N s) now.
    pub(super) fn change(&mut self, place: usize, load: f64) {
        if self.is_none {
            return;
        }
        let more = load - self.loads[place];
        self.loads[place] = load;
        let shares = &self.shares[place * self.loads.len()..];
        self.beside.iter_mut().zip(shares).for_each(|(beside, share)| *beside += share * more);
    }

    /// How much of a load at one place counts as one at another; all of it at itself.
    pub(super) fn share(&self, of: usize, at: usize) -> f64 {
        if of == at {
            1.0
        } else if self.is_none {
            0.0
        } else {
            self.shares[of * self.loads.len() + at]
        }
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
