//! Tells a release that hangs from one that gets no processor.
//!
//! A hung release used processor time of its own beyond the limit, or waited that long for something else than a
//! processor. A starved one did neither: it is late, and to take its place would only add to the load.

use crate::time::Nanos;

/// The state of a release that is overdue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overdue {
    /// Within its limit, or known to the caller already.
    Waited,
    /// For longer than the limit, for want of a processor; said once for each release.
    Starved,
    /// For longer than the limit by its own doing.
    Hung,
}

/// What the supervisor has seen of the release that it waits for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OverdueWatch {
    release: u64,
    /// Seen overdue.
    overdue: Nanos,
    /// Of that, spent computing or waiting for something else than a processor.
    own: Nanos,
    /// Processor time of the thread at the last look, in nanoseconds.
    cpu: Option<u64>,
    starved: bool,
}

impl OverdueWatch {
    /// A look at `release`, which was overdue for `late` of the time since the last one. `cpu` is the processor time of
    /// its thread in nanoseconds, if the system tells; `is_ready` asks whether the thread lacks nothing but a processor.
    pub(crate) fn look(
        &mut self,
        release: u64,
        late: Nanos,
        limit: Nanos,
        cpu: Option<u64>,
        is_ready: impl FnOnce() -> bool,
    ) -> Overdue {
        if self.release != release {
            *self = Self { release, cpu, ..Self::default() };
            return Overdue::Waited;
        }
        let computed = Nanos(cpu.zip(self.cpu).map_or(0, |(now, before)| now.saturating_sub(before)));
        self.cpu = cpu;
        if late == Nanos::ZERO {
            return Overdue::Waited;
        }
        self.overdue = self.overdue + late;
        self.own = self.own + if cpu.is_some() && is_ready() { computed } else { computed.max(late) };
        if self.own > limit {
            return Overdue::Hung;
        }
        if self.overdue > limit && !self.starved {
            self.starved = true;
            return Overdue::Starved;
        }
        Overdue::Waited
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Looks every 10 ms for 500 ms, with a limit of 100 ms; `computed` is the share of the time that the thread ran.
    fn seen(computed: Option<f64>, ready: bool) -> Vec<(u64, Overdue)> {
        let mut watch = OverdueWatch::default();
        let look = |i: u64| {
            let cpu = computed.map(|share| (share * (i * 10 * MS) as f64) as u64);
            (i * 10, watch.look(1, Nanos(10 * MS), Nanos(100 * MS), cpu, || ready))
        };
        (0..50).map(look).filter(|(_, state)| *state != Overdue::Waited).collect()
    }

    #[test]
    fn a_release_hangs_that_computes_or_waits_beyond_its_limit() {
        assert_eq!(seen(Some(1.0), true)[0], (110, Overdue::Hung));
        assert_eq!(seen(Some(0.0), false)[0], (110, Overdue::Hung));
        // Check that a system that tells nothing counts the time itself.
        assert_eq!(seen(None, true)[0], (110, Overdue::Hung));
    }

    #[test]
    fn a_release_that_gets_no_processor_is_starved_and_that_is_said_once() {
        assert_eq!(seen(Some(0.0), true), [(110, Overdue::Starved)]);
        // Check that its own computing still counts: 250 ms of the clock are 100 of its own here.
        assert_eq!(seen(Some(0.4), true)[..2], [(110, Overdue::Starved), (260, Overdue::Hung)]);
    }

    #[test]
    fn the_next_release_begins_anew() {
        let mut watch = OverdueWatch::default();
        for release in 1..100 {
            for _ in 0..9 {
                let state = watch.look(release, Nanos(10 * MS), Nanos(100 * MS), Some(0), || false);
                assert_eq!(state, Overdue::Waited);
            }
        }
    }
}
