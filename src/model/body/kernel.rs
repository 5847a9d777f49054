//! The spring forces of a lattice, eight nodes at once.
//!
//! For each of the 13 forward offsets, node p is joined to node p + delta in linear numbering; where the lattice ends
//! the stiffness and damping are zero, so there are no borders to treat. Own forces stay in registers, the opposite
//! forces are subtracted further on. The code is plain arithmetic that the compiler vectorises for the instruction
//! set chosen at run time; it uses no fused multiply-add and no approximate roots, so every set gives the same bits.

use super::super::Vec3;
use super::lattice_springs::{LANES, LatticeSprings};
use super::spring::Spring;

type Lane = [f64; LANES];

/// Nodes as separate coordinate arrays, padded so that no block reads past the end.
#[derive(Clone, Debug, Default)]
pub(super) struct Coordinates {
    axes: [Vec<f64>; 3],
}

impl Coordinates {
    pub(super) fn new(padded: usize) -> Self {
        Self { axes: std::array::from_fn(|_| vec![0.0; padded]) }
    }

    fn load(&mut self, vectors: &[Vec3]) {
        let [x, y, z] = &mut self.axes;
        for (((vector, x), y), z) in vectors.iter().zip(x).zip(y).zip(z) {
            (*x, *y, *z) = (vector.x, vector.y, vector.z);
        }
    }

    fn clear(&mut self) {
        self.axes.iter_mut().for_each(|axis| axis.fill(0.0));
    }

    #[inline(always)]
    fn lanes(&self, first: usize) -> [Lane; 3] {
        std::array::from_fn(|axis| {
            let mut lane = [0.0; LANES];
            lane.copy_from_slice(&self.axes[axis][first..first + LANES]);
            lane
        })
    }
}

/// Working memory of the kernel.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    positions: Coordinates,
    velocities: Coordinates,
    forces: Coordinates,
    set: InstructionSet,
}

impl Scratch {
    pub(super) fn new(padded: usize) -> Self {
        let coordinates = || Coordinates::new(padded);
        Self {
            positions: coordinates(),
            velocities: coordinates(),
            forces: coordinates(),
            set: InstructionSet::detect(),
        }
    }
}

/// The instruction set that the kernel runs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstructionSet {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512dq") {
                return Self::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }
}

/// The instruction set that lattice forces are computed with on this machine.
pub(super) fn instruction_set() -> &'static str {
    match InstructionSet::detect() {
        InstructionSet::Portable => "portable",
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => "avx2",
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => "avx512",
    }
}

/// Writes the spring force on every node to `out`.
pub(super) fn forces(
    springs: &LatticeSprings,
    scratch: &mut Scratch,
    positions: &[Vec3],
    velocities: &[Vec3],
    out: &mut [Vec3],
) {
    scratch.positions.load(positions);
    scratch.velocities.load(velocities);
    scratch.forces.clear();
    match scratch.set {
        InstructionSet::Portable => accumulate(springs, scratch),
        // SAFETY: `detect` found the features that the function is compiled for on this very machine.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { accumulate_avx2(springs, scratch) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { accumulate_avx512(springs, scratch) },
    }
    let [x, y, z] = &scratch.forces.axes;
    for (((force, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
        *force = Vec3::new(*x, *y, *z);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn accumulate_avx2(springs: &LatticeSprings, scratch: &mut Scratch) {
    accumulate(springs, scratch);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn accumulate_avx512(springs: &LatticeSprings, scratch: &mut Scratch) {
    accumulate(springs, scratch);
}

#[inline(always)]
fn accumulate(springs: &LatticeSprings, scratch: &mut Scratch) {
    let Scratch { positions, velocities, forces, .. } = scratch;
    for first in (0..springs.nodes()).step_by(LANES) {
        let (here, speed) = (positions.lanes(first), velocities.lanes(first));
        let mut own = [[0.0; LANES]; 3];
        for offset in springs.offsets() {
            let other = first + offset.delta;
            let (there, their_speed) = (positions.lanes(other), velocities.lanes(other));
            let pull = spring_lanes(
                &here,
                &there,
                &speed,
                &their_speed,
                &offset.stiffness[first..first + LANES],
                &offset.damping[first..first + LANES],
                offset.rest_length,
            );
            for axis in 0..3 {
                let opposite = &mut forces.axes[axis][other..other + LANES];
                for lane in 0..LANES {
                    own[axis][lane] += pull[axis][lane];
                    opposite[lane] -= pull[axis][lane];
                }
            }
        }
        for (axis, own) in forces.axes.iter_mut().zip(&own) {
            for (force, own) in axis[first..first + LANES].iter_mut().zip(own) {
                *force += own;
            }
        }
    }
}

/// [`Spring::force`] for eight springs: the same expression, with a select where the single one branches.
#[inline(always)]
fn spring_lanes(
    here: &[Lane; 3],
    there: &[Lane; 3],
    speed: &[Lane; 3],
    their_speed: &[Lane; 3],
    stiffness: &[f64],
    damping: &[f64],
    rest_length: f64,
) -> [Lane; 3] {
    let mut pull = [[0.0; LANES]; 3];
    let shortest = Spring::COLLAPSED * rest_length;
    for lane in 0..LANES {
        let along: [f64; 3] =
            [there[0][lane] - here[0][lane], there[1][lane] - here[1][lane], there[2][lane] - here[2][lane]];
        let closing = [
            their_speed[0][lane] - speed[0][lane],
            their_speed[1][lane] - speed[1][lane],
            their_speed[2][lane] - speed[2][lane],
        ];
        let length = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]).sqrt();
        let inverse = if length < shortest { 0.0 } else { 1.0 / length };
        let rate = (along[0] * closing[0] + along[1] * closing[1] + along[2] * closing[2]) * inverse;
        let tension = stiffness[lane] * (length - rest_length) + damping[lane] * rate;
        let scale = tension * inverse;
        for axis in 0..3 {
            pull[axis][lane] = scale * along[axis];
        }
    }
    pull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::mesh::Lattice;

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let lattice = Lattice { nodes: [5, 7, 3] };
        let springs = LatticeSprings::uniform(&lattice, [0.01, 0.012, 0.009], 30.0, 0.05);
        let wobble = |n: usize, scale: f64| {
            let n = n as f64;
            Vec3::new((n * 0.7).sin(), (n * 1.3).cos(), (n * 0.3).sin()) * scale
        };
        let positions: Vec<Vec3> = (0..lattice.len())
            .map(|n| {
                let at = lattice.coordinates(n as u32).map(|c| c as f64);
                Vec3::new(at[0] * 0.01, at[1] * 0.012, at[2] * 0.009) + wobble(n, 1e-3)
            })
            .collect();
        let velocities: Vec<Vec3> = (0..lattice.len()).map(|n| wobble(n + 100, 0.2)).collect();
        let mut scratch = Scratch::new(springs.padded());
        let mut run = |set| {
            scratch.set = set;
            let mut out = vec![Vec3::zeros(); lattice.len()];
            forces(&springs, &mut scratch, &positions, &velocities, &mut out);
            out
        };
        let portable = run(InstructionSet::Portable);
        assert!(portable.iter().any(|force| force.norm() > 1e-3));
        assert_eq!(run(InstructionSet::detect()), portable);

        for node in 0..lattice.len() as u32 {
            let expected = springs.neighbours(&lattice, node).fold(Vec3::zeros(), |sum, (other, spring)| {
                let (i, j) = (node as usize, other as usize);
                sum + spring.force(positions[j] - positions[i], velocities[j] - velocities[i])
            });
            assert!((portable[node as usize] - expected).norm() < 1e-13, "node {node}");
        }
    }
}
