//! The events channel: a thread of its own that reads, says what happened and passes on what the tick must know.

use crate::guard::News;
use crate::protocol;
use crate::wire::Wire;
use crate::words::Words;
use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded};
use palpate::printable;
use std::io;
use std::time::{Duration, Instant};
use tracing::{debug, warn};

/// A thread that is to end does so within this.
const LISTENS_FOR: Duration = Duration::from_millis(50);

/// Between two attempts to connect.
const RETRY: Duration = Duration::from_millis(200);

/// More news than any tick leaves lying about.
const QUEUE: usize = 256;

/// The tick's end of the channel; the thread ends when it is dropped.
#[derive(Debug)]
pub(crate) struct Events {
    news: Receiver<News>,
    _alive: Sender<()>,
}

impl Events {
    /// Connects to `address` and listens for what concerns `device`.
    ///
    /// # Errors
    /// If the first connection fails: a force without its safety events is no offer.
    pub(crate) fn connect(address: String, device: String) -> io::Result<Self> {
        let wire = connect(&address)?;
        let (sender, news) = bounded(QUEUE);
        let (alive, stopped) = bounded(0);
        std::thread::Builder::new()
            .name("haply-events".to_owned())
            .spawn(move || Listener { address, device, news: sender, stopped, words: Words::default() }.run(wire))?;
        Ok(Self { news, _alive: alive })
    }

    /// The next piece of news, if there is one; allocates nothing and does not wait.
    pub(crate) fn next(&self) -> Option<News> {
        self.news.try_recv().ok()
    }
}

fn connect(address: &str) -> io::Result<Wire> {
    let wire = Wire::connect(address)?;
    wire.block_for(LISTENS_FOR)?;
    Ok(wire)
}

struct Listener {
    address: String,
    device: String,
    news: Sender<News>,
    stopped: Receiver<()>,
    words: Words,
}

impl Listener {
    fn run(mut self, mut wire: Wire) {
        loop {
            let why = loop {
                if self.is_stopped() {
                    return;
                }
                match wire.receive() {
                    Ok(Some(message)) => self.pass_on(&message),
                    Ok(None) => {}
                    Err(why) => break why,
                }
            };
            // First the tick, then the words: whoever reads these may keep this thread waiting.
            self.tell(News::ChannelLost);
            self.say(format!("the events channel at {} {why}: no force until it is back", self.address));
            wire = loop {
                std::thread::sleep(RETRY);
                if self.is_stopped() {
                    return;
                }
                if let Ok(wire) = connect(&self.address) {
                    break wire;
                }
            };
            self.tell(News::ChannelBack);
            self.say(format!("the events channel at {} is back", self.address));
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.try_recv() == Err(TryRecvError::Disconnected)
    }

    fn pass_on(&mut self, message: &[u8]) {
        let text = String::from_utf8_lossy(message);
        match protocol::news(message, &self.device) {
            Ok(Some(news)) => {
                self.tell(news);
                self.say(format!("device {}: {news:?}: {}", self.device, printable(&text)));
            }
            Ok(None) => debug!("haply: {}", printable(&text)),
            Err(_) => {
                // It may have been one that concerns safety.
                self.tell(News::UnknownSafety);
                self.say(format!("the events channel sent what is no event, no force for now: {}", printable(&text)));
            }
        }
    }

    /// Says what a user should know, but not all of it where there is no end of it.
    fn say(&mut self, line: String) {
        if let Some(left_out) = self.words.speaks(Instant::now()) {
            warn!("haply: {line}{left_out}");
        }
    }

    /// Waits if the tick has not looked for very long: no news may be lost, and this thread has nothing else to do.
    fn tell(&self, news: News) {
        let _ = self.news.send(news);
    }
}
