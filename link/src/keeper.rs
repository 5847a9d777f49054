//! Looks after the connection of a running session: gives each of its lines one of its own, asks where it is silent, and opens another one where
//! it is broken.

use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpate::Error;
use palpate::link::{Hello, LINES};
use zenoh::Config;

use crate::connection::{Connection, OwnLine, in_background, lacking, say, say_first};
use crate::desk::Answer;
use crate::inbox::Inbox;
use crate::sockets::limit_waiting;
use crate::unique;

/// A link that has been silent for so long is asked whether somebody is there: there may be another process by now.
const ASKS_AFTER: Duration = Duration::from_millis(250);
/// One from which nothing has come for so long is taken for broken, and another one is opened beside it.
const REOPENS_AFTER: Duration = Duration::from_millis(700);
/// Whoever is not reached in this time is not there: no force outlives a longer round trip. On a quick line it is less.
const REACHED_WITHIN: Duration = Duration::from_millis(300);
/// What the two computers may take besides the round trip.
const THINKS_FOR: Duration = Duration::from_millis(100);
/// Another connection is waited for so long before yet another one is tried.
const OPENS_WITHIN: Duration = Duration::from_millis(1000);
/// A session that is silent for so long, welcome or refused, begins anew, under another number.
const RENEWS_AFTER: Duration = Duration::from_secs(5);
/// Lines get connections of their own so long after each other: such as begin at one moment may pause at one moment, as TCP with BBR does for
/// 0.2 s about every ten seconds after it began.
const APART: Duration = Duration::from_millis(300);
/// What was sent before a line got another connection has come after so long.
const ON_ITS_WAY: Duration = Duration::from_secs(2);
/// Between two looks.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// What the bridge and the keeper of its connection share.
#[derive(Debug, Default)]
pub(crate) struct Shared {
    pub(crate) inbox: Arc<Inbox>,
    kept: Mutex<Kept>,
    over: Condvar,
}

#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub(crate) connection: Option<Connection>,
    /// Names the process of the global side.
    pub(crate) peer: u64,
    is_over: bool,
}

impl Shared {
    pub(crate) fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells the keeper to end.
    pub(crate) fn end(&self) {
        self.kept().is_over = true;
        self.over.notify_all();
    }

    fn is_over_after(&self, time: Duration) -> bool {
        let kept = self.over.wait_timeout_while(self.kept(), time, |kept| !kept.is_over);
        kept.map(|(kept, _)| kept.is_over).unwrap_or(true)
    }

    fn silent_for(&self) -> Duration {
        self.inbox.silent_for().unwrap_or(Duration::MAX)
    }
}

/// Looks after a connection while the session runs.
pub(crate) struct Keeper {
    shared: Arc<Shared>,
    config: Config,
    /// Where the global side may be reached, looked up while the network was there.
    places: Vec<SocketAddr>,
    hello: Hello,
    /// How often nobody was reached in time since something came.
    failures: u32,
    /// Lines for which a connection of their own is being opened.
    opening: [Option<Receiver<OwnLine>>; LINES],
    /// When it was last looked which lines lack one.
    completed: Option<Instant>,
    /// When another connection was opened and answered, which gets as long as the first to say something.
    reopened: Option<Instant>,
    /// It is silent, and yet the global side has said that it is welcome, or refused.
    answered_since: Option<Instant>,
    is_refused: bool,
    /// It was told to wait while its session begins: who works for it is not known before it is welcome, even if something comes.
    is_waiting: bool,
}

impl Keeper {
    pub(crate) fn new(shared: Arc<Shared>, config: Config, places: Vec<SocketAddr>, hello: Hello) -> Self {
        let opening = Default::default();
        Self {
            shared,
            config,
            places,
            hello,
            failures: 0,
            opening,
            completed: None,
            reopened: None,
            answered_since: None,
            is_refused: false,
            is_waiting: false,
        }
    }

    /// Until the session is over.
    pub(crate) fn keep(mut self) {
        while !self.shared.is_over_after(LOOK) {
            let silent_for = self.shared.silent_for();
            if silent_for < ASKS_AFTER && !self.is_waiting {
                (self.answered_since, self.failures) = (None, 0);
                self.complete();
                continue;
            }
            let open_for = self.reopened.map_or(Duration::MAX, |at| at.elapsed());
            let may_be_broken = silent_for.min(open_for) > REOPENS_AFTER;
            // TCP waits longer and longer before it tries a dead path again, and so does who waits for it.
            if may_be_broken && !self.is_reachable() {
                self.failures = self.failures.saturating_add(1);
                continue;
            }
            let session = self.shared.kept().connection.as_ref().map(|connection| connection.zenoh().clone());
            // One that is only silent has until then to answer.
            let left = if may_be_broken { Duration::ZERO } else { REOPENS_AFTER.saturating_sub(silent_for) };
            let within = left.max(self.reached_within());
            match session.and_then(|session| say(&session, &self.hello, within)) {
                Some(answer) => self.take(answer),
                None => {
                    self.answered_since = None;
                    self.failures = self.failures.saturating_add(1);
                    if may_be_broken {
                        self.reopen();
                    }
                }
            }
        }
        // Outside of the lock: a bridge may still look.
        let connection = self.shared.kept().connection.take();
        drop(connection);
    }

    /// Gives lines that have none, or a broken one, a connection of their own.
    fn complete(&mut self) {
        for opening in &mut self.opening {
            match opening.as_ref().map(Receiver::try_recv) {
                Some(Ok(line)) => {
                    let replaced = self.shared.kept().connection.as_mut().map(|connection| connection.take(line));
                    in_background("link closing", move || {
                        std::thread::sleep(ON_ITS_WAY);
                        drop(replaced);
                    });
                    *opening = None;
                }
                Some(Err(TryRecvError::Disconnected)) => *opening = None,
                Some(Err(TryRecvError::Empty)) | None => {}
            }
        }
        if self.completed.is_some_and(|at| at.elapsed() < APART) {
            return;
        }
        self.completed = Some(Instant::now());
        // Those that zenoh opened since then, on its own too.
        limit_waiting(&self.places);
        let by_line = self.shared.kept().connection.as_ref().map(Connection::by_line);
        let mut lacking = by_line.iter().flat_map(|by_line| lacking(by_line));
        if let Some(number) = lacking.find(|&number| self.opening[number].is_none()) {
            self.opening[number] = Some(self.open_line(number));
        }
    }

    /// A line with a connection of its own, once it is there; none if that fails.
    fn open_line(&self, number: usize) -> Receiver<OwnLine> {
        let (config, session, inbox) = (self.config.clone(), self.hello.session, Arc::clone(&self.shared.inbox));
        opening(move || OwnLine::open(&config, session, number, &inbox))
    }

    /// An answer takes no longer if somebody is there.
    fn reached_within(&self) -> Duration {
        reached_within(self.hello.round_trip.to_duration(), self.failures)
    }

    fn is_reachable(&self) -> bool {
        let within = self.reached_within();
        self.places.is_empty() || self.places.iter().any(|place| TcpStream::connect_timeout(place, within).is_ok())
    }

    fn take(&mut self, answer: Answer) {
        self.is_waiting = answer == Answer::Wait;
        match answer {
            Answer::Welcome(peer) => {
                self.is_refused = false;
                self.shared.kept().peer = peer;
                self.renew_if_late();
            }
            Answer::Wait | Answer::WaitFor(_) | Answer::Taken(_) => self.answered_since = None,
            Answer::No(why) => {
                if !std::mem::replace(&mut self.is_refused, true) {
                    tracing::warn!(
                        "the global side refuses: {}; there is no force until it does not",
                        palpate::printable(&why)
                    );
                }
                self.renew_if_late();
            }
        }
    }

    /// Begins anew under another number if this one has been welcome or refused for long and got nothing: what was lost on its way here is not
    /// sent again, and a number whose session could not begin stays refused, while the next one may be welcome.
    fn renew_if_late(&mut self) {
        let since = *self.answered_since.get_or_insert_with(Instant::now);
        if since.elapsed() > RENEWS_AFTER {
            self.hello.session = unique();
            self.answered_since = None;
            self.reopen();
        }
    }

    /// Opens another connection beside one that may be broken, and takes its place unless that has come back meanwhile.
    fn reopen(&mut self) {
        let Some(connection) = self.open() else { return };
        if self.shared.silent_for() < ASKS_AFTER {
            in_background("link closing", move || drop(connection));
            return;
        }
        // What is being opened for the lines of the old one has nowhere to go.
        (self.opening, self.completed) = Default::default();
        let session = connection.zenoh().clone();
        let old = self.shared.kept().connection.replace(connection);
        // Closing may wait for a peer that is not there.
        in_background("link closing", move || drop(old));
        if let Some(answer) = say_first(&session, &self.hello) {
            self.reopened = Some(Instant::now());
            self.is_waiting = answer == Answer::Wait;
            if let Answer::Welcome(peer) = answer {
                self.shared.kept().peer = peer;
            }
        }
    }

    /// Another connection, if there is one in time; one that comes later is closed.
    fn open(&self) -> Option<Connection> {
        let (config, session, inbox) = (self.config.clone(), self.hello.session, Arc::clone(&self.shared.inbox));
        opening(move || Connection::open(&config, session, &inbox)).recv_timeout(OPENS_WITHIN).ok()
    }
}

/// An answer takes no longer if somebody is there, where the first round trip took so long and so many attempts have failed since something
/// came: the way may be a longer one by now.
fn reached_within(round_trip: Duration, failures: u32) -> Duration {
    REACHED_WITHIN.min((3 * round_trip + THINKS_FOR).saturating_mul(2_u32.saturating_pow(failures)))
}

/// What `open` opens in the background, once it is there; none if that fails. One that nobody waits for any more is closed there too.
fn opening<T: Send + 'static>(open: impl FnOnce() -> Result<T, Error> + Send + 'static) -> Receiver<T> {
    let (send, opened) = mpsc::sync_channel(0);
    in_background("link opening", move || {
        if let Ok(one) = open() {
            let _ = send.send(one);
        }
    });
    opened
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use zenoh::Wait;

    use super::*;
    use crate::access::Access;
    use crate::line::HELLO;

    #[test]
    fn a_way_that_has_become_longer_is_waited_for_after_a_failure() {
        let within = |round_trip, failures| reached_within(Duration::from_millis(round_trip), failures).as_millis();
        assert_eq!([0, 1, 2, u32::MAX].map(|failures| within(10, failures)), [130, 260, 300, 300]);
        assert_eq!(within(200, 0), 300);
    }

    /// Check that a machine whose session could not begin asks under another number, under which it may be welcome.
    #[test]
    fn whoever_is_refused_for_long_begins_anew() {
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let (address, access) = (format!("tcp/{free}"), Access::default());
        let there = zenoh::open(access.listening(&address).unwrap()).wait().unwrap();
        let answer = |query: zenoh::query::Query| {
            let question = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
            let is_first = Hello::read(&question).unwrap().session == 1;
            let said = if is_first { Answer::No("it is far away".to_owned()) } else { Answer::Welcome(7) };
            query.reply(query.key_expr().clone(), said.write()).wait().unwrap();
        };
        let _queryable = there.declare_queryable(HELLO).callback(answer).wait().unwrap();
        let (shared, config) = (Arc::<Shared>::default(), access.connecting(&address).unwrap());
        let hello = Hello { session: 1, ..Hello::default() };
        let mut keeper = Keeper::new(Arc::clone(&shared), config, Vec::new(), hello);
        let connection = Connection::open(&keeper.config, 1, &shared.inbox).unwrap();
        let ask = |keeper: &mut Keeper| {
            let answer = say_first(connection.zenoh(), &keeper.hello).unwrap();
            keeper.take(answer);
            (keeper.hello.session == 1, shared.kept().peer)
        };
        assert_eq!(ask(&mut keeper), (true, 0));
        keeper.answered_since = Instant::now().checked_sub(RENEWS_AFTER);
        assert!(!ask(&mut keeper).0, "it asks under one number");
        assert_eq!(ask(&mut keeper), (false, 7));
    }
}
