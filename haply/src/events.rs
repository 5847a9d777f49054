//! The events channel: a thread of its own that reads, says what happened and passes on what the tick must know.

use super::guard::News;
use super::protocol::{self, Notice};
use super::websocket::WebSocket;
use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded};
use std::io;
use std::time::Duration;
use tracing::{debug, warn};

/// A thread that is to end does so within this.
const LISTENS_FOR: Duration = Duration::from_millis(50);

/// Between two attempts to connect.
const RETRY: Duration = Duration::from_millis(200);

/// More news than any tick leaves lying about.
const QUEUE: usize = 256;

/// The tick's end of the channel; the thread ends when it is dropped.
#[derive(Debug)]
pub(super) struct Events {
    news: Receiver<News>,
    _alive: Sender<()>,
}

impl Events {
    /// Connects to `address` and listens for what concerns `device`.
    ///
    /// # Errors
    /// If the first connection fails: a force without its safety events is no offer.
    pub(super) fn connect(address: String, device: String) -> io::Result<Self> {
        let socket = connect(&address)?;
        let (sender, news) = bounded(QUEUE);
        let (alive, stopped) = bounded(0);
        std::thread::Builder::new()
            .name("haply-events".to_owned())
            .spawn(move || Listener { address, device, news: sender, stopped }.run(socket))?;
        Ok(Self { news, _alive: alive })
    }

    /// The next piece of news, if there is one; allocates nothing and does not wait.
    pub(super) fn next(&self) -> Option<News> {
        self.news.try_recv().ok()
    }
}

fn connect(address: &str) -> io::Result<WebSocket> {
    let socket = WebSocket::connect(address)?;
    socket.block_for(LISTENS_FOR)?;
    Ok(socket)
}

struct Listener {
    address: String,
    device: String,
    news: Sender<News>,
    stopped: Receiver<()>,
}

impl Listener {
    fn run(self, mut socket: WebSocket) {
        loop {
            let why = loop {
                if self.is_stopped() {
                    return;
                }
                match socket.receive() {
                    Ok(true) => self.pass_on(socket.message()),
                    Ok(false) => {}
                    Err(why) => break why,
                }
            };
            // First the tick, then the words: whoever reads these may keep this thread waiting.
            self.tell(News::ChannelLost);
            warn!("haply: the events channel at {} {why}: no force until it is back", self.address);
            socket = loop {
                std::thread::sleep(RETRY);
                if self.is_stopped() {
                    return;
                }
                if let Ok(socket) = connect(&self.address) {
                    break socket;
                }
            };
            self.tell(News::ChannelBack);
            warn!("haply: the events channel at {} is back", self.address);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.try_recv() == Err(TryRecvError::Disconnected)
    }

    fn pass_on(&self, message: &[u8]) {
        let text = String::from_utf8_lossy(message);
        match protocol::notice(message, &self.device) {
            Ok(Some(notice)) => {
                self.tell(News::Of(notice));
                warn!("haply: device {}: {notice:?}: {text}", self.device);
            }
            Ok(None) => debug!("haply: {text}"),
            Err(_) => {
                // It may have been one that concerns safety.
                self.tell(News::Of(Notice::UnknownSafety));
                warn!("haply: the events channel sent what is no event, no force for now: {text:.80}");
            }
        }
    }

    /// Waits if the tick has not looked for very long: no news may be lost, and this thread has nothing else to do.
    fn tell(&self, news: News) {
        let _ = self.news.send(news);
    }
}
