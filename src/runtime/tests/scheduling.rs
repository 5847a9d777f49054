//! SCHED_DEADLINE, sets of cores and stack sizes: what the kernel really gave, and what it refused.

use palpate_runtime::{Execution, GroupGrant, Nanos, Outcome, RateGroup, Runtime, actor_fn};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Runs the group for a while: its grant, and the line of /proc/self/sched or status that the actor found.
fn run(group: RateGroup, look: impl FnMut() -> String + Send + 'static) -> (GroupGrant, String) {
    let (found, mut look) = (Arc::new(Mutex::new(String::new())), look);
    let sink = Arc::clone(&found);
    let actor = actor_fn("actor", move |ctx| {
        // Not the first: what the group asked for has been granted by then. A late machine may skip any of them.
        if ctx.tick >= 2 {
            *sink.lock().unwrap() = look();
        }
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    let running = graph.group(group.name("g"), vec![actor]).until(Nanos(50_000_000)).build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    let report = running.stop();
    assert_eq!((report.fault, report.groups[0].elapsed_periods), (None, 6));
    let found = found.lock().unwrap().clone();
    (report.grant.groups[0].clone(), found)
}

fn status(key: &str) -> String {
    let text = std::fs::read_to_string("/proc/thread-self/status").unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default().trim().to_owned()
}

/// The policy of the calling thread, by the kernel's number: the 41st field of its stat file.
fn policy() -> String {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().nth(38).unwrap_or_default().to_owned()
}

fn by_deadline() -> RateGroup {
    RateGroup::hz(100).budget(Nanos(1_000_000)).deadline(Nanos(5_000_000)).realtime_by_deadline()
}

#[test]
#[cfg(target_os = "linux")]
fn a_group_under_sched_deadline_has_that_policy_and_sleeps() {
    let (grant, found) = run(by_deadline(), policy);
    assert_eq!((&*grant.policy, &*grant.refused), ("SCHED_DEADLINE", ""));
    assert_eq!((&*found, &*grant.wait), ("6", "sleep"));
}

#[test]
#[cfg(target_os = "linux")]
fn sched_deadline_on_a_pinned_group_is_refused_with_the_remedy_and_the_run_goes_on() {
    let (grant, found) = run(by_deadline().pin(0), policy);
    // On a machine of one core that core is the whole root domain.
    if std::thread::available_parallelism().map_or(1, usize::from) == 1 {
        assert_eq!(grant.policy, "SCHED_DEADLINE");
        return;
    }
    assert_eq!((&*grant.policy, &*found, grant.cpu), ("SCHED_OTHER", "0", Some(0)));
    assert!(grant.refused.contains("refused") && grant.refused.contains("leave `pin` out"), "{}", grant.refused);
}

#[test]
#[cfg(target_os = "linux")]
fn a_group_with_a_set_of_cores_runs_on_these() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (grant, found) = run(RateGroup::hz(100).pin_to(0..cores.min(2)), || status("Cpus_allowed_list:"));
    if cores > 1 {
        assert_eq!((&*grant.cpus, &*found, &*grant.refused), (&[0, 1][..], "0-1", ""));
    } else {
        assert_eq!((grant.cpu, &*found), (Some(0), "0"));
    }
}

#[test]
fn a_group_has_the_stack_that_it_asked_for() {
    /// Uses this many MiB of stack.
    #[inline(never)]
    fn deep(mib: usize) -> u8 {
        let mut block = std::hint::black_box([mib as u8; 1 << 20]);
        if mib > 1 {
            std::hint::black_box(&mut block)[0] = deep(mib - 1)
        }
        block[0]
    }
    let (_, found) = run(RateGroup::hz(100).stack_size(16 << 20), || deep(8).to_string());
    assert_eq!(found, "1");
}

#[test]
fn what_cannot_be_asked_together_is_refused_when_the_graph_is_built() {
    let refused = |groups: Vec<RateGroup>| {
        let mut graph = Runtime::builder(Execution::Threaded);
        groups.into_iter().enumerate().for_each(|(n, group)| _ = graph.group(group.name(format!("g{n}")), vec![]));
        graph.build().unwrap_err().to_string()
    };
    assert!(refused(vec![RateGroup::hz(100).realtime_by_deadline()]).contains("needs a budget"));
    assert!(refused(vec![by_deadline().realtime(50)]).contains("exclude each other"));
    assert!(refused(vec![RateGroup::hz(100).stack_size(100_000)]).contains("100000 bytes"));
    let full = |cores: &[usize]| RateGroup::hz(100).budget(Nanos(9_000_000)).pin_to(cores.iter().copied());
    let said = refused(vec![full(&[0, 1]), full(&[1, 0]), full(&[0])]);
    assert!(said.contains("cores [0, 1] need 270.0 %") && said.contains("of their 200 %"), "{said}");
    // Check that a core that the machine does not have is refused in a set, too.
    assert!(refused(vec![RateGroup::hz(100).pin_to([0, 1000])]).contains("1000"));
}

#[test]
fn a_default_priority_leaves_sched_deadline_and_best_effort_takes_it_back() {
    let policy = |group: RateGroup| {
        let mut graph = Runtime::builder(Execution::Threaded);
        graph.group(group.name("g"), vec![]).build().unwrap().graph().groups[0].policy.clone()
    };
    assert_eq!(policy(by_deadline().realtime_by_default(80)), "SCHED_DEADLINE");
    assert_eq!(policy(by_deadline().best_effort()), "SCHED_OTHER");
    assert_eq!(policy(by_deadline().best_effort().realtime_by_default(80)), "SCHED_OTHER");
}
