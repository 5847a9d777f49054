//! What a report says of each group without a log, in figures and in words.

use palpate_runtime::{Disturbance, Execution, Nanos, Outcome, RateGroup, Runtime, RuntimeReport, SlipCause, actor_fn};
use std::time::Duration;

const MS: u64 = 1_000_000;

fn run(execution: Execution) -> RuntimeReport {
    let mut graph = Runtime::builder(execution);
    let idle = || actor_fn("idle", |_| Outcome::Continue);
    graph
        .group(RateGroup::hz(1000).name("control").latency(Nanos(200_000)), vec![idle()])
        .group(RateGroup::hz(100).name("plan").latency(Nanos(MS)), vec![idle()])
        .until(Nanos(99 * MS));
    if execution == Execution::Virtual {
        // Release 10 takes 2.5 ms, release 20 wakes 3.2 ms late.
        graph.disturb("control", |n| match n {
            10 => Disturbance { work: Nanos(2_500_000), ..Disturbance::default() },
            20 => Disturbance { late_wake: Nanos(3_200_000), ..Disturbance::default() },
            _ => Disturbance::default(),
        });
    }
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    let live = running.live();
    let report = running.stop();
    // Check that both show the same
    for (live, group) in live.iter().zip(&report.groups) {
        assert!(live.lateness == group.lateness && live.execution == group.execution);
        assert_eq!((live.slips, live.misses), (group.slips, group.misses));
    }
    report
}

#[test]
fn a_report_has_lateness_execution_and_causes_of_every_group_as_figures() {
    let report = run(Execution::Virtual);
    let [control, plan] = &report.groups[..] else { panic!("{report}") };
    assert_eq!((control.lateness.count(), control.lateness.max()), (control.released, Nanos(500_000)));
    assert_eq!((control.execution.percentile(0.5), control.execution.max()), (Nanos(200_703), Nanos(2_500_000)));
    assert_eq!((plan.execution.sum(), plan.execution.percentile(0.99)), (Nanos(10 * MS), Nanos(MS)));
    let counts = |cause| (control.slips.of(cause), control.misses.of(cause));
    assert_eq!((counts(SlipCause::LongTick), counts(SlipCause::LateWake)), ((1, 1), (3, 0)));
    assert_eq!((control.slips.total(), control.misses.total()), (control.skipped, control.missed_deadlines));
}

#[test]
fn a_report_is_a_table_with_a_line_per_group_and_the_causes_below_it() {
    let text = run(Execution::Virtual).to_string();
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(
        lines[0].join(" "),
        "group rate periods released skipped missed degraded late p50 p99 max work p50 p99 max"
    );
    assert_eq!(lines[1].join(" "), "control 1000 Hz 100 96 4 1 0 0 500 us 500 us 201 us 2.5 ms 2.5 ms");
    assert_eq!(lines[2].join(" "), "plan 100 Hz 10 10 0 0 0 0 0 0 1 ms 1 ms 1 ms");
    assert!(
        text.contains("\nskipped    control: 3 late wake, 1 long tick\nmissed     control: 1 long tick\n"),
        "{text}"
    );
    assert!(text.ends_with("no fault"), "{text}");
    // Check that the columns stand under their names
    let widths: Vec<usize> = text.lines().take(3).map(|line| line.chars().count()).collect();
    assert!(widths.iter().all(|width| *width == widths[0]), "{text}");
}

#[test]
fn a_report_of_threads_has_the_times_of_all_releases() {
    let report = run(Execution::Threaded);
    for group in &report.groups {
        assert_eq!((group.lateness.count(), group.execution.count()), (group.released, group.released));
        assert_eq!(group.misses.total(), group.missed_deadlines);
    }
}
