//! What a program writes: actors, and what they are told and answer at each release.

use crate::error::ActorError;
use crate::executor::Execution;
use crate::time::{Nanos, Rate};

/// A part of a program that is called once per release of its rate group.
///
/// An actor never reads a clock and never makes a channel: time comes with the [`TickContext`], data through ports from
/// the [builder](crate::RuntimeBuilder). That is what lets the same actor run on a real thread and in virtual time.
///
/// One release of a group: every actor's [`tick`](Self::tick) in the order given to the builder, then every actor's
/// [`commit`](Self::commit) in reverse order. So a device that ticks first (to read) commits last (to write what the
/// others computed in the same release).
///
/// ```
/// use palpate_runtime::{Actor, Outcome, Rate, TickContext};
///
/// struct Integrator(f64);
///
/// impl Actor for Integrator {
///     fn name(&self) -> &str {
///         "integrator"
///     }
///
///     fn tick(&mut self, ctx: &TickContext) -> Outcome {
///         self.0 += ctx.dt_nominal * f64::from(1 + ctx.slips);
///         Outcome::Continue
///     }
/// }
///
/// let mut integrator = Integrator(0.0);
/// integrator.tick(&TickContext::by_hand(Rate::hz(1000), 0));
/// assert_eq!(integrator.0, 0.001);
/// ```
pub trait Actor: Send {
    /// A short name for reports and errors.
    ///
    /// # Real-time
    /// Asked once, when the group is made, not in a tick.
    fn name(&self) -> &str;

    /// Prepares the actor. All starts run one after the other, in group order, on the thread that calls
    /// [`Runtime::start`](crate::Runtime::start), before release 0. What is published here is visible from release 0
    /// on, whatever the group's latency. Actors that take the place of failed ones are started between two releases.
    ///
    /// # Errors
    /// An error ends the start of the whole runtime and is returned from it.
    ///
    /// # Real-time
    /// Not called in a tick: may allocate and block. Where a group is started again, the others tick meanwhile.
    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        let _ = ctx;
        Ok(())
    }

    /// Blocks until the device that this actor reads has something new, at most `timeout`; true if it has.
    ///
    /// Only the first actor of a [device-paced](crate::Release::DevicePaced) group on threads is asked. New is what has
    /// come since it last said so, also between two questions; everything up to the return counts as one frame. Asked
    /// with a timeout of zero it only looks. An actor that returns false before its time, as the default does, is
    /// waited for by the clock, and after a panic it is not asked again.
    ///
    /// # Real-time
    /// May block, at most for `timeout`: the one wait of a device-paced tick. It costs what the device costs; what else
    /// is said about a tick's system calls and allocations does not include it.
    fn wait(&mut self, timeout: Nanos) -> bool {
        let _ = timeout;
        false
    }

    /// Does the work of one release.
    ///
    /// # Real-time
    /// Called on the group's thread: keep it free of allocation, locks and system calls where the group is real-time.
    fn tick(&mut self, ctx: &TickContext) -> Outcome;

    /// Does the second phase of a release, after every actor of the group has ticked, in reverse order.
    ///
    /// # Real-time
    /// As [`tick`](Self::tick).
    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        let _ = ctx;
        Outcome::Continue
    }

    /// Asked after a panic of this actor in a group that [winds down](crate::RateGroup::wind_down): true if it can
    /// still bring to rest what it drives. It is then called on like the others; a second panic is its last. The others
    /// are stopped at once.
    ///
    /// # Real-time
    /// As [`tick`](Self::tick): called on the group's thread between two releases.
    fn recover(&mut self) -> bool {
        false
    }

    /// Ends the actor: on the group's own thread after its last release, also after a fault of this or another actor.
    /// An actor that failed in a group that [winds down](crate::RateGroup::wind_down) is stopped at once.
    ///
    /// # Real-time
    /// May allocate and block for less than [`STOP_BOUND`](crate::STOP_BOUND): nothing is released afterwards. Only the
    /// stop of an actor that failed in a group that winds down is as [`tick`](Self::tick): the others are released on.
    fn stop(&mut self, ctx: &TickContext) {
        let _ = ctx;
    }
}

/// The answer of an actor to a release.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// All is well.
    #[default]
    Continue,
    /// The release was done with less than full quality, for the program's cause with this code. The run goes on; the
    /// report counts such releases, and a change of the code is recorded as
    /// [`Event::DEGRADED`](crate::Event::DEGRADED).
    Degraded(u32),
    /// The actor cannot go on, for the program's cause with this code. A
    /// [restartable](crate::RuntimeBuilder::restartable) group is started again; otherwise the whole runtime stops in
    /// order. Nothing of the actor's group ticks or commits any more, unless the group [winds
    /// down](crate::RateGroup::wind_down): then the other actors do.
    Fault(u32),
}

/// The mode of a rate group: how much of its work an actor should do in a release.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum GroupMode {
    /// The actor does all of its work.
    #[default]
    Normal = 0,
    /// The actor does the least that keeps the system useful. Set by
    /// [`OverrunPolicy::Degrade`](crate::OverrunPolicy::Degrade) from its books of slips and deadlines, and recorded
    /// with every release: an input of the release like any other.
    Degraded = 1,
    /// The actor brings what it drives to rest: the run is ending or another actor of the group has failed. The group
    /// has [that long](crate::RateGroup::wind_down).
    Stopping = 2,
}

impl GroupMode {
    /// The mode with this number; unknown numbers read as [`GroupMode::Normal`].
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn from_code(code: u8) -> Self {
        [Self::Normal, Self::Degraded, Self::Stopping].get(usize::from(code)).copied().unwrap_or_default()
    }

    /// The name of the mode in reports and exports.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Degraded => "degraded",
            Self::Stopping => "stopping",
        }
    }
}

/// The part of a group's life in which its actors are called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Starts run one after the other before anything is released: what they see is the same in every run.
    Start,
    /// A release, which a recording can repeat.
    Release,
    /// A release of an observer: it follows its own schedule, also when a recording is re-executed.
    Observer,
    /// After the last release.
    Stop,
}

/// The context of a release, told to every actor that is called in it. All times count from the start of the run.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug)]
pub struct TickContext {
    /// The number of the release, counting skipped ones: release n is due at n periods after the group's offset.
    pub tick: u64,
    /// The time at which the release was due. Decisions that change results depend on this, never on `now`.
    pub scheduled: Nanos,
    /// The time at which the group's work began; equal to `scheduled` in undisturbed virtual time. In a device-paced
    /// group it may be up to seven eighths of a period earlier than `scheduled`.
    pub now: Nanos,
    /// The nominal period of the group, in seconds.
    pub dt_nominal: f64,
    /// Time since the work of the release before began, in seconds; `dt_nominal` at the first.
    pub dt_measured: f64,
    /// Periods skipped between the release before and this one.
    pub slips: u32,
    /// The mode: how much of its work the actor should do.
    pub mode: GroupMode,
    /// When publications made in this release become visible to other groups; only virtual time looks at it.
    pub(crate) visible_at: Nanos,
    /// The rate group that is called: ports tell by it what comes from another group.
    pub(crate) group: u16,
    /// The place of the actor that is called among those of the group.
    pub(crate) actor: u16,
    /// In which part of its life.
    pub(crate) phase: Phase,
    /// How the graph runs; `None` by hand, which ports of both executions take.
    pub(crate) execution: Option<Execution>,
}

impl TickContext {
    /// The context of release `n` at `rate`, on time and without latency: to drive an actor or a port by hand, in
    /// tests.
    pub fn by_hand(rate: Rate, n: u64) -> Self {
        let scheduled = rate.release(n);
        Self {
            tick: n,
            scheduled,
            now: scheduled,
            dt_nominal: rate.period_s(),
            dt_measured: rate.period_s(),
            slips: 0,
            mode: GroupMode::Normal,
            visible_at: scheduled,
            group: 0,
            actor: 0,
            phase: Phase::Release,
            execution: None,
        }
    }
}

/// An actor made of a name and a closure, for programs that need no more.
///
/// ```
/// use palpate_runtime::{Outcome, Rate, TickContext, actor_fn};
///
/// let mut actor = actor_fn("ends", |ctx| if ctx.tick < 9 { Outcome::Continue } else { Outcome::Fault(7) });
/// assert_eq!(actor.tick(&TickContext::by_hand(Rate::hz(100), 9)), Outcome::Fault(7));
/// ```
///
/// # Real-time
/// Allocates: before the run. The closure is called as [`Actor::tick`].
pub fn actor_fn(name: &str, tick: impl FnMut(&TickContext) -> Outcome + Send + 'static) -> Box<dyn Actor> {
    Box::new(FnActor { name: name.to_owned(), tick })
}

struct FnActor<F> {
    name: String,
    tick: F,
}

impl<F: FnMut(&TickContext) -> Outcome + Send> Actor for FnActor<F> {
    fn name(&self) -> &str {
        &self.name
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        (self.tick)(ctx)
    }
}
