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
    /// Run at once and shift the group's phase: the next release is due one period after this one began.
    ///
    /// As `Skip`, but the group keeps its distance between releases instead of its place in time. Release n is the latest
    /// one that the nominal grid has at that time, so that tick numbers stay true to the clock. Where phases have added up
    /// to a period, that period is skipped with the cause [`Policy`](super::SlipCause::Policy); so is the last one of a
    /// run whose shifted release would come after the end.
    Rephase,
    /// As `Skip`, and from then on ask for less: [`Mode::Degraded`](super::Mode::Degraded) until `recover_after` releases
    /// in a row had no slips and met their deadlines. The mode of each release is recorded with its timing.
    Degrade {
        /// Releases in time that make the mode normal again.
        recover_after: u32,
    },
    /// Stop the whole runtime, in order, at the first release that had to be skipped.
    Stop,
}

/// What releases a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Release {
    /// The clock.
    #[default]
    Periodic,
    /// A device, by a blocking read: the first actor of the group is asked to [wait](super::Actor::wait) for it.
    ///
    /// What it delivers runs the next release, up to seven eighths of a period before that is due; from half a period after
    /// it was due on, the release nearest in time, and the periods between are skipped with the cause
    /// [`StalledPeer`](super::SlipCause::StalledPeer). An earlier frame, the second in the period of one release, is left
    /// out. So the grid of ticks stays that of the nominal rate whatever the device's own clock does: a device 2 per mille
    /// slow skips 2 periods in a thousand. That a thread was woken late cannot be told from a late frame.
    DevicePaced {
        /// How long after a due time the device may stay silent. Then the group goes on at its nominal period by the
        /// clock, until the device delivers again; both are recorded as [`Event::WATCHDOG`](super::Event::WATCHDOG).
        watchdog: Nanos,
    },
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
/// What releases it is its [`Release`] mode: the clock, or a device that has one of its own. The third way, virtual time,
/// is a property of the executor: there every group is released by the virtual clock, a device-paced one as if its device
/// delivered on time, unless a [disturbance](super::Disturbance) delays it.
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
    pub(super) release: Release,
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
            release: Release::default(),
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

    /// Virtual time: when its publications become visible, counted from the release. It may exceed the period; several
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

    /// What releases the group.
    #[must_use]
    pub fn release(mut self, release: Release) -> Self {
        self.release = release;
        self
    }

    /// Lets a device release the group: [`Release::DevicePaced`] with this watchdog, at least one period. Under the
    /// policies [`Skip`](OverrunPolicy::Skip), [`Degrade`](OverrunPolicy::Degrade) and [`Stop`](OverrunPolicy::Stop).
    #[must_use]
    pub fn device_paced(self, watchdog: Nanos) -> Self {
        self.release(Release::DevicePaced { watchdog })
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

    /// The watchdog of a device-paced group.
    pub(super) fn watchdog(&self) -> Option<Nanos> {
        match self.release {
            Release::Periodic => None,
            Release::DevicePaced { watchdog } => Some(watchdog),
        }
    }

    /// The deadline in force, counted from the release.
    pub(super) fn relative_deadline(&self) -> Nanos {
        self.deadline.unwrap_or(self.rate.period())
    }
}
