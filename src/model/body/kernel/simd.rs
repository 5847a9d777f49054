//! Eight doubles at once, or sixteen singles: what the force kernels ask of an instruction set, and the choice of one at run time.

use super::super::super::Vec3;
use super::nodes::{LANES, Lane, Motion, Push, Singles};
use super::portable::Portable;
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512};
use crate::error::ModelError;

/// Eight node numbers.
pub(super) type Numbers = [u32; LANES];

/// The operations of the kernels on eight doubles. A value of an implementing type is proof that this machine has the
/// instruction set, so the methods are safe to call.
///
/// All of them are to be inlined into one function that is compiled for the set: no closures on the way.
pub(crate) trait Simd: Copy {
    /// Eight doubles in registers.
    type V: Copy;
    /// A yes or no for each of them.
    type M: Copy;
    /// Sixteen singles in registers.
    type W: Copy;

    fn splat(self, value: f64) -> Self::V;
    fn load(self, from: &Lane) -> Self::V;
    fn store(self, value: Self::V, to: &mut Lane);
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// a if it is larger than b, else b.
    fn larger(self, a: Self::V, b: Self::V) -> Self::V;
    /// a b + c.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// c - a b.
    fn mul_sub_from(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// a b + c with one rounding on every set: where the processor family has no instruction for it, a function computes it.
    #[inline(always)]
    fn fused(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        self.mul_add(a, b, c)
    }
    /// c - a b with one rounding.
    #[inline(always)]
    fn fused_from(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        self.mul_sub_from(a, b, c)
    }
    /// 1 / sqrt(x), to 4e-16 of itself.
    fn inverse_root(self, x: Self::V) -> Self::V;
    /// `value` where the bit of the lane is set and `x` is not below `limit` (a NaN is not), else 0.
    fn keep(self, bits: Self::M, x: Self::V, limit: Self::V, value: Self::V) -> Self::V;
    /// The lowest bit belongs to the first lane.
    fn mask(self, bits: u8) -> Self::M;

    fn splat_single(self, value: f32) -> Self::W;
    fn load_singles(self, from: &Singles) -> Self::W;
    fn store_singles(self, value: Self::W, to: &mut Singles);
    /// a b + c of singles.
    fn mul_add_single(self, a: Self::W, b: Self::W, c: Self::W) -> Self::W;
    /// Sixteen words as the singles whose upper halves their lower halves are, and as the singles that they are.
    fn load_halves(self, from: &[u32; 2 * LANES]) -> [Self::W; 2];

    /// The last seven of `a`, and the first of `b`.
    fn shift_down(self, a: Self::V, b: Self::V) -> Self::V;
    /// The last of `a`, and the first seven of `b`.
    fn shift_up(self, a: Self::V, b: Self::V) -> Self::V;

    /// Eight vectors as their coordinates.
    #[inline(always)]
    fn load_vectors(self, from: &[Vec3; LANES]) -> [Self::V; 3] {
        let mut axes = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            (axes[0][lane], axes[1][lane], axes[2][lane]) = (from[lane].x, from[lane].y, from[lane].z);
        }
        [self.load(&axes[0]), self.load(&axes[1]), self.load(&axes[2])]
    }

    /// Coordinates as eight vectors.
    #[inline(always)]
    fn store_vectors(self, value: [Self::V; 3], to: &mut [Vec3; LANES]) {
        let mut axes = [[0.0; LANES]; 3];
        for axis in 0..3 {
            self.store(value[axis], &mut axes[axis]);
        }
        for lane in 0..LANES {
            to[lane] = Vec3::new(axes[0][lane], axes[1][lane], axes[2][lane]);
        }
    }

    /// x_to - x_from and v_to - v_from of eight pairs of nodes, with the fourth numbers of both.
    fn differences(self, nodes: &[Motion], from: &Numbers, to: &Numbers) -> [[Self::V; 4]; 2];
    /// What stands behind the positions of eight nodes.
    fn fourth(self, nodes: &[Motion], at: &Numbers) -> Self::V;
    /// Adds eight forces to the nodes `from` and takes them from the nodes `to`, one pair after the other.
    fn exchange(self, pull: [Self::V; 3], forces: &mut [Push], from: &Numbers, to: &Numbers);
    /// Adds eight forces to the nodes `to`, one after the other.
    fn push(self, force: [Self::V; 3], forces: &mut [Push], to: &Numbers);
}

/// Work that is compiled for each instruction set.
pub(crate) trait Work {
    fn run<S: Simd>(self, simd: S);
}

/// An instruction set that spring forces are computed with. Results are bit-identical from run to run on each; between
/// two of them they differ in the last digits.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Whatever the compiler makes of plain arithmetic for the processor family.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512F and AVX-512DQ.
    Avx512,
}

impl InstructionSet {
    /// All sets, the slowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The fastest that this machine has.
    pub fn detect() -> Self {
        Self::ALL.into_iter().rev().find(|set| set.is_available()).unwrap_or(Self::Portable)
    }

    /// True if this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => Avx2::detect().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => Avx512::detect().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Itself, if this machine has it.
    pub(crate) fn available(self) -> Result<Self, ModelError> {
        let error = || ModelError::of("instruction_set", format!("this machine has no {}", self.name()));
        self.is_available().then_some(self).ok_or_else(error)
    }

    /// Its name in logs and reports.
    pub fn name(self) -> &'static str {
        ["portable", "avx2", "avx512"][self as usize]
    }

    /// Does `work` with this set; with the portable one where the machine lacks it.
    #[inline]
    pub(crate) fn run(self, work: impl Work) {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Avx512 => {
                if let Some(set) = Avx512::detect() {
                    return set.run(work);
                }
            }
            Self::Avx2 => {
                if let Some(set) = Avx2::detect() {
                    return set.run(work);
                }
            }
            Self::Portable => {}
        }
        work.run(Portable);
    }
}
