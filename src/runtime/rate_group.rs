//! A rate group: actors that are released together, at one rate, on one thread.

use crate::time::{Nanos, Rate};
use std::fmt;

/// What happens to releases that were due while the group was still busy or asleep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OverrunPolicy {
    /// Run the latest release already due at once and skip the older ones.
    #[default]
    Skip,
    /// Run late releases one after the other without a wait, but keep at most `max` of them waiting: older ones are
    /// skipped.
    CatchUp {
        /// Late releases that may wait behind the one that runs.
        max: u32,
    },
    /// Stop the whole runtime, in order, at the first release that had to be skipped.
    Stop,
}

/// How a group's thread waits for its next release.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Wait {
    /// `SleepSpin` with 100 us where a real-time policy was granted, otherwise `Sleep`.
    #[default]
    Auto,
    /// One absolute sleep.
    Sleep,
    /// Sleep until `margin` before the release, then spin. Only under a real-time policy; otherwise it sleeps.
    SleepSpin {
        /// How long to spin at most.
        margin: Nanos,
    },
    /// Spin all the time. Only under a real-time policy; otherwise it sleeps.
    Spin,
}

impl Wait {
    /// The default margin: above the usual wake-up latency of an idle core, a tenth of a 1 kHz period.
    const MARGIN: Nanos = Nanos(100_000);

    /// What is really done: spinning without a real-time policy only takes time from the threads one waits for.
    pub(crate) fn granted(self, realtime: bool) -> Self {
        match self {
            Self::Auto if realtime => Self::SleepSpin { margin: Self::MARGIN },
            Self::SleepSpin { .. } | Self::Spin if realtime => self,
            _ => Self::Sleep,
        }
    }
}

impl fmt::Display for Wait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Sleep => f.write_str("sleep"),
            Self::SleepSpin { margin } => write!(f, "sleep, then spin {margin}"),
            Self::Spin => f.write_str("spin"),
        }
    }
}

/// The rate, the timing contract and the thread of a group of actors.
///
/// Values that cannot work are refused by [`RuntimeBuilder::build`](super::RuntimeBuilder::build).
#[derive(Clone, Debug, PartialEq)]
pub struct RateGroup {
    pub(super) name: String,
    pub(super) rate: Rate,
    pub(super) offset: Nanos,
    pub(super) deadline: Option<Nanos>,
    pub(super) budget: Option<Nanos>,
    pub(super) latency: Nanos,
    pub(super) cpu: Option<usize>,
    pub(super) priority: Option<u8>,
    pub(super) overrun: OverrunPolicy,
    pub(super) wait: Wait,
    pub(super) observer: bool,
}

impl RateGroup {
    /// A group released at `rate`: deadline one period, no real-time policy, not pinned.
    pub fn new(rate: Rate) -> Self {
        Self {
            name: String::new(),
            rate,
            offset: Nanos::ZERO,
            deadline: None,
            budget: None,
            latency: Nanos::ZERO,
            cpu: None,
            priority: None,
            overrun: OverrunPolicy::default(),
            wait: Wait::default(),
            observer: false,
        }
    }

    /// A group released `hz` times per second.
    ///
    /// # Panics
    /// If `hz` is zero.
    pub fn hz(hz: u32) -> Self {
        Self::new(Rate::hz(hz))
    }

    /// Its name in reports and logs, unique in the graph; `group-0`, `group-1`, ... if not given.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Delays every release: release n is due at offset + n periods.
    #[must_use]
    pub fn offset(mut self, offset: Nanos) -> Self {
        self.offset = offset;
        self
    }

    /// When a release must be done, counted from when it is due; at most, and by default, one period.
    #[must_use]
    pub fn deadline(mut self, deadline: Nanos) -> Self {
        self.deadline = Some(deadline);
        self
    }

    /// The computing time that one release is expected to need: what the admission check adds up.
    #[must_use]
    pub fn budget(mut self, budget: Nanos) -> Self {
        self.budget = Some(budget);
        self
    }

    /// Virtual time: when its publications become visible to other groups, counted from the release. It may exceed the period; several
    /// publications are then in flight and become visible in order. A latency beyond the deadline misses it each time.
    /// Threads take the time that they take.
    #[must_use]
    pub fn latency(mut self, latency: Nanos) -> Self {
        self.latency = latency;
        self
    }

    /// Threads: the processor core to stay on.
    #[must_use]
    pub fn pin(mut self, cpu: usize) -> Self {
        self.cpu = Some(cpu);
        self
    }

    /// Threads: asks for SCHED_FIFO with this priority, 1 to 99. A refusal is reported, the run goes on without.
    #[must_use]
    pub fn realtime(mut self, priority: u8) -> Self {
        self.priority = Some(priority);
        self
    }

    /// What happens to releases that the group could not make in time.
    #[must_use]
    pub fn overrun(mut self, policy: OverrunPolicy) -> Self {
        self.overrun = policy;
        self
    }

    /// Threads: how to wait for the next release.
    #[must_use]
    pub fn wait(mut self, wait: Wait) -> Self {
        self.wait = wait;
        self
    }

    /// Makes it an observer, such as a logger: it ends after all other groups have ended, with one more tick that sees
    /// all they left behind. That last tick is no release: it is not counted and has no timing record.
    #[must_use]
    pub fn observer(mut self) -> Self {
        self.observer = true;
        self
    }

    /// The rate.
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// The deadline in force, counted from the release.
    pub(super) fn relative_deadline(&self) -> Nanos {
        self.deadline.unwrap_or(self.rate.period())
    }
}
