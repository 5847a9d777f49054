//! The builder: it hands out ports, collects rate groups and refuses graphs that cannot work.

use super::actor::Actor;
use super::disturbance::{Disturb, Disturbance};
use super::grant::GrantHandle;
use super::outlet::{self, OutletReader, OutletWriter};
use super::port::{self, QueueReader, QueueWriter, Reader, Writer};
use super::rate_group::RateGroup;
use super::recorder::{RecordDrain, Recorder, Registry};
use super::release::GroupRun;
use super::running::Runtime;
use super::schedule::admit;
use crate::error::{Error, ErrorKind};
use crate::time::{Nanos, Rate};
use std::fmt;
use std::sync::Arc;

/// How a graph is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Execution {
    /// One thread for everything, in the order of virtual time, as fast as the machine allows; bit-identical every time.
    Virtual,
    /// One thread per rate group, in real time.
    Threaded,
}

/// Collects the ports and rate groups of a graph; see [`Runtime::builder`].
pub struct RuntimeBuilder {
    execution: Execution,
    groups: Vec<(RateGroup, Vec<Box<dyn Actor>>)>,
    disturbed: Vec<(String, Disturb)>,
    until: Option<Nanos>,
    registry: Arc<Registry>,
    grants: GrantHandle,
}

impl RuntimeBuilder {
    pub(super) fn new(execution: Execution) -> Self {
        Self {
            execution,
            groups: Vec::new(),
            disturbed: Vec::new(),
            until: None,
            registry: Registry::new(),
            grants: GrantHandle::default(),
        }
    }

    /// A port for the newest value of a large state; every buffer is filled by `init`.
    pub fn exchange<T: Send>(&mut self, init: impl FnMut() -> T + Send + 'static) -> (Writer<T>, Reader<T>) {
        match self.execution {
            Execution::Virtual => port::virtual_exchange(init),
            Execution::Threaded => port::threaded_exchange(init),
        }
    }

    /// A port for ordered samples that holds at least `capacity` of them, rounded up to a power of two.
    pub fn queue<T: Copy + Send>(&mut self, capacity: usize) -> (QueueWriter<T>, QueueReader<T>) {
        match self.execution {
            Execution::Virtual => port::virtual_queue(capacity),
            Execution::Threaded => port::threaded_queue(capacity),
        }
    }

    /// The newest value for a thread outside the graph, such as a renderer; visible at once in both executions.
    pub fn outlet<T: Send>(&mut self, init: impl FnMut() -> T) -> (OutletWriter<T>, OutletReader<T>) {
        outlet::outlet(init)
    }

    /// A record sink for one actor, holding at least `capacity` records between two drains.
    pub fn recorder(&mut self, capacity: usize) -> Recorder {
        self.registry.recorder(capacity)
    }

    /// Takes the records of all recorders, made before or after this call, and of every group's timing and events.
    /// Without a drain the groups record nothing.
    pub fn drain(&mut self) -> RecordDrain {
        self.registry.drain()
    }

    /// Tells what the system granted, from the first actor's start on.
    pub fn grants(&self) -> GrantHandle {
        self.grants.clone()
    }

    /// Adds a rate group; its actors tick in this order. At equal times groups tick in the order they were added.
    pub fn group(&mut self, group: RateGroup, actors: Vec<Box<dyn Actor>>) -> &mut Self {
        self.groups.push((group, actors));
        self
    }

    /// Virtual time: makes the releases of a group late, as `disturbance` says.
    ///
    /// It is asked once per wait, in the order of the releases, with the number of the release that the group waits for. If
    /// the group wakes so late that another release runs, what was said holds for that one.
    pub fn disturb(
        &mut self,
        group: impl Into<String>,
        disturbance: impl FnMut(u64) -> Disturbance + Send + 'static,
    ) -> &mut Self {
        self.disturbed.push((group.into(), Disturb::new(disturbance)));
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
    /// [`ErrorKind::Runtime`](crate::ErrorKind::Runtime), naming the group and the values, for a graph that cannot work:
    /// a deadline beyond the period, a budget beyond the deadline, budgets that overfill a core, equal real-time
    /// priorities pinned to one core, a priority outside 1 to 99, a name used twice, no group that is not an observer; an
    /// overrun policy that says nothing or contradicts the release mode, a watchdog below a period, a device-paced group
    /// without an actor; a disturbance of threads, of no group, or a second one of the same.
    pub fn build(&mut self) -> Result<Runtime, Error> {
        for (index, (group, _)) in self.groups.iter_mut().enumerate() {
            if group.name.is_empty() {
                group.name = format!("group-{index}");
            }
        }
        admit(&self.groups.iter().map(|(group, _)| group.clone()).collect::<Vec<_>>())?;
        self.check_actors()?;
        self.check_disturbances()?;
        let mut built = std::mem::replace(self, Self::new(self.execution));
        let registry = Arc::clone(&built.registry);
        let run = |(index, (spec, actors)): (usize, (RateGroup, Vec<Box<dyn Actor>>))| {
            let recorder = registry.wanted().then(|| registry.recorder(ring_capacity(spec.rate)));
            // The admission check keeps the number of groups far below this.
            let place = built.disturbed.iter().position(|(name, _)| *name == spec.name);
            let disturb = place.map(|place| built.disturbed.swap_remove(place).1);
            GroupRun::new(index as u16, spec, actors, recorder, built.until).disturbed_by(disturb)
        };
        let groups = built.groups.into_iter().enumerate().map(run).collect();
        Ok(Runtime::new(built.execution, groups, registry, built.grants))
    }
}

impl RuntimeBuilder {
    fn check_actors(&self) -> Result<(), Error> {
        let deaf =
            |(group, actors): &&(RateGroup, Vec<Box<dyn Actor>>)| group.watchdog().is_some() && actors.is_empty();
        self.groups.iter().find(deaf).map_or(Ok(()), |(group, _)| {
            Err(Error::new(ErrorKind::Runtime, "is paced by a device and has no actor to wait for it; add one")
                .at(format!("rate group `{}`", group.name)))
        })
    }

    fn check_disturbances(&self) -> Result<(), Error> {
        for (index, (name, _)) in self.disturbed.iter().enumerate() {
            let wrong = if self.execution == Execution::Threaded {
                "threads cannot be disturbed: real time brings its own; use Execution::Virtual"
            } else if self.groups.iter().all(|(group, _)| group.name != *name) {
                "is to be disturbed and is not in the graph; add it or correct its name"
            } else if self.disturbed[..index].iter().any(|(other, _)| other == name) {
                "is disturbed twice; use one disturbance that does both"
            } else {
                continue;
            };
            return Err(Error::new(ErrorKind::Runtime, wrong).at(format!("rate group `{name}`")));
        }
        Ok(())
    }
}

/// Room for four seconds of timing, so that a logger stuck for that long loses nothing; at most 4 MB.
fn ring_capacity(rate: Rate) -> usize {
    ((4.0 * rate.as_hz()) as usize).clamp(256, 65_536)
}

impl fmt::Debug for RuntimeBuilder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let groups: Vec<_> = self.groups.iter().map(|(group, _)| group).collect();
        f.debug_struct("RuntimeBuilder")
            .field("execution", &self.execution)
            .field("groups", &groups)
            .finish_non_exhaustive()
    }
}
