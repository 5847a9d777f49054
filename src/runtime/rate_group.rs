//! A rate group: actors that are released together, at one rate, on one thread.

use crate::time::{Nanos, Rate};

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
    /// Sleep until shortly before the release, then spin, where a real-time policy was granted; otherwise `Sleep`. How
    /// long before is learnt from how late the sleeps end: at most 120 us and 15 % of the period.
    #[default]
    Auto,
    /// One absolute sleep.
    Sleep,
    /// Sleep until a fixed `margin` before the release, then spin. Only under a real-time policy; otherwise it sleeps.
    SleepSpin {
        /// How long to spin at most.
        margin: Nanos,
    },
    /// Spin all the time. Only under a real-time policy; otherwise it sleeps.
    Spin,
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
    pub(super) wind_down: Nanos,
    pub(super) wind_down_at_end: bool,
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
            wind_down: Nanos::ZERO,
            wind_down_at_end: false,
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
    /// Threads take the time that they take, and a latency beyond the period is refused there.
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

    /// When a stop is requested or an actor of the group has failed, the group is released for this long in
    /// [`Mode::Stopping`](super::Mode::Stopping), without the failed actor, so that it can bring what it drives to rest.
    #[must_use]
    pub fn wind_down(mut self, time: Nanos) -> Self {
        self.wind_down = time;
        self
    }

    /// It also [winds down](Self::wind_down) after its last release when the run ends
    /// [by itself](super::RuntimeBuilder::until).
    #[must_use]
    pub fn wind_down_at_end(mut self) -> Self {
        self.wind_down_at_end = true;
        self
    }

    /// True if a [budget](Self::budget) was given.
    pub fn has_budget(&self) -> bool {
        self.budget.is_some()
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
