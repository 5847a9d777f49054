//! The impulses of all places at which tools touch, found together: projected Gauss-Seidel with Coulomb's cone at each place.

use std::ops::Mul;

use super::deformable::Deformable;
use super::exact::Exact;
use super::nearness::Nearness;
use super::resolve::IMMOVABLE;
use super::row::Row;
use super::rows::Rows;
use super::{ContactMode, Law};
use crate::Vec3;
use crate::linear::ImplicitStep;

/// Sweeps to and fro at most, of places on the body's own nodes, and of places that sink in for one and for however many: few of these
/// that lie close together take the most.
const MOST_SWEEPS: usize = 20;
const MOST_SUNKEN_SWEEPS: [usize; 2] = [400, 40];
/// Sweeps that change how fast places close by less than this share of what the impulses do are the last. Impulses themselves
/// need not come to rest: places on the same nodes may share theirs in many ways.
const FOUND: f64 = 1e-7;
/// Sweeps after which what they found of modes is used, and how often at most.
const SWEEPS_BETWEEN: usize = 3;
const MOST_EXACT: usize = 8;
/// Friction is at most this where sweeps with more run away: a tool that wedges surfaces apart which stick to it pushes each of
/// them against the others' friction, the more the longer it is swept. Without friction sweeps cannot run away.
const CALMER: [f64; 4] = [1.0, 0.5, 0.25, 0.0];
/// Places that close so many times faster after the sweeps than anything did before have run away.
const RUN_AWAY: f64 = 10.0;
/// Rounds in which the depth that a tool sinks in is found.
const MOST_ROUNDS: usize = 16;

impl Rows {
    /// Changes the velocities so that no place is entered, none pulls and each impulse is in its cone. Rows meet at shared nodes;
    /// sweeps go to and fro, so that none of them has the last word.
    pub(super) fn solve(&mut self, body: &mut Deformable<'_>, law: &Law, d: f64) {
        let Self { rows, nodes, at_nodes, shared, closing, before, nearness, exact, .. } = self;
        let of = |row: &Row| &nodes[row.nodes.0..row.nodes.1];
        // Masses are lumped: an impulse is felt where its nodes are, along itself.
        let count = rows.len();
        shared.resize(count * count, 0.0);
        for (place, row) in rows.iter().enumerate() {
            let weighted = |&(node, w): &(u32, f64)| w * body.inverse_masses[node as usize];
            shared[place * count + place] = of(row).iter().map(|part| weighted(part) * part.1).sum();
            if place + 1 == count {
                break;
            }
            of(row).iter().for_each(|part| at_nodes[part.0 as usize] = weighted(part));
            for (other, row) in rows.iter().enumerate().skip(place + 1) {
                let answer = of(row).iter().map(|&(node, w)| at_nodes[node as usize] * w).sum();
                (shared[place * count + other], shared[other * count + place]) = (answer, answer);
            }
            of(row).iter().for_each(|&(node, _)| at_nodes[node as usize] = 0.0);
        }
        sweep_calmly(rows, (nearness, exact), shared, [closing, before], law, d);
        for row in rows.iter() {
            for &(node, w) in of(row) {
                body.velocities[node as usize] -= row.impulse * (w * body.inverse_masses[node as usize]);
            }
        }
    }

    /// The same for an implicit step, in which every node answers to an impulse, and not along it.
    pub(super) fn solve_coupled(&mut self, body: &mut Deformable<'_>, system: &ImplicitStep, law: &Law) {
        let Self { rows, nodes, coupling, closing, before, nearness, exact, .. } = self;
        let of = |row: &Row| &nodes[row.nodes.0..row.nodes.1];
        let count = rows.len();
        coupling.clear();
        for row in rows.iter() {
            coupling.extend(rows.iter().map(|other| system.coupling(of(other), of(row))));
        }
        for (place, row) in rows.iter_mut().enumerate() {
            let own = coupling[place * count + place];
            // The steepest answer bounds every other one: the projections stay contractions.
            row.compliance = own.trace();
            row.along = row.normal.dot(&(own * row.normal));
            if row.compliance <= IMMOVABLE || row.along <= 0.0 {
                (row.mode, row.impulse) = (ContactMode::Lost, Vec3::zeros());
            }
        }
        sweep_calmly(rows, (nearness, exact), coupling, [closing, before], law, system.step());
        for row in rows.iter() {
            system.push_all(body.velocities, of(row), row.impulse);
        }
    }
}

/// Sweeps with the friction of `law`, and again with less while they run away.
fn sweep_calmly<C: Copy + Mul<Vec3, Output = Vec3>>(
    rows: &mut [Row],
    (nearness, exact): (&mut Nearness, &mut Exact),
    coupling: &[C],
    [closing, before]: [&mut Vec<Vec3>; 2],
    law: &Law,
    d: f64,
) {
    let mut law = *law;
    let mut calmer = CALMER.iter();
    loop {
        let fastest = find_closing(rows, closing);
        sweep(rows, (nearness, exact), coupling, [closing, before], &law, d);
        if !has_run_away(rows, closing, fastest) {
            return;
        }
        let Some(&most) = calmer.next() else { return };
        law.friction = law.friction.at_most(most);
    }
}

/// Puts how fast each place closes if nothing presses in place of `closing`; returns the fastest of what the sweeps are to end (m/s).
fn find_closing(rows: &[Row], closing: &mut Vec<Vec3>) -> f64 {
    closing.clear();
    closing.extend(rows.iter().map(|row| row.closing));
    closing.iter().zip(rows).fold(0.0, |most: f64, (closing, row)| most.max(closing.norm()).max(row.allowed.abs()))
}

/// True if sweeps made places close much faster than the `fastest` before; nothing presses any more then.
fn has_run_away(rows: &mut [Row], closing: &[Vec3], fastest: f64) -> bool {
    // Written so that what is no number has run away.
    let has = !closing.iter().all(|closing| closing.norm() <= RUN_AWAY * fastest);
    if has {
        rows.iter_mut().for_each(|row| row.impulse = Vec3::zeros());
    }
    has
}

/// Updates rows to and fro until nothing changes, beginning with what pressed in the last step. `coupling` has how each place
/// answers to an impulse (1/kg), one after the other for an impulse at each. How deep the tool sinks in is taken as linear in the
/// force meanwhile, and made anew until it is what it was taken to be.
fn sweep<C: Copy + Mul<Vec3, Output = Vec3>>(
    rows: &mut [Row],
    (nearness, exact): (&mut Nearness, &mut Exact),
    coupling: &[C],
    [closing, before]: [&mut Vec<Vec3>; 2],
    law: &Law,
    d: f64,
) {
    let count = rows.len();
    let answer = |closing: &mut [Vec3], place: usize, change: Vec3| {
        for (closing, &coupling) in closing.iter_mut().zip(&coupling[place * count..]) {
            *closing -= coupling * change;
        }
    };
    for (place, row) in rows.iter().enumerate() {
        answer(closing, place, row.impulse);
    }
    nearness.find(rows);
    let most = if nearness.is_none() {
        MOST_SWEEPS
    } else {
        (MOST_SUNKEN_SWEEPS[0] / count.max(1)).max(MOST_SUNKEN_SWEEPS[1])
    };
    for _ in 0..MOST_ROUNDS {
        for (place, row) in rows.iter_mut().enumerate() {
            if let Some((sinking, _)) = &row.sinking {
                row.sunk = sinking.tangent(nearness.load(place) / d);
            }
        }
        for turn in 1..=most {
            before.clone_from(closing);
            for place in (0..count).chain((0..count).rev()) {
                let row = &mut rows[place];
                let change = row.update(closing[place], law, nearness.beside(place), d);
                answer(closing, place, change);
                nearness.change(place, row.impulse.dot(&row.normal));
            }
            let change =
                closing.iter().zip(&*before).fold(0.0_f64, |most, (now, before)| most.max((now - before).norm()));
            let done = rows.iter().fold(0.0_f64, |most, row| most.max(row.impulse.norm() * row.compliance));
            if change <= FOUND * done {
                break;
            }
            // Sweeps have the last word: they alone keep every place in its cone.
            let is_due = !nearness.is_none()
                && turn % SWEEPS_BETWEEN == 0
                && turn + SWEEPS_BETWEEN <= most.min(MOST_EXACT * SWEEPS_BETWEEN);
            if is_due && exact.solve(rows, nearness, coupling, closing, d) {
                let part = exact.part(rows);
                for (place, change) in exact.changes() {
                    rows[place].impulse += change * part;
                    answer(closing, place, change * part);
                }
                for (place, row) in rows.iter().enumerate() {
                    nearness.change(place, row.impulse.dot(&row.normal));
                }
            }
        }
        let is_as_taken = |(place, row): (usize, &Row)| {
            row.sinking.as_ref().is_none_or(|(sinking, _)| {
                let force = nearness.load(place) / d;
                let depth = sinking.at(force);
                if row.presses() {
                    return (row.sunk.at(force) - depth).abs() <= FOUND * depth;
                }
                // Around a larger force the tool was taken to sink in deeper than it does: that alone releases nothing.
                let left = (closing[place].dot(&row.normal) - row.allowed) * d;
                row.mode == ContactMode::Lost || left <= depth + FOUND * sinking.most()
            })
        };
        if rows.iter().enumerate().all(is_as_taken) {
            break;
        }
    }
}

impl Row {
    fn presses(&self) -> bool {
        self.impulse.dot(&self.normal) > 0.0
    }

    /// Makes its impulse anew for the surface's velocity `closing` against the tool (m/s); returns the change (N s).
    fn update(&mut self, closing: Vec3, law: &Law, beside: f64, d: f64) -> Vec3 {
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
        let along = self.normal_impulse(pressed + (speed - self.allowed) / self.along, beside, d);
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

    /// The impulse along the normal (N s), where `rigid` would be that of a tool that does not sink in beside the elements: so
    /// much less that what the surface is pushed less is what the tool sinks in.
    fn normal_impulse(&self, rigid: f64, beside: f64, d: f64) -> f64 {
        if self.sinking.is_none() {
            return rigid;
        }
        (self.along * rigid - self.sunk.at(beside / d) / d) / (self.along + self.sunk.slope / (d * d))
    }
}
