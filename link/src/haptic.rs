//! The haptic side: says hello, waits for the first model, and comes back after whatever breaks.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use palpate::link::{Hello, Lane, Transport};
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};
use zenoh::Config;

use crate::access::Access;
use crate::connection::{Connection, is_broken, say_first};
use crate::desk::Answer;
use crate::keeper::{Keeper, LOOK, Shared};
use crate::sockets::places;
use crate::{machine, unique};

/// How long the first model is waited for.
const FIRST_MODEL: Duration = Duration::from_secs(30);
/// Once a model has come, the bases that the session begins with are waited for so long: without them it can begin all the same.
const FIRST_BASES: Duration = Duration::from_secs(10);
/// Another machine that has just gone is waited for so long.
const OTHER_GONE: Duration = Duration::from_secs(3);
/// The machines of the scene's other devices are waited for so long.
const OTHERS_COME: Duration = Duration::from_secs(600);
/// For so long the first model is looked for before it is asked again: a machine that asks is there.
const LOOKS_FOR: Duration = Duration::from_millis(500);
/// After so long a message is shown that nothing has come yet.
const TELLS_AFTER: Duration = Duration::from_secs(1);

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
    /// How long the first model is waited for.
    first_model: Duration,
}

impl GlobalSide {
    /// The global side at `address`, such as `tls/big-machine:7447`. Nothing is connected before the session starts.
    ///
    /// # Errors
    /// If the address is none, or `access` does not allow it.
    pub fn at(address: &str, access: &Access) -> Result<Self, Error> {
        let config = access.connecting(address)?;
        Ok(Self { address: address.to_owned(), config, shared: Arc::default(), keeper: None, first_model: FIRST_MODEL })
    }

    /// Says hello until it is welcome and the first models have come, with their bases.
    fn wait_for_models(&self, hello: &mut Hello) -> Result<Connection, Error> {
        let inbox = &self.shared.inbox;
        let (mut connection, mut is_told, mut welcome) = (None::<Connection>, false, None::<Instant>);
        // While others are waited for, the time of the first model does not run.
        let (mut began, mut others, mut first) = (Instant::now(), None::<Instant>, None::<Instant>);
        while first.unwrap_or(began).elapsed() < self.first_model {
            if !is_told && began.elapsed() > TELLS_AFTER {
                is_told = true;
                tracing::warn!(
                    "waiting for the global side at {}, up to {} s",
                    self.address,
                    self.first_model.as_secs()
                );
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
            let is_lost = match say_first(open.zenoh(), hello) {
                Some(Answer::Welcome(peer)) => {
                    self.shared.kept().peer = peer;
                    let since = *welcome.get_or_insert_with(Instant::now);
                    inbox.models() == 0 && since.elapsed() > self.first_model / 2
                }
                Some(Answer::WaitFor(devices)) => {
                    if others.is_none() {
                        tracing::warn!("waiting for the haptic machine with {}", palpate::printable(&devices));
                    }
                    let waited = others.get_or_insert_with(Instant::now).elapsed();
                    if waited > OTHERS_COME {
                        let minutes = OTHERS_COME.as_secs() / 60;
                        return Err(self.error(format!("waits for {devices}, which did not come in {minutes} minutes")));
                    }
                    began = Instant::now();
                    false
                }
                Some(Answer::Taken(device)) if began.elapsed() > OTHER_GONE => {
                    return Err(self.error(format!("works for another haptic machine with {device}")));
                }
                Some(Answer::Wait | Answer::Taken(_)) => false,
                Some(Answer::No(why)) => return Err(self.error(format!("refuses: {why}"))),
                // If it is not, an answer may be on its way behind a lot else.
                None => is_broken(open.zenoh()),
            };
            if is_lost {
                // Nobody sends again what has been on its way here: it is begun anew.
                (connection, welcome) = (None, None);
                hello.session = unique();
                continue;
            }
            let looked = Instant::now();
            // Who is not welcome yet gets none.
            let looks_for = if welcome.is_some() { LOOKS_FOR } else { LOOK };
            while looked.elapsed() < looks_for {
                let has_models = welcome.is_some() && inbox.models() > 0;
                if has_models && (inbox.is_ready() || first.get_or_insert_with(Instant::now).elapsed() > FIRST_BASES) {
                    return connection.ok_or_else(|| self.error("broke off".to_owned()));
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        let (seconds, not) =
            (self.first_model.as_secs(), if welcome.is_some() { "sends no model" } else { "does not answer" });
        Err(self.error(format!("{not} within {seconds} s: is `palpate serve` at work there, with this scene?")))
    }

    fn error(&self, message: String) -> Error {
        Error::new(ErrorKind::Runtime, format!("the global side {message}")).at(&self.address)
    }
}

impl Transport for GlobalSide {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        if let Some(connection) = &mut self.shared.kept().connection {
            connection.lines.put(lane, message);
        }
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        self.shared.inbox.take(message)
    }

    fn connect(&mut self, hello: &Hello) -> Result<(), Error> {
        let mut hello = Hello { machine: machine(), session: unique(), ..hello.clone() };
        let connection = self.wait_for_models(&mut hello)?;
        self.shared.kept().connection = Some(connection);
        let keeper = Keeper::new(Arc::clone(&self.shared), self.config.clone(), places(&self.address), hello);
        let keeper = std::thread::Builder::new().name("link keeper".to_owned()).spawn(move || keeper.keep());
        self.keeper = Some(keeper.map_err(|error| self.error(format!("gets no thread here: {error}")))?);
        Ok(())
    }

    fn peer(&mut self) -> u64 {
        self.shared.kept().peer
    }
}

impl Drop for GlobalSide {
    fn drop(&mut self) {
        self.shared.end();
        if let Some(keeper) = self.keeper.take() {
            let _ = keeper.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::sync::Mutex;

    use palpate::link::{Header, Message};
    use zenoh::Wait;

    use super::*;
    use crate::inbox::Inbox;
    use crate::line::{HELLO, Lines, Way};

    /// A message of the lane of models, as far as anybody looks who only passes it on.
    fn model() -> Vec<u8> {
        let mut bytes = Vec::new();
        Message::Ping.write(Header::default(), &mut bytes);
        (0..u8::MAX)
            .map(|kind| [&bytes[..6], &[kind], &bytes[7..]].concat())
            .find(|bytes| matches!(Message::glance(bytes), Ok((Lane::Models, _))))
            .expect("a kind of message")
    }

    /// Check that a machine that is welcome and gets no model asks again under another number, as what was sent to it may be lost.
    #[test]
    fn whoever_is_welcome_and_gets_nothing_begins_anew() {
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let (address, access) = (format!("tcp/{free}"), Access::default());
        let there = zenoh::open(access.listening(&address).unwrap()).wait().unwrap();
        let sessions = Arc::new(Mutex::new(Vec::new()));
        let seen = Arc::clone(&sessions);
        let answer = move |query: zenoh::query::Query| {
            let question = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
            let said = match Hello::read(&question) {
                Ok(hello) => {
                    let mut seen = seen.lock().unwrap();
                    seen.push(hello.session);
                    seen.dedup();
                    Answer::Welcome(1)
                }
                Err(_) => Answer::Wait,
            };
            query.reply(query.key_expr().clone(), said.write()).wait().unwrap();
        };
        let _queryable = there.declare_queryable(HELLO).callback(answer).wait().unwrap();
        let mut haptic = GlobalSide::at(&address, &access).unwrap();
        haptic.first_model = Duration::from_secs(6);
        let comes = std::thread::spawn(move || haptic.connect(&Hello::default()).map(|()| haptic));
        let began = Instant::now();
        while sessions.lock().unwrap().len() < 2 {
            assert!(began.elapsed() < Duration::from_secs(6), "it asks under one number: {sessions:?}");
            std::thread::sleep(LOOK);
        }
        let session = sessions.lock().unwrap()[1];
        let mut lines = Lines::new(&there, session, Way::Down, &Arc::new(Inbox::default())).unwrap();
        let mut ready = Vec::new();
        Message::Ready.write(Header::default(), &mut ready);
        while !comes.is_finished() {
            lines.put(Lane::Models, &model());
            lines.put(Lane::Bulk, &ready);
            std::thread::sleep(LOOK);
        }
        assert!(comes.join().unwrap().is_ok());
    }
}
