//! One connection of a session: names, what goes out under them and what comes in.

use std::sync::Arc;

use palpate::{Error, ErrorKind};
use zenoh::Wait;
use zenoh::pubsub::Subscriber;

use crate::inbox::Inbox;
use crate::outbox::Outbox;

/// What the haptic side says hello to.
pub(crate) const HELLO: &str = "palpate/hello";

/// Which way messages go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// To the global side.
    Up,
    /// To the haptic side.
    Down,
}

impl Way {
    /// The names of messages that go this way in a session.
    fn prefix(self, session: u64) -> String {
        let way = if self == Self::Up { "up" } else { "down" };
        format!("palpate/session/{session:016x}/{way}")
    }

    fn back(self) -> Self {
        if self == Self::Up { Self::Down } else { Self::Up }
    }
}

/// A session's messages over zenoh: gone when it is dropped.
#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) outbox: Outbox,
    _subscriber: Subscriber<()>,
}

impl Line {
    /// Sends what goes `way` in the `session` of that number, and puts what comes back into `inbox`.
    ///
    /// # Errors
    /// If zenoh or the system refuses.
    pub(crate) fn new(zenoh: &zenoh::Session, session: u64, way: Way, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        let inbox = Arc::clone(inbox);
        let keep = move |sample: zenoh::sample::Sample| {
            let payload = sample.payload();
            if payload.len() <= palpate::link::LARGEST {
                inbox.put(&payload.to_bytes());
            }
        };
        let coming = zenoh.declare_subscriber(format!("{}/*", way.back().prefix(session))).callback(keep).wait();
        let subscriber = coming.map_err(|error| Error::new(ErrorKind::Runtime, format!("zenoh: {error}")))?;
        Ok(Self { outbox: Outbox::new(zenoh, &way.prefix(session))?, _subscriber: subscriber })
    }
}
