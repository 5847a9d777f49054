//! The impulses of all places at which tools touch, found together: projected Gauss-Seidel with Coulomb's cone at each place.

use std::ops::Mul;

use super::columns::Columns;
use super::deformable::Deformable;
use super::resolve::{self, IMMOVABLE};
use super::row::Row;
use super::rows::Rows;
use super::work::Work;
use super::{ContactMode, Friction, Law, coupled};
use crate::linear::ImplicitStep;
use crate::{Mat3, Vec3};

/// Sweeps to and fro at most, of places on the body's own nodes, and of places that sink in for one and for however many: few of these
/// that lie close together take the most.
const MOST_SWEEPS: usize = 20;
const MOST_SUNKEN_SWEEPS: [usize; 2] = [400, 40];
/// Sweeps that change how fast places close by less than this share of what the impulses do are the last. Impulses themselves
/// need not come to rest: places on the same nodes may share theirs in many ways.
const FOUND: f64 = 1e-7;
/// Sweeps after which depths are taken anew and what was found of modes is used, and how often that at most.
const SWEEPS_BETWEEN: usize = 3;
const MOST_EXACT: usize = 7;
/// Places that let go at most each time modes are used.
const MOST_LET_GO: usize = 5;
/// What is left of a load that an exact solution took away, if it is less than this share: rounding.
const GONE: f64 = 1e-12;
/// Friction is at most this where sweeps with more run away: a tool that wedges surfaces apart which stick to it pushes each of
/// them against the others' friction, the more the longer it is swept. Without friction sweeps cannot run away.
const CALMER: [f64; 4] = [1.0, 0.5, 0.25, 0.0];
/// Places that close so many times faster after the sweeps than anything did before have run away.
const RUN_AWAY: f64 = 10.0;
/// So many times as many sweeps at most where the depth that a tool sinks in is not yet what it was taken to be.
const MOST_TIMES: usize = 4;

impl Rows {
    /// Changes the velocities so that no place is entered, none pulls and each impulse is in its cone. Rows meet at shared nodes;
    /// sweeps go to and fro, so that none of them has the last word. Positions are left so that drifting for the whole step ends where two
    /// drifts, before and after the impact of each row, would.
    pub(super) fn solve(&mut self, body: &mut Deformable<'_>, law: &Law, d: f64) {
        let Self { rows, nodes, at_nodes, shared, work, .. } = self;
        let of = |row: &Row| &nodes[row.nodes.0..row.nodes.1];
        // Masses are lumped: an impulse is felt where its nodes are, along itself.
        let find = |rows: &[Row], place: usize, column: &mut [f64]| {
            let of_place = of(&rows[place]);
            of_place.iter().for_each(|&(node, w)| at_nodes[node as usize] = w * body.inverse_masses[node as usize]);
            for (answer, row) in column.iter_mut().zip(rows) {
                *answer = of(row).iter().map(|&(node, w)| at_nodes[node as usize] * w).sum();
            }
            of_place.iter().for_each(|&(node, _)| at_nodes[node as usize] = 0.0);
        };
        if let Some((row, friction)) = point_alone(rows, law) {
            (row.mode, row.impulse) = resolve::impulse(row.compliance, row.closing, &row.normal, friction);
        } else {
            Sweeps { rows, answers: shared, find, work, law: *law, d }.go_calmly();
        }
        for row in rows.iter().filter(|row| row.impulse != Vec3::zeros()) {
            for &(node, w) in of(row) {
                let node = node as usize;
                body.positions[node] += body.velocities[node] * row.before;
                body.velocities[node] -= row.impulse * (w * body.inverse_masses[node]);
                body.positions[node] -= body.velocities[node] * row.before;
            }
        }
    }

    /// The same for an implicit step, in which every node answers to an impulse, and not along it.
    pub(super) fn solve_coupled(&mut self, body: &mut Deformable<'_>, system: &ImplicitStep, law: &Law) {
        let Self { rows, nodes, coupling, work, .. } = self;
        let of = |row: &Row| &nodes[row.nodes.0..row.nodes.1];
        for row in rows.iter_mut() {
            let own = system.coupling(of(row), of(row));
            // The steepest answer bounds every other one: the projections stay contractions.
            row.compliance = own.trace();
            row.along = row.normal.dot(&(own * row.normal));
            if row.compliance <= IMMOVABLE || row.along <= 0.0 {
                (row.mode, row.impulse) = (ContactMode::Lost, Vec3::zeros());
            }
        }
        let find = |rows: &[Row], place: usize, column: &mut [Mat3]| {
            let others = rows.iter().map(|other| system.coupling(of(other), of(&rows[place])));
            column.iter_mut().zip(others).for_each(|(to, answer)| *to = answer);
        };
        if let Some((row, friction)) = point_alone(rows, law) {
            let compliance = system.coupling(of(row), of(row));
            (row.mode, row.impulse) = coupled::impulse(&compliance, row.closing, &row.normal, friction);
        } else {
            Sweeps { rows, answers: coupling, find, work, law: *law, d: system.step() }.go_calmly();
        }
        for row in rows.iter() {
            system.push(body.velocities, of(row), row.impulse);
            if row.before > 0.0 {
                system.push(body.positions, of(row), -row.impulse * row.before);
            }
        }
    }
}

/// The row of a point that touches while no other tool does, if that is the only one, with its friction: it needs no sweeps, and feels what it
/// would without the others, in every bit.
fn point_alone<'a>(rows: &'a mut [Row], law: &Law) -> Option<(&'a mut Row, Option<(Friction, bool)>)> {
    let [row] = rows else { return None };
    let friction = (!row.glued).then_some((law.friction, row.stuck));
    row.is_of_point().then_some((row, friction))
}

/// Sweeps over the places of a step of `d` seconds, from what pressed in the step before.
struct Sweeps<'a, C, F> {
    rows: &'a mut [Row],
    /// How each place answers to an impulse at each (1/kg).
    answers: &'a mut Columns<C>,
    /// Finds how each of some rows answers to an impulse at one of them.
    find: F,
    work: &'a mut Work,
    law: Law,
    d: f64,
}

impl<C: Copy + Default + PartialEq + Mul<Vec3, Output = Vec3>, F: FnMut(&[Row], usize, &mut [C])> Sweeps<'_, C, F> {
    /// Sweeps with the friction of the law, and again with less while they run away.
    fn go_calmly(&mut self) {
        self.answers.begin(self.rows.len());
        let mut calmer = CALMER.iter();
        loop {
            let fastest = self.begin();
            self.go();
            if !self.has_run_away(fastest) {
                return;
            }
            let Some(&most) = calmer.next() else { return };
            self.law.friction = self.law.friction.at_most(most);
        }
    }

    /// Finds how fast each place closes if nothing presses; returns the fastest of what the sweeps are to end (m/s).
    fn begin(&mut self) -> f64 {
        let closing = &mut self.work.closing;
        closing.clear();
        closing.extend(self.rows.iter().map(|row| row.closing));
        let faster = |most: f64, row: &Row| most.max(row.closing.norm()).max(row.allowed.abs());
        self.rows.iter().fold(0.0, faster)
    }

    /// True if sweeps made places close much faster than the `fastest` before; nothing presses any more then.
    fn has_run_away(&mut self, fastest: f64) -> bool {
        // Written so that what is no number has run away.
        let has = !self.work.closing.iter().all(|closing| closing.norm() <= RUN_AWAY * fastest);
        if has {
            self.rows.iter_mut().for_each(|row| row.impulse = Vec3::zeros());
        }
        has
    }

    /// Changes how fast all places close by a change of the impulse (N s) at one.
    fn answer(&mut self, place: usize, change: Vec3) {
        // Where a tool sinks in beside the elements most places do not press.
        if change == Vec3::zeros() {
            return;
        }
        let Self { rows, answers, find, work, .. } = self;
        let answers = answers.of(place, |column| find(rows, place, column));
        answers.for_each(|(at, answer)| work.closing[at] -= answer * change);
    }

    /// Updates rows to and fro until nothing changes, beginning with what pressed in the last step. How deep the tool sinks in is taken as
    /// linear in the force meanwhile, and made anew until it is what it was taken to be.
    fn go(&mut self) {
        let count = self.rows.len();
        (0..count).for_each(|place| self.answer(place, self.rows[place].impulse));
        self.work.nearness.find(self.rows);
        let sinks = !self.work.nearness.is_none();
        let most = if sinks { (MOST_SUNKEN_SWEEPS[0] / count.max(1)).max(MOST_SUNKEN_SWEEPS[1]) } else { MOST_SWEEPS };
        self.take_depths();
        for turn in 1..=MOST_TIMES * most {
            let is_found = self.sweep();
            if (is_found || turn >= most) && self.is_as_deep_as_taken() {
                return;
            }
            let is_due = turn % SWEEPS_BETWEEN == 0;
            if is_found || is_due {
                self.take_depths();
            }
            // Sweeps have the last word: they alone keep every place in its cone.
            if sinks && is_due && !is_found && turn <= (most - SWEEPS_BETWEEN).min(MOST_EXACT * SWEEPS_BETWEEN) {
                self.solve_exactly();
            }
        }
    }

    /// Takes how deep the tool sinks in as linear around the forces that were found.
    fn take_depths(&mut self) {
        for (place, row) in self.rows.iter_mut().enumerate() {
            if let Some((sinking, _)) = &row.sinking {
                row.sunk = sinking.tangent(self.work.nearness.load(place) / self.d).over(self.d);
            }
        }
    }

    /// One sweep to and fro; true if it changed next to nothing.
    fn sweep(&mut self) -> bool {
        let count = self.rows.len();
        self.work.before.clone_from(&self.work.closing);
        for place in (0..count).chain((0..count).rev()) {
            let (closing, beside) = (self.work.closing[place], self.work.nearness.beside(place));
            let change = self.rows[place].update(closing, &self.law, beside);
            self.answer(place, change);
            self.work.nearness.change(self.rows, place);
        }
        // Squares are quicker to find than lengths.
        let changes =
            self.work.closing.iter().zip(&self.work.before).map(|(now, before)| (now - before).norm_squared());
        let done = self.rows.iter().map(|row| row.impulse.norm_squared() * (row.compliance * row.compliance));
        changes.fold(0.0, f64::max) <= FOUND * FOUND * done.fold(0.0, f64::max)
    }

    /// Takes the modes that the sweeps have found as they are, and solves for the impulses. Whoever would pull lets go, and the others are
    /// solved for again.
    fn solve_exactly(&mut self) {
        for _ in 0..MOST_LET_GO {
            let Self { rows, answers, work, .. } = &mut *self;
            let Work { nearness, exact, closing, .. } = &mut **work;
            if !exact.solve(rows, nearness, answers, closing) {
                return;
            }
            let part = exact.part(rows);
            for unknown in 0..exact.unknowns() {
                let (place, change) = self.work.exact.change(unknown);
                self.rows[place].impulse += change * part;
                self.answer(place, change * part);
            }
            for place in 0..self.rows.len() {
                let row = &mut self.rows[place];
                let least = GONE * self.work.nearness.own(place);
                if part < 1.0 && row.can_let_go() && row.impulse.dot(&row.normal) <= least {
                    let left = std::mem::take(&mut row.impulse);
                    row.mode = ContactMode::Free;
                    self.answer(place, -left);
                }
                self.work.nearness.change(self.rows, place);
            }
            if part == 1.0 {
                return;
            }
        }
    }

    /// True if the tool sinks in as deep at each place as it was taken to.
    fn is_as_deep_as_taken(&self) -> bool {
        let Work { nearness, closing, .. } = &*self.work;
        self.rows.iter().enumerate().all(|(place, row)| {
            row.sinking.as_ref().is_none_or(|(sinking, _)| {
                let load = nearness.load(place);
                let depth = sinking.at(load / self.d);
                if row.presses() {
                    return (row.sunk.at(load) * self.d - depth).abs() <= FOUND * depth;
                }
                // Around a larger force the tool was taken to sink in deeper than it does: that alone releases nothing.
                let left = (closing[place].dot(&row.normal) - row.allowed) * self.d;
                row.mode == ContactMode::Lost || left <= depth + FOUND * sinking.most()
            })
        })
    }
}

impl Row {
    /// True if it touches and can let go.
    fn can_let_go(&self) -> bool {
        !self.glued && matches!(self.mode, ContactMode::Stick | ContactMode::Slip)
    }

    fn presses(&self) -> bool {
        self.impulse.dot(&self.normal) > 0.0
    }

    /// Makes its impulse anew for the surface's velocity `closing` against the tool (m/s); returns the change (N s).
    fn update(&mut self, closing: Vec3, law: &Law, beside: f64) -> Vec3 {
        if self.mode == ContactMode::Lost {
            return Vec3::zeros();
        }
        let before = self.impulse;
        if self.glued {
            self.impulse += closing / self.compliance;
            self.mode = ContactMode::Stick;
            return self.impulse - before;
        }
        let n = self.normal;
        let (pressed, speed) = (before.dot(&n), closing.dot(&n));
        let along = self.normal_impulse(pressed, speed, beside);
        // Written so that what is no number releases.
        let (mode, impulse) = if along > 0.0 {
            let across = (before - n * pressed) + (closing - n * speed) / self.compliance;
            let (mode, across) = law.friction.resolve(self.stuck, across, along, self.compliance);
            (mode, n * along + across)
        } else {
            (ContactMode::Free, Vec3::zeros())
        };
        (self.mode, self.impulse) = (mode, impulse);
        impulse - before
    }

    /// The impulse along the normal (N s) for one that closes with `speed` (m/s) while it is `pressed` (N s), and others are pressed
    /// `beside` it. Where the tool sinks in beside the elements it is so much less that what the surface is pushed less is what it sinks in.
    fn normal_impulse(&self, pressed: f64, speed: f64, beside: f64) -> f64 {
        if self.sinking.is_none() {
            return pressed + (speed - self.allowed) / self.along;
        }
        let left = self.along * pressed + (speed - self.allowed) - self.sunk.at(beside);
        // Most places do not press: whether they would is told without a division.
        if left <= 0.0 { left } else { left / (self.along + self.sunk.slope) }
    }
}
