//! The haptic side: says hello, waits for the first model, and comes back after whatever breaks.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use palpate::link::{Hello, Lane, Transport};
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use zenoh::{Config, Wait};

use crate::access::Access;
use crate::desk::Answer;
use crate::inbox::Inbox;
use crate::line::{HELLO, Line, Way};
use crate::unique;

/// How long the first model is waited for.
const FIRST_MODEL: Duration = Duration::from_secs(30);
/// Another machine that has just gone is waited for so long.
const OTHER_GONE: Duration = Duration::from_secs(3);
/// After so long a message is shown that nothing has come yet.
const TELLS_AFTER: Duration = Duration::from_secs(1);
/// An answer to hello is waited for so long.
const ANSWERS_WITHIN: Duration = Duration::from_millis(700);
/// A link that has been silent for so long is asked whether somebody is there: there may be another process by now.
const ASKS_AFTER: Duration = Duration::from_millis(250);
/// One from which nothing has come for so long is taken for broken, and another one is opened beside it.
const REOPENS_AFTER: Duration = Duration::from_millis(1000);
/// A session that is welcome and yet silent for so long begins anew, under another number.
const RENEWS_AFTER: Duration = Duration::from_secs(5);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(50);
/// Round trips of which the quickest counts.
const ROUND_TRIPS: usize = 5;

/// The way to the global side, which is [served](crate::serve) in another process.
///
/// Whatever breaks on the way, it tries again until it is dropped, and the session goes on without force meanwhile.
///
/// # Real-time
/// For a bridge, which is not real-time either: takes a lock that is held for the time of a copy, and never waits for the network.
#[derive(Debug)]
pub struct GlobalSide {
    address: String,
    config: Config,
    shared: Arc<Shared>,
    keeper: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    inbox: Arc<Inbox>,
    kept: Mutex<Kept>,
    over: Condvar,
}

#[derive(Debug, Default)]
struct Kept {
    connection: Option<Connection>,
    peer: u64,
    is_over: bool,
}

/// In the order in which it ends.
#[derive(Debug)]
struct Connection {
    line: Line,
    zenoh: zenoh::Session,
}

impl GlobalSide {
    /// The global side at `address`, such as `tls/big-machine:7447`. Nothing is connected before the session starts.
    ///
    /// # Errors
    /// If the address is none, or `access` does not allow it.
    pub fn at(address: &str, access: &Access) -> Result<Self, Error> {
        let config = access.connecting(address)?;
        Ok(Self { address: address.to_owned(), config, shared: Arc::default(), keeper: None })
    }

    /// Says hello until it is welcome and the first models have come.
    fn wait_for_models(&self, hello: &mut Hello, began: Instant) -> Result<Connection, Error> {
        let inbox = &self.shared.inbox;
        let (mut connection, mut is_told, mut is_welcome) = (None::<Connection>, false, false);
        while began.elapsed() < FIRST_MODEL {
            if !is_told && began.elapsed() > TELLS_AFTER {
                is_told = true;
                tracing::warn!("waiting for the global side at {}, up to {} s", self.address, FIRST_MODEL.as_secs());
            }
            if connection.is_none() {
                connection = Connection::open(&self.config, hello.session, inbox).ok();
                if let Some(connection) = &connection {
                    hello.round_trip = connection.round_trip();
                }
            }
            let Some(open) = &connection else {
                std::thread::sleep(LOOK);
                continue;
            };
            match open.say(hello) {
                Some(Answer::Welcome(peer)) => {
                    is_welcome = true;
                    self.shared.kept().peer = peer;
                }
                Some(Answer::Busy) if began.elapsed() > OTHER_GONE => {
                    return Err(self.error("works for another haptic machine, and takes one".to_owned()));
                }
                Some(Answer::Wait | Answer::Busy) => {}
                Some(Answer::No(why)) => return Err(self.error(format!("refuses: {why}"))),
                None => connection = None,
            }
            let looked = Instant::now();
            while looked.elapsed() < ANSWERS_WITHIN {
                if is_welcome && inbox.models() >= hello.tools.len() {
                    return connection.ok_or_else(|| self.error("broke off".to_owned()));
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        let (seconds, not) = (FIRST_MODEL.as_secs(), if is_welcome { "sends no model" } else { "does not answer" });
        Err(self.error(format!("{not} within {seconds} s: is `palpate serve` at work there, with this scene?")))
    }

    fn error(&self, message: String) -> Error {
        Error::new(ErrorKind::Runtime, format!("the global side {message}")).at(&self.address)
    }
}

impl Transport for GlobalSide {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        if let Some(connection) = &self.shared.kept().connection {
            connection.line.outbox.put(lane, message);
        }
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        self.shared.inbox.take(message)
    }

    fn connect(&mut self, hello: &Hello) -> Result<(), Error> {
        let mut hello = Hello { machine: unique(), session: unique(), ..hello.clone() };
        let connection = self.wait_for_models(&mut hello, Instant::now())?;
        self.shared.kept().connection = Some(connection);
        let (shared, config) = (Arc::clone(&self.shared), self.config.clone());
        let keeper = std::thread::Builder::new().name("link keeper".to_owned());
        let keeper =
            keeper.spawn(move || Keeper { shared, config, hello, welcome_since: None, is_refused: false }.keep());
        self.keeper = Some(keeper.map_err(|error| self.error(format!("gets no thread here: {error}")))?);
        Ok(())
    }

    fn peer(&mut self) -> u64 {
        self.shared.kept().peer
    }
}

impl Drop for GlobalSide {
    fn drop(&mut self) {
        self.shared.kept().is_over = true;
        self.shared.over.notify_all();
        if let Some(keeper) = self.keeper.take() {
            let _ = keeper.join();
        }
    }
}

impl Shared {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Connection {
    fn open(config: &Config, session: u64, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let zenoh = zenoh::open(config.clone()).wait();
        let zenoh = zenoh.map_err(|error| Error::new(ErrorKind::Runtime, format!("zenoh: {error}")))?;
        Ok(Self { line: Line::new(&zenoh, session, Way::Up, inbox)?, zenoh })
    }

    /// Says hello; `None` if nobody answers.
    fn say(&self, hello: &Hello) -> Option<Answer> {
        let mut bytes = Vec::new();
        hello.write(&mut bytes);
        ask(&self.zenoh, bytes)
    }

    /// The quickest of some round trips; none that was answered is no time.
    fn round_trip(&self) -> Nanos {
        let trip = |_| {
            let began = Instant::now();
            ask(&self.zenoh, Vec::new()).map(|_| began.elapsed())
        };
        let quickest = (0..ROUND_TRIPS).filter_map(trip).min().unwrap_or_default();
        Nanos(u64::try_from(quickest.as_nanos()).unwrap_or(u64::MAX))
    }
}

/// Asks the global side; `None` if nobody answers in time.
fn ask(zenoh: &zenoh::Session, question: Vec<u8>) -> Option<Answer> {
    let replies = zenoh.get(HELLO).payload(question).timeout(ANSWERS_WITHIN).wait().ok()?;
    let reply = replies.recv_timeout(2 * ANSWERS_WITHIN).ok()??;
    match reply.result() {
        Ok(sample) => Answer::read(&sample.payload().to_bytes()),
        Err(_) => None,
    }
}

/// Looks after a connection while the session runs.
struct Keeper {
    shared: Arc<Shared>,
    config: Config,
    hello: Hello,
    /// It is silent, and yet welcome.
    welcome_since: Option<Instant>,
    is_refused: bool,
}

impl Keeper {
    fn keep(mut self) {
        while !self.is_over_after(LOOK) {
            if self.silent_for() < ASKS_AFTER {
                self.welcome_since = None;
                continue;
            }
            let session = self.shared.kept().connection.as_ref().map(|connection| connection.zenoh.clone());
            let mut bytes = Vec::new();
            self.hello.write(&mut bytes);
            let answer = session.and_then(|session| ask(&session, bytes));
            self.take(answer);
        }
        // Outside of the lock: a bridge may still look.
        let connection = self.shared.kept().connection.take();
        drop(connection);
    }

    fn take(&mut self, answer: Option<Answer>) {
        match answer {
            Some(Answer::Welcome(peer)) => {
                self.is_refused = false;
                self.shared.kept().peer = peer;
                let since = *self.welcome_since.get_or_insert_with(Instant::now);
                if since.elapsed() > RENEWS_AFTER {
                    self.hello.session = unique();
                    self.welcome_since = None;
                    self.reopen();
                }
            }
            Some(Answer::Wait | Answer::Busy) => self.welcome_since = None,
            Some(Answer::No(why)) => {
                if !std::mem::replace(&mut self.is_refused, true) {
                    tracing::warn!(
                        "the global side refuses: {}; there is no force until it does not",
                        palpate::printable(&why)
                    );
                }
            }
            None => {
                self.welcome_since = None;
                if self.silent_for() > REOPENS_AFTER {
                    self.reopen();
                }
            }
        }
    }

    /// Opens another connection beside one that may be broken, and takes its place unless that has come back meanwhile.
    fn reopen(&mut self) {
        let Ok(connection) = Connection::open(&self.config, self.hello.session, &self.shared.inbox) else { return };
        if self.silent_for() < ASKS_AFTER {
            return;
        }
        let old = self.shared.kept().connection.replace(connection);
        // Closing may wait for a peer that is not there.
        let _ = std::thread::Builder::new().name("link closing".to_owned()).spawn(move || drop(old));
        let mut bytes = Vec::new();
        self.hello.write(&mut bytes);
        let session = self.shared.kept().connection.as_ref().map(|connection| connection.zenoh.clone());
        if let Some(Answer::Welcome(peer)) = session.and_then(|session| ask(&session, bytes)) {
            self.shared.kept().peer = peer;
        }
    }

    fn silent_for(&self) -> Duration {
        self.shared.inbox.silent_for().unwrap_or(Duration::MAX)
    }

    fn is_over_after(&self, time: Duration) -> bool {
        let kept = self.shared.kept();
        let kept = self.shared.over.wait_timeout_while(kept, time, |kept| !kept.is_over);
        kept.map(|(kept, _)| kept.is_over).unwrap_or(true)
    }
}
