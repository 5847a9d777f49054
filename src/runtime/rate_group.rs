//! A rate group: actors that are released together, at one rate, on one thread.

use crate::time::{Nanos, Rate};

/// The overrun policy of a group: what becomes of releases that were due while it was still busy or asleep.
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
    /// Like `Skip`, but the group keeps its distance between releases instead of its place in time. Release n is the
    /// latest one that the nominal grid has at that time, so that tick numbers stay true to the clock. Where phases
    /// have added up to a period, that period is skipped with the cause [`Policy`](crate::SlipCause::Policy); so is the
    /// last one of a run whose shifted release would come after the end.
    Rephase,
    /// Like `Skip`, and from then on ask for less: [`GroupMode::Degraded`](crate::GroupMode::Degraded) until
    /// `recover_after` releases in a row had no slips and met their deadlines. The mode of each release is recorded
    /// with its timing.
    Degrade {
        /// Releases in time that make the mode normal again.
        recover_after: u32,
    },
    /// Stop the whole runtime, in order, at the first release that had to be skipped.
    Stop,
}

/// The source of the releases of a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Release {
    /// The clock releases the group, period by period.
    #[default]
    Periodic,
    /// A device releases the group, by a blocking read: the first actor of the group is asked to
    /// [wait](crate::Actor::wait) for it.
    ///
    /// What it delivers runs the next release, up to seven eighths of a period before that is due; from half a period
    /// after it was due on, the release nearest in time, and the periods between are skipped with the cause
    /// [`StalledPeer`](crate::SlipCause::StalledPeer). An earlier frame, the second in the period of one release, is
    /// left out. So the grid of ticks stays that of the nominal rate whatever the device's own clock does: a device 2
    /// per mille slow skips 2 periods in a thousand. That a thread was woken late cannot be told from a late frame.
    DevicePaced {
        /// The time after a due time for which the device may stay silent. Then the group goes on at its nominal period
        /// by the clock, until the device delivers again; both are recorded as
        /// [`Event::WATCHDOG`](crate::Event::WATCHDOG).
        watchdog: Nanos,
    },
    /// A thread of the program's own releases the group, by [`HostedGroup::release`](crate::HostedGroup::release); in virtual time
    /// the clock does. The group has no thread, so neither policy nor core can be asked for.
    Hosted,
}

/// The way in which a group's thread waits for its next release.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Wait {
    /// Sleep until shortly before the release, then spin, where a real-time policy was granted; otherwise `Sleep`. How
    /// long before is learnt from how late the sleeps end: at most 135 us and 15 % of the period. From 3 kHz on that is
    /// less than a wake-up takes, so that up to 50 us are spun there, at most 90 % of the period; above 20 kHz it spins
    /// all the time.
    #[default]
    Auto,
    /// One absolute sleep.
    Sleep,
    /// Sleep until a fixed `margin` before the release, then spin. Only under a real-time policy; otherwise it sleeps.
    SleepSpin {
        /// The time before the release from which on the thread spins.
        margin: Nanos,
    },
    /// Spin all the time. Only under a real-time policy; otherwise it sleeps.
    Spin,
}

/// The rate, the timing contract and the thread of a group of actors.
///
/// What releases it is its [`Release`] mode: the clock, a device that has one of its own, or a thread of the program's. One more
/// way, virtual time, is a property of the executor: there every group is released by the virtual clock, a device-paced one as
/// if its device delivered on time, unless a [disturbance](crate::Disturbance) delays it.
///
/// Values that cannot work are refused by [`RuntimeBuilder::build`](crate::RuntimeBuilder::build).
///
/// ```
/// use palpate_runtime::{Nanos, OverrunPolicy, Rate, RateGroup};
///
/// let control = RateGroup::hz(1000).name("control").pin(1).realtime(80).budget(Nanos(300_000));
/// let video = RateGroup::new(Rate::new(2997, 100)).overrun(OverrunPolicy::Rephase);
/// assert_eq!((control.rate().period(), video.rate().as_hz()), (Nanos(1_000_000), 29.97));
/// ```
///
/// # Real-time
/// Not real-time safe: its name allocates. Before the run.
#[derive(Clone, Debug, PartialEq)]
pub struct RateGroup {
    pub(crate) name: String,
    pub(crate) rate: Rate,
    pub(crate) offset: Nanos,
    pub(crate) deadline: Option<Nanos>,
    pub(crate) budget: Option<Nanos>,
    pub(crate) latency: Nanos,
    pub(crate) cpu: Option<usize>,
    /// Several cores instead of one.
    pub(crate) cpus: Vec<usize>,
    pub(crate) by_deadline: bool,
    pub(crate) stack: Option<usize>,
    pub(crate) priority: Option<u8>,
    /// No real-time policy is what the group asked for.
    best_effort: bool,
    /// Gives way to all other threads.
    pub(crate) background: bool,
    pub(crate) overrun: OverrunPolicy,
    pub(crate) release: Release,
    pub(crate) wait: Wait,
    pub(crate) observer: bool,
    pub(crate) wind_down: Nanos,
    pub(crate) wind_down_at_end: bool,
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
            cpus: Vec::new(),
            by_deadline: false,
            stack: None,
            priority: None,
            best_effort: false,
            background: false,
            overrun: OverrunPolicy::default(),
            release: Release::default(),
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

    /// Names the group in reports and logs, unique in the graph; `group-0`, `group-1`, ... if not given.
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

    /// Sets the time by which a release must be done, counted from when it is due; at most, and by default, one period.
    #[must_use]
    pub fn deadline(mut self, deadline: Nanos) -> Self {
        self.deadline = Some(deadline);
        self
    }

    /// Declares the computing time that one release is expected to need: what the admission check adds up.
    #[must_use]
    pub fn budget(mut self, budget: Nanos) -> Self {
        self.budget = Some(budget);
        self
    }

    /// Declares, for virtual time, when the publications of a release become visible to other groups, counted from the
    /// release. It may exceed the period; several publications are then in flight and become visible in order. A
    /// latency beyond the deadline misses it each time. Threads take the time that they take, and a latency beyond the
    /// period is refused there.
    #[must_use]
    pub fn latency(mut self, latency: Nanos) -> Self {
        self.latency = latency;
        self
    }

    /// The latency that was declared, zero if none was.
    pub fn declared_latency(&self) -> Nanos {
        self.latency
    }

    /// Pins the thread of the group to the processor core with this number.
    #[must_use]
    pub fn pin(mut self, cpu: usize) -> Self {
        self.cpu = Some(cpu);
        self.cpus.clear();
        self
    }

    /// Lets the thread of the group run on these processor cores only. One core is the same as [`pin`](Self::pin).
    #[must_use]
    pub fn pin_to(mut self, cpus: impl IntoIterator<Item = usize>) -> Self {
        let mut cpus: Vec<usize> = cpus.into_iter().collect();
        cpus.sort_unstable();
        cpus.dedup();
        self.cpu = if let [cpu] = cpus[..] { Some(cpu) } else { None };
        self.cpus = if cpus.len() > 1 { cpus } else { Vec::new() };
        self
    }

    /// Asks for SCHED_DEADLINE on threads: the kernel then gives the group its [budget](Self::budget) in every period by
    /// its deadline, or refuses. It stops a release that takes longer until the next period. Needs a budget, and neither
    /// a priority nor a [core](Self::pin): the kernel wants the thread free to go to any of its cores. A refusal is
    /// reported, the run goes on without.
    #[must_use]
    pub fn realtime_by_deadline(mut self) -> Self {
        (self.by_deadline, self.background) = (true, false);
        self
    }

    /// Sets the size of the thread's stack in bytes, at least 256 KiB; 2 MiB if not given. Where memory is locked, all of
    /// it is.
    #[must_use]
    pub fn stack_size(mut self, bytes: usize) -> Self {
        self.stack = Some(bytes);
        self
    }

    /// Asks for SCHED_FIFO on threads with this priority, 1 to 99. A refusal is reported, the run goes on without.
    #[must_use]
    pub fn realtime(mut self, priority: u8) -> Self {
        self.priority = Some(priority);
        (self.best_effort, self.background) = (false, false);
        self
    }

    /// Asks for no real-time policy, also where a group would get one [by default](Self::realtime_by_default).
    #[must_use]
    pub fn best_effort(mut self) -> Self {
        self.priority = None;
        self.by_deadline = false;
        self.best_effort = true;
        self
    }

    /// Asks for no real-time policy and lets its thread give way to all others that want the same processor: for work that may take its
    /// time, on a machine that has little to spare.
    #[must_use]
    pub fn background(self) -> Self {
        Self { background: true, ..self.best_effort() }
    }

    /// Asks for SCHED_FIFO with this priority unless the group has said what it wants, by [`realtime`](Self::realtime),
    /// [`realtime_by_deadline`](Self::realtime_by_deadline) or [`best_effort`](Self::best_effort).
    #[must_use]
    pub fn realtime_by_default(self, priority: u8) -> Self {
        if self.best_effort || self.is_realtime() { self } else { self.realtime(priority) }
    }

    /// Sets what becomes of releases that the group could not make in time.
    #[must_use]
    pub fn overrun(mut self, policy: OverrunPolicy) -> Self {
        self.overrun = policy;
        self
    }

    /// Sets what releases the group: the clock or a device.
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

    /// Lets a thread of the program's own release the group: [`Release::Hosted`]. Under the policies
    /// [`Skip`](OverrunPolicy::Skip), [`Degrade`](OverrunPolicy::Degrade) and [`Stop`](OverrunPolicy::Stop).
    #[must_use]
    pub fn hosted(self) -> Self {
        self.release(Release::Hosted)
    }

    /// Sets how the thread of the group waits for its next release.
    #[must_use]
    pub fn wait(mut self, wait: Wait) -> Self {
        self.wait = wait;
        self
    }

    /// Makes the group an observer, such as a logger: it ends after all other groups have ended, with one more tick
    /// that sees all they left behind. That last tick is no release: it is not counted and has no timing record.
    #[must_use]
    pub fn observer(mut self) -> Self {
        self.observer = true;
        self
    }

    /// Lets the group bring what it drives to rest: when a stop is requested or an actor of it has failed, it is
    /// released for this long in [`GroupMode::Stopping`](crate::GroupMode::Stopping), without the failed actor, so that
    /// it can bring what it drives to rest. Periods that are overdue by then are skipped and do not count; a device is
    /// not waited for. A fault that a [restart](crate::RuntimeBuilder::restartable) answers begins none.
    #[must_use]
    pub fn wind_down(mut self, time: Nanos) -> Self {
        self.wind_down = time;
        self
    }

    /// Lets the group also [wind down](Self::wind_down) after its last release when the run ends
    /// [by itself](crate::RuntimeBuilder::until).
    #[must_use]
    pub fn wind_down_at_end(mut self) -> Self {
        self.wind_down_at_end = true;
        self
    }

    /// The budget that was declared, if one was.
    pub fn declared_budget(&self) -> Option<Nanos> {
        self.budget
    }

    /// The rate of the group.
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// The longest time that the group makes up release by release instead of skipping it.
    pub fn catches_up(&self) -> Nanos {
        match self.overrun {
            OverrunPolicy::CatchUp { max } => self.rate.release(max.into()),
            _ => Nanos::ZERO,
        }
    }

    /// True if a thread of the program's releases the group.
    pub fn is_hosted(&self) -> bool {
        self.release == Release::Hosted
    }

    /// The cores that the group may run on; empty if it may run on any.
    pub(crate) fn cores(&self) -> Vec<usize> {
        self.cpu.map_or_else(|| self.cpus.clone(), |cpu| vec![cpu])
    }

    /// True if a real-time policy is asked for.
    pub(crate) fn is_realtime(&self) -> bool {
        self.priority.is_some() || self.by_deadline
    }

    /// A thread of the group's name and stack.
    pub(crate) fn thread(&self) -> std::thread::Builder {
        let thread = std::thread::Builder::new().name(self.name.clone());
        match self.stack {
            Some(bytes) => thread.stack_size(bytes),
            None => thread,
        }
    }

    /// The watchdog of a device-paced group.
    pub(crate) fn watchdog(&self) -> Option<Nanos> {
        match self.release {
            Release::Periodic | Release::Hosted => None,
            Release::DevicePaced { watchdog } => Some(watchdog),
        }
    }

    /// The deadline in force, counted from the release.
    pub(crate) fn relative_deadline(&self) -> Nanos {
        self.deadline.unwrap_or(self.rate.period())
    }
}
