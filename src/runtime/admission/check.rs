//! The admission check: a graph that cannot work is refused when it is built, with the values that failed.

use crate::error::GraphError;
use crate::executor::Execution;
use crate::rate_group::{OverrunPolicy, RateGroup, Release};
use std::collections::BTreeMap;

/// Records carry the group's number in 16 bits; far fewer make sense.
const MAX_GROUPS: usize = 256;

/// A thread touches half of it beforehand.
const LEAST_STACK: usize = 256 * 1024;

/// The processor cores that a graph is checked against.
#[derive(Clone, Copy)]
pub(crate) struct Cores<'a> {
    /// The number of them that the process may use.
    pub(crate) usable: usize,
    /// The numbers of those that the machine has; empty if the system does not say.
    pub(crate) there: &'a [usize],
}

/// Checks the groups of a graph against themselves, each other and the `cores` of the machine.
///
/// Virtual time may stand for any machine: how many cores this one has and how long a result takes are no matter there.
pub(crate) fn admit(groups: &[RateGroup], execution: Execution, cores: Cores<'_>) -> Result<(), GraphError> {
    if groups.iter().all(|group| group.observer) {
        return Err(GraphError::refused(
            "the graph has no group that is not an observer: it would end at once; add one",
        ));
    }
    if groups.len() > MAX_GROUPS {
        return Err(GraphError::refused(format!("{} rate groups, at most {MAX_GROUPS} are possible", groups.len())));
    }
    groups.iter().try_for_each(check_group)?;
    for (index, group) in groups.iter().enumerate() {
        for earlier in &groups[..index] {
            check_pair(earlier, group)?;
        }
    }
    check_cores(groups)?;
    match execution {
        Execution::Virtual => Ok(()),
        Execution::Threaded => {
            groups.iter().try_for_each(|group| check_latency(group).and_then(|()| check_core(group, cores.there)))?;
            check_all(groups, cores.usable)
        }
    }
}

/// A core that the machine has not is a mistake, other than one that the process may not use: that is a refusal like any
/// other.
fn check_core(group: &RateGroup, there: &[usize]) -> Result<(), GraphError> {
    match group.cores().iter().find(|cpu| !there.is_empty() && !there.contains(cpu)) {
        Some(cpu) => {
            let there: Vec<String> = there.iter().map(usize::to_string).collect();
            let message = format!("there is no core {cpu} to pin it to; the machine has {}", there.join(", "));
            Err(GraphError::refused(message).in_group(&group.name))
        }
        None => Ok(()),
    }
}

fn check_group(group: &RateGroup) -> Result<(), GraphError> {
    let refuse = |message: String| Err(GraphError::refused(message).in_group(&group.name));
    let period = group.rate.period();
    if let Some(deadline) = group.deadline
        && (deadline.0 == 0 || deadline > period)
    {
        return refuse(format!("deadline {deadline} must be above 0 and at most the period {period}"));
    }
    if let Some(budget) = group.budget
        && (budget.0 == 0 || budget > group.relative_deadline())
    {
        let deadline = group.relative_deadline();
        return refuse(format!(
            "budget {budget} must be above 0 and at most the deadline {deadline} (period {period})"
        ));
    }
    if let Some(priority) = group.priority
        && !(1..=99).contains(&priority)
    {
        return refuse(format!("real-time priority {priority} must be 1 to 99"));
    }
    if group.by_deadline && group.budget.is_none() {
        return refuse(
            "SCHED_DEADLINE needs a budget: the computing time that the kernel is to keep for it".to_owned(),
        );
    }
    if group.by_deadline && group.priority.is_some() {
        return refuse("SCHED_DEADLINE and a real-time priority exclude each other; leave one out".to_owned());
    }
    if let Some(stack) = group.stack
        && stack < LEAST_STACK
    {
        return refuse(format!("a stack of {stack} bytes is below the {LEAST_STACK} that a group's thread needs"));
    }
    if matches!(group.overrun, OverrunPolicy::CatchUp { max: 0 }) {
        return refuse(
            "catching up with at most 0 releases is the policy Skip; use that or a larger number".to_owned(),
        );
    }
    check_policy(group)
}

/// Policies that say nothing, and release modes that contradict them.
fn check_policy(group: &RateGroup) -> Result<(), GraphError> {
    let refuse = |message: String| Err(GraphError::refused(message).in_group(&group.name));
    if group.overrun == (OverrunPolicy::Degrade { recover_after: 0 }) {
        return refuse(
            "degrading until 0 releases were in time is the policy Skip; use that or a larger number".to_owned(),
        );
    }
    let period = group.rate.period();
    let paced_by = match group.release {
        Release::Periodic => return Ok(()),
        Release::DevicePaced { watchdog } if watchdog < period => {
            return refuse(format!(
                "watchdog {watchdog} must be at least the period {period}: a device may be that late"
            ));
        }
        Release::DevicePaced { .. } => "a device that paces the group: it has one frame per release and sets the phase",
        Release::Hosted if group.is_realtime() || !group.cores().is_empty() => {
            return refuse(
                "a hosted group has no thread of its own to give a policy or a core: set them on the program's"
                    .to_owned(),
            );
        }
        Release::Hosted => "a hosted group: the program's thread has one call per release and sets the phase",
    };
    if group.observer {
        return refuse("an observer ends after the others and cannot be paced from outside; leave one out".to_owned());
    }
    match group.overrun {
        OverrunPolicy::CatchUp { .. } | OverrunPolicy::Rephase => {
            refuse(format!("the policy {:?} contradicts {paced_by}; use Skip, Degrade or Stop", group.overrun))
        }
        _ => Ok(()),
    }
}

fn check_pair(a: &RateGroup, b: &RateGroup) -> Result<(), GraphError> {
    if a.name == b.name {
        return Err(GraphError::refused(format!("two rate groups are called `{}`; give each its own name", a.name)));
    }
    if let (Some(priority), Some(cpu)) = (a.priority, a.cpu)
        && (b.priority, b.cpu) == (a.priority, a.cpu)
    {
        return Err(GraphError::refused(format!(
            "rate groups `{}` and `{}` both have real-time priority {priority} on core {cpu}: one would wait for the \
             other to sleep; give them different priorities or cores",
            a.name, b.name
        )));
    }
    Ok(())
}

/// A thread whose results take longer than its period would fall behind for ever.
fn check_latency(group: &RateGroup) -> Result<(), GraphError> {
    let period = group.rate.period();
    if group.latency <= period {
        return Ok(());
    }
    let message = format!(
        "latency {} is above the period {period}: on threads a result must be there before the next release; lower the \
         latency or the rate, or run in virtual time",
        group.latency
    );
    Err(GraphError::refused(message).in_group(&group.name))
}

/// Budgets as parts of their periods: the sum and its terms.
#[derive(Default)]
struct Load {
    sum: f64,
    terms: Vec<String>,
}

impl Load {
    fn add(&mut self, group: &RateGroup) {
        if let Some(budget) = group.budget {
            self.sum += budget.as_secs_f64() / group.rate.period_s();
            self.terms.push(format!("`{}` {budget} of {}", group.name, group.rate.period()));
        }
    }

    /// One part in a million of slack: budgets that fill a core exactly must not fail on the last bit.
    fn exceeds(&self, cores: usize) -> bool {
        self.sum > cores as f64 * (1.0 + 1e-6)
    }

    fn in_words(&self) -> String {
        format!("{:.1} % ({})", 100.0 * self.sum, self.terms.join(" + "))
    }
}

/// The budgets of the groups pinned to one core must fit into its time.
fn check_cores(groups: &[RateGroup]) -> Result<(), GraphError> {
    let mut cores = BTreeMap::<usize, Load>::new();
    for group in groups {
        group.cpu.into_iter().for_each(|cpu| cores.entry(cpu).or_default().add(group));
    }
    for set in groups.iter().map(|group| &group.cpus).filter(|set| !set.is_empty()) {
        let mut load = Load::default();
        let within = |group: &&RateGroup| {
            let cores = group.cores();
            !cores.is_empty() && cores.iter().all(|core| set.contains(core))
        };
        groups.iter().filter(within).for_each(|group| load.add(group));
        if load.exceeds(set.len()) {
            let (need, room) = (load.in_words(), 100 * set.len());
            let wrong =
                format!("the budgets on cores {set:?} need {need} of their {room} %; lower them or use more cores");
            return Err(GraphError::refused(wrong));
        }
    }
    match cores.iter().find(|(_, load)| load.exceeds(1)) {
        None => Ok(()),
        Some((cpu, load)) => Err(GraphError::refused(format!(
            "the budgets on core {cpu} need {} of its 100 %; lower them or use another core",
            load.in_words()
        ))),
    }
}

/// All budgets must fit into the time of all cores.
fn check_all(groups: &[RateGroup], cores: usize) -> Result<(), GraphError> {
    let mut load = Load::default();
    groups.iter().for_each(|group| load.add(group));
    if !load.exceeds(cores) {
        return Ok(());
    }
    let cores = if cores == 1 { "1 core".to_owned() } else { format!("{cores} cores") };
    Err(GraphError::refused(format!(
        "the budgets need {} of {cores}; lower them, or allow the process more cores",
        load.in_words()
    )))
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::error::GraphErrorKind;
    use crate::time::{Nanos, Rate};

    fn named(name: &str) -> RateGroup {
        RateGroup::hz(1000).name(name)
    }

    fn cores(usable: usize) -> Cores<'static> {
        Cores { usable, there: &[0, 1] }
    }

    /// On threads, on a machine of two cores.
    fn admit(groups: &[RateGroup]) -> Result<(), GraphError> {
        super::admit(groups, Execution::Threaded, cores(2))
    }

    #[track_caller]
    fn refused(groups: &[RateGroup], words: &[&str]) {
        let error = admit(groups).unwrap_err();
        assert_eq!(error.kind(), GraphErrorKind::Refused);
        for word in words {
            assert!(error.to_string().contains(word), "`{word}` is not in: {error}");
        }
    }

    #[test]
    fn a_deadline_beyond_the_period_is_refused_with_both_values() {
        refused(&[named("a").deadline(Nanos(1_500_000))], &["rate group `a`", "1.5 ms", "1 ms"]);
        refused(&[named("a").deadline(Nanos(0))], &["above 0"]);
        assert!(admit(&[named("a").deadline(Nanos(1_000_000))]).is_ok());
    }

    #[test]
    fn a_budget_beyond_the_period_or_deadline_is_refused() {
        refused(&[named("a").budget(Nanos(2_000_000))], &["budget 2 ms", "1 ms"]);
        refused(&[named("a").deadline(Nanos(200_000)).budget(Nanos(300_000))], &["300 us", "200 us"]);
    }

    #[test]
    fn a_latency_beyond_the_period_is_refused_on_threads_and_allowed_in_virtual_time() {
        let late = [named("a").latency(Nanos(1_000_001))];
        refused(&late, &["rate group `a`", "1.000001 ms", "1 ms", "virtual time"]);
        assert!(super::admit(&late, Execution::Virtual, cores(2)).is_ok());
        assert!(admit(&[named("a").latency(Nanos(1_000_000))]).is_ok());
    }

    #[test]
    fn a_core_that_does_not_exist_is_refused_on_threads_with_those_that_do() {
        let far = [named("a").pin(2)];
        refused(&far, &["rate group `a`", "no core 2", "has 0, 1"]);
        refused(&[named("a").pin_to([998, 999])], &["rate group `a`", "no core 998", "has 0, 1"]);
        refused(&[named("a").pin_to([1, 999])], &["no core 999"]);
        assert!(admit(&[named("a").pin(1)]).is_ok());
        assert!(super::admit(&far, Execution::Virtual, cores(2)).is_ok());
        // Check that a system which does not say leaves it to the thread
        assert!(super::admit(&far, Execution::Threaded, Cores { usable: 2, there: &[] }).is_ok());
    }

    #[test]
    fn equal_real_time_priorities_on_one_core_are_refused() {
        refused(&[named("a").realtime(80).pin(1), named("b").realtime(80).pin(1)], &["`a` and `b`", "80", "core 1"]);
        assert!(admit(&[named("a").realtime(80).pin(1), named("b").realtime(80).pin(0)]).is_ok());
        assert!(admit(&[named("a").realtime(80).pin(1), named("b").realtime(79).pin(1)]).is_ok());
        assert!(admit(&[named("a").realtime(80), named("b").realtime(80)]).is_ok());
        refused(&[named("a").realtime(0)], &["priority 0"]);
        refused(&[named("a").realtime(100)], &["priority 100"]);
    }

    #[test]
    fn budgets_that_overfill_a_core_are_refused_with_the_sum() {
        let slow = RateGroup::new(Rate::hz(30)).name("slow").pin(1).budget(Nanos(20_000_000));
        refused(
            &[named("fast").pin(1).budget(Nanos(500_000)), slow.clone()],
            &["core 1", "110.0 %", "`fast`", "`slow`"],
        );
        assert!(admit(&[named("fast").pin(0).budget(Nanos(500_000)), slow]).is_ok());
    }

    #[test]
    fn budgets_that_overfill_all_cores_together_are_refused_on_threads_with_the_sum() {
        let groups = ["a", "b", "c"].map(|name| named(name).budget(Nanos(700_000)));
        refused(&groups, &["210.0 %", "`a` 700 us of 1 ms + `b`", "2 cores"]);
        assert!(super::admit(&groups, Execution::Threaded, cores(3)).is_ok());
        assert!(super::admit(&groups, Execution::Virtual, cores(1)).is_ok());
        // Check that budgets which fill every core exactly fit
        assert!(admit(&[named("a").budget(Nanos(1_000_000)), named("b").budget(Nanos(1_000_000))]).is_ok());
    }

    #[test]
    fn a_policy_that_says_nothing_is_refused() {
        refused(&[named("a").overrun(OverrunPolicy::CatchUp { max: 0 })], &["rate group `a`", "Skip"]);
        refused(&[named("a").overrun(OverrunPolicy::Degrade { recover_after: 0 })], &["rate group `a`", "Skip"]);
        assert!(admit(&[named("a").overrun(OverrunPolicy::Degrade { recover_after: 1 })]).is_ok());
        assert!(admit(&[named("a").overrun(OverrunPolicy::Rephase)]).is_ok());
    }

    #[test]
    fn a_device_paced_group_needs_a_watchdog_of_a_period_and_a_policy_that_fits() {
        let paced = || named("a").device_paced(Nanos(1_000_000));
        for policy in [OverrunPolicy::Skip, OverrunPolicy::Degrade { recover_after: 9 }, OverrunPolicy::Stop] {
            assert!(admit(&[paced().overrun(policy)]).is_ok());
        }
        refused(&[named("a").device_paced(Nanos(999_999))], &["watchdog 999.999 us", "period 1 ms"]);
        refused(&[paced().overrun(OverrunPolicy::CatchUp { max: 3 })], &["CatchUp { max: 3 }", "Skip"]);
        refused(&[paced().overrun(OverrunPolicy::Rephase)], &["Rephase", "phase"]);
        refused(&[named("b"), paced().observer()], &["rate group `a`", "observer"]);
    }

    #[test]
    fn a_hosted_group_asks_for_no_thread_and_needs_a_policy_that_fits() {
        let hosted = || named("a").hosted();
        for policy in [OverrunPolicy::Skip, OverrunPolicy::Degrade { recover_after: 9 }, OverrunPolicy::Stop] {
            assert!(admit(&[hosted().overrun(policy)]).is_ok());
        }
        refused(&[hosted().realtime(80)], &["rate group `a`", "no thread of its own"]);
        refused(&[hosted().pin(1)], &["no thread of its own"]);
        refused(&[hosted().overrun(OverrunPolicy::Rephase)], &["Rephase", "program's thread"]);
        refused(&[named("b"), hosted().observer()], &["rate group `a`", "observer"]);
    }

    #[test]
    fn names_are_unique_and_something_must_run() {
        refused(&[named("a"), named("b"), named("a")], &["called `a`"]);
        refused(&[], &["no group"]);
        refused(&[named("a").observer()], &["observer"]);
    }
}
