//! A turn as four numbers, as files, logs and devices write it.

use crate::Turn;

/// The turn of a quaternion (w, x, y, z), bit for bit: whether its length is one is for the caller to know.
///
/// ```
/// use palpate_model::{Turn, turn_of, wxyz};
///
/// assert_eq!(turn_of([1.0, 0.0, 0.0, 0.0]), Turn::identity());
/// assert_eq!(wxyz(&turn_of([0.6, 0.0, -0.0, 0.8])), [0.6, 0.0, -0.0, 0.8]);
/// ```
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn turn_of([w, x, y, z]: [f64; 4]) -> Turn {
    Turn::new_unchecked(nalgebra::Quaternion::new(w, x, y, z))
}

/// The quaternion (w, x, y, z) of a turn, bit for bit.
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn wxyz(turn: &Turn) -> [f64; 4] {
    [turn.w, turn.i, turn.j, turn.k]
}
