//! How much may wait for a part of the session that is late.

use crate::session::prepare::ModelPlan;

/// A logger or a global model that is stuck for this long loses nothing.
const SECONDS_BUFFERED: f64 = 4.0;
/// However slow the haptic rate is: release 0 makes several records before the first drain.
const MIN_TICKS_BUFFERED: usize = 64;
/// However fast it is: a second of 1 MHz, 64 MiB a ring.
const MAX_TICKS_BUFFERED: usize = 1 << 20;

/// Haptic ticks whose records and samples may wait.
pub(super) fn ticks_buffered(plan: &ModelPlan) -> usize {
    let ticks = (SECONDS_BUFFERED * plan.timing.haptic.as_hz()) as usize;
    ticks.clamp(MIN_TICKS_BUFFERED, MAX_TICKS_BUFFERED)
}
