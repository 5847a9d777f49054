//! Stage 3 and again at the end: the largest change from one force to the next.

use super::{Force, norm};

/// `to`, or as far towards it as `limit` (N) from `from` allows; and whether it acted.
///
/// # Real-time
/// Bounded, real-time safe.
pub fn slew(from: Force, to: Force, limit: f64) -> (Force, bool) {
    let change: Force = std::array::from_fn(|i| to[i] - from[i]);
    let length = norm(change);
    if length <= limit {
        return (to, false);
    }
    (std::array::from_fn(|i| from[i] + change[i] * (limit / length)), true)
}
