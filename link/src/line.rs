//! The lines of a session: names, what goes out under them and what comes in.
//!
//! By which of them a message goes [its lane](Lane::lines) says. Each has a connection of its own as soon as that is there.

use std::sync::Arc;

use palpate::link::{LINES, Lane};
use palpate::{Error, ErrorKind};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
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
    /// The names of messages that go this way by a line of a session.
    fn prefix(self, session: u64, line: usize) -> String {
        let way = if self == Self::Up { "up" } else { "down" };
        format!("palpate/session/{session:016x}/{line}/{way}")
    }

    fn back(self) -> Self {
        if self == Self::Up { Self::Down } else { Self::Up }
    }
}

/// What is taken of what comes by a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hears {
    All,
    /// All but what goes by the other lines too.
    WhatGoesOnce,
}

impl Hears {
    fn names(self) -> &'static str {
        if self == Self::All { "*/*" } else { "once/*" }
    }
}

/// A session's messages over zenoh: gone when they are dropped.
#[derive(Debug)]
pub(crate) struct Lines {
    lines: Vec<Line>,
    /// Messages that had to go.
    sent: u64,
}

impl Lines {
    /// Sends what goes `way` in the `session` of that number, and puts what comes back into `inbox`: all lines go over `zenoh`.
    ///
    /// # Errors
    /// If zenoh or the system refuses.
    pub(crate) fn new(zenoh: &zenoh::Session, session: u64, way: Way, inbox: &Arc<Inbox>) -> Result<Self, Error> {
        // Over one connection the copies of a model would only hold each other up.
        let hears = |number| if number == 0 { Hears::All } else { Hears::WhatGoesOnce };
        let lines = (0..LINES).map(|number| Line::new(zenoh, session, number, (way, hears(number)), inbox));
        Ok(Self { lines: lines.collect::<Result<_, _>>()?, sent: 0 })
    }

    /// Lets another one stand for the line of that number. The old one still hears and sends what waits until it is dropped.
    pub(crate) fn replace(&mut self, number: usize, line: Line) -> Line {
        std::mem::replace(&mut self.lines[number], line)
    }

    /// Nothing goes and comes any more.
    pub(crate) fn end(&mut self) {
        self.lines.clear();
    }

    /// Hands over a message; never waits for the network.
    pub(crate) fn put(&mut self, lane: Lane, message: &[u8]) {
        let message = ZBytes::from(message);
        self.sent += 1;
        // None once it is over.
        for line in self.lines.get(lane.lines(self.sent)).into_iter().flatten() {
            line.outbox.put(lane, message.clone());
        }
    }
}

/// One of them.
#[derive(Debug)]
pub(crate) struct Line {
    outbox: Outbox,
    _subscriber: Subscriber<()>,
}

impl Line {
    /// The line of that number of the `session`: sends what goes `way` over `zenoh`, and puts what comes back into `inbox`.
    ///
    /// # Errors
    /// If zenoh or the system refuses.
    pub(crate) fn new(
        zenoh: &zenoh::Session,
        session: u64,
        number: usize,
        (way, hears): (Way, Hears),
        inbox: &Arc<Inbox>,
    ) -> Result<Self, Error> {
        let [out, back] = [way, way.back()].map(|way| way.prefix(session, number));
        let inbox = Arc::clone(inbox);
        let keep = move |sample: zenoh::sample::Sample| {
            let payload = sample.payload();
            if payload.len() <= palpate::link::LARGEST {
                inbox.put(&payload.to_bytes());
            }
        };
        let coming = zenoh.declare_subscriber(format!("{back}/{}", hears.names())).callback(keep).wait();
        let subscriber = coming.map_err(|error| Error::new(ErrorKind::Runtime, format!("zenoh: {error}")))?;
        Ok(Self { outbox: Outbox::new(zenoh, &out)?, _subscriber: subscriber })
    }
}
