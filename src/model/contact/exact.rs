//! The impulses of places whose modes are known, from one linear system.
//!
//! Sweeps are slow where places lie so close together that one can stand for another. Once they have told which places press,
//! stick and slip, what is left is linear.

use std::ops::Mul;

use super::ContactMode;
use super::columns::Columns;
use super::nearness::Nearness;
use super::row::Row;
use crate::Vec3;

/// More unknowns than this are left to the sweeps.
const MOST_UNKNOWNS: usize = 64;
/// Places that can stand for each other make the system singular; so much more of its diagonal does not. More of it where places that hardly
/// differ would push against each other, and what is between them to any speed.
const MORE: [f64; 2] = [1e-10, 1e-3];
/// No impulse takes so many times more speed from its place than any place closes with.
const MOST: f64 = 10.0;

/// One unknown of the system.
#[derive(Clone, Copy, Debug)]
struct Unknown {
    place: usize,
    /// The impulse for one of it.
    push: Vec3,
    /// The direction in which the place must close as it may.
    test: Vec3,
    /// It is what presses, and the tool may sink in.
    presses: bool,
}

/// The system, with room for the largest.
#[derive(Clone, Debug)]
pub(super) struct Exact {
    unknowns: Vec<Unknown>,
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Default for Exact {
    fn default() -> Self {
        Self {
            unknowns: Vec::with_capacity(MOST_UNKNOWNS),
            matrix: Vec::with_capacity(MOST_UNKNOWNS * MOST_UNKNOWNS),
            right: Vec::with_capacity(MOST_UNKNOWNS),
        }
    }
}

impl Exact {
    /// The changes of the impulses (N s), place after place, after which `rows` close as their modes demand. Directions of sliding stay
    /// what they are. `false` if there is no such change, or too many unknowns. `answers` and `closing` are those of the sweeps.
    pub(super) fn solve<C: Copy + Default + PartialEq + Mul<Vec3, Output = Vec3>>(
        &mut self,
        rows: &[Row],
        nearness: &Nearness,
        answers: &Columns<C>,
        closing: &[Vec3],
    ) -> bool {
        self.unknowns.clear();
        for (place, row) in rows.iter().enumerate() {
            if self.unknowns.len() + 3 > MOST_UNKNOWNS {
                return false;
            }
            let n = row.normal;
            let pressed = row.impulse.dot(&n);
            match row.mode {
                // What has no impulse has changed nothing: nobody has asked how others answer to it.
                ContactMode::Stick if row.impulse != Vec3::zeros() => {
                    let across = if n.x.abs() < 0.6 { n.cross(&Vec3::x()) } else { n.cross(&Vec3::y()) }.normalize();
                    let unknown = |axis: Vec3, presses| Unknown { place, push: axis, test: axis, presses };
                    let presses = !row.glued;
                    self.unknowns.extend([
                        unknown(n, presses),
                        unknown(across, false),
                        unknown(n.cross(&across), false),
                    ]);
                }
                ContactMode::Slip if pressed > 0.0 => {
                    self.unknowns.push(Unknown { place, push: row.impulse / pressed, test: n, presses: true });
                }
                _ => {}
            }
        }
        for more in MORE {
            self.matrix.clear();
            self.right.clear();
            for one in &self.unknowns {
                let row = &rows[one.place];
                let allowed = if one.presses { row.allowed + row.sunk.at(nearness.load(one.place)) } else { 0.0 };
                self.right.push(one.test.dot(&closing[one.place]) - allowed);
                for other in &self.unknowns {
                    let mut answer = one.test.dot(&(answers.get(other.place, one.place) * other.push));
                    if one.presses && other.presses {
                        answer += row.sunk.slope * nearness.share(other.place, one.place);
                    }
                    self.matrix.push(answer);
                }
            }
            let fastest = rows.iter().map(|row| row.closing.norm());
            let fastest = self.right.iter().map(|right| right.abs()).chain(fastest).fold(0.0, f64::max);
            let is_slow =
                |(unknown, change): (&Unknown, &f64)| (change * rows[unknown.place].compliance).abs() <= MOST * fastest;
            if eliminate(&mut self.matrix, &mut self.right, more) && self.unknowns.iter().zip(&self.right).all(is_slow)
            {
                return true;
            }
        }
        false
    }

    /// How many changes were found.
    pub(super) fn unknowns(&self) -> usize {
        self.unknowns.len()
    }

    /// One of them: a change of the impulse (N s) at a place, which may have more of them.
    pub(super) fn change(&self, unknown: usize) -> (usize, Vec3) {
        let Unknown { place, push, .. } = self.unknowns[unknown];
        (place, push * self.right[unknown])
    }

    /// The part of the changes, at most all of them, up to which no place pulls.
    pub(super) fn part(&self, rows: &[Row]) -> f64 {
        let pressing = self.unknowns.iter().zip(&self.right).filter(|(unknown, _)| unknown.presses);
        pressing.fold(1.0, |part, (unknown, &more)| {
            let row = &rows[unknown.place];
            let pressed = row.impulse.dot(&row.normal).max(0.0);
            if pressed + more < 0.0 { part.min(pressed / -more) } else { part }
        })
    }
}

/// Solves a dense system, with so much `more` of its diagonal, in place, row by row, by elimination with row pivots; `false` if it is
/// singular.
fn eliminate(matrix: &mut [f64], right: &mut [f64], more: f64) -> bool {
    let n = right.len();
    (0..n).for_each(|i| matrix[i * n + i] *= 1.0 + more);
    for column in 0..n {
        let size = |row: usize| matrix[row * n + column].abs();
        let pivot = (column..n).max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(column);
        if !(size(pivot) > 0.0 && size(pivot).is_finite()) {
            return false;
        }
        if pivot != column {
            (column..n).for_each(|k| matrix.swap(pivot * n + k, column * n + k));
            right.swap(pivot, column);
        }
        let (done, left) = matrix.split_at_mut((column + 1) * n);
        let upper = &done[column * n..];
        let known = right[column];
        for (row, right) in left.chunks_exact_mut(n).zip(&mut right[column + 1..]) {
            let share = row[column] / upper[column];
            if share != 0.0 {
                row[column..].iter_mut().zip(&upper[column..]).for_each(|(value, upper)| *value -= share * upper);
                *right -= share * known;
            }
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row * n + k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row * n + row];
    }
    right.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::super::grain::Sunk;
    use super::*;

    /// A place that sticks and closes at `closing` (m/s), which all places of its tool and their answers of 1/kg are about.
    fn sticking(closing: Vec3) -> Row {
        Row {
            tool: 0,
            triangle: 0,
            weights: [1.0, 0.0, 0.0],
            feature: [0, u32::MAX, u32::MAX],
            share: 0.0,
            place: Vec3::zeros(),
            normal: Vec3::z(),
            target: Vec3::zeros(),
            closing,
            allowed: 0.0,
            compliance: 1.0,
            along: 1.0,
            sinking: None,
            sunk: Sunk::default(),
            stuck: true,
            glued: false,
            mode: ContactMode::Stick,
            impulse: Vec3::z() * 0.1,
            before: 0.0,
            nodes: (0, 1),
        }
    }

    /// Check that two places that are all but one, and do not move quite alike, do not push against each other: the difference is next to
    /// nothing, and so is what would take it away. What they have in common is taken away.
    #[test]
    fn places_that_are_all_but_one_do_not_push_each_other() {
        let rows = [Vec3::new(0.1, 0.0, 1.0), Vec3::new(0.1, 0.02, 1.01)].map(sticking);
        let (mut answers, mut nearness, mut exact) = (Columns::default(), Nearness::with_room(2), Exact::default());
        nearness.find(&rows);
        answers.begin(2);
        for place in 0..2 {
            let find =
                |column: &mut [f64]| (0..2).for_each(|at| column[at] = if at == place { 1.0 } else { 1.0 - 1e-7 });
            assert_eq!(answers.of(place, find).count(), 2);
        }
        assert!(exact.solve(&rows, &nearness, &answers, &rows.map(|row| row.closing)));
        let mut sums = [Vec3::zeros(); 2];
        for (place, change) in (0..exact.unknowns()).map(|unknown| exact.change(unknown)) {
            sums[place] += change;
        }
        assert!(sums.iter().all(|sum| sum.norm() < 20.0), "{sums:?}");
        assert!((sums[0] + sums[1] - Vec3::new(0.1, 0.01, 1.005)).norm() < 1e-3, "{sums:?}");
    }

    #[test]
    fn elimination_solves_and_tells_what_it_cannot() {
        let mut right = [5.0, 10.0, 7.0];
        // Without row pivots the first would be zero.
        assert!(eliminate(&mut [0.0, 1.0, 1.0, 2.0, 1.0, 2.0, 1.0, 3.0, 0.0], &mut right, 1e-10));
        for (found, known) in right.into_iter().zip([1.0, 2.0, 3.0]) {
            assert!((found - known).abs() < 1e-8, "{right:?}");
        }
        assert!(!eliminate(&mut [0.0; 4], &mut [1.0, 1.0], 1e-10));
        assert!(!eliminate(&mut [f64::NAN; 1], &mut [1.0], 1e-10));
    }
}
