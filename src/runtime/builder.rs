//! The builder: it hands out ports, collects rate groups and refuses graphs that cannot work.

use crate::accounting::ledger::Ledger;
use crate::actor::Actor;
use crate::admission::plan::Plan;
use crate::error::{ActorError, GraphError};
use crate::executor::Execution;
use crate::executor::disturbance::{Disturb, Disturbance};
use crate::graph::view::PortKind;
use crate::graph::wiring::Wiring;
use crate::group::group_run::GroupRun;
use crate::ports::exchange_port::{Reader, Writer};
use crate::ports::inlet::{Commands, InputValue, Parameter};
use crate::ports::outlet::{OutletReader, OutletWriter, outlet};
use crate::ports::port_state::PortPlan;
use crate::ports::port_traffic::Sides;
use crate::ports::queue_port::{QueueReader, QueueWriter};
use crate::ports::restartable::{ExchangePort, OutletPort, QueuePort, RecorderPort};
use crate::rate_group::RateGroup;
use crate::records::recorder::{RecordDrain, Recorder, Registry};
use crate::reexecution::recording::Recording;
use crate::reexecution::replay::Reexecution;
use crate::reexecution::script::{Script, ScriptedPort};
use crate::runtime::Runtime;
use crate::supervision::restart::{Factory, Restart, Restarter};
use crate::system::grant::GrantHandle;
use crate::time::{Nanos, Rate};
use std::sync::Arc;

/// Who plays in a group.
enum Cast {
    Once(Vec<Box<dyn Actor>>),
    Restartable(Restart, Factory),
}

/// Collects the ports and rate groups of a graph; see [`Runtime::builder`].
///
/// A graph that cannot work is refused with the values that say why:
///
/// ```
/// use palpate_runtime::{Execution, Nanos, RateGroup, Runtime};
///
/// let mut graph = Runtime::builder(Execution::Threaded);
/// for name in ["a", "b"] {
///     graph.group(RateGroup::hz(1000).name(name).pin(0).budget(Nanos(700_000)), vec![]);
/// }
/// let refused = graph.build().unwrap_err().to_string();
/// assert!(refused.starts_with("the budgets on core 0 need 140.0 % (`a` 700 us of 1 ms + `b` 700 us of 1 ms)"));
/// ```
///
/// # Real-time
/// Not real-time safe: allocates. It is gone before anything ticks.
pub struct RuntimeBuilder {
    execution: Execution,
    groups: Vec<(RateGroup, Cast)>,
    disturbed: Vec<(String, Disturb)>,
    until: Option<Nanos>,
    registry: Arc<Registry>,
    grants: GrantHandle,
    /// Exchanges and queues made so far.
    ports: u32,
    wiring: Wiring,
    measures_cost: bool,
    /// What to repeat, and what its ports must show.
    recording: Option<(Recording, Script)>,
}

impl Runtime {
    /// A builder for a graph that runs in this execution.
    pub fn builder(execution: Execution) -> RuntimeBuilder {
        RuntimeBuilder::new(execution, None)
    }

    /// A builder for a graph that repeats `recording` in virtual time: it must be built as the recorded one was, with
    /// the same groups and ports in the same order. Exactly the recorded releases run, whatever rates, policies and
    /// [`until`](RuntimeBuilder::until) say, and every one of them sees through its ports what it saw then.
    ///
    /// A recording that lacks a record ends in a [fault](crate::RuntimeReport::fault) that names what is missing.
    pub fn reexecution(recording: Recording) -> RuntimeBuilder {
        RuntimeBuilder::new(Execution::Virtual, Some(recording))
    }
}

impl RuntimeBuilder {
    pub(crate) fn new(execution: Execution, recording: Option<Recording>) -> Self {
        Self {
            execution,
            groups: Vec::new(),
            disturbed: Vec::new(),
            until: None,
            registry: Registry::new(),
            grants: GrantHandle::default(),
            ports: 0,
            wiring: Wiring::default(),
            measures_cost: false,
            recording: recording.map(|recording| {
                let script = recording.script();
                (recording, script)
            }),
        }
    }

    /// The next port's number, and what it must show in a re-execution.
    fn plan_port<T>(&mut self, kind: PortKind) -> (PortPlan, Option<ScriptedPort>) {
        let port = self.ports;
        self.ports += 1;
        let script = self.recording.as_ref().map(|(_, script)| script.port(port));
        let plan = PortPlan::new(self.execution, port, &self.registry);
        self.wiring.add::<T>(kind, &plan.sides);
        (plan, script)
    }

    fn plan_outlet<T>(&mut self) -> Sides {
        let sides = Sides::new();
        self.wiring.add::<T>(PortKind::Outlet, &sides);
        sides
    }

    /// Names the port that is made next, and declares its ends for the [picture of the graph](crate::GraphView) before the run:
    /// each is an actor, `group/actor` where several actors have that name, or a rate group. The reading end of an
    /// outlet and the sending end of a parameter or of commands are outside the graph and may be any word.
    ///
    /// Without it a port has a number for a name, and its ends are known once they have been used.
    ///
    /// ```
    /// use palpate_runtime::{Execution, Outcome, RateGroup, Runtime, actor_fn};
    ///
    /// let mut graph = Runtime::builder(Execution::Virtual);
    /// let (mut plan, mut target) = graph.link("target", "planner", "controller").exchange(|| 0.0);
    /// let planner = actor_fn("planner", move |ctx| {
    ///     plan.publish(ctx);
    ///     Outcome::Continue
    /// });
    /// let controller = actor_fn("controller", move |ctx| {
    ///     target.refresh(ctx);
    ///     Outcome::Continue
    /// });
    /// graph.group(RateGroup::hz(1000).name("control"), vec![controller]);
    /// graph.group(RateGroup::hz(10).name("plan"), vec![planner]);
    /// let graph = graph.build()?.graph();
    /// assert!(graph.to_string().contains("plan/planner -> control/controller"));
    /// std::fs::write(std::env::temp_dir().join("graph.svg"), graph.to_svg())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn link(&mut self, name: impl Into<String>, from: impl Into<String>, to: impl Into<String>) -> &mut Self {
        self.wiring.link(name.into(), from.into(), to.into());
        self
    }

    /// A port for the newest value of a large state; every buffer is filled by `init`.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn exchange<T: Send + 'static>(&mut self, init: impl FnMut() -> T + Send + 'static) -> (Writer<T>, Reader<T>) {
        let port = self.exchange_port(init);
        (port.writer(), port.reader())
    }

    /// A port for the newest value of a large state, with halves that a [restarted](Self::restartable) group can take
    /// again.
    pub fn exchange_port<T: Send + 'static>(&mut self, init: impl FnMut() -> T + Send + 'static) -> ExchangePort<T> {
        let (plan, script) = self.plan_port::<T>(PortKind::Exchange);
        ExchangePort::new(self.execution, plan, script, init)
    }

    /// A port for ordered samples that holds at least `capacity` of them, rounded up to a power of two.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn queue<T: Copy + Send + 'static>(&mut self, capacity: usize) -> (QueueWriter<T>, QueueReader<T>) {
        let port = self.queue_port(capacity);
        (port.writer(), port.reader())
    }

    /// A port for ordered samples, with halves that a [restarted](Self::restartable) group can take again.
    pub fn queue_port<T: Copy + Send + 'static>(&mut self, capacity: usize) -> QueuePort<T> {
        let (plan, script) = self.plan_port::<T>(PortKind::Queue);
        QueuePort::new(self.execution, plan, script, capacity)
    }

    /// The newest value for a thread outside the graph, such as a renderer; visible at once in both executions.
    pub fn outlet<T: Send>(&mut self, init: impl FnMut() -> T) -> (OutletWriter<T>, OutletReader<T>) {
        outlet(&self.plan_outlet::<T>(), init)
    }

    /// A port for the newest value for a thread outside the graph, with halves that a [restarted](Self::restartable)
    /// group can take again.
    pub fn outlet_port<T: Send + 'static>(&mut self, init: impl FnMut() -> T + Send + 'static) -> OutletPort<T> {
        OutletPort::new(self.plan_outlet::<T>(), init)
    }

    /// A value that the program sets from outside while the graph runs.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn parameter<T: InputValue>(&mut self, initial: T) -> Parameter<T> {
        let (plan, script) = self.plan_port::<T>(PortKind::Parameter);
        Parameter::new(plan, script, initial)
    }

    /// Commands that the program sends from outside while the graph runs; at least `capacity` of them may wait, rounded
    /// up to a power of two.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn commands<T: InputValue>(&mut self, capacity: usize) -> Commands<T> {
        let (plan, script) = self.plan_port::<T>(PortKind::Commands);
        Commands::new(plan, script, capacity)
    }

    /// A record sink for one actor, holding at least `capacity` records between two drains.
    pub fn recorder(&mut self, capacity: usize) -> Recorder {
        self.registry.recorder(capacity)
    }

    /// A record sink for one actor that a [restarted](Self::restartable) group can take again.
    pub fn recorder_port(&mut self, capacity: usize) -> RecorderPort {
        RecorderPort::new(&self.registry, capacity)
    }

    /// Takes the records of all recorders, made before or after this call, and of every group's timing and events.
    /// Without a drain the groups record nothing, and ports made before the first call record nothing either.
    pub fn drain(&mut self) -> RecordDrain {
        self.registry.drain()
    }

    /// Tells what the system granted, from the first actor's start on.
    pub fn grants(&self) -> GrantHandle {
        self.grants.clone()
    }

    /// Adds a rate group; its actors tick in this order. At equal times groups tick in the order they were added.
    pub fn group(&mut self, group: RateGroup, actors: Vec<Box<dyn Actor>>) -> &mut Self {
        self.groups.push((group, Cast::Once(actors)));
        self
    }

    /// Adds a rate group whose actors are made by `factory`: once when the graph is built, and again whenever one of
    /// them panicked, reported a fault or did not return, as often as `restart` allows. The other groups run on
    /// meanwhile. What stops the run by its overrun policy, or fails while it winds down, is not started again; an
    /// observer cannot be.
    ///
    /// The factory takes the halves of the actors' ports from ports that can be taken again
    /// ([`exchange_port`](Self::exchange_port) and the like), which cuts the failed actors off. Periods that passed
    /// meanwhile are skipped with the cause [`Fault`](crate::SlipCause::Fault), under every overrun policy.
    ///
    /// # Real-time
    /// On threads the factory runs, and the new actors are started, on the thread that then takes the group over,
    /// before it is given its policy and core: both may allocate and take their time, and nobody waits for them but a
    /// stop.
    pub fn restartable(
        &mut self,
        group: RateGroup,
        restart: Restart,
        factory: impl FnMut() -> Result<Vec<Box<dyn Actor>>, ActorError> + Send + 'static,
    ) -> &mut Self {
        self.groups.push((group, Cast::Restartable(restart, Box::new(factory))));
        self
    }

    /// Virtual time: makes the releases of a group late, as `disturbance` says.
    ///
    /// It is asked once per wait, in the order of the releases, with the number of the release that the group waits
    /// for. If the group wakes so late that another release runs, what was said holds for that one.
    ///
    /// # Real-time
    /// Asked by virtual time only, between two releases: may allocate.
    pub fn disturb(
        &mut self,
        group: impl Into<String>,
        disturbance: impl FnMut(u64) -> Disturbance + Send + 'static,
    ) -> &mut Self {
        self.disturbed.push((group.into(), Disturb::new(disturbance)));
        self
    }

    /// Virtual time: measures the CPU time of every release, for [`RuntimeReport::costs`](crate::RuntimeReport::costs).
    /// Nothing that an actor computes depends on it.
    pub fn measure_cost(&mut self) -> &mut Self {
        self.measures_cost = true;
        self
    }

    /// Ends the run by itself: the last release of each group is the last one due at or before `time`.
    pub fn until(&mut self, time: Nanos) -> &mut Self {
        self.until = Some(time);
        self
    }

    /// Checks the graph and makes it ready to start; the builder is empty afterwards.
    ///
    /// # Errors
    /// [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused), naming the group and the values, for a graph that
    /// cannot work: a deadline beyond the period, a budget beyond the deadline, budgets that overfill a core or all
    /// cores together, on threads a core that is not there, a latency beyond the period, equal real-time priorities pinned to one core, a
    /// priority outside 1 to 99, a name used twice, no group that is not an observer; an overrun policy that says
    /// nothing or contradicts the release mode, a [link](Self::link) to nobody, a watchdog below a period, a device-paced group without an actor; a
    /// disturbance of threads, of no group, or a second one of the same; a [measurement](Self::measure_cost) of
    /// threads. Or what a [factory](Self::restartable) says. For a re-execution also if the recording is one of another
    /// graph, and [`GraphErrorKind::Recording`](crate::GraphErrorKind::Recording) if it has gaps.
    pub fn build(&mut self) -> Result<Runtime, GraphError> {
        for (index, (group, _)) in self.groups.iter_mut().enumerate() {
            if group.name.is_empty() {
                group.name = format!("group-{index}");
            }
        }
        Plan::check(self.execution, &self.specs())?;
        self.check_restartable()?;
        self.check_disturbances()?;
        self.check_measurement()?;
        let mut built = std::mem::replace(self, Self::new(self.execution, None));
        let registry = built.registry;
        let mut groups = Vec::with_capacity(built.groups.len());
        let mut restarters = Vec::with_capacity(built.groups.len());
        let mut disturbances = Vec::with_capacity(built.groups.len());
        for (index, (spec, cast)) in built.groups.into_iter().enumerate() {
            // The admission check keeps the number of groups far below this.
            let index = index as u16;
            let records = registry.wanted().then(|| RecorderPort::new(&registry, ring_capacity(spec.rate)));
            let place = built.disturbed.iter().position(|(name, _)| *name == spec.name);
            let disturb = place.map(|place| built.disturbed.swap_remove(place).1);
            let (group, restarter) = match cast {
                Cast::Once(actors) => {
                    let ledger = Ledger::new(index, &spec, built.until);
                    let recorder = records.as_ref().map(RecorderPort::recorder);
                    (GroupRun::new(built.execution, index, spec, actors, recorder, ledger), None)
                }
                Cast::Restartable(policy, factory) => {
                    let events = registry.wanted().then(|| registry.recorder(SUPERVISOR_EVENTS));
                    let mut restarter = Restarter {
                        policy,
                        factory,
                        execution: built.execution,
                        index,
                        spec,
                        until: built.until,
                        records,
                        events,
                        shown: None,
                        restarts: 0,
                    };
                    let (group, books) = restarter.first()?;
                    (group, Some((restarter, books)))
                }
            };
            group.check_listener()?;
            groups.push(group);
            disturbances.push(disturb);
            restarters.push(restarter);
        }
        let repeat = |(recording, script)| Reexecution::new(recording, script, &groups, built.ports);
        let reexecution = built.recording.map(repeat).transpose()?;
        built.wiring.close(&groups)?;
        let Self { execution, grants, measures_cost, wiring, .. } = built;
        let wiring = Arc::new(wiring);
        Ok(Runtime {
            execution,
            wiring,
            groups,
            restarters,
            disturbances,
            reexecution,
            registry,
            grants,
            measures_cost,
        })
    }
}

/// Events of the supervisor about one group between two drains.
const SUPERVISOR_EVENTS: usize = 64;

impl RuntimeBuilder {
    fn specs(&self) -> Vec<RateGroup> {
        self.groups.iter().map(|(group, _)| group.clone()).collect()
    }

    /// An observer ends after all others: what fails in it is told when it ends, and there is nothing it could go on
    /// with.
    fn check_restartable(&self) -> Result<(), GraphError> {
        for (group, cast) in &self.groups {
            let wrong = match cast {
                Cast::Restartable(..) if group.observer => "an observer cannot be restartable; add it with `group`",
                Cast::Restartable(..) if group.is_hosted() => {
                    "a hosted group cannot be restartable: it has no thread that could be replaced; add it with `group`"
                }
                _ => continue,
            };
            return Err(GraphError::refused(wrong).in_group(&group.name));
        }
        Ok(())
    }

    fn check_measurement(&self) -> Result<(), GraphError> {
        if self.measures_cost && self.execution == Execution::Threaded {
            let wrong =
                "the cost of threads is not measured: it takes system calls; their execution times are in every report";
            return Err(GraphError::refused(wrong));
        }
        Ok(())
    }

    fn check_disturbances(&self) -> Result<(), GraphError> {
        for (index, (name, _)) in self.disturbed.iter().enumerate() {
            let wrong = if self.execution == Execution::Threaded {
                "threads cannot be disturbed: real time brings its own; use Execution::Virtual"
            } else if self.recording.is_some() {
                "a re-execution cannot be disturbed: its releases are those of the recording"
            } else if self.groups.iter().all(|(group, _)| group.name != *name) {
                "is to be disturbed and is not in the graph; add it or correct its name"
            } else if self.disturbed[..index].iter().any(|(other, _)| other == name) {
                "is disturbed twice; use one disturbance that does both"
            } else {
                continue;
            };
            return Err(GraphError::refused(wrong).in_group(name));
        }
        Ok(())
    }
}

/// Room for four seconds of two records a release, so that a logger stuck for that long loses nothing; at most 4 MB.
fn ring_capacity(rate: Rate) -> usize {
    ((8.0 * rate.as_hz()) as usize).clamp(256, 65_536)
}

impl_debug!(RuntimeBuilder, "execution": |own| own.execution, "groups": |own| own.specs());
