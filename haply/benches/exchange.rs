//! An exchange with the service: the client's WebSocket and JSON against the bare socket, in the same run.
//!
//! Both send the bytes of a command (250 B) over loopback and receive those of a state (1 kB). The client puts frames around them,
//! masks, checks and reads what they say; the bare socket does not look at them. So the difference is all that any other
//! WebSocket and JSON could save. What one exchange of the client allocates is counted, and must be nothing.
//!
//! `cargo bench -p palpate-haply --bench exchange`

#[path = "../src/guard.rs"]
#[allow(dead_code, unused_imports, reason = "only what protocol needs")]
mod guard;
#[path = "../src/protocol.rs"]
#[allow(dead_code, unused_imports, reason = "only what the tick needs")]
mod protocol;
#[path = "../src/wire.rs"]
#[allow(dead_code, unused_imports, reason = "only what the tick needs")]
mod wire;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

const STATE: &str = r#"{"session_id":7,"inverse3":[{"device_id":"049D","state":{"angular_position":{"a0":-88.81024,"a1":118.23612,"a2":3.7508194},"angular_velocity":{"a0":0,"a1":0,"a2":0},"body_orientation":{"x":0.035461426,"y":0.6989746,"z":0.0025634766,"w":0.71429443},"cursor_position":{"x":0.12794551,"y":0.038903017,"z":-0.05089721},"cursor_velocity":{"x":-0.00018,"y":-2.3e-5,"z":0},"current_cursor_force":{"x":0.1,"y":0,"z":0.5},"mode":"position","control_domain":"cartesian","control_mode":"force","transform":{"position":{"x":0,"y":0,"z":0},"rotation":{"x":0,"y":0,"z":0,"w":1},"scale":{"x":1,"y":1,"z":1}},"transform_velocity":{}},"status":{"calibrated":true,"in_use":true,"power_supply":true,"ready":true,"started":true}}],"verse_grip":[],"wireless_verse_grip":[{"device_id":"1102","state":{"buttons":{"a":true,"b":false,"c":true},"hall":16,"orientation":{"w":1,"x":0,"y":0,"z":0}}}],"custom_verse_grip":[]}"#;

const EXCHANGES: usize = 20_000;
const WARM_UP: usize = 1000;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

fn count() {
    ALLOCATIONS.set(ALLOCATIONS.get() + 1);
}

// SAFETY: every call is passed to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps alloc's contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller keeps realloc's contract.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps dealloc's contract.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Answers each packet of bytes with a state, as a frame if there was a handshake.
fn serve(listener: &TcpListener, is_websocket: bool) -> io::Result<()> {
    let mut stream = listener.accept()?.0;
    stream.set_nodelay(true)?;
    let mut frame = Vec::new();
    if is_websocket {
        drop(tungstenite::accept(stream.try_clone()?).map_err(io::Error::other)?);
        frame.extend_from_slice(&[0x81, 126]);
        frame.extend_from_slice(&(STATE.len() as u16).to_be_bytes());
    }
    frame.extend_from_slice(STATE.as_bytes());
    let mut bytes = [0; 4096];
    while stream.read(&mut bytes)? > 0 {
        stream.write_all(&frame)?;
    }
    Ok(())
}

fn service(is_websocket: bool) -> io::Result<String> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?.to_string();
    std::thread::spawn(move || serve(&listener, is_websocket));
    Ok(address)
}

/// Receives until all of a state is there; gives false while it is not.
fn all_of_it(mut stream: &TcpStream, got: &mut usize) -> io::Result<bool> {
    match stream.read(&mut [0; 4096]) {
        Ok(count) => *got += count,
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
        Err(error) => return Err(error),
    }
    Ok(*got == STATE.len())
}

/// Time until the state is there, and how much of it was work: not waiting.
#[derive(Default)]
struct Times {
    round_trip: Vec<Duration>,
    work: Vec<Duration>,
}

impl Times {
    fn exchange(&mut self, send: impl FnOnce(), mut receive: impl FnMut() -> bool) {
        std::thread::sleep(Duration::from_micros(200));
        let begun = Instant::now();
        send();
        let sent = begun.elapsed();
        let mut look = Instant::now();
        while !receive() {
            look = Instant::now();
        }
        self.work.push(sent + look.elapsed());
        self.round_trip.push(begun.elapsed());
    }

    fn row(&mut self, name: &str) -> f64 {
        let us = |times: &mut Vec<Duration>, share: f64| {
            times.drain(..WARM_UP.min(times.len()));
            times.sort_unstable();
            1e6 * times[(share * (times.len() - 1) as f64) as usize].as_secs_f64()
        };
        let (mut trip, mut work) = (self.round_trip.clone(), self.work.clone());
        let [trip50, work50] = [us(&mut trip.clone(), 0.5), us(&mut work.clone(), 0.5)];
        let [trip99, work99] = [us(&mut trip, 0.99), us(&mut work, 0.99)];
        println!(
            "{name:12} round trip p50 {trip50:6.1} us, p99 {trip99:6.1} us; work p50 {work50:6.1} us, p99 {work99:6.1} us"
        );
        work50
    }
}

fn main() -> io::Result<()> {
    let bare = TcpStream::connect(service(false)?)?;
    bare.set_nodelay(true)?;
    bare.set_nonblocking(true)?;
    let mut wire = wire::Wire::connect(&service(true)?)?;
    wire.never_block()?;
    let commands = protocol::Commands::new("palpate:palpate", "XYZ", "049D", 5.0);
    let mut command = Vec::new();
    commands.force(&mut command, true, [0.1, 0.2, 0.3]);

    let (mut floor, mut client, mut allocations) = (Times::default(), Times::default(), 0);
    for times in [&mut floor, &mut client] {
        *times = Times { round_trip: Vec::with_capacity(EXCHANGES), work: Vec::with_capacity(EXCHANGES) };
    }
    for exchange in 0..EXCHANGES {
        let mut got = 0;
        let send = || (&bare).write_all(&command).expect("a small packet fits");
        floor.exchange(send, || all_of_it(&bare, &mut got).expect("connected"));
        let before = ALLOCATIONS.get();
        let wire = std::cell::RefCell::new(&mut wire);
        let send = || {
            wire.borrow_mut().send(|out| commands.force(out, true, [0.1, 0.2, 0.3])).expect("connected");
        };
        client.exchange(send, || {
            let frame = wire.borrow_mut().receive().expect("connected");
            let reply = frame.map(|frame| protocol::reply(&frame, "049D").expect("a state"));
            reply.is_some_and(|reply| reply.buttons == 0b101 && reply.device.is_some())
        });
        if exchange >= WARM_UP {
            allocations += ALLOCATIONS.get() - before;
        }
    }
    println!("{} exchanges over loopback, {} B out, {} B in", EXCHANGES - WARM_UP, command.len(), STATE.len());
    let (floor, client) = (floor.row("bare socket"), client.row("the client"));
    println!("the client's work is {:.2} of the bare socket's; it allocated {allocations} times", client / floor);
    assert_eq!(allocations, 0, "an exchange allocates nothing");
    Ok(())
}
