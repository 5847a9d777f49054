//! The ways of all tools so far: what a model that comes late has to make up for.

use crate::contact::ToolMotion;

/// Ticks that are remembered: an older model is not used.
const TICKS: usize = 1024;

/// How every tool of a session has moved in the last ticks.
#[derive(Clone, Debug)]
pub struct Ways {
    tools: usize,
    /// Those of tick t at place t % TICKS, a motion for each tool.
    motions: Vec<ToolMotion>,
    now: u64,
}

impl Ways {
    /// So many tools, at tick 0.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(tools: usize) -> Self {
        Self { tools, motions: vec![ToolMotion::default(); tools * TICKS], now: 0 }
    }

    /// Adds the motion of each tool in the next tick.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn go(&mut self, motions: impl Iterator<Item = ToolMotion>) {
        self.now += 1;
        let places = self.places(self.now);
        self.motions[places].iter_mut().zip(motions).for_each(|(place, motion)| *place = motion);
    }

    /// The last tick.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// How each tool moved in `tick`, which is one of those that are remembered.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn of(&self, tick: u64) -> &[ToolMotion] {
        &self.motions[self.places(tick)]
    }

    /// True if every tick after `tick` is remembered.
    pub(super) fn reaches_back_to(&self, tick: u64) -> bool {
        self.now.saturating_sub(tick) < TICKS as u64
    }

    fn places(&self, tick: u64) -> std::ops::Range<usize> {
        let first = self.tools * (tick as usize % TICKS);
        first..first + self.tools
    }
}
