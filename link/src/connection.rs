//! The opened connections of a session to the global side, and what is asked over them.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use palpate::link::{Hello, LINES};
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use zenoh::{Config, Wait};

use crate::desk::Answer;
use crate::inbox::Inbox;
use crate::line::{HELLO, Hears, Line, Lines, Way};

/// An answer to hello is waited for so long.
const ANSWERS_WITHIN: Duration = Duration::from_millis(700);
/// Where zenoh knows of nobody who could answer yet.
const ASKS_AGAIN_AFTER: Duration = Duration::from_millis(10);
/// Round trips of which the quickest counts.
const ROUND_TRIPS: usize = 5;
#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) lines: Lines,
    /// That of each line; one that has none of its own goes by that of the first.
    zenoh: Vec<zenoh::Session>,
}

impl Connection {
    /// Connects for the `session` of that number, whose messages come into `inbox`: all lines go by one connection at first. If the path
    /// breaks meanwhile, zenoh may take ten seconds to give up, whatever its timeouts say.
    ///
    /// # Errors
    /// If nobody is there, or zenoh or the system refuses.
    pub(crate) fn open(config: &Config, session: u64, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let zenoh = open(config)?;
        Ok(Self { lines: Lines::new(&zenoh, session, Way::Up, inbox)?, zenoh: vec![zenoh; LINES] })
    }

    /// Those by which its lines go.
    pub(crate) fn by_line(&self) -> Vec<zenoh::Session> {
        self.zenoh.clone()
    }

    /// Lets a line go over a connection of its own. What it went by before is returned: messages may still be on their way there.
    pub(crate) fn take(&mut self, OwnLine { number, line, zenoh }: OwnLine) -> Replaced {
        let old = self.lines.replace(number, line);
        Replaced { _line: old, _zenoh: std::mem::replace(&mut self.zenoh[number], zenoh) }
    }

    /// What is asked goes by the first of them.
    pub(crate) fn zenoh(&self) -> &zenoh::Session {
        &self.zenoh[0]
    }

    /// The quickest of some round trips; none that was answered is no time.
    pub(crate) fn round_trip(&self) -> Nanos {
        let trip = |_| {
            let began = Instant::now();
            ask_first(self.zenoh(), &[]).map(|_| began.elapsed())
        };
        let quickest = (0..ROUND_TRIPS).filter_map(trip).min().unwrap_or_default();
        Nanos(u64::try_from(quickest.as_nanos()).unwrap_or(u64::MAX))
    }
}

impl Drop for Connection {
    /// Closes all at once: each may wait for a peer that is not there.
    fn drop(&mut self) {
        self.lines.end();
        let closing = self.zenoh.drain(..).map(|zenoh| in_background("link closing", move || drop(zenoh)));
        let closing: Vec<_> = closing.collect();
        closing.into_iter().flatten().for_each(|closing| drop(closing.join()));
    }
}

/// A line with a connection of its own.
#[derive(Debug)]
pub(crate) struct OwnLine {
    number: usize,
    line: Line,
    zenoh: zenoh::Session,
}

impl OwnLine {
    /// Opens it for the `session` of that number, whose messages come into `inbox`.
    ///
    /// # Errors
    /// If nobody is there, or zenoh or the system refuses.
    pub(crate) fn open(config: &Config, session: u64, number: usize, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let zenoh = open(config)?;
        Ok(Self { number, line: Line::new(&zenoh, session, number, (Way::Up, Hears::All), inbox)?, zenoh })
    }
}

/// What a line went by until it got another connection, in the order in which it ends. That may wait for a peer that is not there.
#[derive(Debug)]
pub(crate) struct Replaced {
    _line: Line,
    _zenoh: zenoh::Session,
}

/// The lines that have no connection of their own [among](Connection::by_line) these, or one at whose other end nobody is.
pub(crate) fn lacking(by_line: &[zenoh::Session]) -> Vec<usize> {
    let is_own = |line: usize| line == 0 || by_line[line].zid() != by_line[0].zid();
    (0..by_line.len()).filter(|&line| !is_own(line) || is_broken(&by_line[line])).collect()
}

/// True if nobody is at the other end any more.
pub(crate) fn is_broken(zenoh: &zenoh::Session) -> bool {
    let info = zenoh.info();
    info.routers_zid().wait().next().is_none() && info.peers_zid().wait().next().is_none()
}

/// One connection.
///
/// # Errors
/// If nobody is there, or zenoh refuses.
fn open(config: &Config) -> Result<zenoh::Session, Error> {
    let failed = |error| Error::new(ErrorKind::Runtime, format!("zenoh: {error}"));
    zenoh::open(config.clone()).wait().map_err(failed)
}

/// Does it on a thread of its own. Where the system gives none, what `work` holds is dropped at once.
pub(crate) fn in_background(name: &str, work: impl FnOnce() + Send + 'static) -> Option<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).ok()
}

/// Says hello over a connection that may be new; `None` if nobody answers in time.
pub(crate) fn say_first(zenoh: &zenoh::Session, hello: &Hello) -> Option<Answer> {
    ask_first(zenoh, &written(hello))
}

/// Asks over a connection that may be new: for a round trip and more it knows of nobody who answers, and zenoh says at once that there is
/// none.
fn ask_first(zenoh: &zenoh::Session, question: &[u8]) -> Option<Answer> {
    let began = Instant::now();
    loop {
        let answer = ask(zenoh, question, ANSWERS_WITHIN);
        if answer.is_some() || began.elapsed() > ANSWERS_WITHIN {
            return answer;
        }
        std::thread::sleep(ASKS_AGAIN_AFTER);
    }
}

/// Says hello over a connection that has been at work; `None` if nobody answers within that time.
pub(crate) fn say(zenoh: &zenoh::Session, hello: &Hello, within: Duration) -> Option<Answer> {
    ask(zenoh, &written(hello), within)
}

fn written(hello: &Hello) -> Vec<u8> {
    let mut bytes = Vec::new();
    hello.write(&mut bytes);
    bytes
}

/// Asks the global side; `None` if nobody answers in time.
fn ask(zenoh: &zenoh::Session, question: &[u8], within: Duration) -> Option<Answer> {
    let replies = zenoh.get(HELLO).payload(question).timeout(within).wait().ok()?;
    let reply = replies.recv_timeout(2 * within).ok()??;
    match reply.result() {
        Ok(sample) => Answer::read(&sample.payload().to_bytes()),
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::net::TcpListener;

    use palpate::link::{Header, Lane, Message};

    use super::*;
    use crate::access::Access;

    const SESSION: u64 = 7;

    fn put_pings(lines: &mut Lines, numbers: std::ops::Range<u64>) {
        for number in numbers {
            let mut ping = Vec::new();
            Message::Ping.write(Header { number, ..Header::default() }, &mut ping);
            // Of the lanes, the one of which nothing is dropped.
            lines.put(Lane::Bulk, &ping);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn pings(inbox: &Inbox, within: Duration, count: usize) -> BTreeSet<u64> {
        let (began, mut message, mut numbers) = (Instant::now(), Vec::new(), BTreeSet::new());
        while began.elapsed() < within && numbers.len() < count {
            while inbox.take(&mut message) {
                numbers.insert(Message::glance(&message).unwrap().1.number);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        numbers
    }

    /// Check that lines get connections of their own while messages go both ways, that none is lost by it, and that one that breaks is found.
    #[test]
    fn lines_move_to_connections_of_their_own_and_lose_nothing() {
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let (address, access) = (format!("tcp/{free}"), Access::default());
        let there = zenoh::open(access.listening(&address).unwrap()).wait().unwrap();
        let [inbox_there, inbox] = [0; 2].map(|_| Arc::new(Inbox::default()));
        let mut lines = Lines::new(&there, SESSION, Way::Down, &inbox_there).unwrap();
        let config = access.connecting(&address).unwrap();
        let mut connection = Connection::open(&config, SESSION, &inbox).unwrap();
        // Until each side knows what the other one hears.
        let (mut begun, mut number) = (false, 0);
        while !begun {
            put_pings(&mut connection.lines, number..number + 9);
            put_pings(&mut lines, number..number + 9);
            number += 9;
            begun = [&inbox_there, &inbox].iter().all(|inbox| pings(inbox, Duration::from_millis(50), 9).len() == 9);
            assert!(number < 1000, "no message comes");
        }
        let sent = number..number + 400;
        let mut replaced = Vec::new();
        std::thread::scope(|scope| {
            scope.spawn(|| put_pings(&mut lines, sent.clone()));
            for (hundred, expected) in [&[1, 2][..], &[1], &[], &[]].into_iter().enumerate() {
                let from = sent.start + 100 * hundred as u64;
                put_pings(&mut connection.lines, from..from + 100);
                let lacking = lacking(&connection.by_line());
                assert_eq!(lacking, expected);
                if let Some(&line) = lacking.last() {
                    replaced.push(connection.take(OwnLine::open(&config, SESSION, line, &inbox).unwrap()));
                }
            }
        });
        for inbox in [&inbox_there, &inbox] {
            let come = pings(inbox, Duration::from_secs(5), 400);
            assert!(sent.clone().all(|number| come.contains(&number)), "{} of 400 have come", come.len());
        }
        connection.by_line()[1].close().wait().unwrap();
        assert_eq!(lacking(&connection.by_line()), [1]);
    }
}
