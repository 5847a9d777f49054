//! A transport within one process.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use palpate::link::{Hello, Lane, Message, Transport};
use palpate::runtime::Nanos;
use palpate::session::{GlobalSession, Running};
use palpate::{Error, ErrorKind};

/// True for the message of local models.
pub fn has_models(message: &[u8]) -> bool {
    matches!(Message::glance(message), Ok((Lane::Models, _)))
}

pub type Way = Arc<Mutex<VecDeque<Vec<u8>>>>;

/// What carries messages at once, as far as it is not cut.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// From the haptic side, and to it.
    pub ways: [Way; 2],
    pub is_cut: Arc<Mutex<bool>>,
    /// What was said over it.
    hello: Arc<Mutex<Option<Hello>>>,
    /// What the haptic side counts as its peer, and the global side.
    pub peers: [Arc<Mutex<u64>>; 2],
    /// Pictures of the body that were sent.
    pictures: Arc<Mutex<usize>>,
}

#[derive(Clone, Debug)]
pub struct End {
    line: Line,
    side: usize,
}

impl Line {
    /// The end of the haptic side, 0, or of the global one.
    pub fn end(&self, side: usize) -> End {
        End { line: self.clone(), side }
    }

    /// What the haptic side has said of itself, once it has.
    pub fn hello(&self) -> Hello {
        loop {
            let hello = self.hello.lock().unwrap().clone();
            if let Some(hello) = hello {
                return hello;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Starts the global side once the other one has said who it is.
    pub fn serve(&self, global: GlobalSession) -> Running {
        let hello = self.hello();
        assert_eq!(global.hello().difference(&hello), None);
        global.start(vec![(Box::new(self.end(1)), hello)]).unwrap()
    }

    /// Pictures that have been sent over it so far.
    pub fn pictures(&self) -> usize {
        *self.pictures.lock().unwrap()
    }
}

impl Transport for End {
    fn send(&mut self, lane: Lane, message: &[u8], _: Nanos) {
        *self.line.pictures.lock().unwrap() += usize::from(lane == Lane::Pictures);
        if !*self.line.is_cut.lock().unwrap() {
            self.line.ways[self.side].lock().unwrap().push_back(message.to_vec());
        }
    }

    fn receive(&mut self, _: Nanos, message: &mut Vec<u8>) -> bool {
        let Some(next) = self.line.ways[1 - self.side].lock().unwrap().pop_front() else { return false };
        *message = next;
        true
    }

    fn connect(&mut self, hello: &Hello) -> Result<(), Error> {
        *self.line.hello.lock().unwrap() = Some(hello.clone());
        let until = Instant::now() + Duration::from_secs(30);
        while !self.line.ways[1].lock().unwrap().iter().any(|message| has_models(message)) {
            if Instant::now() > until {
                return Err(Error::new(ErrorKind::Runtime, "nobody answers"));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    fn peer(&mut self) -> u64 {
        *self.line.peers[self.side].lock().unwrap()
    }
}
