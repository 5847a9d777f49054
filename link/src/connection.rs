//! The opened connections of a session to the global side, and what is asked over them.

use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
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
/// The other connections are waited for as long again as the first one took, and so much more.
const LAGS: Duration = Duration::from_millis(50);

#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) lines: Lines,
    /// One for each line, as a rule.
    zenoh: Vec<zenoh::Session>,
}

impl Connection {
    /// Connects for the `session` of that number, whose messages come into `inbox`. If the path breaks meanwhile, zenoh may take ten seconds to
    /// give up, whatever its timeouts say.
    ///
    /// # Errors
    /// If nobody is there, or zenoh or the system refuses.
    pub(crate) fn open(config: &Config, session: u64, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let zenoh = open_several(config)?;
        // A line whose own connection did not come in time goes by another's.
        Ok(Self { lines: Lines::new(zenoh.iter().cycle().take(LINES), session, Way::Up, inbox)?, zenoh })
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

impl Drop for Connection {
    /// Closes all at once: each may wait for a peer that is not there.
    fn drop(&mut self) {
        self.lines = Lines::default();
        let closing = self.zenoh.drain(..).map(|zenoh| in_background("link closing", move || drop(zenoh)));
        let closing: Vec<_> = closing.collect();
        closing.into_iter().flatten().for_each(|closing| drop(closing.join()));
    }
}

/// As many connections as there are lines, or those of them that are there soon after the first.
fn open_several(config: &Config) -> Result<Vec<zenoh::Session>, Error> {
    let (began, (send, opened)) = (Instant::now(), mpsc::channel());
    for _ in 0..LINES {
        let (send, config) = (send.clone(), config.clone());
        // One that comes too late has nowhere to go, and is closed.
        in_background("link opening", move || drop(send.send(zenoh::open(config).wait())));
    }
    drop(send);
    let (mut zenoh, mut until, mut why) = (Vec::new(), None, "no thread to connect".to_owned());
    loop {
        let next = match until {
            None => opened.recv().ok(),
            Some(until) => opened.recv_timeout(Instant::saturating_duration_since(&until, Instant::now())).ok(),
        };
        match next {
            Some(Ok(session)) => zenoh.push(session),
            Some(Err(error)) => why = error.to_string(),
            None => break,
        }
        until = until.or_else(|| (!zenoh.is_empty()).then(|| Instant::now() + began.elapsed() + LAGS));
    }
    if zenoh.is_empty() { Err(Error::new(ErrorKind::Runtime, format!("zenoh: {why}"))) } else { Ok(zenoh) }
}

/// Does it on a thread of its own. Where the system gives none, what `work` holds is dropped at once.
pub(crate) fn in_background(name: &str, work: impl FnOnce() + Send + 'static) -> Option<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).ok()
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
