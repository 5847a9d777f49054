//! How the ticks of a haptic machine are counted on the global side.

/// Releases within a second in which samples come before their time: fewer may themselves have been held up.
const EARLY_RELEASES: u32 = 3;

/// How the ticks of a haptic machine are counted on the global side.
///
/// Each machine counts from its own start. One that is alone is the clock of its session. Of several each is counted so that its least late
/// samples are of now, by the clock of the global side: so all are in step, whenever they began and however far away they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbering {
    is_alone: bool,
    /// By so much a tick is counted higher here than there; `None` until one has come.
    ahead: Option<i64>,
    /// How late the least late sample was that has come since (ticks).
    least_late: i64,
    since: u64,
    /// In how many releases since some came before their time, the last of them, and how early the least early one was (ticks, below zero).
    early: u32,
    last_early: u64,
    least_early: i64,
}

impl Numbering {
    /// Of a machine that is alone or not.
    pub(super) fn new(is_alone: bool) -> Self {
        Self {
            is_alone,
            ahead: is_alone.then_some(0),
            least_late: i64::MAX,
            since: 0,
            early: 0,
            last_early: 0,
            least_early: i64::MIN,
        }
    }

    /// Another machine counts from now on.
    pub(super) fn begin_anew(&mut self) {
        *self = Self::new(self.is_alone);
    }

    /// True if nothing has come.
    pub(super) fn is_new(&self) -> bool {
        self.ahead.is_none()
    }

    /// A sample of the tick `there` has come `now`, a tick of the clock here; a second has so many ticks.
    pub(super) fn hear(&mut self, there: u64, now: u64, second: u64) {
        if self.is_alone {
            return;
        }
        let begun = now.wrapping_sub(there).cast_signed();
        let Some(ahead) = self.ahead else {
            (self.ahead, self.least_late, self.since) = (Some(begun), i64::MAX, now);
            return;
        };
        let late = begun - ahead;
        self.least_late = self.least_late.min(late);
        if late < 0 {
            self.least_early = self.least_early.max(late);
            self.early += u32::from(self.last_early != now);
            self.last_early = now;
        }
        // What comes before its time shows that those before it were late.
        if self.early >= EARLY_RELEASES {
            self.shift(self.least_early, now);
        } else if now.saturating_sub(self.since) >= second {
            self.shift(self.least_late.max(0), now);
        }
    }

    fn shift(&mut self, by: i64, now: u64) {
        self.ahead = self.ahead.map(|ahead| ahead + by);
        (self.least_late, self.since, self.early, self.least_early) = (i64::MAX, now, 0, i64::MIN);
    }

    /// What the tick `there` is counted as here.
    pub(super) fn here(&self, there: u64) -> u64 {
        there.saturating_add_signed(self.ahead.unwrap_or_default())
    }

    /// What the tick `here` is counted as there: as the first one, until one has come.
    pub(super) fn there(&self, here: u64) -> u64 {
        self.ahead.map_or(0, |ahead| here.saturating_add_signed(-ahead))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_is_alone_is_counted_as_it_counts() {
        let mut numbering = Numbering::new(true);
        numbering.hear(7, 900, 1000);
        assert_eq!((numbering.here(7), numbering.there(7)), (7, 7));
    }

    /// A machine that began 5 s after the global side, whose samples take 14 ticks and up to 30 more.
    fn late(tick: u64) -> u64 {
        14 + tick * 7919 % 31
    }

    #[test]
    fn the_least_late_samples_are_of_now() {
        let mut numbering = Numbering::new(false);
        assert_eq!(numbering.there(4_000), 0, "nothing has come");
        (0..3_000).for_each(|tick| numbering.hear(tick, 5_000 + tick + late(tick), 1_000));
        let off = numbering.here(3_000) - 8_000;
        assert!((14..=16).contains(&off), "{off} ticks");
        assert_eq!(numbering.there(numbering.here(3_000)), 3_000);
    }

    #[test]
    fn a_clock_that_is_slower_or_faster_stays_in_step() {
        for per_million in [-100_i64, 100] {
            let mut numbering = Numbering::new(false);
            for tick in 0..600_000_u64 {
                let drifted = (tick as i64 + tick as i64 * per_million / 1_000_000) as u64;
                numbering.hear(tick, drifted + late(tick), 1_000);
                let off = numbering.here(tick).abs_diff(drifted + 14);
                assert!(tick < 1_000 || off <= 3, "{off} ticks after {tick}, {per_million} ppm");
            }
        }
    }
}
