//! What browsers cost a session: lateness of the 1 kHz group with and without them, and the server's own CPU time and bytes per picture for
//! a surface of 20,000 triangles.
//!
//! ```text
//! cargo bench -p palpate-view --bench browsers              # 40 pairs of segments of 1 s each
//! cargo bench -p palpate-view --bench browsers -- 120 1     # pairs and seconds
//! ```
//!
//! One session runs throughout. Segments without browsers and with four of them alternate, in an order that changes from pair to pair: what
//! the machine does slowly comes to both alike. In a segment with browsers they open, one of them reads ten times a second and one not at
//! all, and they close. Lateness is that of the log, tick by tick. The ratio of the two 99th percentiles has an interval that holds it with
//! 95 %, by drawing pairs again with replacement.
//!
//! The browsers are threads of this program that read what they are sent: what drawing costs is the browsers' own. Needs Linux for the CPU
//! time, which it reads from `/proc`.

use std::net::TcpStream;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use palpate::log::{LogEntry, LogReader, LogRecord, LoggedExecution};
use palpate::prelude::*;
use palpate::random::uniform;
use palpate::{Error, ErrorKind};
use palpate_view::{Options, Server, serve};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

const BROWSERS: usize = 4;
/// Clock ticks of `/proc` in a second.
const TICKS_PER_S: f64 = 100.0;
/// Times that pairs are drawn again.
const DRAWS: u64 = 2000;

fn main() -> Result<(), Error> {
    let mut numbers = std::env::args().skip(1).filter_map(|word| word.parse::<u64>().ok());
    let (pairs, seconds) = (numbers.next().unwrap_or(40), numbers.next().unwrap_or(1));
    lateness(pairs, Duration::from_secs(seconds))?;
    for (browsers, global_hz) in [(1, 30), (BROWSERS, 30), (1, 60)] {
        let segment = segment(mat(global_hz)?, browsers, Duration::from_secs(5))?;
        let kb = 1e-3 * segment.bytes as f64 / segment.surfaces.max(1) as f64;
        let per_s = segment.surfaces as f64 / (segment.seconds * browsers as f64);
        let share = 100.0 * segment.cpu_s / segment.seconds;
        println!(
            "20,000 triangles, {browsers} browsers, global model at {global_hz} Hz: server {share:.2} % of a core, {kb:.0} kB with each of \
             {per_s:.1} surfaces a second"
        );
    }
    Ok(())
}

/// Lateness without and with browsers, in pairs of segments of `span`.
fn lateness(pairs: u64, span: Duration) -> Result<(), Error> {
    let log = std::env::temp_dir().join(format!("palpate-browsers-{}.mcap", std::process::id()));
    let running = Session::from_scene(Scene::demo()).endless().share_records().log(&log).build()?.start()?;
    let server = serve(running, &Options::default())?;
    server.wait_for(Duration::from_secs(1));
    let mut spans: Vec<[[u64; 2]; 2]> = Vec::new();
    for pair in 0..pairs {
        let mut both = [[0; 2]; 2];
        for with in if pair % 2 == 0 { [false, true] } else { [true, false] } {
            let begin = now_ns();
            let readers: Vec<_> =
                (0..if with { BROWSERS } else { 0 }).map(|number| reader(&server, number, span)).collect();
            server.wait_for(span);
            readers.into_iter().for_each(|reader| drop(reader.join()));
            both[usize::from(with)] = [begin, now_ns()];
        }
        spans.push(both);
    }
    server.stop().ok_or_else(|| Error::new(ErrorKind::Runtime, "the session's thread is gone"))?;
    let ticks = ticks(&log)?;
    let _ = std::fs::remove_file(&log);
    let within = |[from, to]: [u64; 2]| -> Vec<f64> {
        ticks.iter().filter(|(time, _)| (from..to).contains(time)).map(|(_, us)| *us).collect()
    };
    let pairs: Vec<[Vec<f64>; 2]> = spans.iter().map(|both| both.map(within)).collect();
    let all: Vec<usize> = (0..pairs.len()).collect();
    for (q, name) in [(0.5, "p50"), (0.99, "p99")] {
        let [without, with] = [0, 1].map(|place| pooled(&pairs, &all, place, q));
        let mut ratios: Vec<f64> = (0..DRAWS)
            .map(|draw| {
                let pair = |&place: &usize| (uniform(draw, place as u64) * all.len() as f64) as usize;
                let drawn: Vec<usize> = all.iter().map(pair).collect();
                pooled(&pairs, &drawn, 1, q) / pooled(&pairs, &drawn, 0, q)
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let change = |share: f64| 100.0 * (ratios[(share * (ratios.len() - 1) as f64) as usize] - 1.0);
        println!(
            "lateness {name}: {without:.3} us without, {with:.3} us with {BROWSERS} browsers: {:+.1} %, 95 % within {:+.1} to {:+.1} %",
            100.0 * (with / without - 1.0),
            change(0.025),
            change(0.975)
        );
    }
    Ok(())
}

/// The percentile of all ticks of one kind of segments in `drawn` pairs (us).
fn pooled(pairs: &[[Vec<f64>; 2]], drawn: &[usize], place: usize, q: f64) -> f64 {
    let mut values: Vec<f64> = drawn.iter().flat_map(|&pair| &pairs[pair][place]).copied().collect();
    let rank = ((q * values.len() as f64).ceil() as usize).clamp(1, values.len().max(1)) - 1;
    if values.is_empty() { f64::NAN } else { *values.select_nth_unstable_by(rank, f64::total_cmp).1 }
}

/// Unix time (ns) and lateness (us) of every tick of the haptic group in the log.
fn ticks(log: &std::path::Path) -> Result<Vec<(u64, f64)>, Error> {
    let (mut start, mut ticks) = (0, Vec::new());
    for entry in LogReader::open(log)? {
        match entry? {
            LogEntry::Environment(environment) => {
                if let LoggedExecution::Threaded { start_unix_ns } = environment.execution {
                    start = start_unix_ns;
                }
            }
            LogEntry::Record(LogRecord::Tick(tick)) if tick.group == 0 => {
                ticks.push((start + tick.scheduled.0, 1e-3 * tick.woke.saturating_sub(tick.scheduled).0 as f64));
            }
            _ => {}
        }
    }
    Ok(ticks)
}

fn now_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64)
}

/// What a segment of a run with a large surface was like.
struct Segment {
    cpu_s: f64,
    seconds: f64,
    bytes: u64,
    surfaces: u64,
}

/// A mat with 19,996 triangles, pressed by a sphere.
fn mat(global_hz: u32) -> Result<Running, Error> {
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
        .global(RateGroup::hz(global_hz))
        .local(RateGroup::hz(1000).realtime(80))
        .share_records()
        .build()?
        .start()
}

fn segment(running: Running, browsers: usize, span: Duration) -> Result<Segment, Error> {
    let server = serve(running, &Options::default())?;
    let readers: Vec<_> = (0..browsers).map(|_| reader(&server, 0, span + span)).collect();
    let (before, begin) = (server_cpu_s(), Instant::now());
    server.wait_for(span);
    let (cpu_s, seconds) = (server_cpu_s() - before, begin.elapsed().as_secs_f64());
    drop(server.stop());
    let read: Vec<(u64, u64)> = readers.into_iter().filter_map(|reader| reader.join().ok()).collect();
    let (bytes, surfaces) = read.iter().fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    Ok(Segment { cpu_s, seconds, bytes, surfaces })
}

/// A browser that reads until the server goes, or until so much time has passed; the one of number 2 ten times a second, that of number 3
/// not at all. Bytes and surfaces that it got.
fn reader(server: &Server, number: usize, span: Duration) -> std::thread::JoinHandle<(u64, u64)> {
    let (address, url, begin) = (server.address(), server.url(), Instant::now());
    std::thread::spawn(move || {
        let mut socket = connect(address, url.split_once('#').map_or("", |parts| parts.1));
        let (mut bytes, mut surfaces) = (0, 0);
        if number == 3 {
            std::thread::sleep(span);
        }
        while begin.elapsed() < span
            && let Ok(message) = socket.read()
        {
            bytes += message.len() as u64;
            surfaces += u64::from(matches!(&message, Message::Binary(data) if data.starts_with(&[4, 0, 0, 0])));
            if number == 2 {
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
