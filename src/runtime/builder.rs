//! The builder: it hands out ports, collects rate groups and refuses graphs that cannot work.

use super::actor::Actor;
use super::grant::GrantHandle;
use super::outlet::{self, OutletReader, OutletWriter};
use super::port::{self, PortPlan, Reader, Writer};
use super::queue_port::{self, QueueReader, QueueWriter};
use super::rate_group::RateGroup;
use super::recorder::{RecordDrain, Recorder, Registry};
use super::recording::Recording;
use super::reexecution::Reexecution;
use super::release::GroupRun;
use super::running::Runtime;
use super::schedule::admit;
use super::script::Script;
use crate::error::Error;
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
    until: Option<Nanos>,
    registry: Arc<Registry>,
    grants: GrantHandle,
    /// Exchanges and queues made so far.
    ports: u32,
    /// What to repeat, and what its ports must show.
    recording: Option<(Recording, Script)>,
}

impl RuntimeBuilder {
    pub(super) fn new(execution: Execution, recording: Option<Recording>) -> Self {
        Self {
            execution,
            groups: Vec::new(),
            until: None,
            registry: Registry::new(),
            grants: GrantHandle::default(),
            ports: 0,
            recording: recording.map(|recording| {
                let script = recording.script();
                (recording, script)
            }),
        }
    }

    fn plan_port(&mut self) -> PortPlan<'_> {
        let port = self.ports;
        self.ports += 1;
        let script = self.recording.as_ref().map(|(_, script)| script.port(port));
        PortPlan { port, registry: &self.registry, script }
    }

    /// A port for the newest value of a large state; every buffer is filled by `init`.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn exchange<T: Send>(&mut self, init: impl FnMut() -> T + Send + 'static) -> (Writer<T>, Reader<T>) {
        match self.execution {
            Execution::Virtual => port::virtual_exchange(self.plan_port(), init),
            Execution::Threaded => port::threaded_exchange(self.plan_port(), init),
        }
    }

    /// A port for ordered samples that holds at least `capacity` of them, rounded up to a power of two.
    ///
    /// Ports made after [`drain`](Self::drain) record what a [re-execution](Recording) needs.
    pub fn queue<T: Copy + Send>(&mut self, capacity: usize) -> (QueueWriter<T>, QueueReader<T>) {
        match self.execution {
            Execution::Virtual => queue_port::virtual_queue(self.plan_port(), capacity),
            Execution::Threaded => queue_port::threaded_queue(self.plan_port(), capacity),
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
        self.groups.push((group, actors));
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
    /// priorities pinned to one core, a priority outside 1 to 99, a name used twice, no group that is not an observer. For a
    /// re-execution also if the recording is one of another graph, and [`ErrorKind::Log`](crate::ErrorKind::Log) if it
    /// has gaps.
    pub fn build(&mut self) -> Result<Runtime, Error> {
        for (index, (group, _)) in self.groups.iter_mut().enumerate() {
            if group.name.is_empty() {
                group.name = format!("group-{index}");
            }
        }
        admit(&self.groups.iter().map(|(group, _)| group.clone()).collect::<Vec<_>>())?;
        let built = std::mem::replace(self, Self::new(self.execution, None));
        let registry = built.registry;
        let run = |(index, (spec, actors)): (usize, (RateGroup, Vec<Box<dyn Actor>>))| {
            let recorder = registry.wanted().then(|| registry.recorder(ring_capacity(spec.rate)));
            // The admission check keeps the number of groups far below this.
            GroupRun::new(index as u16, spec, actors, recorder, built.until)
        };
        let groups: Vec<GroupRun> = built.groups.into_iter().enumerate().map(run).collect();
        let reexecution = match built.recording {
            Some((recording, script)) => Some(Reexecution::new(recording, script, &groups, built.ports)?),
            None => None,
        };
        Ok(Runtime::new(built.execution, groups, reexecution, registry, built.grants))
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
