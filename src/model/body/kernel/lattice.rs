//! The spring forces of a lattice, eight nodes at once.
//!
//! For each of the 13 forward offsets, node p is joined to node p + delta in linear numbering; a bit for every node says
//! whether the spring is there, so there are no borders to treat. Own forces stay in registers, and so do the opposite forces until all
//! is known that neighbouring offsets subtract further on.

use std::ops::Range;

use super::super::super::Vec3;
use super::super::lattice_springs::{Coefficients, Elasticity, LatticeSprings};
use super::cores::Cores;
use super::nodes::{Arrays, LANES, Lane};
use super::pull::{Springs, scale, shortest};
use super::simd::{InstructionSet, Simd, Work};
#[cfg(feature = "parallel")]
use crate::error::ModelError;

/// Evaluates the springs of a lattice.
#[derive(Clone, Debug)]
pub(crate) struct LatticeKernel {
    parts: Vec<LatticePart>,
    set: InstructionSet,
    cores: Cores,
}

impl LatticeKernel {
    pub(crate) fn new(springs: &LatticeSprings) -> Self {
        let mut new = Self { parts: Vec::new(), set: InstructionSet::detect(), cores: Cores::default() };
        new.divide(springs, 1);
        new
    }

    pub(crate) fn set_instruction_set(&mut self, set: InstructionSet) {
        self.set = set;
    }

    /// For the `springs` of a part of the lattice, on the same cores.
    pub(crate) fn of_part(&self, springs: &LatticeSprings) -> Self {
        let mut new = Self { parts: Vec::new(), set: self.set, cores: self.cores.clone() };
        new.divide(springs, self.parts.len());
        new
    }

    #[cfg(feature = "parallel")]
    pub(crate) fn set_cores(&mut self, springs: &LatticeSprings, cores: usize) -> Result<(), ModelError> {
        self.cores = Cores::new(cores)?;
        self.divide(springs, cores);
        Ok(())
    }

    fn divide(&mut self, springs: &LatticeSprings, parts: usize) {
        let eights = springs.exist.len();
        let parts = parts.min(eights);
        let part = |n: usize| LatticePart::new(springs, n * eights / parts..(n + 1) * eights / parts);
        self.parts = (0..parts).map(part).collect();
    }

    /// Writes the spring force on every node to `out`.
    pub(crate) fn forces(
        &mut self,
        springs: &LatticeSprings,
        positions: &[Vec3],
        velocities: &[Vec3],
        out: &mut [Vec3],
    ) {
        let Self { parts, set, cores } = self;
        let mut rest = &mut *out;
        let pieces = parts.iter_mut().map(|part| {
            let piece = rest.split_off_mut(..part.own().len()).unwrap_or_default();
            (part, piece)
        });
        cores.each(pieces, |(part, out)| part.forces(*set, springs, positions, velocities, out));
        for part in parts {
            part.add_beyond(&mut out[part.own().end..]);
        }
    }
}

/// The springs that begin in a range of nodes, with working memory of their own: what one core does.
#[derive(Clone, Debug)]
struct LatticePart {
    /// The range in eights of nodes.
    eights: Range<usize>,
    /// The nodes that the springs touch: those of the range and what is in their reach.
    nodes: Range<usize>,
    arrays: Arrays,
}

impl LatticePart {
    fn new(springs: &LatticeSprings, eights: Range<usize>) -> Self {
        let first = eights.start * LANES;
        let end = eights.end * LANES + springs.reach();
        // Forces begin an eight later, and end one later: what is subtracted from nodes before the first and beyond the last is nothing.
        Self { nodes: first..end.min(springs.nodes), arrays: Arrays::new(end - first + 2 * LANES), eights }
    }

    /// The nodes in whose range the springs begin.
    fn own(&self) -> Range<usize> {
        self.nodes.start..(self.eights.end * LANES).min(self.nodes.end)
    }

    /// Computes the forces of the springs; writes those on the own nodes to `out`.
    fn forces(
        &mut self,
        set: InstructionSet,
        springs: &LatticeSprings,
        positions: &[Vec3],
        velocities: &[Vec3],
        out: &mut [Vec3],
    ) {
        let positions = &positions[self.nodes.clone()];
        let velocities = &velocities[self.nodes.clone()];
        set.run(Evaluation { part: self, springs, positions, velocities, out });
    }

    /// Adds the forces on nodes beyond the own ones to `rest`, which begins where these end.
    fn add_beyond(&mut self, rest: &mut [Vec3]) {
        let (beyond, own) = (self.nodes.end - self.own().end, LANES + self.own().len());
        let (_, [x, y, z]) = self.arrays.split();
        for (n, force) in rest[..beyond].iter_mut().enumerate() {
            *force += Vec3::new(x[own + n], y[own + n], z[own + n]);
        }
    }
}

struct Evaluation<'a> {
    part: &'a mut LatticePart,
    springs: &'a LatticeSprings,
    positions: &'a [Vec3],
    velocities: &'a [Vec3],
    out: &'a mut [Vec3],
}

impl Work for Evaluation<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { part, springs, positions, velocities, out } = self;
        let eights = part.eights.clone();
        let ([x, y, z, u, v, w], [fx, fy, fz]) = part.arrays.split();
        load(s, positions, [&mut *x, &mut *y, &mut *z]);
        load(s, velocities, [&mut *u, &mut *v, &mut *w]);
        fx.fill(0.0);
        fy.fill(0.0);
        fz.fill(0.0);
        let (motion, forces) = ([&*x, &*y, &*z, &*u, &*v, &*w], [&mut *fx, &mut *fy, &mut *fz]);
        match &springs.elasticity {
            &Elasticity::Uniform { stiffness, damping } => {
                let same = Uniform { number: stiffness, stiffness: s.splat(stiffness), damping: s.splat(damping) };
                accumulate(s, springs, eights, same, motion, forces);
            }
            Elasticity::Varied { sets, set_of } => {
                accumulate(s, springs, eights, Varied { sets, set_of }, motion, forces);
            }
        }
        store(s, [&fx[LANES..], &fy[LANES..], &fz[LANES..]], out);
    }
}

/// The eight doubles from `first` on.
#[inline(always)]
fn lane(array: &[f64], first: usize) -> &Lane {
    (&array[first..first + LANES]).try_into().expect("as long as a lane")
}

#[inline(always)]
fn lane_mut(array: &mut [f64], first: usize) -> &mut Lane {
    (&mut array[first..first + LANES]).try_into().expect("as long as a lane")
}

/// Vectors to coordinate arrays.
#[inline(always)]
fn load<S: Simd>(s: S, vectors: &[Vec3], [x, y, z]: [&mut [f64]; 3]) {
    let (eights, rest) = vectors.as_chunks();
    for (n, eight) in eights.iter().enumerate() {
        let axes = s.load_vectors(eight);
        s.store(axes[0], lane_mut(x, n * LANES));
        s.store(axes[1], lane_mut(y, n * LANES));
        s.store(axes[2], lane_mut(z, n * LANES));
    }
    for (n, vector) in rest.iter().enumerate() {
        let n = eights.len() * LANES + n;
        (x[n], y[n], z[n]) = (vector.x, vector.y, vector.z);
    }
}

/// Coordinate arrays to vectors.
#[inline(always)]
fn store<S: Simd>(s: S, [x, y, z]: [&[f64]; 3], vectors: &mut [Vec3]) {
    let (eights, rest) = vectors.as_chunks_mut();
    let done = eights.len() * LANES;
    for (n, eight) in eights.iter_mut().enumerate() {
        let first = n * LANES;
        s.store_vectors([s.load(lane(x, first)), s.load(lane(y, first)), s.load(lane(z, first))], eight);
    }
    for (n, vector) in rest.iter_mut().enumerate() {
        *vector = Vec3::new(x[done + n], y[done + n], z[done + n]);
    }
}

/// Where the coefficients of eight springs come from.
trait Source<S: Simd>: Copy {
    /// What belongs to eight nodes.
    type Eight: Copy;

    fn eight(self, eight: usize) -> Self::Eight;
    /// Stiffness, damping and k L0 of the springs from there in `direction`.
    fn springs(self, s: S, eight: Self::Eight, direction: usize, rest_length: f64) -> [S::V; 3];
}

/// The same for all springs: kept in registers.
#[derive(Clone, Copy)]
struct Uniform<S: Simd> {
    number: f64,
    stiffness: S::V,
    damping: S::V,
}

impl<S: Simd> Source<S> for Uniform<S> {
    type Eight = ();

    #[inline(always)]
    fn eight(self, _: usize) {}

    #[inline(always)]
    fn springs(self, s: S, (): (), _: usize, rest_length: f64) -> [S::V; 3] {
        [self.stiffness, self.damping, s.splat(self.number * rest_length)]
    }
}

/// Those of several materials.
#[derive(Clone, Copy)]
struct Varied<'a> {
    sets: &'a [Coefficients],
    set_of: &'a [u32],
}

impl<'a, S: Simd> Source<S> for Varied<'a> {
    type Eight = &'a Coefficients;

    #[inline(always)]
    fn eight(self, eight: usize) -> &'a Coefficients {
        &self.sets[self.set_of[eight] as usize]
    }

    #[inline(always)]
    fn springs(self, s: S, eight: &'a Coefficients, direction: usize, rest_length: f64) -> [S::V; 3] {
        let stiffness = s.load(&eight.stiffness[direction]);
        [stiffness, s.load(&eight.damping[direction]), s.mul(stiffness, s.splat(rest_length))]
    }
}

/// What the springs of an eight, in one direction, push at the nodes further on (N).
type Pushes<S> = [<S as Simd>::V; 3];

/// What is still to be subtracted from nodes of another row of the lattice, to which three offsets lead: to the column before, the same
/// and the next. Their ends overlap by all but one node. They are summed in registers, one eight later, when all is known of them:
/// what one offset subtracted would have to be in memory before the next one could go on.
#[derive(Clone, Copy)]
struct Pending<S: Simd> {
    /// What is known of the sums.
    sums: Pushes<S>,
    /// Of the springs to the column before, and to the next.
    back: Pushes<S>,
    on: Pushes<S>,
    /// Eights until nothing is left.
    left: u8,
}

impl<S: Simd> Pending<S> {
    #[inline(always)]
    fn none(s: S) -> Self {
        let none = [s.splat(0.0); 3];
        Self { sums: none, back: none, on: none, left: 0 }
    }

    /// Subtracts what the eight before pushed at the nodes from `end` on, and takes what the present one pushes.
    #[inline(always)]
    fn take(&mut self, s: S, [back, same, on]: [Pushes<S>; 3], forces: &mut [&mut [f64]; 3], end: usize) {
        for axis in 0..3 {
            let sum = s.add(self.sums[axis], s.shift_down(self.back[axis], back[axis]));
            let force = lane_mut(forces[axis], end);
            s.store(s.sub(s.load(force), sum), force);
            self.sums[axis] = s.add(same[axis], s.shift_up(self.on[axis], on[axis]));
        }
        (self.back, self.on) = (back, on);
    }
}

/// Positions and velocities of eight nodes.
#[derive(Clone, Copy)]
struct Eight<S: Simd> {
    positions: [S::V; 3],
    velocities: [S::V; 3],
}

impl<S: Simd> Eight<S> {
    #[inline(always)]
    fn load(s: S, [x, y, z, u, v, w]: &[&[f64]; 6], first: usize) -> Self {
        Self {
            positions: [s.load(lane(x, first)), s.load(lane(y, first)), s.load(lane(z, first))],
            velocities: [s.load(lane(u, first)), s.load(lane(v, first)), s.load(lane(w, first))],
        }
    }

    /// The forces (N) of springs to the nodes of `other`, where there are `bits`, with stiffness, damping and k L0.
    #[inline(always)]
    fn pull(
        &self,
        s: S,
        other: &Self,
        bits: u8,
        [stiffness, damping, preload]: [S::V; 3],
        rest_length: f64,
    ) -> Pushes<S> {
        let (mut along, mut closing) = ([s.splat(0.0); 3], [s.splat(0.0); 3]);
        for axis in 0..3 {
            along[axis] = s.sub(other.positions[axis], self.positions[axis]);
            closing[axis] = s.sub(other.velocities[axis], self.velocities[axis]);
        }
        let shortest = s.splat(shortest(rest_length));
        let joined = Springs { exist: s.mask(bits), stiffness, damping, preload, shortest };
        let scale = scale(s, &along, &closing, &joined);
        for pull in &mut along {
            *pull = s.mul(scale, *pull);
        }
        along
    }
}

/// Adds up what all springs pull: `forces` begin an eight before the nodes.
#[inline(always)]
fn accumulate<S: Simd, C: Source<S>>(
    s: S,
    springs: &LatticeSprings,
    eights: Range<usize>,
    source: C,
    motion: [&[f64]; 6],
    forces: [&mut [f64]; 3],
) {
    let none = [s.splat(0.0); 3];
    // All are equally long: bounds are checked once for all of them.
    let ([x, ..], [fx, ..]) = (&motion, &forces);
    let (length, room) = (x.len(), fx.len());
    let [x, y, z, u, v, w] = motion;
    let motion = [&x[..length], &y[..length], &z[..length], &u[..length], &v[..length], &w[..length]];
    let [fx, fy, fz] = forces;
    let mut forces = [&mut fx[..room], &mut fy[..room], &mut fz[..room]];
    let [along_row, rows @ ..] = &springs.offsets;
    let rows = rows.as_chunks::<3>().0;
    let (mut pending, mut before) = ([Pending::none(s); 4], none);
    let count = eights.len();
    for (n, eight) in eights.enumerate() {
        let first = n * LANES;
        let (coefficients, [along_bits, bits @ ..]) = (source.eight(eight), &springs.exist[eight]);
        let here = Eight::load(s, &motion, first);
        let mut own = none;
        let mut pushed = none;
        if *along_bits != 0 {
            let of_spring = source.springs(s, coefficients, 0, along_row.rest_length);
            let other = Eight::load(s, &motion, first + along_row.delta);
            pushed = here.pull(s, &other, *along_bits, of_spring, along_row.rest_length);
            own = pushed;
        }
        for axis in 0..3 {
            own[axis] = s.sub(own[axis], s.shift_up(before[axis], pushed[axis]));
        }
        before = pushed;
        for (row, (bits, pending)) in bits.as_chunks::<3>().0.iter().zip(&mut pending).enumerate() {
            if *bits == [0; 3] && pending.left == 0 {
                continue;
            }
            let mut pushes = [none; 3];
            for column in 0..3 {
                if bits[column] == 0 {
                    continue;
                }
                let offset = &rows[row][column];
                let of_spring = source.springs(s, coefficients, 1 + 3 * row + column, offset.rest_length);
                let other = Eight::load(s, &motion, first + offset.delta);
                pushes[column] = here.pull(s, &other, bits[column], of_spring, offset.rest_length);
                for axis in 0..3 {
                    own[axis] = s.add(own[axis], pushes[column][axis]);
                }
            }
            pending.left = if *bits == [0; 3] { pending.left - 1 } else { 2 };
            pending.take(s, pushes, &mut forces, first + rows[row][1].delta);
        }
        for axis in 0..3 {
            let force = lane_mut(forces[axis], LANES + first);
            s.store(s.add(s.load(force), own[axis]), force);
        }
    }
    let first = count * LANES;
    for axis in 0..3 {
        let force = lane_mut(forces[axis], LANES + first);
        s.store(s.sub(s.load(force), s.shift_up(before[axis], none[axis])), force);
    }
    for (row, pending) in rows.iter().zip(&mut pending) {
        for n in 0..usize::from(pending.left) {
            pending.take(s, [none; 3], &mut forces, first + n * LANES + row[1].delta);
        }
    }
}
