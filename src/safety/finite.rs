//! Stage 1: numbers that are not finite never go on.

use super::Force;

/// The force, or zero if any component is not finite; and whether it acted.
///
/// # Real-time
/// Bounded, real-time safe.
pub fn finite(force: Force) -> (Force, bool) {
    if force.iter().all(|c| c.is_finite()) { (force, false) } else { ([0.0; 3], true) }
}
