//! A force, and what may become of it in any stage: finite, within a length, within a change.

/// A force in space (N), an entry per axis.
pub type Force = [f64; 3];

pub(super) fn norm(force: Force) -> f64 {
    dot(force, force).sqrt()
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Stage 1: the force, or zero if any component is not finite; and whether it acted.
pub(crate) fn finite(force: Force) -> (Force, bool) {
    if force.iter().all(|c| c.is_finite()) { (force, false) } else { ([0.0; 3], true) }
}

/// Stage 2: the force shortened to `limit` (N), direction kept; and whether it acted.
pub(crate) fn clamp(force: Force, limit: f64) -> (Force, bool) {
    // Scaled first: the square of a huge component overflows.
    let largest = force.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    if largest == 0.0 {
        return (force, false);
    }
    let direction = force.map(|c| c / largest);
    let length = norm(direction);
    if largest <= limit / length { (force, false) } else { (direction.map(|c| c * (limit / length)), true) }
}

/// Stage 3, and again at the end: `to`, or as far towards it as `limit` (N) from `from` allows; and whether it acted.
pub(crate) fn slew(from: Force, to: Force, limit: f64) -> (Force, bool) {
    let change: Force = std::array::from_fn(|i| to[i] - from[i]);
    let length = norm(change);
    if length <= limit {
        return (to, false);
    }
    (std::array::from_fn(|i| from[i] + change[i] * (limit / length)), true)
}
