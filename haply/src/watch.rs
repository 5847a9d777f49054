//! The watch over the expiry: a thread that says zero where the tick does not go on.
//!
//! A service drops a force when its client falls silent, but no page says after what time. So a tick that is caught somewhere
//! does not keep its force beyond the expiry. What nobody can say any more, in a process that was killed, is the service's.

use std::sync::{Arc, Mutex, TryLockError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::protocol::Commands;
use crate::wire::Wire;

/// Between two looks at the clock.
const LOOK: Duration = Duration::from_millis(5);

/// What thread and tick share. Neither waits for the other: who does not get the lock tries again at its next look.
#[derive(Debug, Default)]
struct Shared {
    /// When the force that was commanded last ends; `None` if there is none.
    due: Option<Instant>,
    /// Zeros that the thread has said.
    zeros: u64,
}

/// The tick's side; the thread ends when this and every [`Sender`] of connections are dropped.
#[derive(Debug)]
pub(crate) struct Watch {
    shared: Arc<Mutex<Shared>>,
    seen: u64,
}

impl Watch {
    /// Starts the thread. It speaks over the connection that was sent last.
    pub(crate) fn start(commands: Commands) -> std::io::Result<(Self, Sender<Wire>)> {
        let shared = Arc::new(Mutex::new(Shared::default()));
        let (sender, connections) = bounded(4);
        let theirs = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("haply-watch".to_owned())
            .spawn(move || watch(&theirs, &connections, &commands))?;
        Ok((Self { shared, seen: 0 }, sender))
    }

    /// A force was commanded that ends then, or none. Does not wait.
    pub(crate) fn expect(&self, due: Option<Instant>) {
        if let Ok(mut shared) = self.shared.try_lock() {
            shared.due = due;
        }
    }

    /// How many zeros the thread has said since the last question. Does not wait.
    pub(crate) fn zeros(&mut self) -> u64 {
        let Ok(zeros) = self.shared.try_lock().map(|shared| shared.zeros) else {
            return 0;
        };
        zeros - std::mem::replace(&mut self.seen, zeros)
    }
}

fn watch(shared: &Mutex<Shared>, connections: &Receiver<Wire>, commands: &Commands) {
    let mut wire: Option<Wire> = None;
    loop {
        match connections.recv_timeout(LOOK) {
            Ok(next) => {
                // A new connection holds no force.
                if let Ok(mut shared) = shared.try_lock() {
                    shared.due = None;
                }
                wire = Some(next);
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if !is_due(shared) {
            continue;
        }
        if let Some(wire) = &mut wire {
            // A connection that is broken takes no force either.
            let _ = wire.send(|out| commands.force(out, false, [0.0; 3]));
        }
        // No words: whoever reads them could keep this thread from the next one. The tick counts its zeros.
    }
}

/// True once for a force that has expired; by then it is counted.
fn is_due(shared: &Mutex<Shared>) -> bool {
    let mut shared = match shared.try_lock() {
        Ok(shared) => shared,
        Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        Err(TryLockError::WouldBlock) => return false,
    };
    let now = Instant::now();
    let is_due = shared.due.take_if(|due| now >= *due).is_some();
    shared.zeros += u64::from(is_due);
    is_due
}
