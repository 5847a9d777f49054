//! Time zero of a run on threads: when its groups are let go, or when a host releases its group for the first time.

use crate::primitives::sync::{AtomicU64, Ordering};
use crate::system::os;
use crate::time::Nanos;

/// No time of the monotonic clock.
const UNKNOWN: u64 = u64::MAX;

/// Time zero, once it is known.
#[derive(Debug)]
pub(crate) struct Beginning(AtomicU64);

impl Beginning {
    pub(crate) fn new() -> Self {
        Self(AtomicU64::new(UNKNOWN))
    }

    /// Time zero, which is `ns` of the monotonic clock unless it was set before.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn set(&self, ns: u64) -> u64 {
        // Relaxed: the time itself is all that is told.
        self.0.compare_exchange(UNKNOWN, ns, Ordering::Relaxed, Ordering::Relaxed).map_or_else(|known| known, |_| ns)
    }

    /// Time zero, if it is known.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn get(&self) -> Option<u64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|&ns| ns != UNKNOWN)
    }

    /// The time since then; none before.
    pub(crate) fn elapsed(&self) -> Nanos {
        self.get().map_or(Nanos::ZERO, since)
    }
}

/// The time since time zero, `base_ns` of the monotonic clock.
pub(crate) fn since(base_ns: u64) -> Nanos {
    Nanos(os::monotonic().saturating_sub(base_ns))
}
