//! The schedule of a graph before it runs: what each group asks for, what the cores have to bear, which releases fall on
//! the same instant and which privileges this system would refuse. Nothing in it is a reason to refuse the graph.

use crate::admission::check::{Cores, admit};
use crate::error::GraphError;
use crate::executor::Execution;
use crate::graph::view::GraphView;
use crate::rate_group::RateGroup;
use crate::reports::text::{percent, places, short};
use crate::system::grant::{best_effort, refusals};
use crate::system::machine::{MachineFinding, Readiness, findings};
use crate::system::os;
use crate::system::wait::Waiter;
use crate::time::{Nanos, Rate};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// The schedule of a graph; its `Display` is a table.
///
/// ```
/// use palpate_runtime::{Execution, Nanos, Plan, RateGroup};
///
/// let groups = [RateGroup::hz(1000).name("fast").budget(Nanos(250_000)), RateGroup::hz(30).name("slow")];
/// let plan = Plan::of(Execution::Virtual, &groups)?;
/// assert_eq!((plan.total_load, plan.coincidences[0].every), (0.25, Nanos(100_000_000)));
/// println!("{plan}");
/// # Ok::<(), palpate_runtime::GraphError>(())
/// ```
///
/// # Real-time
/// Not real-time safe: allocates, starts threads. Before the run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Plan {
    /// The execution that the graph was built for.
    pub execution: Execution,
    /// Processor cores that the process may use.
    pub cores: usize,
    /// What each rate group asks for, in graph order.
    pub groups: Vec<GroupPlan>,
    /// The load that the declared budgets put on each core that a group is pinned to, as a part of that core (0 to 1).
    pub core_load: BTreeMap<usize, f64>,
    /// The load that the declared budgets of all groups are together, in cores.
    pub total_load: f64,
    /// Pairs of groups that share a core, or may, and have releases at the same instant; in virtual time every pair
    /// does.
    pub coincidences: Vec<Coincidence>,
    /// The picture of the graph; groups alone where nothing else is known.
    pub graph: GraphView,
    /// How far the machine is prepared for real time; empty in virtual time and if no group asks for a real-time policy.
    pub machine: Vec<MachineFinding>,
    /// Privileges that the system would refuse now, a sentence each; a refusal degrades a run and never fails it.
    pub missing: Vec<String>,
}

/// The demands of one rate group on the machine, as declared.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GroupPlan {
    /// The name of the group.
    pub name: String,
    /// The rate of the group.
    pub rate: Rate,
    /// The delay of every release, counted from the start of the run.
    pub offset: Nanos,
    /// The deadline in force, counted from the release.
    pub deadline: Nanos,
    /// The declared computing time of one release, if there is one.
    pub budget: Option<Nanos>,
    /// The number of the core that the group is pinned to.
    pub cpu: Option<usize>,
    /// The numbers of the cores that the group may run on, where it may run on several and not on all.
    pub cpus: Vec<usize>,
    /// True if SCHED_DEADLINE is asked for.
    pub by_deadline: bool,
    /// The real-time priority asked for.
    pub priority: Option<u8>,
    /// True if the group's thread gives way to all others.
    pub background: bool,
    /// The way in which the group waits for its releases, in words.
    pub wait: String,
    /// The overrun policy: what becomes of releases that the group cannot make in time.
    pub overrun: String,
}

impl GroupPlan {
    fn of(group: &RateGroup, execution: Execution) -> Self {
        Self {
            name: group.name.clone(),
            rate: group.rate,
            offset: group.offset,
            deadline: group.relative_deadline(),
            budget: group.budget,
            cpu: group.cpu,
            cpus: group.cpus.clone(),
            by_deadline: group.by_deadline,
            priority: group.priority,
            background: group.background,
            wait: match execution {
                Execution::Virtual => "virtual".to_owned(),
                Execution::Threaded => {
                    Waiter::new(group.wait, group.priority.is_some(), group.rate.period()).to_string()
                }
            },
            overrun: format!("{:?}", group.overrun),
        }
    }

    /// The budget as a part of the period (0 to 1); `None` without a budget.
    pub fn utilisation(&self) -> Option<f64> {
        self.budget.map(|budget| budget.as_secs_f64() / self.rate.period_s())
    }
}

/// Two groups with releases at the same instant: one of them then waits for the other.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Coincidence {
    /// The name of the group that was added first; in virtual time it ticks first.
    pub first: String,
    /// The name of the group that was added later.
    pub second: String,
    /// The time from one such instant to the next.
    pub every: Nanos,
}

impl Plan {
    /// Refuses a graph of these groups that cannot work: what [`of`](Self::of) does first. The system is asked for
    /// nothing.
    ///
    /// # Errors
    /// [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused), naming the group and the values; see
    /// [`RuntimeBuilder::build`](crate::RuntimeBuilder::build).
    pub fn check(execution: Execution, groups: &[RateGroup]) -> Result<(), GraphError> {
        admit(groups, execution, Cores { usable: os::cores(), there: &os::cores_there() })
    }

    /// The plan of a graph of these groups. The system is asked, on short-lived threads, for what a threaded run would
    /// ask it for; nothing else is touched.
    ///
    /// # Errors
    /// As [`RuntimeBuilder::build`](crate::RuntimeBuilder::build): a graph that cannot work has no plan.
    pub fn of(execution: Execution, groups: &[RateGroup]) -> Result<Self, GraphError> {
        Self::check(execution, groups)?;
        let plans: Vec<_> = groups.iter().map(|group| GroupPlan::of(group, execution)).collect();
        let mut core_load = BTreeMap::new();
        for (cpu, load) in plans.iter().filter_map(|plan| Some((plan.cpu?, plan.utilisation()?))) {
            *core_load.entry(cpu).or_default() += load;
        }
        Ok(Self {
            execution,
            cores: os::cores(),
            total_load: plans.iter().filter_map(GroupPlan::utilisation).sum(),
            core_load,
            coincidences: coincidences(groups, execution),
            graph: GraphView::of_groups(execution, groups),
            machine: match execution {
                Execution::Virtual => Vec::new(),
                Execution::Threaded => findings(Path::new("/"), groups),
            },
            missing: match execution {
                Execution::Virtual => Vec::new(),
                Execution::Threaded => refusals(groups),
            },
            groups: plans,
        })
    }
}

fn coincidences(groups: &[RateGroup], execution: Execution) -> Vec<Coincidence> {
    let mut found = Vec::new();
    for (index, first) in groups.iter().enumerate() {
        for second in &groups[index + 1..] {
            let (a, b) = (first.cores(), second.cores());
            let apart = !a.is_empty() && !b.is_empty() && a.iter().all(|core| !b.contains(core));
            if apart && execution == Execution::Threaded {
                continue;
            }
            if let Some(every) = meeting(first, second) {
                let [first, second] = [first, second].map(|group| group.name.clone());
                found.push(Coincidence { first, second, every });
            }
        }
    }
    found
}

/// The time between two instants at which both groups are released; `None` if there is none.
///
/// Release n of a is due at o_a + n s_a / r_a, so both meet where n A - m B = C with A = s_a r_b, B = s_b r_a and C =
/// (o_b - o_a) r_a r_b, all in parts of 1 / (r_a r_b): in integers, and so either for ever or never.
fn meeting(a: &RateGroup, b: &RateGroup) -> Option<Nanos> {
    const NANOS_PER_S: u128 = 1_000_000_000;
    let ((r_a, s_a), (r_b, s_b)) = (a.rate.as_fraction(), b.rate.as_fraction());
    let [r_a, s_a, r_b, s_b] = [r_a, s_a, r_b, s_b].map(u128::from);
    let (period_a, period_b) = (s_a * NANOS_PER_S * r_b, s_b * NANOS_PER_S * r_a);
    let common = gcd(period_a, period_b);
    let shift = u128::from(a.offset.0.abs_diff(b.offset.0)).checked_mul(r_a * r_b)?;
    if shift % common != 0 {
        return None;
    }
    // Farther apart than integers reach: not within the life of any run.
    let between = (period_a / common).checked_mul(period_b)?;
    u64::try_from(between / (r_a * r_b)).ok().map(Nanos)
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.execution {
            Execution::Threaded => writeln!(f, "in real time, a thread per group, {} cores", self.cores)?,
            Execution::Virtual => writeln!(f, "in virtual time, on one thread")?,
        }
        let width = self.groups.iter().map(|group| group.name.chars().count()).max().unwrap_or(0).max(5);
        let header = ["rate", "period", "offset", "deadline", "budget", "load"];
        write!(f, "\n{:width$}", "group")?;
        header.iter().try_for_each(|name| write!(f, " {name:>10}"))?;
        let wait_width = self.groups.iter().map(|group| group.wait.chars().count()).max().unwrap_or(0).max(4);
        let policy = |group: &GroupPlan| match (self.execution, group.priority) {
            (Execution::Virtual, _) => "-".to_owned(),
            (Execution::Threaded, Some(priority)) => format!("SCHED_FIFO {priority}"),
            (Execution::Threaded, None) if group.by_deadline => "SCHED_DEADLINE".to_owned(),
            (Execution::Threaded, None) => best_effort(group.background),
        };
        let policy_width = self.groups.iter().map(|group| policy(group).len()).max().unwrap_or(0).max(14) + 1;
        writeln!(f, "  core  {:policy_width$}{:wait_width$}  overrun", "policy", "wait")?;
        for group in &self.groups {
            let policy = policy(group);
            let core = match self.execution {
                Execution::Virtual => "-".to_owned(),
                Execution::Threaded => match (group.cpu, &group.cpus[..]) {
                    (Some(cpu), _) => cpu.to_string(),
                    (None, []) => "any".to_owned(),
                    (None, cpus) => cpus.iter().map(usize::to_string).collect::<Vec<_>>().join(","),
                },
            };
            write!(f, "{:width$} {:>10}", group.name, group.rate.to_string())?;
            for time in [Some(group.rate.period()), Some(group.offset), Some(group.deadline), group.budget] {
                write!(f, " {:>10}", time.map_or("-".to_owned(), short))?;
            }
            let load = group.utilisation().map_or("-".to_owned(), percent);
            writeln!(f, " {load:>10}  {core:>4}  {policy:policy_width$}{:wait_width$}  {}", group.wait, group.overrun)?;
        }
        writeln!(f)?;
        if self.total_load > 0.0 {
            write!(f, "budgets    all groups {} of {} %", percent(self.total_load), 100 * self.cores)?;
            self.core_load.iter().try_for_each(|(cpu, load)| write!(f, ", core {cpu} {}", percent(*load)))?;
            writeln!(f)?;
        }
        for Coincidence { first, second, every } in &self.coincidences {
            let (per_second, every) = (places(1.0 / every.as_secs_f64()), short(*every));
            writeln!(f, "coincide   {first} and {second}: {per_second} times per second, every {every}")?;
        }
        self.graph.warnings.iter().try_for_each(|warning| writeln!(f, "warning    {warning}"))?;
        let lacks = self.machine.iter().filter(|finding| finding.state == Readiness::Missing);
        lacks.clone().try_for_each(|finding| writeln!(f, "machine    {finding}"))?;
        if lacks.count() > 0 {
            writeln!(f, "           (docs/realtime.md explains each)")?;
        }
        self.missing.iter().try_for_each(|missing| writeln!(f, "missing    {missing}"))
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn group(name: &str, releases: u32, seconds: u32, offset: u64) -> RateGroup {
        RateGroup::new(Rate::new(releases, seconds)).name(name).offset(Nanos(offset))
    }

    #[test]
    fn thirty_hertz_and_a_kilohertz_meet_ten_times_a_second_and_not_at_all_with_an_odd_offset() {
        let every = |a: &RateGroup, b: &RateGroup| meeting(a, b).map(|every| every.0);
        let haptic = group("local", 1000, 1, 0);
        assert_eq!(every(&haptic, &group("global", 30, 1, 0)), Some(100_000_000));
        assert_eq!(every(&haptic, &group("global", 30, 1, 2_000_000)), Some(100_000_000));
        assert_eq!(every(&haptic, &group("global", 30, 1, 500_000)), None);
        assert_eq!(every(&haptic, &group("video", 2997, 100, 0)), Some(100_000_000_000));
        assert_eq!(every(&haptic, &haptic), Some(1_000_000));
    }

    proptest! {
        #[test]
        fn meetings_are_those_that_counting_finds(
            r_a in 1_u32..12, s_a in 1_u32..4, r_b in 1_u32..12, s_b in 1_u32..4, offset in 0_u64..8,
        ) {
            // Offsets in quarters of a second; instants as whole numbers of parts of a second that both grids share.
            let (a, b) = (group("a", r_a, s_a, 0), group("b", r_b, s_b, offset * 250_000_000));
            let [ra, sa, rb, sb] = [r_a, s_a, r_b, s_b].map(u64::from);
            let parts = 4 * ra * rb;
            let horizon = 100 * parts;
            let of_b: Vec<u64> = (0..).map(|m| offset * ra * rb + m * 4 * ra * sb).take_while(|&t| t < horizon).collect();
            let both: Vec<u64> = of_b.into_iter().filter(|t| t % (4 * rb * sa) == 0).collect();
            match meeting(&a, &b) {
                None => prop_assert!(both.is_empty(), "{both:?}"),
                Some(every) => {
                    prop_assert!(both.len() > 1);
                    for pair in both.windows(2) {
                        let between = u128::from(pair[1] - pair[0]) * 1_000_000_000 / u128::from(parts);
                        prop_assert_eq!(u128::from(every.0), between);
                    }
                }
            }
        }
    }

    #[test]
    fn groups_on_different_cores_do_not_meet_on_threads() {
        let groups = [group("a", 100, 1, 0).pin(0), group("b", 50, 1, 0).pin(1), group("c", 7, 1, 0)];
        let pairs = |execution| -> Vec<_> {
            coincidences(&groups, execution).iter().map(|c| format!("{}{}", c.first, c.second)).collect()
        };
        assert_eq!(pairs(Execution::Threaded), ["ac", "bc"]);
        assert_eq!(pairs(Execution::Virtual), ["ab", "ac", "bc"]);
    }

    #[test]
    fn a_plan_adds_up_budgets_and_names_what_is_missing() {
        let groups = [
            group("a", 1000, 1, 0).pin(0).budget(Nanos(250_000)).realtime(80),
            group("b", 100, 1, 0).pin(0).budget(Nanos(1_000_000)),
            group("c", 10, 1, 0),
        ];
        let mut plan = Plan::of(Execution::Threaded, &groups).unwrap();
        // What is refused depends on the machine.
        plan.missing = vec!["a: SCHED_FIFO 80 refused".to_owned()];
        assert!((plan.core_load[&0] - 0.35).abs() < 1e-12 && (plan.total_load - 0.35).abs() < 1e-12);
        assert_eq!(plan.groups[0].utilisation(), Some(0.25));
        assert_eq!(plan.groups[2].utilisation(), None);
        let text = plan.to_string();
        for words in
            ["SCHED_FIFO 80", "250 us", "35.0 %", "a and b: 100 times per second, every 10 ms", "missing    a: "]
        {
            assert!(text.contains(words), "{words:?} is not in\n{text}");
        }
        let simulated = Plan::of(Execution::Virtual, &groups).unwrap();
        assert!(simulated.missing.is_empty() && !simulated.to_string().contains("SCHED"), "{simulated}");
    }
}
