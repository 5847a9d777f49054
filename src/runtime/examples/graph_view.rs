//! A graph that shows itself: as text before the run, as text, JSON, DOT and SVG with times and counts after it.
//!
//! `cargo run --release -p palpate-runtime --example graph_view [FOLDER]` writes `graph.svg`, `graph.dot` and
//! `graph.json`.

use palpate_runtime::{Actor, Execution, GraphView, Nanos, Outcome, RateGroup, Runtime, TickContext, actor_fn};
use std::path::PathBuf;
use std::time::Duration;

fn actor(name: &str, mut tick: impl FnMut(&TickContext) + Send + 'static) -> Box<dyn Actor> {
    actor_fn(name, move |ctx| {
        tick(ctx);
        Outcome::Continue
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    let mut graph = Runtime::builder(Execution::Threaded);
    let (mut send_command, mut command) = graph.link("command", "controller", "drive").exchange(|| 0.0);
    let (mut send_sample, mut samples) = graph.link("samples", "drive", "estimator").queue::<[f64; 2]>(64);
    let (mut send_state, mut state) = graph.link("state", "estimator", "controller").exchange(|| [0.0; 2]);
    let (mut send_seen, mut seen) = graph.link("seen", "estimator", "planner").exchange(|| [0.0; 2]);
    let (mut send_target, mut target) = graph.link("target", "planner", "controller").exchange(|| 0.0);
    let (mut send_picture, picture) = graph.link("picture", "estimator", "window").outlet(|| [0.0; 2]);

    let mut x = 0.0;
    let drive = actor("drive", move |ctx| {
        command.refresh(ctx);
        x += *command.get() * ctx.dt_nominal;
        send_sample.push(ctx, [ctx.scheduled.as_secs_f64(), x]);
    });
    let controller = actor("controller", move |ctx| {
        state.refresh(ctx);
        target.refresh(ctx);
        *send_command.buffer() = 4.0 * (target.get() - state.get()[0]);
        send_command.publish(ctx);
    });
    let mut last = [0.0; 2];
    let estimator = actor("estimator", move |ctx| {
        while let Some([t, x]) = samples.pop(ctx) {
            last = [x, (x - last[0]) / (t - last[1]).max(1e-3)];
        }
        *send_state.buffer() = last;
        send_state.publish(ctx);
        *send_seen.buffer() = last;
        send_seen.publish(ctx);
        *send_picture.buffer() = last;
        send_picture.publish(ctx);
    });
    let planner = actor("planner", move |ctx| {
        seen.refresh(ctx);
        *send_target.buffer() = ctx.scheduled.as_secs_f64().sin();
        send_target.publish(ctx);
    });
    graph
        .group(RateGroup::hz(1000).name("control").realtime(80).pin(0).budget(Nanos(200_000)), vec![drive, controller])
        .group(RateGroup::hz(100).name("estimate").budget(Nanos(1_000_000)), vec![estimator])
        .group(RateGroup::hz(10).name("plan"), vec![planner])
        .group(RateGroup::hz(20).name("log").observer(), vec![])
        .until(Nanos(1_000_000_000));
    let graph = graph.build()?;
    println!("{}", graph.graph());

    let running = graph.start()?;
    running.wait_for(Duration::MAX);
    let report = running.stop();
    drop(picture);
    let view: &GraphView = &report.graph;
    println!("{view}\n{report}");
    for (name, text) in [("graph.svg", view.to_svg()), ("graph.dot", view.to_dot()), ("graph.json", view.to_json())] {
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}
