//! What browsers cost a session: lateness of the 1 kHz group with and without them, interleaved, and the server's own CPU time and
//! bytes per picture for a surface of 20,000 triangles.
//!
//! ```text
//! cargo bench -p palpate-view --bench browsers            # 6 rounds of 2 x 5 s
//! cargo bench -p palpate-view --bench browsers -- 20 10   # rounds and seconds
//! ```
//!
//! The browsers are threads of this program that read what they are sent, one of them only now and then: what drawing costs is the
//! browsers' own. Needs Linux for the CPU time, which it reads from `/proc`.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use palpate::Error;
use palpate::prelude::*;
use palpate_view::{Options, Server, serve};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

const BROWSERS: usize = 4;
/// Clock ticks of `/proc` in a second.
const TICKS_PER_S: f64 = 100.0;

/// What a segment of a run was like.
struct Segment {
    lateness_us: [f64; 2],
    cpu_s: f64,
    seconds: f64,
    bytes: u64,
    surfaces: u64,
}

fn main() -> Result<(), Error> {
    let mut numbers = std::env::args().skip(1).filter_map(|word| word.parse::<u64>().ok());
    let (rounds, seconds) = (numbers.next().unwrap_or(6), numbers.next().unwrap_or(5));
    let span = Duration::from_secs(seconds);
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for round in 0..rounds {
        // What changes slowly on the machine comes to both alike.
        let order = if round % 2 == 0 { [0, BROWSERS] } else { [BROWSERS, 0] };
        for browsers in order {
            let segment = segment(demo()?, browsers, span)?;
            let [p50, p99] = segment.lateness_us;
            println!(
                "{browsers} browsers: lateness p50 {p50:7.3} us, p99 {p99:8.2} us; server {:.2} % of a core",
                share(&segment)
            );
            if browsers == 0 { without.push(segment) } else { with.push(segment) }
        }
    }
    let median = |segments: &[Segment], place: usize| {
        let mut values: Vec<f64> = segments.iter().map(|segment| segment.lateness_us[place]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    for (place, name) in [(0, "p50"), (1, "p99")] {
        let (before, after) = (median(&without, place), median(&with, place));
        let change = 100.0 * (after / before - 1.0);
        println!("lateness {name}: median {before:.3} us without, {after:.3} us with: {change:+.1} %");
    }
    for browsers in [1, BROWSERS] {
        let segment = segment(mat()?, browsers, span)?;
        let kb = 1e-3 * segment.bytes as f64 / segment.surfaces.max(1) as f64;
        let per_s = segment.surfaces as f64 / (segment.seconds * browsers as f64);
        let share = share(&segment);
        println!(
            "20,000 triangles, {browsers} browsers: server {share:.2} % of a core, {kb:.0} kB with each of {per_s:.1} surfaces a second"
        );
    }
    Ok(())
}

fn share(segment: &Segment) -> f64 {
    100.0 * segment.cpu_s / segment.seconds
}

/// The demo scene, which fits this kind of machine.
fn demo() -> Result<Running, Error> {
    Session::from_scene(Scene::demo()).endless().share_records().build()?.start()
}

/// A mat with 19,996 triangles, pressed by a sphere.
fn mat() -> Result<Running, Error> {
    let body = Block::builder([100, 50, 2], [0.2, 0.1, 0.004])
        .stiffness(5.0)
        .damping_ratio(0.3)
        .node_mass(0.5e-3)
        .fix(Face::ZMin)
        .build()?;
    let path = ToolPath::new(
        vec![0.0, 0.5, 3.0, 5.5, 60.0],
        vec![[0.05, 0.05, 0.02], [0.05, 0.05, 0.011], [0.15, 0.05, 0.011], [0.05, 0.05, 0.011], [0.05, 0.05, 0.011]],
    )?;
    Session::builder(body)
        .path(path)
        .tool(ToolShape::Sphere { radius: 0.008 })
        .model(palpate::model::local::Kind::Hold)
        .global(RateGroup::hz(30))
        .local(RateGroup::hz(1000).realtime(80))
        .share_records()
        .build()?
        .start()
}

fn segment(running: Running, browsers: usize, span: Duration) -> Result<Segment, Error> {
    let server = serve(running, &Options::default())?;
    let readers: Vec<_> = (0..browsers).map(|number| reader(&server, number == browsers - 1)).collect();
    let (before, begin) = (server_cpu_s(), Instant::now());
    server.wait_for(span);
    let (cpu_s, seconds) = (server_cpu_s() - before, begin.elapsed().as_secs_f64());
    let summary = server.stop();
    let (mut bytes, mut surfaces) = (0, 0);
    for reader in readers {
        if let Ok((own, shown)) = reader.join() {
            (bytes, surfaces) = (bytes + own, surfaces + shown);
        }
    }
    let summary = summary.ok_or_else(|| Error::new(palpate::ErrorKind::Runtime, "the session's thread is gone"))?;
    let lateness = &summary.runtime.groups[0].lateness;
    let us = |q: f64| 1e-3 * lateness.percentile(q).0 as f64;
    Ok(Segment { lateness_us: [us(0.5), us(0.99)], cpu_s, seconds, bytes, surfaces })
}

/// A browser that reads until the server goes, a `slow` one ten times a second: bytes and surfaces that it got.
fn reader(server: &Server, slow: bool) -> std::thread::JoinHandle<(u64, u64)> {
    let (address, url) = (server.address(), server.url());
    std::thread::spawn(move || {
        let mut socket = connect(address, url.split_once('#').map_or("", |parts| parts.1));
        let (mut bytes, mut surfaces) = (0, 0);
        while let Ok(message) = socket.read() {
            bytes += message.len() as u64;
            surfaces += u64::from(matches!(&message, Message::Binary(data) if data.starts_with(&[4, 0, 0, 0])));
            if slow {
                std::thread::sleep(Duration::from_millis(100));
            }
        }
        (bytes, surfaces)
    })
}

fn connect(address: std::net::SocketAddr, token: &str) -> WebSocket<TcpStream> {
    let mut request = format!("ws://{address}/socket").into_client_request().expect("an address");
    request.headers_mut().insert("Origin", format!("http://{address}").parse().expect("a header"));
    let stream = TcpStream::connect(address).expect("the server listens");
    let mut socket = tungstenite::client(request, stream).expect("it answers").0;
    let enter = format!(r#"{{"do":"enter","token":"{token}"}}"#);
    socket.send(Message::Text(enter.into())).expect("it reads");
    socket
}

/// CPU time of the server's threads so far (s). A browser's thread that has ended is not counted, so it is asked before the end.
fn server_cpu_s() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return f64::NAN };
    let ticks = tasks.flatten().filter_map(|task| {
        let stat = std::fs::read_to_string(task.path().join("stat")).ok()?;
        let (name, rest) = stat.split_once('(')?.1.rsplit_once(')')?;
        let mut fields = rest.split_whitespace().skip(11);
        let mut next = || fields.next().and_then(|ticks| ticks.parse::<u64>().ok());
        name.starts_with("view").then_some(next()? + next()?)
    });
    ticks.sum::<u64>() as f64 / TICKS_PER_S
}
