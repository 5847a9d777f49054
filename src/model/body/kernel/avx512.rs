//! AVX-512: eight doubles in one register, the reciprocal root from the 14-bit estimate and three terms of a series.
//!
//! A value of [`Avx512`] is made by [`Avx512::detect`] alone, so whoever has one may call the instructions: that is the
//! reason why every block here is sound. Loads and stores go through references to whole arrays.

use std::arch::x86_64::*;

use super::super::super::Vec3;
use super::nodes::{LANES, Lane, Motion, Push, Singles};
use super::simd::{Numbers, Simd, Work};

/// Proof that this machine has AVX-512F and AVX-512DQ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx512(());

impl Avx512 {
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        let is_there =
            std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512dq");
        is_there.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run(self, work: impl Work) {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { compiled(self, work) }
    }

    /// Eight vectors, each as x y z 0.
    #[inline(always)]
    fn quads(self, [x, y, z]: [__m512d; 3]) -> [__m256d; LANES] {
        // SAFETY: the features were detected.
        unsafe {
            // By quarters x y of vectors 0 2 4 6 and 1 3 5 7, and z 0.
            let zero = _mm512_setzero_pd();
            let xy = [_mm512_unpacklo_pd(x, y), _mm512_unpackhi_pd(x, y)];
            let z0 = [_mm512_unpacklo_pd(z, zero), _mm512_unpackhi_pd(z, zero)];
            let mut quads = [_mm256_setzero_pd(); LANES];
            for odd in 0..2 {
                // Halves: vectors 0 and 2 (1 and 3), 4 and 6 (5 and 7).
                let low = _mm512_shuffle_f64x2::<0b01_00_01_00>(xy[odd], z0[odd]);
                let high = _mm512_shuffle_f64x2::<0b11_10_11_10>(xy[odd], z0[odd]);
                // low: xy0 xy2 z0 z2, high: xy4 xy6 z4 z6.
                quads[odd] = _mm512_castpd512_pd256(_mm512_shuffle_f64x2::<0b10_00_10_00>(low, low));
                quads[2 + odd] = _mm512_castpd512_pd256(_mm512_shuffle_f64x2::<0b11_01_11_01>(low, low));
                quads[4 + odd] = _mm512_castpd512_pd256(_mm512_shuffle_f64x2::<0b10_00_10_00>(high, high));
                quads[6 + odd] = _mm512_castpd512_pd256(_mm512_shuffle_f64x2::<0b11_01_11_01>(high, high));
            }
            quads
        }
    }
}

#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
fn compiled(set: Avx512, work: impl Work) {
    work.run(set);
}

/// A register from a Vec3 array: 24 doubles without gaps.
const _: () = assert!(size_of::<[Vec3; LANES]>() == 24 * size_of::<f64>());

/// Operations that are one instruction each.
macro_rules! lanewise {
    ($($name:ident($($x:ident),+) = $instruction:ident;)+) => {$(
        #[inline(always)]
        fn $name(self, $($x: __m512d),+) -> __m512d {
            // SAFETY: the features were detected.
            unsafe { $instruction($($x),+) }
        }
    )+};
}

impl Simd for Avx512 {
    type V = __m512d;
    type M = __mmask8;
    type W = __m512;

    #[inline(always)]
    fn splat(self, value: f64) -> __m512d {
        // SAFETY: the features were detected.
        unsafe { _mm512_set1_pd(value) }
    }

    #[inline(always)]
    fn load(self, from: &Lane) -> __m512d {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe { _mm512_loadu_pd(from.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, value: __m512d, to: &mut Lane) {
        // SAFETY: the features were detected; the reference covers all that is written.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), value) }
    }

    lanewise! {
        add(a, b) = _mm512_add_pd;
        sub(a, b) = _mm512_sub_pd;
        mul(a, b) = _mm512_mul_pd;
        larger(a, b) = _mm512_max_pd;
        mul_add(a, b, c) = _mm512_fmadd_pd;
        mul_sub_from(a, b, c) = _mm512_fnmadd_pd;
    }

    #[inline(always)]
    fn inverse_root(self, x: __m512d) -> __m512d {
        // SAFETY: the features were detected.
        unsafe {
            let y = _mm512_rsqrt14_pd(x);
            // e = 1 - x y^2 is below 2^-13. First x times y, so that nothing overflows on the way.
            let e = _mm512_fnmadd_pd(_mm512_mul_pd(x, y), y, _mm512_set1_pd(1.0));
            // (1 - e)^(-1/2) = 1 + e / 2 + 3 e^2 / 8 + 5 e^3 / 16 + ...
            let series = _mm512_fmadd_pd(e, _mm512_set1_pd(5.0 / 16.0), _mm512_set1_pd(3.0 / 8.0));
            let series = _mm512_fmadd_pd(e, series, _mm512_set1_pd(0.5));
            _mm512_fmadd_pd(y, _mm512_mul_pd(e, series), y)
        }
    }

    #[inline(always)]
    fn keep(self, bits: __mmask8, x: __m512d, limit: __m512d, value: __m512d) -> __m512d {
        // SAFETY: the features were detected.
        unsafe { _mm512_maskz_mov_pd(_mm512_mask_cmp_pd_mask::<_CMP_NLT_UQ>(bits, x, limit), value) }
    }

    #[inline(always)]
    fn mask(self, bits: u8) -> __mmask8 {
        bits
    }

    #[inline(always)]
    fn splat_single(self, value: f32) -> __m512 {
        // SAFETY: the features were detected.
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn load_singles(self, from: &Singles) -> __m512 {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn store_singles(self, value: __m512, to: &mut Singles) {
        // SAFETY: the features were detected; the reference covers all that is written.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), value) }
    }

    #[inline(always)]
    fn mul_add_single(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: the features were detected.
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn load_halves(self, from: &[u32; 2 * LANES]) -> [__m512; 2] {
        // SAFETY: the features were detected; the reference covers all that is read.
        unsafe {
            let words = _mm512_loadu_si512(from.as_ptr().cast());
            [_mm512_castsi512_ps(_mm512_slli_epi32::<16>(words)), _mm512_castsi512_ps(words)]
        }
    }

    #[inline(always)]
    fn load_vectors(self, from: &[Vec3; LANES]) -> [__m512d; 3] {
        let from = from.as_ptr().cast::<f64>();
        // SAFETY: the features were detected; eight vectors are 24 doubles.
        unsafe {
            let a = _mm512_loadu_pd(from);
            let b = _mm512_loadu_pd(from.add(8));
            let c = _mm512_loadu_pd(from.add(16));
            // Numbers 0 to 7 name a double of the first operand, 8 to 15 one of the second.
            let x = _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 3, 6, 9, 12, 15, 0, 0), b);
            let y = _mm512_permutex2var_pd(a, _mm512_setr_epi64(1, 4, 7, 10, 13, 0, 0, 0), b);
            let z = _mm512_permutex2var_pd(a, _mm512_setr_epi64(2, 5, 8, 11, 14, 0, 0, 0), b);
            [
                _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 10, 13), c),
                _mm512_permutex2var_pd(y, _mm512_setr_epi64(0, 1, 2, 3, 4, 8, 11, 14), c),
                _mm512_permutex2var_pd(z, _mm512_setr_epi64(0, 1, 2, 3, 4, 9, 12, 15), c),
            ]
        }
    }

    #[inline(always)]
    fn store_vectors(self, [x, y, z]: [__m512d; 3], to: &mut [Vec3; LANES]) {
        let to = to.as_mut_ptr().cast::<f64>();
        // SAFETY: the features were detected; eight vectors are 24 doubles.
        unsafe {
            let a = _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 8, 0, 1, 9, 0, 2, 10), y);
            let b = _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 3, 11, 0, 4, 12, 0, 5), y);
            let c = _mm512_permutex2var_pd(x, _mm512_setr_epi64(13, 0, 6, 14, 0, 7, 15, 0), y);
            _mm512_storeu_pd(to, _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 1, 8, 3, 4, 9, 6, 7), z));
            _mm512_storeu_pd(to.add(8), _mm512_permutex2var_pd(b, _mm512_setr_epi64(10, 1, 2, 11, 4, 5, 12, 7), z));
            _mm512_storeu_pd(to.add(16), _mm512_permutex2var_pd(c, _mm512_setr_epi64(0, 13, 2, 3, 14, 5, 6, 15), z));
        }
    }

    #[inline(always)]
    fn shift_down(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: the features were detected.
        unsafe {
            let (a, b) = (_mm512_castpd_si512(a), _mm512_castpd_si512(b));
            _mm512_castsi512_pd(_mm512_alignr_epi64::<1>(b, a))
        }
    }

    #[inline(always)]
    fn shift_up(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: the features were detected.
        unsafe {
            let (a, b) = (_mm512_castpd_si512(a), _mm512_castpd_si512(b));
            _mm512_castsi512_pd(_mm512_alignr_epi64::<7>(b, a))
        }
    }

    #[inline(always)]
    fn differences(self, nodes: &[Motion], from: &Numbers, to: &Numbers) -> [[__m512d; 4]; 2] {
        // SAFETY: the features were detected.
        unsafe {
            let mut d = [_mm512_setzero_pd(); LANES];
            for lane in 0..LANES {
                let here = self.load(&nodes[from[lane] as usize].0);
                d[lane] = _mm512_sub_pd(self.load(&nodes[to[lane] as usize].0), here);
            }
            // d[n] = x y z - u v w - of pair n. In each 128-bit quarter: x y of two pairs to x x and y y, z likewise.
            let low = [
                _mm512_unpacklo_pd(d[0], d[1]),
                _mm512_unpacklo_pd(d[2], d[3]),
                _mm512_unpacklo_pd(d[4], d[5]),
                _mm512_unpacklo_pd(d[6], d[7]),
            ];
            let high = [
                _mm512_unpackhi_pd(d[0], d[1]),
                _mm512_unpackhi_pd(d[2], d[3]),
                _mm512_unpackhi_pd(d[4], d[5]),
                _mm512_unpackhi_pd(d[6], d[7]),
            ];
            // low[n] has the quarters x, z, u, w of two pairs; high[n] y, fourth, v, fourth.
            let xz = [
                _mm512_shuffle_f64x2::<0b10_00_10_00>(low[0], low[1]),
                _mm512_shuffle_f64x2::<0b10_00_10_00>(low[2], low[3]),
            ];
            let zw = [
                _mm512_shuffle_f64x2::<0b11_01_11_01>(low[0], low[1]),
                _mm512_shuffle_f64x2::<0b11_01_11_01>(low[2], low[3]),
            ];
            let yv = [
                _mm512_shuffle_f64x2::<0b10_00_10_00>(high[0], high[1]),
                _mm512_shuffle_f64x2::<0b10_00_10_00>(high[2], high[3]),
            ];
            let fourths = [
                _mm512_shuffle_f64x2::<0b11_01_11_01>(high[0], high[1]),
                _mm512_shuffle_f64x2::<0b11_01_11_01>(high[2], high[3]),
            ];
            // Each now x u x u (z w z w, y v y v, and the fourths) by quarters.
            let even = |a, b| _mm512_shuffle_f64x2::<0b10_00_10_00>(a, b);
            let odd = |a, b| _mm512_shuffle_f64x2::<0b11_01_11_01>(a, b);
            [
                [even(xz[0], xz[1]), even(yv[0], yv[1]), even(zw[0], zw[1]), even(fourths[0], fourths[1])],
                [odd(xz[0], xz[1]), odd(yv[0], yv[1]), odd(zw[0], zw[1]), odd(fourths[0], fourths[1])],
            ]
        }
    }

    #[inline(always)]
    fn fourth(self, nodes: &[Motion], at: &Numbers) -> __m512d {
        // SAFETY: the features were detected; a motion is eight doubles.
        unsafe {
            // Of four rows: second and fourth of two, and of these the upper halves. Closures would be compiled without the features,
            // and each instruction would be a call.
            let mut fours = [_mm256_setzero_pd(); 2];
            for half in 0..2 {
                let mut rows = [_mm256_setzero_pd(); 4];
                for lane in 0..4 {
                    rows[lane] = _mm256_loadu_pd(nodes[at[4 * half + lane] as usize].0.as_ptr());
                }
                let (ab, cd) = (_mm256_unpackhi_pd(rows[0], rows[1]), _mm256_unpackhi_pd(rows[2], rows[3]));
                fours[half] = _mm256_permute2f128_pd::<0x31>(ab, cd);
            }
            _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(fours[0]), fours[1])
        }
    }

    #[inline(always)]
    fn exchange(self, pull: [__m512d; 3], forces: &mut [Push], from: &Numbers, to: &Numbers) {
        let quads = self.quads(pull);
        // SAFETY: the features were detected; a push is four doubles.
        unsafe {
            for lane in 0..LANES {
                let own = &mut forces[from[lane] as usize].0;
                _mm256_storeu_pd(own.as_mut_ptr(), _mm256_add_pd(_mm256_loadu_pd(own.as_ptr()), quads[lane]));
                let other = &mut forces[to[lane] as usize].0;
                _mm256_storeu_pd(other.as_mut_ptr(), _mm256_sub_pd(_mm256_loadu_pd(other.as_ptr()), quads[lane]));
            }
        }
    }

    #[inline(always)]
    fn push(self, force: [__m512d; 3], forces: &mut [Push], to: &Numbers) {
        let quads = self.quads(force);
        // SAFETY: the features were detected; a push is four doubles.
        unsafe {
            for lane in 0..LANES {
                let own = &mut forces[to[lane] as usize].0;
                _mm256_storeu_pd(own.as_mut_ptr(), _mm256_add_pd(_mm256_loadu_pd(own.as_ptr()), quads[lane]));
            }
        }
    }
}
