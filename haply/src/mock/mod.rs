//! A mock of the service, to try the device path without hardware.
//!
//! It behaves as the documented one does: one inventory when a client connects, exactly one state for each message from then
//! on, a device that goes idle when commands stop, and events on a channel of their own. Behind it is a simulated device in
//! a simulated hand. It can be told to fail.

mod fault;
mod plant;
mod request;
mod world;

pub use fault::MockFaultKind;

use super::protocol::is_plain;
use super::websocket::WebSocket;
use palpate::{Error, ErrorKind};
use crossbeam_channel::bounded;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::Duration;
use world::{Answer, World};

/// How often waiting threads look whether they should end, or have something to say.
const LOOK: Duration = Duration::from_millis(5);

/// How late a slow service is.
const SLOW: Duration = Duration::from_millis(5);

/// A fault, once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MockFault {
    /// Which.
    pub kind: MockFaultKind,
    /// It begins with the command after so many; with 0 a status is so from the start, until some time after the first.
    pub after: u64,
}

/// What kind of service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MockOptions {
    /// Port of the simulation channel on this machine; any free one if 0.
    pub port: u16,
    /// Port of the events channel; any free one if 0.
    pub events_port: u16,
    /// The id of its one Inverse3.
    pub device_id: String,
    /// What it does wrong.
    pub fault: Option<MockFault>,
}

impl Default for MockOptions {
    fn default() -> Self {
        Self { port: 10001, events_port: 10020, device_id: "049D".to_owned(), fault: None }
    }
}

/// What a mock service has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MockCounts {
    /// Connections to the simulation channel.
    pub connections: u64,
    /// Messages of clients.
    pub messages: u64,
    /// Messages that opened or changed a session.
    pub sessions: u64,
    /// Messages with a `set_*` command.
    pub commands: u64,
    /// Messages that asked for the state only.
    pub probes: u64,
    /// Messages with two `set_*` commands for one device.
    pub conflicts: u64,
    /// Messages that were not JSON of the documented shape.
    pub malformed: u64,
    /// Replies sent.
    pub replies: u64,
    /// Events sent.
    pub events: u64,
}

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
        let spawn = |listener: TcpListener, serve: fn(TcpStream, &Mutex<World>)| {
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

fn locked(world: &Mutex<World>) -> MutexGuard<'_, World> {
    world.lock().unwrap_or_else(PoisonError::into_inner)
}

fn accept(listener: &TcpListener, world: &Arc<Mutex<World>>, serve: fn(TcpStream, &Mutex<World>)) {
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

/// One client of the simulation channel.
fn simulate(stream: TcpStream, world: &Mutex<World>) {
    let Ok(mut socket) = WebSocket::accept(stream) else {
        return;
    };
    let (session, inventory) = {
        let mut world = locked(world);
        world.counts.connections += 1;
        world.go_on();
        (world.counts.connections, world.state(true, world.counts.connections))
    };
    if socket.block_for(LOOK).is_err() || socket.send(|out| out.extend_from_slice(inventory.as_bytes())).is_err() {
        return;
    }
    loop {
        let is_message = socket.receive();
        {
            let world = locked(world);
            if world.is_over || world.is_away() {
                return socket.close();
            }
        }
        let answer = match is_message {
            Ok(true) => locked(world).answer(socket.message(), session),
            Ok(false) => continue,
            Err(_) => return,
        };
        let state = match answer {
            Answer::Now(state) => state,
            Answer::Late(state) => {
                sleep(SLOW);
                state
            }
            Answer::Nothing => continue,
            Answer::Leave => return socket.close(),
        };
        // Counted before it is sent: a client that has it must find it counted.
        locked(world).counts.replies += 1;
        if socket.send(|out| out.extend_from_slice(state.as_bytes())).is_err() {
            return;
        }
    }
}

/// One client of the events channel.
fn announce(stream: TcpStream, world: &Mutex<World>) {
    let Ok(mut socket) = WebSocket::accept(stream) else {
        return;
    };
    let (sender, events) = bounded(1024);
    locked(world).listeners.push(sender);
    if socket.block_for(LOOK).is_err() {
        return;
    }
    loop {
        // What a client says here means nothing; that it has gone does.
        if socket.receive().is_err() {
            return;
        }
        {
            let world = locked(world);
            if world.is_over || world.is_away() {
                return socket.close();
            }
        }
        for text in events.try_iter() {
            if socket.send(|out| out.extend_from_slice(text.as_bytes())).is_err() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn service() -> (MockService, WebSocket) {
        let service = MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() }).unwrap();
        let socket = WebSocket::connect(&service.address()).unwrap();
        (service, socket)
    }

    fn exchange(socket: &mut WebSocket, message: &str) -> String {
        socket.send(|out| out.extend_from_slice(message.as_bytes())).unwrap();
        assert_eq!(socket.receive(), Ok(true), "{message}");
        String::from_utf8(socket.message().to_vec()).unwrap()
    }

    const FORCE: &str =
        r#"{"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":0,"y":1,"z":0}}}}]}"#;

    #[test]
    fn a_client_gets_one_inventory_and_then_one_state_for_each_message() {
        let (service, mut socket) = service();
        assert_eq!(socket.receive(), Ok(true));
        assert!(socket.message().starts_with(b"{") && String::from_utf8_lossy(socket.message()).contains("\"config\""));
        let state = exchange(&mut socket, FORCE);
        assert!(state.contains("\"control_mode\":\"force\"") && !state.contains("\"config\""), "{state}");
        // Check that nothing is pushed, and that what is no message has its reply and its event as well
        socket.block_for(Duration::from_millis(50)).unwrap();
        assert_eq!(socket.receive(), Ok(false));
        exchange(&mut socket, "garbage");
        exchange(&mut socket, r#"{"session":{"force_render_full_state":{}}}"#);
        let counts = service.counts();
        assert_eq!((counts.messages, counts.replies, counts.commands, counts.malformed), (3, 3, 1, 1));
    }

    #[test]
    fn two_commands_in_one_frame_conflict_and_a_device_without_commands_goes_idle() {
        let (service, mut socket) = service();
        assert_eq!(socket.receive(), Ok(true));
        let both = FORCE.replace("{\"set_c", "{\"set_cursor_position\":{},\"set_c");
        exchange(&mut socket, &both);
        assert_eq!((service.counts().conflicts, service.applied_n()), (1, [0.0; 3]));
        exchange(&mut socket, FORCE);
        sleep(Duration::from_millis(50));
        let probe = r#"{"inverse3":[{"device_id":"049D","commands":{"probe_position":{}}}]}"#;
        assert!(exchange(&mut socket, probe).contains("\"control_mode\":\"idle\""));
        assert_eq!(service.applied_n(), [0.0; 3]);
    }
}
