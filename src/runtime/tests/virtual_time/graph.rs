//! The graph made visible: before a run as declared, after it as used, in every form.

use palpate_runtime::{
    Execution, GraphErrorKind, GraphView, Nanos, Outcome, PortEnd, PortKind, RateGroup, Runtime, RuntimeBuilder,
    TickContext, actor_fn,
};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// A fast group that samples and a slow one that answers; with or without names for the ports.
fn graph(execution: Execution, linked: bool) -> RuntimeBuilder {
    let mut graph = Runtime::builder(execution);
    let link = |graph: &mut RuntimeBuilder, name, from, to| {
        if linked {
            graph.link(name, from, to);
        }
    };
    link(&mut graph, "samples", "sensor", "slow/estimator");
    let (mut send, mut samples) = graph.queue::<u64>(4);
    link(&mut graph, "state", "estimator", "fast");
    let (mut publish, mut state) = graph.exchange(|| 0.0);
    link(&mut graph, "picture", "slow", "a \"window\" <1>");
    let (mut show, picture) = graph.outlet(|| 0.0);
    let sensor = actor_fn("sensor", move |ctx| {
        state.refresh(ctx);
        send.push(ctx, ctx.tick);
        Outcome::Continue
    });
    let estimator = actor_fn("estimator", move |ctx| {
        let _ = &picture; // held as long as the graph
        while samples.pop(ctx).is_some() {}
        publish.publish(ctx);
        show.publish(ctx);
        Outcome::Continue
    });
    let idle = actor_fn("idle", |_| Outcome::Continue);
    graph
        .group(RateGroup::hz(1000).name("fast").pin(0).realtime(70).budget(Nanos(MS / 4)), vec![idle, sensor])
        .group(RateGroup::hz(100).name("slow"), vec![estimator])
        .until(Nanos(99 * MS));
    graph
}

fn after(mut graph: RuntimeBuilder) -> GraphView {
    let running = graph.build().unwrap().start().unwrap();
    running.wait_for(Duration::MAX);
    let during = running.graph();
    let view = running.stop().graph;
    assert_eq!((during.ports, during.groups), (view.ports.clone(), view.groups.clone()));
    view
}

fn ends(view: &GraphView) -> Vec<(PortEnd, PortEnd)> {
    view.ports.iter().map(|port| (port.from.clone(), port.to.clone())).collect()
}

fn actor(group: usize, actor: usize) -> PortEnd {
    PortEnd::Group { group, actor: Some(actor) }
}

#[test]
fn a_plan_shows_groups_actors_and_declared_ports() {
    let plan = graph(Execution::Threaded, true).build().unwrap().plan().unwrap();
    let view = plan.graph;
    let names: Vec<_> = view.ports.iter().map(|port| (&*port.name, port.kind, &*port.carries)).collect();
    let expected = [
        ("samples", PortKind::Queue, "u64"),
        ("state", PortKind::Exchange, "f64"),
        ("picture", PortKind::Outlet, "f64"),
    ];
    assert_eq!(names, expected);
    let window = PortEnd::Outside("a \"window\" <1>".to_owned());
    let slow = PortEnd::Group { group: 1, actor: None };
    let fast = PortEnd::Group { group: 0, actor: None };
    assert_eq!(ends(&view), [(actor(0, 1), actor(1, 0)), (actor(1, 0), fast), (slow, window)]);
    assert_eq!((&*view.groups[0].cores, &*view.groups[0].policy), (&[0][..], "SCHED_FIFO 70"));
    assert_eq!((view.groups[0].actors.join(" "), view.warnings), ("idle sensor".to_owned(), Vec::new()));
}

#[test]
fn a_run_shows_who_used_each_port_and_how_often_without_any_declaration() {
    for execution in [Execution::Virtual, Execution::Threaded] {
        let built = graph(execution, false).build().unwrap();
        assert!(
            built.graph().ports[..2]
                .iter()
                .all(|port| (&port.from, &port.to) == (&PortEnd::Unknown, &PortEnd::Unknown))
        );
        let view = after(graph(execution, false));
        assert_eq!(ends(&view)[..2], [(actor(0, 1), actor(1, 0)), (actor(1, 0), actor(0, 1))]);
        assert_eq!(view.ports[2].to, PortEnd::Outside("outside".to_owned()));
        let measured: Vec<_> = view.groups.iter().map(|group| group.measured.as_ref().unwrap()).collect();
        assert_eq!(measured[0].lateness.count(), measured[0].released);
        let [samples, state, picture] = &view.ports[..] else { panic!("{view}") };
        // Check that every sample was sent or dropped, and none taken that was not sent
        assert_eq!(samples.sent + samples.dropped, measured[0].released);
        assert!(samples.taken > 0 && samples.taken <= samples.sent && state.taken <= state.sent);
        assert_eq!((state.sent, picture.sent, picture.taken), (measured[1].released, measured[1].released, 0));
        assert_eq!(view.warnings, ["port `port-2`: nothing was read from it so far"]);
    }
    let view = after(graph(Execution::Virtual, false));
    assert_eq!((view.elapsed, view.ports[0].sent, view.ports[0].dropped), (Some(Nanos(99 * MS)), 41, 59));
}

#[test]
fn a_port_that_nobody_writes_or_reads_is_named_before_the_run() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (writer, _) = graph.link("orphan", "a", "a").exchange(|| 0);
    let port = graph.queue_port::<u8>(4);
    let mut reader = port.reader();
    let tick = move |ctx: &TickContext| {
        let _ = &writer;
        while reader.pop(ctx).is_some() {}
        Outcome::Continue
    };
    let plan = graph.group(RateGroup::hz(10).name("a"), vec![actor_fn("a", tick)]).build().unwrap().plan().unwrap();
    let tell = "give its half to an actor, or leave the port out";
    let expected =
        [format!("port `orphan`: nobody reads it; {tell}"), format!("port `port-1`: nobody writes it; {tell}")];
    assert_eq!(plan.graph.warnings, expected);
    assert!(plan.to_string().contains(&format!("warning    {}", expected[0])), "{plan}");
}

#[test]
fn a_port_that_is_used_by_another_than_its_link_says_is_named() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut writer, mut reader) = graph.link("x", "one", "two").exchange(|| 0);
    let one = actor_fn("one", move |ctx| {
        reader.refresh(ctx);
        Outcome::Continue
    });
    let two = actor_fn("two", move |ctx| {
        writer.publish(ctx);
        Outcome::Continue
    });
    graph.group(RateGroup::hz(10).name("g"), vec![two, one]).until(Nanos(100 * MS));
    let warnings = after(graph).warnings;
    let expected = [
        "port `x`: `g/two` writes it, not `g/one` as its link says",
        "port `x`: `g/one` reads it, not `g/two` as its link says",
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn a_link_to_nobody_or_of_no_port_is_refused() {
    let refused = |declare: &dyn Fn(&mut RuntimeBuilder)| {
        let mut graph = Runtime::builder(Execution::Virtual);
        declare(&mut graph);
        let idle = || actor_fn("idle", |_| Outcome::Continue);
        graph.group(RateGroup::hz(10).name("g"), vec![idle()]).group(RateGroup::hz(10).name("h"), vec![idle()]);
        let error = graph.build().unwrap_err();
        assert_eq!(error.kind(), GraphErrorKind::Refused);
        error.to_string()
    };
    let link =
        |graph: &mut RuntimeBuilder, name: &str, from: &str, to: &str| drop(graph.link(name, from, to).exchange(|| 0));
    let nobody = refused(&|graph| link(graph, "x", "g", "nobody"));
    assert_eq!(nobody, "link `x`: `nobody` is no actor and no rate group; there are g/idle, h/idle");
    let several = refused(&|graph| link(graph, "x", "idle", "g"));
    assert_eq!(several, "link `x`: several actors are called `idle`; write group/actor");
    assert!(refused(&|graph| _ = graph.link("x", "g", "h")).contains("link `x` names no port"));
    let twice = refused(&|graph| (0..2).for_each(|_| link(graph, "x", "g/idle", "h/idle")));
    assert_eq!(twice, "two ports are called `x`; give each its own name");
}

/// The strings of a text in which only what is quoted may hold any character; fails where a quote is left open.
fn unquoted(text: &str) -> String {
    let (mut rest, mut quoted, mut escaped) = (String::new(), false, false);
    for c in text.chars() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            c if !quoted => rest.push(c),
            _ => {}
        }
    }
    assert!(!quoted, "a quote is open in\n{text}");
    rest
}

#[test]
fn text_json_dot_and_svg_hold_every_group_port_and_figure_and_are_well_formed() {
    let view = after(graph(Execution::Virtual, true));
    let text = view.to_string();
    assert!(
        text.contains("port       samples: fast/sensor -> slow/estimator, queue of u64, 41 sent, 37 taken, 59 dropped"),
        "{text}"
    );
    let json = view.to_json();
    for words in
        ["\"elapsed_ns\": 99000000", "\"budget_ns\": 250000", "\"to\": \"a \\\"window\\\" <1>\"", "\"released\": 100"]
    {
        assert!(json.contains(words), "{words} is not in\n{json}");
    }
    let (dot, svg) = (view.to_dot(), view.to_svg());
    for (form, open, close) in [(&json, '{', '}'), (&json, '[', ']'), (&dot, '{', '}'), (&dot, '[', ']')] {
        let bare = unquoted(form);
        assert_eq!(bare.matches(open).count(), bare.matches(close).count(), "{form}");
    }
    assert!(dot.contains("  g0a1 -> g1a0 [label=\"samples\\n41 sent, 37 taken, 59 dropped\"];"), "{dot}");
    assert!(svg.contains(">a \"window\" &lt;1&gt;</text>") && svg.ends_with("</svg>\n"), "{svg}");
    for word in ["fast", "slow", "sensor", "estimator", "samples", "state", "picture", "41 sent, 37 taken, 59 dropped"]
    {
        assert!(svg.contains(&format!(">{word}</text>")), "{word} is not in\n{svg}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

#[test]
fn a_linked_port_used_by_hand_before_the_start_neither_stops_it_nor_contradicts_its_link() {
    for execution in [Execution::Virtual, Execution::Threaded] {
        let mut graph = Runtime::builder(execution);
        graph.link("value", "second", "first");
        let (mut publish, mut read) = graph.exchange(|| 0.0);
        publish.publish(&TickContext::by_hand(palpate_runtime::Rate::hz(100), 0));
        let first = actor_fn("first", move |ctx| {
            read.refresh(ctx);
            Outcome::Continue
        });
        let second = actor_fn("second", move |_| {
            let _ = &publish;
            Outcome::Continue
        });
        graph.group(RateGroup::hz(100).name("a"), vec![first]).group(RateGroup::hz(50).name("b"), vec![second]);
        let graph = graph.build().unwrap();
        assert_eq!(graph.graph().warnings, Vec::<String>::new());
        drop(graph.start().unwrap());
    }
}
