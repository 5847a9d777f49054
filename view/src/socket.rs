//! One browser: what it says is read, what waits for it is sent, and it may take its time within bounds.
//!
//! By turns it is read for some milliseconds and sent for some, whatever else there is to read or to send. A browser that stops
//! reading stops its own thread alone, and that for moments: what could not be sent is tried again, and only the newest picture waits.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig, frame::coding::CloseCode};
use tungstenite::{Error, Message, Utf8Bytes, WebSocket};

use crate::client::Outgoing;
use crate::http::PATIENCE;
use crate::hub::{Browser, Hub};
use crate::wish::Wish;

/// A message of the page has a hundred bytes.
const MOST_BYTES: usize = 4 << 10;
/// A message may come in fragments, of which each has a head: so much before it is whole.
const MOST_UNFINISHED: usize = 2 * MOST_BYTES;
/// How long it is read before something is sent.
const LOOK: Duration = Duration::from_millis(4);
/// How long something is sent before it is read, and how long a write waits for a browser that does not read.
const PUSH: Duration = Duration::from_millis(20);
/// A browser that has taken nothing or not answered for so long is gone, or may come again.
const GONE: Duration = Duration::from_secs(90);
/// A browser is asked this often whether it is there. It answers by itself, whatever its page does.
const ASK: Duration = Duration::from_secs(20);
/// A page hears something at least this often, so that it knows a connection that is dead.
const BEAT: Duration = Duration::from_secs(2);

/// Messages that a browser may send at once, and per second: a page sends one per picture of its screen.
const BURST: f64 = 400.0;
const PER_SECOND: f64 = 250.0;

/// Why a connection is ended, in words, and for the page by a code: after [`CloseCode::Policy`] there is no use in coming again, after
/// any other the page does by itself.
type Farewell = (CloseCode, &'static str);
const REFUSED: Farewell = (CloseCode::Policy, "the address lacks its token");
/// A page that sleeps says nothing: it may know the token all the same.
const SILENT: Farewell = (CloseCode::Again, "the page did not say its token in time");
const FULL: Farewell = (CloseCode::Again, "too many browsers, close one");
const FLOOD: Farewell = (CloseCode::Again, "too many messages");
const NO_MESSAGE: Farewell = (CloseCode::Protocol, "that is no message of the page");
const TOO_LONG: Farewell = (CloseCode::Size, "that message is too long");
const REPLACED: Farewell = (CloseCode::Away, "the page has come again");
const OVER: Farewell = (CloseCode::Away, "the server has ended");

/// Messages that may still come: a bucket that fills with time.
#[derive(Debug)]
struct Allowance {
    left: f64,
    since: Instant,
}

impl Allowance {
    fn new(now: Instant) -> Self {
        Self { left: BURST, since: now }
    }

    /// Takes one message at `now`; false if there were too many.
    fn take(&mut self, now: Instant) -> bool {
        let passed = now.saturating_duration_since(self.since).as_secs_f64();
        (self.left, self.since) = ((self.left + PER_SECOND * passed).min(BURST) - 1.0, now);
        self.left >= 0.0
    }
}

/// A browser's stream. Fragments of which none is the last are read on and on without a message, and a long message is written on and on
/// over a slow link: by these bounds that ends.
struct Bounded {
    stream: TcpStream,
    /// Nothing is read or written after it.
    until: Instant,
    /// Bytes that may come before a message is whole.
    left: usize,
}

impl Bounded {
    fn is_in_time(&self) -> io::Result<()> {
        if Instant::now() < self.until { Ok(()) } else { Err(io::ErrorKind::WouldBlock.into()) }
    }
}

impl Read for Bounded {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if self.left == 0 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        self.is_in_time()?;
        let count = self.stream.read(to)?;
        self.left = self.left.saturating_sub(count);
        Ok(count)
    }
}

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.is_in_time()?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

type Socket = WebSocket<Bounded>;

/// Serves a browser that asked for a socket, until it goes, says what it may not, or the server ends.
pub(crate) fn serve(stream: TcpStream, rest: Vec<u8>, hub: &Hub) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(PUSH))?;
    let config = WebSocketConfig::default().max_message_size(Some(MOST_BYTES)).max_frame_size(Some(MOST_BYTES));
    let stream = Bounded { stream, until: Instant::now(), left: MOST_UNFINISHED };
    let mut socket = Socket::from_partially_read(stream, rest, Role::Server, Some(config));
    let Some(browser) = enter(&mut socket, hub) else { return Ok(()) };
    let farewell = talk(&mut socket, &browser, hub);
    hub.leave(&browser);
    if let Some(farewell) = farewell {
        close(&mut socket, farewell);
    }
    Ok(())
}

/// The next message, if it is whole before `until`; otherwise an error that [is a wait](is_wait).
fn read(socket: &mut Socket, until: Instant) -> Result<Message, Error> {
    socket.get_mut().until = until;
    let message = socket.read()?;
    socket.get_mut().left = MOST_UNFINISHED;
    Ok(message)
}

/// Waits for the token, and lets the browser in.
fn enter(socket: &mut Socket, hub: &Hub) -> Option<Arc<Browser>> {
    let begin = Instant::now();
    let farewell = loop {
        if hub.is_over() {
            break OVER;
        }
        if begin.elapsed() >= PATIENCE {
            break SILENT;
        }
        match read(socket, Instant::now() + LOOK) {
            Ok(Message::Text(text)) => match Wish::read(&text) {
                Some(Wish::Enter { token, again }) if hub.token.is(&token) => match hub.enter(again.as_deref()) {
                    Some(browser) => return Some(browser),
                    None => break FULL,
                },
                _ => break REFUSED,
            },
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Err(error) if is_wait(&error) => {}
            _ => return None,
        }
    };
    close(socket, farewell);
    None
}

/// Does what the browser says in a [`LOOK`]; true if it said anything. An error ends the connection, with these words.
fn listen(
    socket: &mut Socket,
    browser: &Browser,
    hub: &Hub,
    allowance: &mut Allowance,
) -> Result<bool, Option<Farewell>> {
    let until = Instant::now() + LOOK;
    let mut has_said = false;
    loop {
        match read(socket, until) {
            Ok(_) if !allowance.take(Instant::now()) => return Err(Some(FLOOD)),
            Ok(Message::Text(text)) => match Wish::read(&text) {
                Some(wish) if !matches!(wish, Wish::Enter { .. }) => hub.wish(browser.number, wish),
                _ => return Err(Some(NO_MESSAGE)),
            },
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(Message::Close(_)) => return Err(None),
            Ok(_) => return Err(Some(NO_MESSAGE)),
            Err(error) if is_wait(&error) => return Ok(has_said),
            Err(Error::Capacity(_)) => return Err(Some(TOO_LONG)),
            Err(_) => return Err(None),
        }
        has_said = true;
    }
}

/// Reads and sends until the browser goes, or until it is sent away.
fn talk(socket: &mut Socket, browser: &Browser, hub: &Hub) -> Option<Farewell> {
    let begin = Instant::now();
    let mut allowance = Allowance::new(begin);
    let (mut is_sent, mut moved, mut said, mut asked, mut heard) = (true, begin, begin, begin, begin);
    loop {
        if hub.is_over() {
            return Some(OVER);
        }
        if browser.outbox().is_replaced {
            return Some(REPLACED);
        }
        match listen(socket, browser, hub, &mut allowance) {
            Ok(true) => heard = Instant::now(),
            Ok(false) => {}
            Err(farewell) => return farewell,
        }
        if heard.elapsed() > GONE {
            return None;
        }
        // Over a slow link there is always more to send, and the hand is heard all the same.
        socket.get_mut().until = Instant::now() + PUSH;
        if !is_sent {
            is_sent = has_gone(socket.flush())?;
        }
        if is_sent {
            moved = Instant::now();
        } else if moved.elapsed() >= GONE {
            return None;
        }
        if is_sent && asked.elapsed() > ASK {
            asked = Instant::now();
            is_sent = has_gone(socket.send(Message::Ping(bytes::Bytes::new())))?;
        }
        if is_sent && said.elapsed() > BEAT {
            browser.outbox().say(json!({ "kind": "here" }));
        }
        // Nothing new is handed over before the last message has gone: so no more than one waits here.
        while is_sent && let Some(message) = { browser.outbox().take() } {
            let (length, message) = match message {
                Outgoing::Text(text) => (text.len(), Message::Text(text.into())),
                Outgoing::Bytes(bytes) => (bytes.len(), Message::Binary(bytes)),
            };
            is_sent = has_gone(socket.send(message))?;
            said = Instant::now();
            hub.count_sent(length);
        }
    }
}

/// True for what was written whole, false for what waits for room; `None` if the connection is over.
fn has_gone(written: Result<(), Error>) -> Option<bool> {
    match written {
        Ok(()) => Some(true),
        Err(error) if is_wait(&error) => Some(false),
        Err(_) => None,
    }
}

/// True if there was nothing to read, or no room to write, for the moment; a process that was stopped and goes on is interrupted in it.
fn is_wait(error: &Error) -> bool {
    let Error::Io(error) = error else { return false };
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// Says why, and goes, whether it is heard or not.
fn close(socket: &mut Socket, (code, words): Farewell) {
    let frame = CloseFrame { code, reason: Utf8Bytes::from_static(words) };
    let until = Instant::now() + PATIENCE / 6;
    socket.get_mut().until = until;
    let _ = socket.close(Some(frame));
    let _ = socket.flush();
    let _ = socket.get_ref().stream.shutdown(std::net::Shutdown::Write);
    // What is still on the way is read, so that the words are not thrown away with the connection.
    while Instant::now() < until && read(socket, until).is_ok_and(|message| !message.is_close()) {}
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::client::Picture;

    #[test]
    fn a_page_may_send_one_message_per_picture_and_no_flood() {
        let begin = Instant::now();
        let mut allowance = Allowance::new(begin);
        let of_a_page = (0_u64..2400).all(|n| allowance.take(begin + Duration::from_micros(8333 * n)));
        assert!(of_a_page, "20 s at 120 Hz");
        let mut flood = Allowance::new(begin);
        let taken = (0..1000).take_while(|_| flood.take(begin)).count();
        assert_eq!(taken, BURST as usize);
        assert!(flood.take(begin + Duration::from_secs(10)), "it fills again");
    }

    #[test]
    fn a_hand_behind_a_slow_link_is_heard_at_once() {
        let (sender, wishes) = std::sync::mpsc::channel();
        let hub = Hub::new(crate::guard::Token::new().unwrap(), sender);
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let far = listener.accept().unwrap().0;
        let mut hand = WebSocket::from_raw_socket(near.try_clone().unwrap(), Role::Client, None);
        let mut say = |message| hand.send(Message::Text(Value::to_string(&message).into())).unwrap();
        say(json!({ "do": "enter", "token": hub.token.text() }));
        std::thread::scope(|scope| {
            scope.spawn(|| serve(far, Vec::new(), &hub));
            // Some of what is shown is read now and then, and there is always more.
            scope.spawn(|| {
                let mut part = vec![0; 64 << 10];
                while (&near).read(&mut part).is_ok_and(|count| count > 0) {
                    std::thread::sleep(Duration::from_millis(5));
                }
            });
            scope.spawn(|| {
                let bytes = bytes::Bytes::from(vec![0; 128 << 10]);
                while !hub.wait(Duration::from_millis(1)) {
                    [Picture::Topology, Picture::Surface, Picture::Tools]
                        .iter()
                        .for_each(|&kind| hub.show(kind, &bytes));
                }
            });
            // What the system holds between the two is full.
            while hub.traffic().1 < 16 << 20 {
                std::thread::yield_now();
            }
            for time in 0..200 {
                say(json!({ "do": "seek", "time": time }));
            }
            let begin = Instant::now();
            let heard = || wishes.recv_timeout(Duration::from_secs(2).saturating_sub(begin.elapsed())).ok();
            let count = std::iter::from_fn(heard).take(200).count();
            hub.end();
            assert_eq!(count, 200, "heard at once");
        });
    }
}
