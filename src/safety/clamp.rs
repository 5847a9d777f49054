//! Stage 2: the device's largest force.

use super::{Force, norm};

/// The force shortened to `limit` (N), direction kept; and whether it acted.
///
/// # Real-time
/// Bounded, real-time safe.
pub fn clamp(force: Force, limit: f64) -> (Force, bool) {
    // Scaled first: the square of a huge component overflows.
    let largest = force.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    if largest == 0.0 {
        return (force, false);
    }
    let direction = force.map(|c| c / largest);
    let length = norm(direction);
    if largest <= limit / length { (force, false) } else { (direction.map(|c| c * (limit / length)), true) }
}
