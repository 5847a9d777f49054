//! How a wait for a release ended: what the clock or a device told the books.

use crate::time::Nanos;

/// How a wait for a release ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wake {
    /// When the group was running again.
    pub(crate) woke: Nanos,
    /// What ended it.
    pub(crate) by: WokenBy,
    /// When that was there; the group may have been busy or asleep for longer.
    pub(crate) ready: Nanos,
    /// Virtual time: when the group's injected work is done and it can run again. `None`: when the release ends.
    pub(crate) free: Option<Nanos>,
}

/// What ends a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WokenBy {
    /// The clock: the release was due.
    Timer,
    /// The device that paces the group had something new.
    Frame,
}

impl Wake {
    /// The wait for a release due at `due` ended at `woke`.
    pub(crate) fn by_timer(due: Nanos, woke: Nanos) -> Self {
        Self { woke, by: WokenBy::Timer, ready: due, free: None }
    }

    /// The device delivered at `woke`.
    pub(crate) fn by_frame(woke: Nanos) -> Self {
        Self { woke, by: WokenBy::Frame, ready: woke, free: None }
    }
}
