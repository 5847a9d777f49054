//! The global side: listens, and runs a session for the haptic machine that comes.

use std::sync::Arc;
use std::time::Duration;

use palpate::link::{Hello, Lane, Transport};
use palpate::runtime::Nanos;
use palpate::session::{GlobalSession, Running, Summary};
use palpate::{Error, ErrorKind};
use zenoh::Wait;

use crate::access::Access;
use crate::desk::Desk;
use crate::inbox::Inbox;
use crate::line::{HELLO, Line, Way};

/// Between two looks whether somebody has come, or whoever serves wants to end.
const LOOK: Duration = Duration::from_millis(50);

/// What happens on the global side, to be shown.
#[derive(Debug)]
#[non_exhaustive]
pub enum Event {
    /// It listens, and a session is ready.
    Listening,
    /// A haptic machine has come, and the global model runs for it; what it says of itself.
    Came(Box<Hello>),
    /// A haptic machine has come, and there is nothing for it; why.
    Refused(Error),
    /// The session is over: the machine has gone or begun anew, or the global model failed.
    Ended(Box<Summary>),
}

/// Listens at `address` and runs the global model of a session, made by `make`, for the haptic machine that comes, one at a time; until
/// `is_over`. What happens is told to `tell`, on this thread.
///
/// A machine that comes again after a break of its link goes on with the session as it is. One that was started anew begins with another
/// one, from the body as it was made.
///
/// # Errors
/// If `access` does not allow the address, it is taken, or `make` fails.
pub fn serve(
    mut make: impl FnMut() -> Result<GlobalSession, Error>,
    address: &str,
    access: &Access,
    mut is_over: impl FnMut() -> bool,
    mut tell: impl FnMut(Event),
) -> Result<(), Error> {
    let config = access.listening(address)?;
    let mut ready = make()?;
    let desk = Arc::new(Desk::new(ready.hello().clone()));
    let refused = |error: zenoh::Error| Error::new(ErrorKind::Runtime, format!("cannot listen: {error}")).at(address);
    let zenoh = zenoh::open(config).wait().map_err(refused)?;
    let asked = Arc::clone(&desk);
    let answer = move |query: zenoh::query::Query| {
        let question = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
        let _ = query.reply(query.key_expr().clone(), asked.answer(&question).write()).wait();
    };
    let _queryable = zenoh.declare_queryable(HELLO).callback(answer).wait().map_err(refused)?;
    tell(Event::Listening);
    let mut running: Option<Running> = None;
    while !is_over() {
        if let Some((hello, inbox)) = desk.wait_for_guest(LOOK) {
            running.take().into_iter().for_each(|running| tell(Event::Ended(Box::new(running.stop()))));
            let end = Line::new(&zenoh, hello.session, Way::Down, &inbox).map(|line| HapticSide { line, inbox });
            match end.and_then(|end| ready.start(end, &hello)) {
                Ok(started) => {
                    running = Some(started);
                    tell(Event::Came(Box::new(hello)));
                }
                Err(error) => {
                    desk.refuse(error.to_string());
                    tell(Event::Refused(error));
                }
            }
            ready = make()?;
            desk.is_ready();
        }
        let has_failed = running.as_ref().is_some_and(Running::finished);
        if has_failed || (running.is_some() && desk.is_alone()) {
            desk.forget();
            running.take().into_iter().for_each(|running| tell(Event::Ended(Box::new(running.stop()))));
        }
    }
    running.into_iter().for_each(|running| tell(Event::Ended(Box::new(running.stop()))));
    Ok(())
}

/// The way to the haptic side, for the length of a session.
#[derive(Debug)]
struct HapticSide {
    line: Line,
    inbox: Arc<Inbox>,
}

impl Transport for HapticSide {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        self.line.outbox.put(lane, message);
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        self.inbox.take(message)
    }
}
