//! What a running graph shows of itself: monotone while it runs, equal to the report when it is over.

use palpate_runtime::{
    Execution, GroupLive, Nanos, Outcome, OverrunPolicy, RateGroup, RunningGraph, Runtime, actor_fn,
};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;

fn start(execution: Execution) -> RunningGraph {
    let spiky = actor_fn("spiky", move |ctx| {
        let start = Instant::now();
        while execution == Execution::Threaded && ctx.tick % 50 == 20 && start.elapsed() < Duration::from_millis(4) {
            std::hint::spin_loop();
        }
        Outcome::Continue
    });
    // Threads refuse what virtual time allows: a latency beyond the period.
    let latency = if execution == Execution::Virtual { 50 * MS } else { 0 };
    let mut graph = Runtime::builder(execution);
    graph
        .group(RateGroup::hz(1000).name("fast").latency(Nanos(100_000)), vec![spiky])
        .group(RateGroup::hz(30).name("slow").latency(Nanos(latency)), vec![])
        .until(Nanos(400 * MS))
        .build()
        .unwrap()
        .start()
        .unwrap()
}

/// Check that nothing has become less, and that every released period is in the histograms.
fn assert_later(before: &GroupLive, after: &GroupLive) {
    assert_eq!((&before.name, before.rate), (&after.name, after.rate));
    for (before, after) in [
        (before.released, after.released),
        (before.skipped, after.skipped),
        (before.missed, after.missed),
        (before.lateness.count(), after.lateness.count()),
        (before.execution.count(), after.execution.count()),
        (before.execution.sum().0, after.execution.sum().0),
        (before.lateness.max().0, after.lateness.max().0),
    ] {
        assert!(before <= after, "{before} then {after}");
    }
    for times in [&after.lateness, &after.execution] {
        assert!(times.count() >= after.released, "{after:?}");
        let shown = [0.5, 0.9, 0.99, 0.999].map(|q| times.percentile(q));
        assert!(shown.is_sorted() && shown[3] <= times.max(), "{shown:?}");
    }
}

#[test]
fn a_running_graph_shows_itself_and_ends_as_its_report_says() {
    for execution in [Execution::Threaded, Execution::Virtual] {
        let running = start(execution);
        let mut shown = running.live();
        assert_eq!(shown.iter().map(|group| &*group.name).collect::<Vec<_>>(), ["fast", "slow"]);
        let mut looks = 0;
        while !running.finished() {
            running.wait_for(Duration::from_millis(5));
            let now = running.live();
            shown.iter().zip(&now).for_each(|(before, after)| assert_later(before, after));
            looks += u64::from(now[0].released > shown[0].released);
            shown = now;
        }
        assert!(looks > 5, "it was never seen at work");
        let last = running.live();
        let report = running.stop();
        for (live, group) in last.iter().zip(&report.groups) {
            assert_eq!(
                (live.released, live.skipped, live.missed),
                (group.released, group.skipped, group.missed_deadlines)
            );
            assert_eq!((live.lateness.count(), live.execution.count()), (group.released, group.released));
        }
        match execution {
            // The spikes cost periods, and the work is in the histogram.
            Execution::Threaded => {
                assert!(last[0].skipped > 0 && last[0].execution.max() >= Nanos(4 * MS), "{last:?}");
                assert!(last[0].busy(Nanos(400 * MS)) > 0.05, "{last:?}");
            }
            // Nothing is late, and everything takes the declared time.
            Execution::Virtual => {
                assert_eq!((last[0].lateness.max(), last[0].execution.sum()), (Nanos::ZERO, Nanos(401 * 100_000)));
                assert_eq!((last[1].execution.percentile(0.5), last[1].missed), (Nanos(50 * MS), 13));
            }
        }
    }
}

#[test]
fn periods_that_a_policy_gave_up_are_shown() {
    let actor = actor_fn("slow", |_| {
        std::thread::sleep(Duration::from_millis(20));
        Outcome::Continue
    });
    let mut graph = Runtime::builder(Execution::Threaded);
    let running = graph.group(RateGroup::hz(1000).overrun(OverrunPolicy::Stop), vec![actor]).build().unwrap();
    let running = running.start().unwrap();
    running.wait_for(Duration::from_secs(60));
    let shown = running.live().remove(0);
    let group = running.stop().groups.remove(0);
    assert_eq!((shown.released, shown.skipped), (group.released, group.skipped));
    assert!(shown.skipped > 0);
}
