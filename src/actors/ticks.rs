//! Haptic ticks: which of them a release runs, and which belong to a resync.

use crate::runtime::{GroupMode, Rate, TickContext};

/// Haptic ticks that one release advances at most. After a long stall the rest is made up by the releases that follow:
/// simulated time never stretches, and no release takes longer than this many ticks.
const MAX_TICKS_PER_RELEASE: u64 = 8;

/// The same in degraded mode: still one more than a period asks for, so that what is owed is made up in the end.
const MAX_TICKS_WHEN_DEGRADED: u64 = 2;

/// The ticks after `now` that this release runs: for each how many are left until the release is reached, itself included.
pub(super) fn due(ctx: &TickContext, now: u64) -> impl Iterator<Item = u64> + use<> {
    let owed = ctx.tick.saturating_sub(now);
    let most = match ctx.mode {
        GroupMode::Normal | GroupMode::Stopping => MAX_TICKS_PER_RELEASE,
        GroupMode::Degraded => MAX_TICKS_WHEN_DEGRADED,
    };
    (0..owed.min(most)).map(move |i| owed - i)
}

/// The haptic ticks of the resyncs, which follow from the two rates.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResyncTicks {
    haptic: Rate,
    global: Rate,
    next: u64,
}

impl ResyncTicks {
    pub(super) fn new(haptic: Rate, global: Rate) -> Self {
        Self { haptic, global, next: 0 }
    }

    /// True if `tick`, which is asked once and after those before it, belongs to a resync.
    pub(super) fn has(&mut self, tick: u64) -> bool {
        let is_resync = tick == self.haptic.last_release(self.global.release(self.next));
        self.next += u64::from(is_resync);
        is_resync
    }
}
