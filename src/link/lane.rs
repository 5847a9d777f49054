//! How urgent messages are, and by which lines they go.

use std::ops::Range;

use crate::random::uniform;

/// Lines of a session, each a connection of its own. Over TCP whatever comes after a lost packet waits for it to come again, for a round trip
/// and more; what goes by another line does not.
pub const LINES: usize = 3;

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

    /// The lines by which a side's message of that number goes.
    ///
    /// Local models, of which hardly one is without a loss, go by all, and the first to arrive is taken. Bases, which are long and hold up what is
    /// behind them, all go by the last one. The rest goes by one line each, by chance: in turn, those of one of three tools would all go by the
    /// same. Tool ticks, which repeat the last ones, are there in time whichever line is held up.
    pub fn lines(self, number: u64) -> Range<usize> {
        match self {
            Self::Models => 0..LINES,
            Self::Bulk => LINES - 1..LINES,
            Self::Urgent | Self::Pictures => {
                let line = (uniform(0, number) * LINES as f64) as usize;
                line..line + 1
            }
        }
    }

    /// True if what waits is worth nothing once there is something newer.
    pub fn keeps_the_newest(self) -> bool {
        matches!(self, Self::Models | Self::Pictures)
    }
}
