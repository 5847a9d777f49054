//! Measuring what a run costs: every release and every build is counted, and nothing that is computed depends on it.

mod session_support;

use palpate::ErrorKind;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::runtime::{Execution, GraphErrorKind, Outcome, RateGroup, Runtime, actor_fn};
use palpate::session::{Session, SessionBuilder};
use session_support::*;
use std::time::Duration;

fn session(model: LocalModelKind) -> SessionBuilder {
    Session::builder(block()).path(pressing()).model(model).virtual_time().keep_records().duration_s(0.2)
}

#[test]
fn every_release_of_a_measured_graph_is_counted_with_its_work() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let busy = actor_fn("busy", |_| {
        (0..1_000_000_u64).for_each(|n| {
            std::hint::black_box(n);
        });
        Outcome::Continue
    });
    let idle = actor_fn("idle", |_| Outcome::Continue);
    graph.group(RateGroup::hz(100).name("busy"), vec![busy]).group(RateGroup::hz(1000).name("idle"), vec![idle]);
    let running = graph.until(Nanos(50_000_000)).measure_cost().build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    let report = running.stop();
    let counted: Vec<(&str, u64)> = report.costs.iter().map(|cost| (&*cost.name, cost.cpu.count())).collect();
    assert_eq!(counted, [("busy", 6), ("idle", 51)]);
    assert!(report.costs[0].cpu.sum() > report.costs[1].cpu.sum(), "{report:?}");
}

#[test]
fn nothing_is_measured_unless_it_is_asked_for_and_never_on_threads() {
    let unasked = session(LocalModelKind::Patch).build().unwrap().run().unwrap();
    assert!(unasked.runtime.costs.is_empty() && unasked.builds.is_none());
    let idle = || actor_fn("idle", |_| Outcome::Continue);
    let mut graph = Runtime::builder(Execution::Threaded);
    let refused = graph.group(RateGroup::hz(100), vec![idle()]).measure_cost().build().unwrap_err();
    assert_eq!(refused.kind(), GraphErrorKind::Refused);
    let refused = Session::builder(block()).path(pressing()).measure_cost().build().unwrap_err();
    assert!(refused.kind() == ErrorKind::Runtime && refused.to_string().contains("virtual_time"), "{refused}");
}

#[test]
fn a_measured_run_computes_the_same_bits_and_counts_every_build() {
    for model in LocalModelKind::ALL {
        let [plain, measured] = [false, true].map(|measures| {
            let builder = session(model);
            let builder = if measures { builder.measure_cost() } else { builder };
            builder.build().unwrap().run().unwrap()
        });
        assert!(plain.records == measured.records, "{model:?}: the records differ");
        let released: Vec<u64> = measured.runtime.groups.iter().map(|group| group.released).collect();
        let counted: Vec<u64> = measured.runtime.costs.iter().map(|cost| cost.cpu.count()).collect();
        // The last group is the logger: its last tick is no release.
        assert_eq!(counted, released, "{model:?}");
        // One at the start, then one for every release of the global model but release 0.
        let builds = if model == LocalModelKind::Full { 0 } else { released[1] };
        assert_eq!(measured.builds.map(|builds| builds.count()), Some(builds), "{model:?}");
    }
}
