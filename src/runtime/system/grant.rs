//! What the system granted and what it refused, so that a refused privilege is reported and never silent.

use crate::primitives::sync::lock;
use crate::rate_group::RateGroup;
use crate::system::os;
use crate::system::wait::Waiter;
use std::sync::{Arc, Mutex};

/// The privileges that a run got from the system, and facts about the machine. Plain texts and numbers, easy to
/// serialise.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SystemGrant {
    /// True in virtual time, where nothing is asked for.
    pub virtual_time: bool,
    /// Whether memory is locked: `locked`, `not asked`, or why it was refused.
    pub mlock: String,
    /// Timer slack of the group threads: `1 ns`, `not asked`, or why it was refused.
    pub timer_slack: String,
    /// Whether processors are kept out of idle states that take long to leave: `held off`, `not asked`, or why it was
    /// refused.
    pub idle_states: String,
    /// The clock source: what the kernel reads the time from.
    pub clock_source: String,
    /// The kernel's release and build.
    pub kernel: String,
    /// The number of processor cores that the process may use.
    pub cores: usize,
    /// The privileges of each rate group, in graph order.
    pub groups: Vec<GroupGrant>,
}

/// The privileges that the thread of one rate group got, and those that it was refused.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GroupGrant {
    /// The group's name.
    pub name: String,
    /// The scheduling policy in force.
    pub policy: String,
    /// The real-time priority in force; 0 for none.
    pub priority: u8,
    /// The number of the core that the thread is pinned to.
    pub cpu: Option<usize>,
    /// The numbers of the cores that the thread may run on, where several were asked for and granted.
    pub cpus: Vec<usize>,
    /// The way in which the thread waits for its releases, in words.
    pub wait: String,
    /// The privileges that were refused, with the reason; empty if nothing was.
    pub refused: String,
}

/// A handle to what the system granted, which is known from before the first actor is started.
#[derive(Clone, Debug, Default)]
pub struct GrantHandle(Arc<Mutex<Option<SystemGrant>>>);

impl GrantHandle {
    /// The privileges that the system granted; `None` before the runtime is started.
    ///
    /// # Real-time
    /// Takes a lock and allocates: for loggers.
    pub fn get(&self) -> Option<SystemGrant> {
        lock(&self.0).clone()
    }

    pub(crate) fn set(&self, grant: SystemGrant) {
        *lock(&self.0) = Some(grant);
    }

    /// A group has got a new thread.
    pub(crate) fn replace(&self, group: usize, grant: GroupGrant) {
        if let Some(place) = lock(&self.0).as_mut().and_then(|system| system.groups.get_mut(group)) {
            *place = grant;
        }
    }
}

/// What the calling thread's set-up led to.
pub(crate) struct ThreadGrant {
    pub(crate) group: GroupGrant,
    pub(crate) timer_slack: String,
    pub(crate) waiter: Waiter,
    /// Shows the thread to the supervisor.
    pub(crate) probe: os::ThreadProbe,
}

const FIFO: &str = "SCHED_FIFO";
const DEADLINE: &str = "SCHED_DEADLINE";
const OTHER: &str = "SCHED_OTHER";

fn policy(fifo: bool, deadline: bool, background: bool) -> String {
    match (fifo, deadline) {
        (_, true) => DEADLINE.to_owned(),
        (true, _) => FIFO.to_owned(),
        _ => best_effort(background),
    }
}

/// The policy of a thread that is none of real time, and how it is said that it gives way.
pub(crate) fn best_effort(background: bool) -> String {
    if background { format!("{OTHER}, nice {}", os::BACKGROUND_NICE) } else { OTHER.to_owned() }
}

/// The group's three numbers; admission has seen to it that there is a budget.
fn ask_deadline(spec: &RateGroup) -> Result<(), String> {
    os::set_deadline(spec.budget.unwrap_or_default().0, spec.relative_deadline().0, spec.rate.period().0)
}

/// Sets the calling thread up for `spec` as far as the system allows.
pub(crate) fn set_up_thread(spec: &RateGroup) -> ThreadGrant {
    os::block_signals();
    let mut refused = Vec::new();
    let mut granted = |result: Result<(), String>| result.map_err(|reason| refused.push(reason)).is_ok();
    os::touch_stack();
    let timer_slack = os::set_timer_slack().map_or_else(|reason| reason, |()| "1 ns".to_owned());
    let cpu = spec.cpu.filter(|&cpu| granted(os::pin_to(&[cpu])));
    let priority = spec.priority.filter(|&priority| granted(os::set_realtime(priority)));
    let cpus = if !spec.cpus.is_empty() && granted(os::pin_to(&spec.cpus)) { spec.cpus.clone() } else { Vec::new() };
    // After the cores: the kernel looks at them when it grants it.
    let by_deadline = spec.by_deadline && granted(ask_deadline(spec));
    let background = spec.background && granted(os::give_way());
    // A thread that spins uses up its budget: under SCHED_DEADLINE it sleeps.
    let waiter = Waiter::new(spec.wait, priority.is_some(), spec.rate.period());
    let group = GroupGrant {
        name: spec.name.clone(),
        policy: policy(priority.is_some(), by_deadline, background),
        priority: priority.unwrap_or(0),
        cpu,
        cpus,
        wait: waiter.to_string(),
        refused: refused.join("; "),
    };
    ThreadGrant { group, timer_slack, waiter, probe: os::ThreadProbe::of_this_thread() }
}

/// What a threaded run of `groups` would be refused now, a sentence each: the same set-up on threads that end at once.
pub(crate) fn refusals(groups: &[RateGroup]) -> Vec<String> {
    let mut refused = Vec::new();
    for spec in groups.iter().filter(|group| !group.is_hosted()) {
        let own = spec.clone();
        let probe = spec.thread().spawn(move || set_up_thread(&own));
        let grant = match probe.map(std::thread::JoinHandle::join) {
            Ok(Ok(grant)) => grant,
            _ => {
                refused.push(format!("{}: the system gives no thread", spec.name));
                continue;
            }
        };
        if !grant.group.refused.is_empty() {
            refused.push(format!("{}: {}", spec.name, grant.group.refused));
        }
        if grant.timer_slack.starts_with("refused") {
            refused.push(format!("{}: timer slack {}", spec.name, grant.timer_slack));
        }
    }
    if groups.iter().any(RateGroup::is_realtime) {
        refused.extend(os::may_lock_everything().err().map(|reason| format!("memory: {reason}")));
        refused.extend(os::stay_awake().err().map(|reason| format!("idle states: {reason}")));
    }
    refused
}

impl GroupGrant {
    /// The grant of a group that a thread of the program's releases: nothing is asked for.
    pub(crate) fn hosted(spec: &RateGroup) -> Self {
        let policy = "the program's thread".to_owned();
        Self { name: spec.name.clone(), policy, wait: "hosted".to_owned(), ..Self::default() }
    }
}

impl SystemGrant {
    /// True if the group got a real-time policy.
    pub(crate) fn is_realtime(group: &GroupGrant) -> bool {
        group.policy == FIFO || group.policy == DEADLINE
    }

    /// The facts about the machine; groups and privileges are left to the caller.
    pub(crate) fn of_machine() -> Self {
        Self {
            virtual_time: false,
            mlock: "not asked".to_owned(),
            timer_slack: "not asked".to_owned(),
            idle_states: "not asked".to_owned(),
            clock_source: os::clock_source(),
            kernel: os::kernel(),
            cores: os::cores(),
            groups: Vec::new(),
        }
    }

    /// The grant of a virtual run: one thread, nothing asked for.
    pub(crate) fn of_virtual_time<'a>(groups: impl Iterator<Item = &'a RateGroup>) -> Self {
        let group = |spec: &RateGroup| GroupGrant {
            name: spec.name.clone(),
            policy: OTHER.to_owned(),
            wait: "virtual".to_owned(),
            ..GroupGrant::default()
        };
        Self { virtual_time: true, groups: groups.map(group).collect(), ..Self::of_machine() }
    }
}
