//! The spring forces of a lattice, eight nodes at once.
//!
//! For each of the 13 forward offsets, node p is joined to node p + delta in linear numbering; a bit for every node says
//! whether the spring is there, so there are no borders to treat. Own forces stay in registers, the opposite forces are
//! subtracted further on.

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
        Self { nodes: first..end.min(springs.nodes), arrays: Arrays::new(end - first), eights }
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
        let (beyond, own) = (self.nodes.end - self.own().end, self.own().len());
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
        store(s, [fx, fy, fz], out);
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

#[inline(always)]
fn accumulate<S: Simd, C: Source<S>>(
    s: S,
    springs: &LatticeSprings,
    eights: Range<usize>,
    source: C,
    [x, y, z, u, v, w]: [&[f64]; 6],
    [fx, fy, fz]: [&mut [f64]; 3],
) {
    for (n, eight) in eights.enumerate() {
        let first = n * LANES;
        let coefficients = source.eight(eight);
        let here = [s.load(lane(x, first)), s.load(lane(y, first)), s.load(lane(z, first))];
        let speed = [s.load(lane(u, first)), s.load(lane(v, first)), s.load(lane(w, first))];
        let mut own = [s.splat(0.0); 3];
        for (direction, (bits, offset)) in springs.exist[eight].iter().zip(&springs.offsets).enumerate() {
            if *bits == 0 {
                continue;
            }
            let other = first + offset.delta;
            let along = [
                s.sub(s.load(lane(x, other)), here[0]),
                s.sub(s.load(lane(y, other)), here[1]),
                s.sub(s.load(lane(z, other)), here[2]),
            ];
            let closing = [
                s.sub(s.load(lane(u, other)), speed[0]),
                s.sub(s.load(lane(v, other)), speed[1]),
                s.sub(s.load(lane(w, other)), speed[2]),
            ];
            let [stiffness, damping, preload] = source.springs(s, coefficients, direction, offset.rest_length);
            let shortest = s.splat(shortest(offset.rest_length));
            let joined = Springs { exist: s.mask(*bits), stiffness, damping, preload, shortest };
            let scale = scale(s, &along, &closing, &joined);
            for axis in 0..3 {
                own[axis] = s.mul_add(scale, along[axis], own[axis]);
            }
            let opposite = lane_mut(fx, other);
            s.store(s.mul_sub_from(scale, along[0], s.load(opposite)), opposite);
            let opposite = lane_mut(fy, other);
            s.store(s.mul_sub_from(scale, along[1], s.load(opposite)), opposite);
            let opposite = lane_mut(fz, other);
            s.store(s.mul_sub_from(scale, along[2], s.load(opposite)), opposite);
        }
        let force = lane_mut(fx, first);
        s.store(s.add(s.load(force), own[0]), force);
        let force = lane_mut(fy, first);
        s.store(s.add(s.load(force), own[1]), force);
        let force = lane_mut(fz, first);
        s.store(s.add(s.load(force), own[2]), force);
    }
}
