//! The opened connections of a session to the global side, and what is asked over them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use palpate::link::Hello;
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use zenoh::{Config, Wait};

use crate::desk::Answer;
use crate::inbox::Inbox;
use crate::line::{HELLO, LINES, Lines, Way};

/// An answer to hello is waited for so long.
pub(crate) const ANSWERS_WITHIN: Duration = Duration::from_millis(700);
/// Round trips of which the quickest counts.
const ROUND_TRIPS: usize = 5;

/// In the order in which it ends.
#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) lines: Lines,
    /// One for each line.
    zenoh: Vec<zenoh::Session>,
}

impl Connection {
    /// Connects for the `session` of that number, whose messages come into `inbox`. If the path breaks meanwhile, zenoh may take ten seconds to
    /// give up, whatever its timeouts say.
    ///
    /// # Errors
    /// If nobody is there, or zenoh or the system refuses.
    pub(crate) fn open(config: &Config, session: u64, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let failed = |why: String| Error::new(ErrorKind::Runtime, format!("zenoh: {why}"));
        let open = || zenoh::open(config.clone()).wait().map_err(|error| failed(error.to_string()));
        // All at once: each takes some round trips.
        let zenoh: Result<Vec<_>, _> = std::thread::scope(|scope| {
            let opening = [(); LINES].map(|()| scope.spawn(open));
            let opened = opening.map(|opening| opening.join().unwrap_or_else(|_| Err(failed("failed".to_owned()))));
            opened.into_iter().collect()
        });
        let zenoh = zenoh?;
        Ok(Self { lines: Lines::new(zenoh.iter(), session, Way::Up, inbox)?, zenoh })
    }

    /// What is asked goes by the first of them.
    pub(crate) fn zenoh(&self) -> &zenoh::Session {
        &self.zenoh[0]
    }

    /// The quickest of some round trips; none that was answered is no time.
    pub(crate) fn round_trip(&self) -> Nanos {
        let trip = |_| {
            let began = Instant::now();
            ask(self.zenoh(), Vec::new(), ANSWERS_WITHIN).map(|_| began.elapsed())
        };
        let quickest = (0..ROUND_TRIPS).filter_map(trip).min().unwrap_or_default();
        Nanos(u64::try_from(quickest.as_nanos()).unwrap_or(u64::MAX))
    }
}

/// Says hello; `None` if nobody answers within that time.
pub(crate) fn say(zenoh: &zenoh::Session, hello: &Hello, within: Duration) -> Option<Answer> {
    let mut bytes = Vec::new();
    hello.write(&mut bytes);
    ask(zenoh, bytes, within)
}

/// Asks the global side; `None` if nobody answers in time.
fn ask(zenoh: &zenoh::Session, question: Vec<u8>, within: Duration) -> Option<Answer> {
    let replies = zenoh.get(HELLO).payload(question).timeout(within).wait().ok()?;
    let reply = replies.recv_timeout(2 * within).ok()??;
    match reply.result() {
        Ok(sample) => Answer::read(&sample.payload().to_bytes()),
        Err(_) => None,
    }
}
