//! The picture of a graph as data: what is known before a run, and what was measured in it.

use crate::executor::Execution;
use crate::rate_group::RateGroup;
use crate::reports::group_live::GroupLive;
use crate::system::grant::best_effort;
use crate::time::{Nanos, Rate};

/// The picture of a graph: rate groups with their actors, and the ports that connect them.
///
/// Before a run it has what was declared, after one also what was measured. Its `Display` is a text of a line per group
/// and port.
///
/// # Real-time
/// Not real-time safe: allocates. Before a run, after it, and for threads that show it.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct GraphView {
    /// The execution that the graph was built for.
    pub execution: Execution,
    /// The time since the start of the run; `None` before.
    pub elapsed: Option<Nanos>,
    /// The rate groups, in graph order.
    pub groups: Vec<GraphGroup>,
    /// The ports, in the order in which the builder made them.
    pub ports: Vec<GraphPort>,
    /// A sentence for each port that nobody reads or writes, or that others use than was declared.
    pub warnings: Vec<String>,
}

/// A rate group in the [picture](GraphView) of its graph.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GraphGroup {
    /// The name of the group.
    pub name: String,
    /// The rate of the group.
    pub rate: Rate,
    /// The deadline in force, counted from the release.
    pub deadline: Nanos,
    /// The declared computing time of one release, if there is one.
    pub budget: Option<Nanos>,
    /// The numbers of the cores that the group may run on; empty if it may run on any.
    pub cores: Vec<usize>,
    /// The scheduling policy asked for, in words.
    pub policy: String,
    /// True if the group ends after all others.
    pub observer: bool,
    /// The names of the actors, in the order of their ticks.
    pub actors: Vec<String>,
    /// Counts and times of the run so far; `None` before.
    pub measured: Option<GroupLive>,
}

/// The kind of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PortKind {
    /// The newest value between actors.
    Exchange,
    /// Ordered samples between actors.
    Queue,
    /// The newest value for a thread outside the graph.
    Outlet,
    /// The newest value from outside the graph.
    Parameter,
    /// Commands in order from outside the graph.
    Commands,
}

impl PortKind {
    /// A short name for tables.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exchange => "exchange",
            Self::Queue => "queue",
            Self::Outlet => "outlet",
            Self::Parameter => "parameter",
            Self::Commands => "commands",
        }
    }
}

/// One end of a port.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PortEnd {
    /// The end was not declared and has not been used yet.
    Unknown,
    /// Nobody holds this half of the port.
    Nobody,
    /// The half is held by a thread outside the graph, by this name.
    Outside(String),
    /// The half is held in a rate group.
    Group {
        /// The place of the group in [`GraphView::groups`].
        group: usize,
        /// The place of the actor in the group, if it is known.
        actor: Option<usize>,
    },
}

/// A port in the [picture](GraphView) of its graph: an edge from who writes it to who reads it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GraphPort {
    /// The name that a [link](crate::RuntimeBuilder::link) gave it, or `port-n` with its number.
    pub name: String,
    /// The kind of the port.
    pub kind: PortKind,
    /// The type of the values that it carries, without paths.
    pub carries: String,
    /// The end that writes.
    pub from: PortEnd,
    /// The end that reads.
    pub to: PortEnd,
    /// The number of values published or samples sent.
    pub sent: u64,
    /// The number of values or samples taken by the reading end; of an exchange those that were not overtaken.
    pub taken: u64,
    /// The number of samples for which the queue had no room.
    pub dropped: u64,
}

impl GraphView {
    /// The picture of groups without actors and ports.
    pub(crate) fn of_groups(execution: Execution, groups: &[RateGroup]) -> Self {
        let groups = groups.iter().map(|group| GraphGroup::of(group, execution)).collect();
        Self { execution, groups, ..Self::default() }
    }

    /// The picture with what was measured by `elapsed`.
    pub(crate) fn after(mut self, elapsed: Nanos, live: Vec<GroupLive>) -> Self {
        self.elapsed = Some(elapsed);
        for (group, live) in self.groups.iter_mut().zip(live) {
            group.measured = Some(live);
        }
        for port in &self.ports {
            let what = match (port.sent, port.taken) {
                (0, _) => "nothing was written to it so far",
                (_, 0) => "nothing was read from it so far",
                _ => continue,
            };
            if port.from != PortEnd::Nobody && port.to != PortEnd::Nobody {
                self.warnings.push(format!("port `{}`: {what}", port.name));
            }
        }
        self
    }

    /// An end in words: `group/actor`.
    pub(crate) fn in_words(&self, end: &PortEnd) -> String {
        match end {
            PortEnd::Unknown => "?".to_owned(),
            PortEnd::Nobody => "nobody".to_owned(),
            PortEnd::Outside(name) => name.clone(),
            PortEnd::Group { group, actor } => {
                let group = &self.groups[*group];
                match actor.and_then(|actor| group.actors.get(actor)) {
                    Some(actor) => format!("{}/{actor}", group.name),
                    None => group.name.clone(),
                }
            }
        }
    }
}

impl GraphGroup {
    fn of(group: &RateGroup, execution: Execution) -> Self {
        let threaded = execution == Execution::Threaded;
        Self {
            name: group.name.clone(),
            rate: group.rate,
            deadline: group.relative_deadline(),
            budget: group.budget,
            cores: if threaded { group.cores() } else { Vec::new() },
            policy: match group.priority.filter(|_| threaded) {
                Some(priority) => format!("SCHED_FIFO {priority}"),
                None if threaded && group.by_deadline => "SCHED_DEADLINE".to_owned(),
                None if threaded => best_effort(group.background),
                None => "virtual time".to_owned(),
            },
            observer: group.observer,
            actors: Vec::new(),
            measured: None,
        }
    }
}
