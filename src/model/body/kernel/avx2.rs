//! AVX2 with fused multiply-add: eight doubles in two registers, exact root and division.
//!
//! A value of [`Avx2`] is made by [`Avx2::detect`] alone, so whoever has one may call the instructions: that is the reason
//! why every block here is sound. Loads and stores go through references to whole arrays.

use std::arch::x86_64::*;

use super::nodes::{LANES, Lane, Motion, Push, Singles};
use super::simd::{Numbers, Simd, Work};

/// Proof that this machine has AVX2 and FMA.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

/// Lanes 0 to 3, lanes 4 to 7.
type Pair = [__m256d; 2];

impl Avx2 {
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        let is_there = std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
        is_there.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run(self, work: impl Work) {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { compiled(self, work) }
    }

    /// Rows of four doubles to columns.
    #[inline(always)]
    fn transpose(self, [a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
        // SAFETY: the features were detected.
        unsafe {
            let (ab, cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
            let (ba, dc) = (_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
            [
                _mm256_permute2f128_pd::<0x20>(ab, cd),
                _mm256_permute2f128_pd::<0x20>(ba, dc),
                _mm256_permute2f128_pd::<0x31>(ab, cd),
                _mm256_permute2f128_pd::<0x31>(ba, dc),
            ]
        }
    }
}

#[target_feature(enable = "avx2,fma")]
fn compiled(set: Avx2, work: impl Work) {
    work.run(set);
}

/// Operations that are one instruction for each half.
macro_rules! lanewise {
    ($($name:ident($($x:ident),+) = $instruction:ident;)+) => {$(
        #[inline(always)]
        fn $name(self, $($x: Pair),+) -> Pair {
            // SAFETY: the features were detected.
            unsafe { [$instruction($($x[0]),+), $instruction($($x[1]),+)] }
        }
    )+};
}

impl Simd for Avx2 {
    type V = Pair;
    type M = Pair;
    type W = [__m256; 2];

    #[inline(always)]
    fn splat(self, value: f64) -> Pair {
        // SAFETY: the features were detected.
        unsafe { [_mm256_set1_pd(value); 2] }
    }

    #[inline(always)]
    fn load(self, from: &Lane) -> Pair {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe { [_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from.as_ptr().add(4))] }
    }

    #[inline(always)]
    fn store(self, value: Pair, to: &mut Lane) {
        // SAFETY: the features were detected; the reference covers all that is written.
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), value[0]);
            _mm256_storeu_pd(to.as_mut_ptr().add(4), value[1]);
        }
    }

    lanewise! {
        add(a, b) = _mm256_add_pd;
        sub(a, b) = _mm256_sub_pd;
        mul(a, b) = _mm256_mul_pd;
        larger(a, b) = _mm256_max_pd;
        mul_add(a, b, c) = _mm256_fmadd_pd;
        mul_sub_from(a, b, c) = _mm256_fnmadd_pd;
    }

    #[inline(always)]
    fn inverse_root(self, x: Pair) -> Pair {
        // SAFETY: the features were detected.
        unsafe {
            let one = _mm256_set1_pd(1.0);
            [_mm256_div_pd(one, _mm256_sqrt_pd(x[0])), _mm256_div_pd(one, _mm256_sqrt_pd(x[1]))]
        }
    }

    #[inline(always)]
    fn keep(self, bits: Pair, x: Pair, limit: Pair, value: Pair) -> Pair {
        // SAFETY: the features were detected.
        unsafe {
            let is_long = [
                _mm256_and_pd(bits[0], _mm256_cmp_pd::<_CMP_NLT_UQ>(x[0], limit[0])),
                _mm256_and_pd(bits[1], _mm256_cmp_pd::<_CMP_NLT_UQ>(x[1], limit[1])),
            ];
            [_mm256_and_pd(is_long[0], value[0]), _mm256_and_pd(is_long[1], value[1])]
        }
    }

    #[inline(always)]
    fn mask(self, bits: u8) -> Pair {
        // SAFETY: the features were detected.
        unsafe {
            let all = _mm256_set1_epi64x(i64::from(bits));
            let (low, high) = (_mm256_setr_epi64x(1, 2, 4, 8), _mm256_setr_epi64x(16, 32, 64, 128));
            [
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(all, low), low)),
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(all, high), high)),
            ]
        }
    }

    #[inline(always)]
    fn splat_single(self, value: f32) -> [__m256; 2] {
        // SAFETY: the features were detected.
        unsafe { [_mm256_set1_ps(value); 2] }
    }

    #[inline(always)]
    fn load_singles(self, from: &Singles) -> [__m256; 2] {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(LANES))] }
    }

    #[inline(always)]
    fn store_singles(self, value: [__m256; 2], to: &mut Singles) {
        // SAFETY: the features were detected; the reference covers all that is written.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), value[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(LANES), value[1]);
        }
    }

    #[inline(always)]
    fn mul_add_single(self, a: [__m256; 2], b: [__m256; 2], c: [__m256; 2]) -> [__m256; 2] {
        // SAFETY: the features were detected.
        unsafe { [_mm256_fmadd_ps(a[0], b[0], c[0]), _mm256_fmadd_ps(a[1], b[1], c[1])] }
    }

    #[inline(always)]
    fn load_halves(self, from: &[u32; 2 * LANES]) -> [[__m256; 2]; 2] {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe {
            let low = _mm256_loadu_si256(from.as_ptr().cast());
            let high = _mm256_loadu_si256(from.as_ptr().add(LANES).cast());
            let lower = [_mm256_slli_epi32::<16>(low), _mm256_slli_epi32::<16>(high)];
            [
                [_mm256_castsi256_ps(lower[0]), _mm256_castsi256_ps(lower[1])],
                [_mm256_castsi256_ps(low), _mm256_castsi256_ps(high)],
            ]
        }
    }

    #[inline(always)]
    fn shift_down(self, a: Pair, b: Pair) -> Pair {
        // SAFETY: the features were detected.
        unsafe {
            let (low, high) = (_mm256_permute2f128_pd::<0x21>(a[0], a[1]), _mm256_permute2f128_pd::<0x21>(a[1], b[0]));
            [_mm256_shuffle_pd::<0b0101>(a[0], low), _mm256_shuffle_pd::<0b0101>(a[1], high)]
        }
    }

    #[inline(always)]
    fn shift_up(self, a: Pair, b: Pair) -> Pair {
        // SAFETY: the features were detected.
        unsafe {
            let (low, high) = (_mm256_permute2f128_pd::<0x21>(a[1], b[0]), _mm256_permute2f128_pd::<0x21>(b[0], b[1]));
            [_mm256_shuffle_pd::<0b0101>(low, b[0]), _mm256_shuffle_pd::<0b0101>(high, b[1])]
        }
    }

    #[inline(always)]
    fn differences(self, nodes: &[Motion], from: &Numbers, to: &Numbers) -> [[Pair; 4]; 2] {
        // SAFETY: the features were detected; a motion is eight doubles.
        unsafe {
            let mut differences = [[[_mm256_setzero_pd(); 2]; 4]; 2];
            for half in 0..2 {
                let mut rows = [[_mm256_setzero_pd(); 4]; 2];
                for lane in 0..4 {
                    let there = self.load(&nodes[to[4 * half + lane] as usize].0);
                    let here = self.load(&nodes[from[4 * half + lane] as usize].0);
                    rows[0][lane] = _mm256_sub_pd(there[0], here[0]);
                    rows[1][lane] = _mm256_sub_pd(there[1], here[1]);
                }
                for kind in 0..2 {
                    let columns = self.transpose(rows[kind]);
                    for (number, &column) in columns.iter().enumerate() {
                        differences[kind][number][half] = column;
                    }
                }
            }
            differences
        }
    }

    #[inline(always)]
    fn fourth(self, nodes: &[Motion], at: &Numbers) -> Pair {
        // SAFETY: the features were detected; a motion is eight doubles.
        unsafe {
            let mut fourth = [_mm256_setzero_pd(); 2];
            for half in 0..2 {
                // No closure, for the reason that AVX-512's says.
                let mut rows = [_mm256_setzero_pd(); 4];
                for lane in 0..4 {
                    rows[lane] = _mm256_loadu_pd(nodes[at[4 * half + lane] as usize].0.as_ptr());
                }
                fourth[half] = self.transpose(rows)[3];
            }
            fourth
        }
    }

    #[inline(always)]
    fn exchange(self, [x, y, z]: [Pair; 3], forces: &mut [Push], from: &Numbers, to: &Numbers) {
        // SAFETY: the features were detected; a push is four doubles.
        unsafe {
            for half in 0..2 {
                let rows = self.transpose([x[half], y[half], z[half], _mm256_setzero_pd()]);
                for lane in 0..4 {
                    let own = &mut forces[from[4 * half + lane] as usize].0;
                    _mm256_storeu_pd(own.as_mut_ptr(), _mm256_add_pd(_mm256_loadu_pd(own.as_ptr()), rows[lane]));
                    let other = &mut forces[to[4 * half + lane] as usize].0;
                    _mm256_storeu_pd(other.as_mut_ptr(), _mm256_sub_pd(_mm256_loadu_pd(other.as_ptr()), rows[lane]));
                }
            }
        }
    }

    #[inline(always)]
    fn push(self, [x, y, z]: [Pair; 3], forces: &mut [Push], to: &Numbers) {
        // SAFETY: the features were detected; a push is four doubles.
        unsafe {
            for half in 0..2 {
                let rows = self.transpose([x[half], y[half], z[half], _mm256_setzero_pd()]);
                for lane in 0..4 {
                    let own = &mut forces[to[4 * half + lane] as usize].0;
                    _mm256_storeu_pd(own.as_mut_ptr(), _mm256_add_pd(_mm256_loadu_pd(own.as_ptr()), rows[lane]));
                }
            }
        }
    }
}
