//! Threads in real time. These tests assert counts and identities, never an absolute time: the machine may be busy.

mod support;

use palpate_runtime::{
    Event, Execution, Nanos, Outcome, OverrunPolicy, RateGroup, Runtime, SlipCause, TickTiming, Wait, actor_fn,
};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use support::busy;

const MS: u64 = 1_000_000;

#[test]
fn a_soak_with_stalls_accounts_for_every_period_and_record() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let spiky = actor_fn("spiky", |ctx| {
        if ctx.tick % 100 == 50 {
            busy(Duration::from_millis(5));
        }
        Outcome::Continue
    });
    let timings: Arc<Mutex<Vec<TickTiming>>> = Arc::default();
    let sink = Arc::clone(&timings);
    let logger = actor_fn("logger", move |_| {
        let mut records = Vec::new();
        drain.drain(&mut records);
        sink.lock().unwrap().extend(records.iter().filter_map(TickTiming::from_record));
        Outcome::Continue
    });
    let running = graph
        .group(RateGroup::hz(1000).name("skip"), vec![spiky])
        .group(
            RateGroup::hz(500).name("catch up").overrun(OverrunPolicy::CatchUp { max: 3 }),
            vec![actor_fn("calm", |_| Outcome::Continue)],
        )
        .group(RateGroup::hz(30).name("slow"), vec![])
        .group(RateGroup::hz(20).name("log").observer(), vec![logger])
        .until(Nanos(2_000 * MS))
        .build()
        .unwrap()
        .start()
        .unwrap();
    running.wait_for(Duration::from_secs(120));
    let report = running.stop();
    assert_eq!((&report.fault, report.lost_records), (&None, 0));
    let timings = timings.lock().unwrap();
    for (index, (group, periods)) in report.groups.iter().zip([2001, 1001, 61]).enumerate() {
        assert_eq!(group.elapsed_periods, periods, "{}", group.name);
        assert_eq!(group.released + group.skipped, periods, "{}", group.name);
        // The records tell the same story: each release once, and every skipped period with a cause.
        let own: Vec<_> = timings.iter().filter(|t| usize::from(t.group) == index).collect();
        assert_eq!(own.len() as u64, group.released);
        assert_eq!(own.iter().map(|t| u64::from(t.slips)).sum::<u64>(), group.skipped);
        assert!(own.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1 + u64::from(pair[1].slips)));
        assert_eq!(own.iter().filter(|t| t.missed()).count() as u64, group.missed_deadlines);
        assert!(own.iter().all(|t| (t.cause != SlipCause::None) == (t.slips > 0 || t.missed())));
        assert!(own.iter().all(|t| t.scheduled <= t.woke && t.woke <= t.start && t.start <= t.end));
        assert!(own.iter().all(|t| t.scheduled == group.rate.release(t.tick)));
    }
    // A tick of five periods cannot but cost periods, and they are blamed on it.
    assert!(report.groups[0].slips.of(SlipCause::LongTick) >= 4);
}

#[test]
fn the_actor_is_told_how_many_periods_were_skipped() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let (mut expected, mut overran) = (0, false);
    let actor = actor_fn("a", move |ctx| {
        assert_eq!(ctx.tick, expected + u64::from(ctx.slips));
        assert!(ctx.dt_measured >= 0.0);
        expected = ctx.tick + 1;
        if ctx.tick >= 5 && !overran {
            overran = true;
            busy(Duration::from_millis(10));
        }
        Outcome::Continue
    });
    let running = graph.group(RateGroup::hz(1000), vec![actor]).until(Nanos(50 * MS)).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    assert_eq!(report.fault, None);
    assert!(report.groups[0].skipped >= 8, "{report}");
}

#[test]
fn the_stop_policy_ends_the_run_at_the_first_overrun() {
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let actor = actor_fn("a", |_| {
        busy(Duration::from_millis(30));
        Outcome::Continue
    });
    let running = graph
        .group(RateGroup::hz(1000).name("strict").overrun(OverrunPolicy::Stop), vec![actor])
        .group(RateGroup::hz(100).name("other"), vec![])
        .build()
        .unwrap()
        .start()
        .unwrap();
    running.wait_for(Duration::from_secs(60));
    assert!(running.finished());
    let report = running.stop();
    let fault = report.fault.unwrap();
    assert_eq!((&*fault.group, &*fault.actor), ("strict", ""));
    let strict = &report.groups[0];
    assert_eq!(strict.released + strict.skipped, strict.elapsed_periods);
    assert_eq!(strict.slips.of(SlipCause::Policy), 1);
    let mut records = Vec::new();
    drain.drain(&mut records);
    let event = records.iter().filter_map(Event::from_record).find(|event| event.code == Event::STOPPED).unwrap();
    assert_eq!(event.detail, strict.skipped);
}

#[test]
fn a_refused_privilege_is_reported_and_the_run_goes_on() {
    let mut graph = Runtime::builder(Execution::Threaded);
    // The group's thread inherits the one core of this one; on a machine with no other nothing is refused.
    let cores = core_affinity::get_core_ids().unwrap();
    assert!(core_affinity::set_for_current(cores[0]));
    let closed = cores.last().unwrap().id;
    let group = RateGroup::hz(1000).realtime(10).pin(closed).wait(Wait::Spin);
    let actor = actor_fn("a", |_| Outcome::Continue);
    let running = graph.group(group, vec![actor]).until(Nanos(20 * MS)).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    assert_eq!((report.groups[0].elapsed_periods, &report.fault), (21, &None));
    let grant = &report.grant.groups[0];
    assert_eq!(grant.cpu, (cores.len() == 1).then_some(closed));
    assert!(cores.len() == 1 || grant.refused.contains(&format!("core {closed} is not open")), "{grant:?}");
    assert_ne!(report.grant.mlock, "not asked");
    if grant.priority == 0 {
        println!("no real-time policy here: {}", grant.refused);
        assert_eq!((&*grant.policy, &*grant.wait), ("SCHED_OTHER", "sleep"));
    } else {
        assert_eq!((&*grant.policy, grant.priority, &*grant.wait), ("SCHED_FIFO", 10, "spin"));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_thread_made_by_a_real_time_actor_does_not_inherit_its_policy() {
    let policy_here = || {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        // Field 41 is the policy; the name in field 2 may hold spaces.
        let fields = stat.rsplit_once(") ").unwrap().1;
        fields.split(' ').nth(38).unwrap().parse::<u32>().unwrap()
    };
    const OTHER: u32 = 0;
    const FIFO: u32 = 1;
    let seen: Arc<Mutex<Vec<(u32, u32)>>> = Arc::default();
    let sink = Arc::clone(&seen);
    let actor = actor_fn("a", move |_| {
        sink.lock().unwrap().push((policy_here() & 0xff, std::thread::spawn(policy_here).join().unwrap() & 0xff));
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    let running =
        graph.group(RateGroup::hz(100).realtime(10), vec![actor]).until(Nanos::ZERO).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let report = running.stop();
    if report.grant.groups[0].priority == 0 {
        println!("skipped: {}", report.grant.groups[0].refused);
        return;
    }
    assert_eq!(*seen.lock().unwrap(), [(FIFO, OTHER)]);
    assert_eq!(policy_here(), OTHER);
}
