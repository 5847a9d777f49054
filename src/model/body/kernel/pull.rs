//! The force of eight springs, as [`Spring::force`](super::super::Spring::force) says it.

use super::super::spring::Spring;
use super::simd::Simd;

/// Eight springs: which of them are there, k, b and L0.
pub(super) struct Springs<S: Simd> {
    pub(super) exist: S::M,
    pub(super) stiffness: S::V,
    pub(super) damping: S::V,
    /// k L0 (N).
    pub(super) preload: S::V,
    /// Square of the length (m^2) below which a spring has no direction.
    pub(super) shortest: S::V,
}

/// (COLLAPSED L0)^2.
#[inline(always)]
pub(super) fn shortest(rest_length: f64) -> f64 {
    let length = Spring::COLLAPSED * rest_length;
    length * length
}

/// What `along` is to be multiplied with for the force on the first node (N/m):
/// `[k (L - L0) + b u.closing] / L = k + ((b along.closing) / L - k L0) / L`.
#[inline(always)]
pub(super) fn scale<S: Simd>(s: S, along: &[S::V; 3], closing: &[S::V; 3], springs: &Springs<S>) -> S::V {
    let square = s.mul(along[0], along[0]);
    let square = s.mul_add(along[1], along[1], square);
    let square = s.mul_add(along[2], along[2], square);
    let product = s.mul(along[0], closing[0]);
    let product = s.mul_add(along[1], closing[1], product);
    let product = s.mul_add(along[2], closing[2], product);
    let inverse = s.inverse_root(square);
    let tension = s.mul_sub_from(s.mul(springs.damping, product), inverse, springs.preload);
    let scale = s.mul_sub_from(tension, inverse, springs.stiffness);
    s.keep(springs.exist, square, springs.shortest, scale)
}
