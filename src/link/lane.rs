//! How urgent messages are.

/// How urgent a message is: an urgent one never waits behind one that is less so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Few bytes, every millisecond: tool ticks, clock, control.
    Urgent,
    /// The newest local models: of those that wait to go, only the last are worth sending.
    Models,
    /// Large and needed once: bases.
    Bulk,
    /// The newest picture of the body, for somebody who looks: after everything else, and of those that wait only the last.
    Pictures,
}

impl Lane {
    /// So many lanes there are, the most urgent first.
    pub const COUNT: usize = 4;

    /// True if what waits is worth nothing once there is something newer.
    pub fn keeps_the_newest(self) -> bool {
        matches!(self, Self::Models | Self::Pictures)
    }
}
