//! Slips: virtual time injects what threads only suffer, and the books must tell exactly that, in number and in cause.

use crate::support::busy;
use palpate_runtime::{
    Disturbance, Execution, Nanos, Outcome, OverrunPolicy, Rate, RateGroup, Runtime, RuntimeReport, SlipCause,
    TickContext, TickTiming, actor_fn,
};
use proptest::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// One group of a generated graph; times in nanoseconds.
#[derive(Clone, Debug)]
struct Plan {
    rate: Rate,
    offset: u64,
    latency: u64,
    policy: OverrunPolicy,
    watchdog: Option<u64>,
    /// What disturbs release n, repeating.
    disturbances: Vec<Disturbance>,
}

impl Plan {
    fn group(&self, name: &str) -> RateGroup {
        let group = RateGroup::new(self.rate).name(name).offset(Nanos(self.offset)).latency(Nanos(self.latency));
        let group = group.overrun(self.policy);
        self.watchdog.map_or(group.clone(), |watchdog| group.device_paced(Nanos(watchdog)))
    }

    fn disturbance(&self, release: u64) -> Disturbance {
        self.disturbances[release as usize % self.disturbances.len()]
    }
}

/// Runs the graph in virtual time; the timings of each group.
fn run(plans: &[Plan], until: u64) -> (RuntimeReport, Vec<Vec<TickTiming>>) {
    let mut graph = Runtime::builder(Execution::Virtual);
    let mut drain = graph.drain();
    for (index, plan) in plans.iter().enumerate() {
        let (name, own) = (format!("group {index}"), plan.clone());
        graph.disturb(name.clone(), move |release| own.disturbance(release));
        graph.group(plan.group(&name), vec![actor_fn("a", |_| Outcome::Continue)]);
    }
    let running = graph.until(Nanos(until)).build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    assert!(running.finished());
    let report = running.stop();
    let mut records = Vec::new();
    drain.drain(&mut records);
    let all: Vec<_> = records.iter().filter_map(TickTiming::from_record).collect();
    let of = |index: usize| all.iter().filter(|timing| usize::from(timing.group) == index).copied().collect();
    (report, (0..plans.len()).map(of).collect())
}

/// What must come out of one group, found by listing periods one by one and striking them off.
#[derive(Debug, Default, PartialEq)]
struct Expected {
    /// Per release: number, scheduled time, wake-up, slips, those of them that the policy gave up.
    releases: Vec<(u64, u64, u64, u64, u64)>,
    injected: u64,
    by_policy: u64,
    stopped: bool,
}

fn expected(plan: &Plan, until: u64) -> Expected {
    let mut out = Expected::default();
    let nominal: Vec<u64> =
        (0..).map(|n| plan.offset + plan.rate.release(n).0).take_while(|&due| due <= until).collect();
    let half = plan.rate.period().0 / 2;
    let (mut phase, mut free, mut silent_until, mut driving) = (0, 0, 0, false);
    let mut left: Vec<u64> = (0..nominal.len() as u64).collect();
    let due = |n: u64, phase: u64| nominal[n as usize] + phase;
    while let Some(&next) = left.first() {
        if due(next, phase) > until {
            // The last period of a shifted grid.
            out.by_policy += left.len() as u64;
            break;
        }
        let disturbance = plan.disturbance(next);
        let mut ready = due(next, phase);
        let mut frame = false;
        if let Some(watchdog) = plan.watchdog {
            silent_until = silent_until.max(ready + disturbance.stall.0);
            let limit = if driving { ready } else { ready + watchdog };
            driving = silent_until > limit;
            (ready, frame) = (silent_until.min(limit), !driving);
        }
        let woke = ready.max(free) + disturbance.late_wake.0;
        free = woke + disturbance.work.0;
        // A frame counts from half a period before a release is due.
        let reach = if frame { woke + half } else { woke.min(until) };
        let ripe: Vec<u64> = left.iter().copied().filter(|&n| n == next || due(n, phase) <= reach).collect();
        let mut by_policy = 0;
        let run = match plan.policy {
            OverrunPolicy::CatchUp { max } => ripe[ripe.len().saturating_sub(max as usize + 1)],
            OverrunPolicy::Stop if ripe.len() > 1 => {
                out.injected += ripe.len() as u64 - 1;
                out.by_policy += 1;
                out.stopped = true;
                return out;
            }
            OverrunPolicy::Rephase if ripe.len() > 1 && woke <= until => {
                let latest = (0..nominal.len() as u64).filter(|&n| due(n, 0) <= woke).max().unwrap();
                by_policy = latest - ripe[ripe.len() - 1];
                phase = woke - due(latest, 0);
                latest
            }
            _ => ripe[ripe.len() - 1],
        };
        let slips = left.iter().filter(|&&n| n < run).count() as u64;
        left.retain(|&n| n > run);
        out.releases.push((run, due(run, phase), woke, slips, by_policy));
        out.injected += slips - by_policy;
        out.by_policy += by_policy;
    }
    out
}

fn rates() -> impl Strategy<Value = Rate> {
    prop_oneof![Just(Rate::hz(1000)), Just(Rate::hz(300)), Just(Rate::hz(30)), Just(Rate::new(2997, 100))]
}

fn policies() -> impl Strategy<Value = OverrunPolicy> {
    prop_oneof![
        Just(OverrunPolicy::Skip),
        (1_u32..5).prop_map(|max| OverrunPolicy::CatchUp { max }),
        Just(OverrunPolicy::Rephase),
        (1_u32..5).prop_map(|recover_after| OverrunPolicy::Degrade { recover_after }),
        Just(OverrunPolicy::Stop),
    ]
}

/// Thousandths of a period: mostly nothing, else up to six periods.
fn spans() -> impl Strategy<Value = u64> {
    prop_oneof![3 => Just(0_u64), 1 => 0_u64..1000, 1 => 1000_u64..6000]
}

/// A group whose disturbances are all of the kinds that `scale` lets through.
fn plans(kinds: [bool; 3]) -> impl Strategy<Value = Plan> {
    let spans = prop::collection::vec([spans(), spans(), spans()], 1..20);
    // The watchdog in thousandths of a period; a group with one is paced by its device.
    let watchdog =
        if kinds[2] { (Just(true), 1000_u64..5000).boxed() } else { (any::<bool>(), 1000_u64..5000).boxed() };
    (rates(), 0..1000_u64, 0..2000_u64, policies(), watchdog, spans).prop_map(
        move |(rate, offset, latency, policy, (paced, watchdog), spans)| {
            let period = rate.period().0;
            // A device that paces its group goes with three of the policies.
            let fits = !matches!(policy, OverrunPolicy::CatchUp { .. } | OverrunPolicy::Rephase);
            let only_stalls = kinds == [false, false, true];
            let policy = if fits || !only_stalls { policy } else { OverrunPolicy::Skip };
            let of = |share: u64| share * period / 1000;
            let disturbance = |[late, work, stall]: [u64; 3]| Disturbance {
                late_wake: Nanos(if kinds[0] { of(late) } else { 0 }),
                work: Nanos(if kinds[1] { of(work) } else { 0 }),
                stall: Nanos(if kinds[2] { of(stall) } else { 0 }),
            };
            Plan {
                rate,
                offset: of(offset),
                latency: of(latency),
                policy,
                watchdog: (paced && (fits || only_stalls)).then(|| of(watchdog).max(period)),
                disturbances: spans.into_iter().map(disturbance).collect(),
            }
        },
    )
}

/// A cause, and a graph that is disturbed in this way only.
fn one_kind() -> impl Strategy<Value = (SlipCause, Vec<Plan>)> {
    let kinds = [
        (SlipCause::LateWake, [true, false, false]),
        (SlipCause::LongTick, [false, true, false]),
        (SlipCause::StalledPeer, [false, false, true]),
    ];
    prop::sample::select(kinds.to_vec())
        .prop_flat_map(|(cause, kinds)| (Just(cause), prop::collection::vec(plans(kinds), 1..4)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_injected_cause_is_the_reported_one_and_counts_are_exact(
        (cause, plans) in one_kind(),
        until in 50 * MS..400 * MS,
    ) {
        let expected: Vec<_> = plans.iter().map(|plan| expected(plan, until)).collect();
        let (report, timings) = run(&plans, until);
        let stopped = expected.iter().any(|group| group.stopped);
        prop_assert_eq!(report.fault.is_some(), stopped);
        for (index, group) in report.groups.iter().enumerate() {
            prop_assert_eq!(group.released + group.skipped, group.elapsed_periods);
            let seen: Vec<_> = timings[index]
                .iter()
                .map(|t| (t.tick, t.scheduled.0, t.woke.0, u64::from(t.slips), u64::from(t.given_up)))
                .collect();
            // Check that every release is the expected one; a stop, of any group, cuts the others off
            let want = &expected[index];
            let common = if stopped { seen.len().min(want.releases.len()) } else { want.releases.len() };
            prop_assert_eq!(&seen, &want.releases[..common]);
            for t in &timings[index] {
                // Check that the cause is the injected one, also of a release without slips that was too late
                let known = matches!(t.cause, SlipCause::None) || t.cause == cause
                    || (t.missed() && t.slips == 0 && t.cause == SlipCause::LongTick);
                prop_assert!(known, "{:?}", t);
                prop_assert_eq!(t.cause != SlipCause::None, t.slips > 0 || t.missed());
            }
            if !stopped || (want.stopped && plans.len() == 1) {
                prop_assert_eq!(group.slips.of(cause), want.injected);
                prop_assert_eq!(group.slips.of(SlipCause::Policy), want.by_policy);
                prop_assert_eq!(group.skipped, want.injected + want.by_policy);
            }
        }
    }

    #[test]
    fn the_identity_holds_under_any_mixture(
        plans in prop::collection::vec(plans([true, true, true]), 1..4),
        until in 50 * MS..400 * MS,
    ) {
        let expected: Vec<_> = plans.iter().map(|plan| expected(plan, until)).collect();
        let (report, timings) = run(&plans, until);
        let stopped = expected.iter().any(|group| group.stopped);
        for (index, group) in report.groups.iter().enumerate() {
            prop_assert_eq!(group.released + group.skipped, group.elapsed_periods);
            prop_assert_eq!(group.slips.total(), group.skipped);
            prop_assert_eq!(group.released, timings[index].len() as u64);
            if !stopped {
                let want = &expected[index];
                prop_assert_eq!(group.skipped, want.injected + want.by_policy);
                let periods = plans[index].rate.last_release(Nanos(until - plans[index].offset)) + 1;
                prop_assert_eq!(group.elapsed_periods, periods);
            }
            // Check that releases come in order, and the periods between them are the slips
            for pair in timings[index].windows(2) {
                prop_assert!(pair[1].tick == pair[0].tick + 1 + u64::from(pair[1].slips));
                prop_assert!(pair[1].woke >= pair[0].woke);
            }
        }
        // Check that the same disturbances give the same run
        prop_assert_eq!(run(&plans, until), (report, timings));
    }
}

/// The version that a 1 kHz reader sees at each tick of a 100 Hz writer that is disturbed at its release 1.
fn versions_seen(latency: u64, disturbance: Disturbance) -> Vec<u64> {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut writer, mut reader) = graph.exchange(|| 0);
    let write = actor_fn("writer", move |ctx| {
        assert_eq!(ctx.now, ctx.scheduled + if ctx.tick == 1 { disturbance.late_wake } else { Nanos::ZERO });
        *writer.buffer() = ctx.tick;
        writer.publish(ctx);
        Outcome::Continue
    });
    let seen: Arc<Mutex<Vec<u64>>> = Arc::default();
    let sink = Arc::clone(&seen);
    let read = actor_fn("reader", move |ctx| {
        reader.refresh(ctx);
        sink.lock().unwrap().push(reader.version());
        Outcome::Continue
    });
    graph.disturb("w", move |release| if release == 1 { disturbance } else { Disturbance::default() });
    graph
        .group(RateGroup::hz(100).name("w").latency(Nanos(latency)), vec![write])
        .group(RateGroup::hz(1000).name("r"), vec![read])
        .until(Nanos(30 * MS));
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    assert_eq!(running.stop().fault, None);
    seen.lock().unwrap().clone()
}

#[test]
fn a_disturbed_publication_is_visible_when_latency_and_work_are_over() {
    let disturbed = |late, work| Disturbance { late_wake: Nanos(late), work: Nanos(work), ..Disturbance::default() };
    for (latency, late, work, visible_at) in
        [(2, 0, 0, 12), (2, 0, 1, 12), (2, 0, 5, 15), (0, 3, 0, 13), (2, 3, 0, 13), (6, 3, 0, 16), (2, 3, 4, 17)]
    {
        let seen = versions_seen(latency * MS, disturbed(late * MS, work * MS));
        // Check the tick at which the version of release 1 is seen first
        let first = seen.iter().position(|&version| version == 2).unwrap();
        assert_eq!(first, visible_at, "latency {latency}, late {late}, work {work} ms");
    }
}

#[test]
fn a_late_group_runs_after_those_that_are_on_time() {
    let order: Arc<Mutex<Vec<(&str, u64)>>> = Arc::default();
    let note = |name: &'static str| {
        let sink = Arc::clone(&order);
        actor_fn(name, move |ctx: &TickContext| {
            sink.lock().unwrap().push((name, ctx.tick));
            Outcome::Continue
        })
    };
    let mut graph = Runtime::builder(Execution::Virtual);
    graph
        .group(RateGroup::hz(1000).name("first"), vec![note("first")])
        .group(RateGroup::hz(1000).name("second"), vec![note("second")])
        .until(Nanos(2 * MS))
        .disturb("first", |release| Disturbance {
            late_wake: Nanos(if release == 1 { MS / 2 } else { 0 }),
            ..Disturbance::default()
        });
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    running.stop();
    let expected = [("first", 0), ("second", 0), ("second", 1), ("first", 1), ("first", 2), ("second", 2)];
    assert_eq!(*order.lock().unwrap(), expected);
}

#[test]
fn a_disturbance_that_cannot_be_is_refused_with_the_group() {
    let calm = |_: u64| Disturbance::default();
    let refused = |execution, disturbed: &[&str], words: &str| {
        let mut graph = Runtime::builder(execution);
        graph.group(RateGroup::hz(100).name("g"), vec![]);
        for &name in disturbed {
            graph.disturb(name, calm);
        }
        let error = graph.build().unwrap_err().to_string();
        assert!(error.contains(words) && error.contains(&format!("`{}`", disturbed[0])), "{error}");
    };
    refused(Execution::Threaded, &["g"], "Execution::Virtual");
    refused(Execution::Virtual, &["other"], "not in the graph");
    refused(Execution::Virtual, &["g", "g"], "twice");
    // A group that is waited for needs somebody to wait.
    let mut graph = Runtime::builder(Execution::Virtual);
    let error = graph.group(RateGroup::hz(100).device_paced(Nanos(10 * MS)), vec![]).build().unwrap_err();
    assert!(error.to_string().contains("`group-0`") && error.to_string().contains("no actor"), "{error}");
}

#[test]
fn real_stalls_are_accounted_for_and_long_ticks_are_told_from_late_wakes() {
    const SECONDS: u64 = 3;
    let mut graph = Runtime::builder(Execution::Threaded);
    let mut drain = graph.drain();
    let timings: Arc<Mutex<Vec<TickTiming>>> = Arc::default();
    let sink = Arc::clone(&timings);
    let logger = actor_fn("logger", move |_| {
        let mut records = Vec::new();
        drain.drain(&mut records);
        sink.lock().unwrap().extend(records.iter().filter_map(TickTiming::from_record));
        Outcome::Continue
    });
    let stalling = |name: &str, every: u64, stall: fn(Duration)| {
        actor_fn(name, move |ctx| {
            if ctx.tick % every == every / 2 {
                stall(Duration::from_micros(2300 + 100 * (ctx.tick % 37)));
            }
            Outcome::Continue
        })
    };
    let hog = actor_fn("hog", |_| {
        busy(Duration::from_millis(8));
        Outcome::Continue
    });
    let policies = [
        ("skip", OverrunPolicy::Skip),
        ("catch up", OverrunPolicy::CatchUp { max: 2 }),
        ("rephase", OverrunPolicy::Rephase),
        ("degrade", OverrunPolicy::Degrade { recover_after: 5 }),
    ];
    for (index, (name, policy)) in policies.into_iter().enumerate() {
        let stall = if index % 2 == 0 { std::thread::sleep } else { busy };
        graph.group(RateGroup::hz(1000).name(name).overrun(policy), vec![stalling(name, 60 + index as u64, stall)]);
    }
    let calm = actor_fn("calm", |_| Outcome::Continue);
    graph
        .group(RateGroup::hz(1000).name("victim").pin(0), vec![calm])
        .group(RateGroup::hz(10).name("hog").pin(0).realtime(20), vec![hog])
        .group(RateGroup::hz(20).name("log").observer(), vec![logger])
        .until(Nanos(SECONDS * 1000 * MS));
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::from_secs(120));
    let report = running.stop();
    assert_eq!((&report.fault, report.lost_records), (&None, 0));
    let timings = timings.lock().unwrap();
    for (index, group) in report.groups.iter().enumerate() {
        let own: Vec<_> = timings.iter().filter(|t| usize::from(t.group) == index).collect();
        assert_eq!(group.released + group.skipped, group.elapsed_periods, "{}", group.name);
        assert_eq!(own.len() as u64, group.released, "{}", group.name);
        assert_eq!(own.iter().filter(|t| t.missed()).count() as u64, group.missed_deadlines);
        assert!(own.iter().all(|t| (t.cause != SlipCause::None) == (t.slips > 0 || t.missed())), "{}", group.name);
        if !group.name.starts_with("log") {
            let periods = group.rate.last_release(Nanos(SECONDS * 1000 * MS)) + 1;
            assert_eq!(group.elapsed_periods, periods, "{}", group.name);
        }
        for pair in own.windows(2) {
            // Check that periods that passed during a tick of more than one are blamed on it, whatever came before
            let (work, period) = (pair[0].end.0 - pair[0].woke.0, group.rate.period().0);
            if work > period && pair[1].slips > 0 && pair[0].end > pair[0].scheduled + Nanos(period + 1) {
                assert_eq!(pair[1].cause, SlipCause::LongTick, "{}: {pair:?}", group.name);
            }
        }
        // Check that every stall of the actor's own cost periods that are blamed on it
        if policies.iter().any(|(name, _)| *name == group.name) {
            assert!(group.slips.of(SlipCause::LongTick) >= 20, "{}: {:?}", group.name, group.slips);
        }
    }
    // Check that a thread that was kept from its core says so: it has no long tick of its own to blame.
    let victim = &report.groups[policies.len()];
    if report.grant.groups[policies.len() + 1].priority > 0 {
        assert!(victim.slips.of(SlipCause::LateWake) >= 20, "{:?}", victim.slips);
    }
    let degraded = &report.groups[3];
    assert!(degraded.in_degraded_mode > degraded.released / 60, "{degraded:?}");
}
