//! A mock of the service, to try the device path without hardware.
//!
//! It behaves as the documented one does: one inventory when a client connects, exactly one state for each message from then
//! on, a device that goes idle when commands stop, and events on a channel of their own. Behind it is a simulated device in
//! a simulated hand. It can be told to fail.

mod fault;
mod options;
mod plant;
mod world;

pub use fault::{MockFault, MockFaultKind};
pub use options::{MockCounts, MockOptions};

use crate::protocol::is_plain;
use crate::wire::{Broken, Wire};
use crossbeam_channel::bounded;
use palpate::{Error, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::Duration;
use world::World;

/// How often waiting threads look whether they should end, or have something to say.
const LOOK: Duration = Duration::from_millis(5);

/// A service on this machine; it ends when it is dropped.
#[derive(Debug)]
pub struct MockService {
    world: Arc<Mutex<World>>,
    address: SocketAddr,
    events_address: SocketAddr,
}

impl MockService {
    /// Opens both channels.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] if a port is taken, [`ErrorKind::Usage`] for an id that no frame can hold.
    ///
    /// # Real-time
    /// Not for a tick.
    pub fn start(options: MockOptions) -> Result<Self, Error> {
        if !is_plain(&options.device_id) {
            let message = format!("the device id is {:?}, must be letters and digits", options.device_id);
            return Err(Error::new(ErrorKind::Usage, message));
        }
        let listen = |port: u16| {
            let fail = |error: std::io::Error| {
                Error::new(ErrorKind::Device, format!("cannot listen on port {port}: {error}; choose another one"))
            };
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(fail)?;
            listener.set_nonblocking(true).map_err(fail)?;
            let address = listener.local_addr().map_err(fail)?;
            Ok::<_, Error>((listener, address))
        };
        let ((simulation, address), (events, events_address)) = (listen(options.port)?, listen(options.events_port)?);
        let world = Arc::new(Mutex::new(World::new(options)));
        let spawn = |listener: TcpListener, serve: Serve| {
            let world = Arc::clone(&world);
            std::thread::spawn(move || accept(&listener, &world, serve));
        };
        spawn(simulation, simulate);
        spawn(events, announce);
        Ok(Self { world, address, events_address })
    }

    /// `host:port` of the simulation channel.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn address(&self) -> String {
        self.address.to_string()
    }

    /// `host:port` of the events channel.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn events_address(&self) -> String {
        self.events_address.to_string()
    }

    /// What it has seen so far.
    ///
    /// # Real-time
    /// Not for a tick: may block.
    pub fn counts(&self) -> MockCounts {
        locked(&self.world).counts
    }

    /// Fails in this way with the next command, in place of what the options said.
    ///
    /// # Real-time
    /// Not for a tick: may block.
    pub fn fail(&self, kind: MockFaultKind) {
        locked(&self.world).fail(kind);
    }

    /// The forces that were commanded since the fault began (N), at most ten thousand.
    ///
    /// # Real-time
    /// Not for a tick: may block, allocates.
    pub fn forces_since_fault_n(&self) -> Vec<[f64; 3]> {
        locked(&self.world).forces_n.clone()
    }

    /// The force on the simulated device now (N).
    ///
    /// # Real-time
    /// Not for a tick: may block.
    pub fn applied_n(&self) -> [f64; 3] {
        locked(&self.world).applied_n()
    }
}

impl Drop for MockService {
    fn drop(&mut self) {
        locked(&self.world).is_over = true;
    }
}

/// Serves one client that has connected.
type Serve = fn(TcpStream, &Mutex<World>) -> Result<(), Broken>;

fn locked(world: &Mutex<World>) -> MutexGuard<'_, World> {
    world.lock().unwrap_or_else(PoisonError::into_inner)
}

fn accept(listener: &TcpListener, world: &Arc<Mutex<World>>, serve: Serve) {
    loop {
        let is_away = {
            let mut world = locked(world);
            if world.is_over {
                return;
            }
            world.go_on();
            world.is_away()
        };
        match listener.accept() {
            // Whoever knocks while it is away finds the line dead.
            Ok((stream, _)) if is_away => drop(stream),
            Ok((stream, _)) => {
                let world = Arc::clone(world);
                std::thread::spawn(move || serve(stream, &world));
            }
            Err(_) => sleep(LOOK),
        }
    }
}

/// One client of the simulation channel, until it or the service goes.
fn simulate(stream: TcpStream, world: &Mutex<World>) -> Result<(), Broken> {
    let mut wire = Wire::accept(stream)?;
    let (session, inventory) = {
        let mut world = locked(world);
        world.counts.connections += 1;
        world.go_on();
        (world.counts.connections, world.state(true, world.counts.connections))
    };
    wire.block_for(LOOK)?;
    wire.say(&inventory)?;
    loop {
        let message = wire.receive()?;
        // Counted before it is sent: a client that has an answer must find it counted.
        let (answer, delay) = match message {
            Some(message) if !locked(world).is_away() => locked(world).answer(&message, session),
            _ => (None, Duration::ZERO),
        };
        if locked(world).is_away() {
            wire.close();
            return Ok(());
        }
        sleep(delay);
        if let Some(state) = answer {
            wire.say(&state)?;
        }
    }
}

/// One client of the events channel, until it or the service goes.
fn announce(stream: TcpStream, world: &Mutex<World>) -> Result<(), Broken> {
    let mut wire = Wire::accept(stream)?;
    let (sender, events) = bounded(1024);
    locked(world).listeners.push(sender);
    wire.block_for(LOOK)?;
    loop {
        // What a client says here means nothing; that it has gone does.
        wire.receive()?;
        if locked(world).is_away() {
            wire.close();
            return Ok(());
        }
        for text in events.try_iter() {
            wire.say(&text)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn service() -> (MockService, Wire) {
        let service = MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() }).unwrap();
        let wire = Wire::connect(&service.address()).unwrap();
        (service, wire)
    }

    fn received(wire: &mut Wire) -> String {
        String::from_utf8(wire.receive().unwrap().unwrap().to_vec()).unwrap()
    }

    fn exchange(wire: &mut Wire, message: &str) -> String {
        wire.say(message).unwrap();
        received(wire)
    }

    const FORCE: &str =
        r#"{"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":0,"y":1,"z":0}}}}]}"#;

    #[test]
    fn a_client_gets_one_inventory_and_then_one_state_for_each_message() {
        let (service, mut wire) = service();
        assert!(received(&mut wire).contains("\"config\""));
        let state = exchange(&mut wire, FORCE);
        assert!(state.contains("\"control_mode\":\"force\"") && !state.contains("\"config\""), "{state}");
        // Check that nothing is pushed, and that what is no message has its reply and its event as well
        wire.block_for(Duration::from_millis(50)).unwrap();
        assert!(wire.receive().unwrap().is_none());
        exchange(&mut wire, "garbage");
        exchange(&mut wire, r#"{"session":{"force_render_full_state":{}}}"#);
        let counts = service.counts();
        assert_eq!((counts.messages, counts.replies, counts.commands, counts.malformed), (3, 3, 1, 1));
    }

    // Check that a page of any site, which a browser lets connect, cannot push the hand on this machine.
    #[test]
    fn a_page_of_a_browser_is_refused_and_a_program_is_not() {
        use std::io::{Read, Write};
        let (service, mut wire) = service();
        assert!(received(&mut wire).contains("inverse3"));
        let mut stream = TcpStream::connect(service.address()).unwrap();
        let request = "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
            Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nOrigin: http://evil.example\r\n\r\n";
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 403"), "{answer}");
    }

    #[test]
    fn two_commands_in_one_frame_conflict_and_a_device_without_commands_goes_idle() {
        let (service, mut wire) = service();
        received(&mut wire);
        let both = FORCE.replace("{\"set_c", "{\"set_cursor_position\":{},\"set_c");
        exchange(&mut wire, &both);
        assert_eq!((service.counts().conflicts, service.applied_n()), (1, [0.0; 3]));
        exchange(&mut wire, FORCE);
        sleep(Duration::from_millis(50));
        let probe = r#"{"inverse3":[{"device_id":"049D","commands":{"probe_position":{}}}]}"#;
        assert!(exchange(&mut wire, probe).contains("\"control_mode\":\"idle\""));
        assert_eq!(service.applied_n(), [0.0; 3]);
    }
}
