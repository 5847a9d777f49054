//! Ports that are large, and ports in the wrong graph.

#[macro_use]
mod support;

use palpate_runtime::{
    Actor, ActorError, Execution, GraphErrorKind, Nanos, Outcome, RateGroup, Reader, Runtime, RuntimeBuilder,
    RuntimeReport, TickContext, actor_fn,
};
use std::time::Duration;

in_both_executions! {
    a_large_state_needs_no_large_stack
    a_port_of_a_graph_of_the_other_execution_is_refused_by_name_and_place
    a_port_of_the_other_execution_that_is_used_in_start_refuses_the_graph
    a_port_of_another_graph_of_this_execution_works
}

const STATE: usize = 1 << 20;

fn a_large_state_needs_no_large_stack(execution: Execution) {
    // One value may be on the stack while it is made; three of them do not fit.
    let thread = std::thread::Builder::new().stack_size(5 * STATE / 2).spawn(move || {
        let mut graph = Runtime::builder(execution);
        let (_writer, reader) = graph.exchange(|| [7_u8; STATE]);
        let (_shown, display) = graph.outlet(|| [8_u8; STATE]);
        (reader.get()[STATE - 1], display.get()[0])
    });
    assert_eq!(thread.unwrap().join().unwrap(), (7, 8));
}

fn run(graph: &mut RuntimeBuilder) -> RuntimeReport {
    let running = graph.group(RateGroup::hz(1000).name("g"), vec![]).until(Nanos(20_000_000)).build().unwrap();
    let running = running.start().unwrap();
    running.wait_for(Duration::from_secs(20));
    running.stop()
}

fn other(execution: Execution) -> Execution {
    match execution {
        Execution::Virtual => Execution::Threaded,
        Execution::Threaded => Execution::Virtual,
    }
}

fn a_port_of_a_graph_of_the_other_execution_is_refused_by_name_and_place(execution: Execution) {
    let mut wrong = Runtime::builder(other(execution));
    let _ = wrong.exchange(|| 0);
    let (mut value, mut newest) = wrong.exchange(|| 0);
    let (mut samples, mut queue) = wrong.queue::<u8>(4);
    let users = [
        (
            1,
            actor_fn("publishes", move |ctx| {
                value.publish(ctx);
                Outcome::Continue
            }),
        ),
        (
            1,
            actor_fn("refreshes", move |ctx| {
                newest.refresh(ctx);
                Outcome::Continue
            }),
        ),
        (
            2,
            actor_fn("pushes", move |ctx| {
                samples.push(ctx, 1);
                Outcome::Continue
            }),
        ),
        (
            2,
            actor_fn("pops", move |ctx| {
                queue.pop(ctx);
                Outcome::Continue
            }),
        ),
    ];
    for (port, user) in users {
        let mut graph = Runtime::builder(execution);
        graph.group(RateGroup::hz(100).name("user"), vec![user]);
        let fault = run(&mut graph).fault.unwrap();
        assert_eq!(fault.at, Nanos::ZERO, "{fault}");
        for words in [&format!("port {port} "), "tests/ports.rs:", &format!("Execution::{:?}", other(execution))] {
            assert!(fault.what.contains(words), "{words:?} is not in: {fault}");
        }
    }
}

/// Looks at its port before the first release.
struct Early(Reader<i32>);

impl Actor for Early {
    fn name(&self) -> &str {
        "early"
    }

    fn start(&mut self, ctx: &TickContext) -> Result<(), ActorError> {
        self.0.refresh(ctx);
        Ok(())
    }

    fn tick(&mut self, _: &TickContext) -> Outcome {
        Outcome::Continue
    }
}

fn a_port_of_the_other_execution_that_is_used_in_start_refuses_the_graph(execution: Execution) {
    let (_, reader) = Runtime::builder(other(execution)).exchange(|| 0);
    let mut graph = Runtime::builder(execution);
    let error = graph.group(RateGroup::hz(100), vec![Box::new(Early(reader))]).build().unwrap().start().unwrap_err();
    assert_eq!(error.kind(), GraphErrorKind::Actor);
    assert!(error.to_string().contains("actor `early`: panicked in start: port 0 "), "{error}");
}

fn a_port_of_another_graph_of_this_execution_works(execution: Execution) {
    let (mut value, _) = Runtime::builder(execution).exchange(|| 0);
    let mut graph = Runtime::builder(execution);
    let user =
        actor_fn("publishes", move |ctx| if value.publish(ctx) > 0 { Outcome::Continue } else { Outcome::Fault(1) });
    graph.group(RateGroup::hz(100), vec![user]);
    assert_eq!(run(&mut graph).fault, None);
}
