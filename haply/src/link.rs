//! The simulation channel's connection, made and made again by a thread of its own: a tick never waits for a connection.

use crate::protocol::{self, Reply};
use crate::wire::{Broken, Wire};
use crate::words::Words;
use crossbeam_channel::{Receiver, Sender, bounded};
use palpate::printable;
use std::time::{Duration, Instant};
use tracing::warn;

/// Between two attempts to connect.
const RETRY: Duration = Duration::from_millis(100);

/// Why the tick gave a connection up.
#[derive(Debug)]
pub(crate) enum Lost {
    /// The socket said so.
    Broken(Broken),
    /// It sent something that is no state.
    Garbage,
    /// Its replies came late or not at all, for too long.
    Silent,
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Broken(broken) => broken.fmt(f),
            Self::Garbage => f.write_str("sent something that is no state"),
            Self::Silent => f.write_str("is too late with its replies, or silent"),
        }
    }
}

/// A connection with the state that it began with.
#[derive(Debug)]
pub(crate) struct Link {
    pub(crate) wire: Wire,
    pub(crate) first: Reply,
}

/// The tick's side of the thread; it ends when this is dropped.
#[derive(Debug)]
pub(crate) struct Links {
    lost: Sender<(Lost, Wire)>,
    made: Receiver<Link>,
}

/// Connects, reads the inventory and finds the device: the one of this id, or the first. Gives a second
/// writer on the connection and the id too.
///
/// # Errors
/// What went wrong, as the end of a sentence that begins with the service and its address.
pub(crate) fn connect(address: &str, wanted: Option<&str>) -> Result<(Link, Wire, String), String> {
    let mut wire = Wire::connect(address).map_err(|error| format!("does not answer: {error}"))?;
    let received = wire.receive().map_err(|broken| broken.to_string())?;
    let frame = received.ok_or("sent no inventory within 2 s")?;
    let not_a_state = "sent an inventory that cannot be read";
    let ids = protocol::device_ids(&frame).ok_or(not_a_state)?;
    let id = match wanted {
        None => ids.first().cloned().ok_or("has no Inverse3")?,
        Some(id) if ids.iter().any(|found| found == id) => id.to_owned(),
        Some(id) => return Err(format!("has no device {id:?}, it has {ids:?}")),
    };
    let first = protocol::reply(&frame, &id).ok_or(not_a_state)?;
    let second = wire.never_block().and_then(|()| wire.second()).map_err(|error| error.to_string())?;
    Ok((Link { wire, first }, second, id))
}

impl Links {
    /// Starts the thread that connects to `address` again whenever it is told to; a second writer on each new connection
    /// goes to `watch`.
    pub(crate) fn new(address: String, device: String, watch: Sender<Wire>) -> std::io::Result<Self> {
        let (lost, losses) = bounded::<(Lost, Wire)>(1);
        let (sender, made) = bounded(1);
        std::thread::Builder::new().name("haply-link".to_owned()).spawn(move || {
            let mut words = Words::default();
            let mut say = |line: String| {
                if let Some(left_out) = words.speaks(Instant::now()) {
                    warn!("haply: {}{left_out}", printable(&line));
                }
            };
            // Ends with the tick's side: then there is nobody to lose a connection.
            for (why, mut wire) in &losses {
                // For every writer on it; then the words, which may have to wait for a reader.
                wire.close();
                say(format!("the service at {address} {why}: the force is zero, reconnecting"));
                let mut last = String::new();
                let (link, second) = loop {
                    // Nothing is lost while there is nothing: what comes here is the end.
                    if losses.recv_timeout(RETRY).is_err_and(|error| error.is_disconnected()) {
                        return;
                    }
                    match connect(&address, Some(&device)) {
                        Ok((link, second, _)) => break (link, second),
                        Err(why) if why != last => {
                            say(format!("the service at {address} {why}"));
                            last = why;
                        }
                        Err(_) => {}
                    }
                };
                say(format!("connected to the service at {address} again, device {device}"));
                if watch.send(second).is_err() || sender.send(link).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { lost, made })
    }

    /// Hands over a connection that is of no use any more, and asks for another. Neither waits nor closes it.
    pub(crate) fn lose(&self, why: Lost, wire: Wire) {
        // There is one connection, and the thread takes a loss before it makes the next one: there is room.
        let _ = self.lost.try_send((why, wire));
    }

    /// The new connection, once it is there. Does not wait.
    pub(crate) fn take(&self) -> Option<Link> {
        self.made.try_recv().ok()
    }
}
