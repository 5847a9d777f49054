//! A connection to the service: tungstenite over TCP, so that a look at it never waits and costs no more than it must.
//!
//! Buffers are made once. A message that is received shares the buffer of its connection and gives it back when it is dropped;
//! one that is sent is written into a buffer of its own that comes back the same way. So an exchange allocates nothing.

use bytes::{BufMut, Bytes, BytesMut};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};
#[cfg(any(test, feature = "mock"))]
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
#[cfg(any(test, feature = "mock"))]
use tungstenite::http::StatusCode;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, HandshakeError, Message, WebSocket};

/// Longest message that is believed: an inventory of many devices has some ten kilobytes.
const MAX_MESSAGE: usize = 64 * 1024;

/// Bytes that one look takes: a service that talks without an end, in frames of no length, keeps no tick.
const MOST_PER_LOOK: usize = MAX_MESSAGE + 1024;

/// Messages without content, such as pings, that one look takes.
const MOST_EMPTY: u32 = 64;

/// For connecting and for the handshake; never in a tick.
const PATIENCE: Duration = Duration::from_secs(2);

/// The socket below, with limits on what it gives.
#[derive(Debug)]
struct Limited {
    stream: TcpStream,
    /// Bytes until the next look.
    left: usize,
    /// When the handshake must be over.
    until: Option<Instant>,
}

impl Read for Limited {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let most = into.len().min(self.left);
        if most == 0 || self.until.is_some_and(|until| Instant::now() > until) {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let count = self.stream.read(&mut into[..most])?;
        self.left -= count;
        Ok(count)
    }
}

impl Write for Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// One end of a connection.
#[derive(Debug)]
pub(crate) struct Wire {
    socket: WebSocket<Limited>,
    output: BytesMut,
}

/// Why a connection is of no use any more, as the end of a sentence that begins with its other side.
#[derive(Debug)]
pub(crate) struct Broken(Error);

impl std::fmt::Display for Broken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        use tungstenite::error::ProtocolError::ResetWithoutClosingHandshake;
        match &self.0 {
            Error::ConnectionClosed | Error::AlreadyClosed | Error::Protocol(ResetWithoutClosingHandshake) => {
                f.write_str("closed the connection")
            }
            Error::Io(error) => write!(f, "is unreachable ({})", error.kind()),
            error => write!(f, "broke the WebSocket protocol ({error})"),
        }
    }
}

impl From<io::Error> for Broken {
    fn from(error: io::Error) -> Self {
        Self(Error::Io(error))
    }
}

fn config() -> WebSocketConfig {
    // A frame goes out with the call that writes it, in one piece.
    WebSocketConfig::default()
        .read_buffer_size(MAX_MESSAGE)
        .write_buffer_size(0)
        .max_write_buffer_size(2 * MAX_MESSAGE)
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE))
}

/// The stream of a handshake that has [`PATIENCE`].
fn limited(stream: TcpStream) -> io::Result<Limited> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    Ok(Limited { stream, left: MOST_PER_LOOK, until: Some(Instant::now() + PATIENCE) })
}

impl Wire {
    /// Connects to `address`, `host:port` with or without `ws://`.
    pub(crate) fn connect(address: &str) -> io::Result<Self> {
        let host = address.strip_prefix("ws://").unwrap_or(address).trim_end_matches('/');
        let mut result = Err(io::Error::new(io::ErrorKind::NotFound, "the name has no address"));
        for address in host.to_socket_addrs()? {
            result = TcpStream::connect_timeout(&address, PATIENCE);
            if result.is_ok() {
                break;
            }
        }
        let made = tungstenite::client::client_with_config(format!("ws://{host}/"), limited(result?)?, Some(config()));
        Ok(Self::over(made.map_err(refused)?.0))
    }

    /// Answers a client that has connected.
    #[cfg(any(test, feature = "mock"))]
    pub(crate) fn accept(stream: TcpStream) -> io::Result<Self> {
        let made = tungstenite::accept_hdr_with_config(limited(stream)?, native, Some(config()));
        Ok(Self::over(made.map_err(refused)?))
    }

    fn over(mut socket: WebSocket<Limited>) -> Self {
        socket.get_mut().until = None;
        Self { socket, output: BytesMut::with_capacity(4096) }
    }

    /// A second writer on a client's connection. A frame is one call of the system, so that two writers do not mix theirs.
    pub(crate) fn second(&self) -> io::Result<Self> {
        let limited = Limited { stream: self.socket.get_ref().stream.try_clone()?, left: 0, until: None };
        Ok(Self::over(WebSocket::from_raw_socket(limited, Role::Client, Some(config().read_buffer_size(0)))))
    }

    /// From now on receiving only looks, and sending gives up at once.
    pub(crate) fn never_block(&self) -> io::Result<()> {
        self.socket.get_ref().stream.set_nonblocking(true)
    }

    /// How long receiving waits, about: the system counts in ticks of its own, up to 4 ms long.
    pub(crate) fn block_for(&self, timeout: Duration) -> io::Result<()> {
        self.socket.get_ref().stream.set_read_timeout(Some(timeout))
    }

    /// Sends one text message that `write` appends to an empty buffer.
    pub(crate) fn send<T>(&mut self, write: impl FnOnce(&mut dyn Write) -> T) -> Result<T, Broken> {
        let written = write(&mut (&mut self.output).writer());
        let text = self.output.split().try_into().map_err(|error| Broken(Error::from(error)))?;
        let sent = self.socket.send(Message::Text(text));
        self.output.reserve(1024);
        sent.map_err(Broken)?;
        Ok(written)
    }

    /// Sends `text` as one message.
    #[cfg(any(test, feature = "mock"))]
    pub(crate) fn say(&mut self, text: &str) -> Result<(), Broken> {
        self.socket.send(text.into()).map_err(Broken)
    }

    /// Receives one message; `None` if there is none yet. It is to be dropped before the next one is received.
    pub(crate) fn receive(&mut self) -> Result<Option<Bytes>, Broken> {
        self.socket.get_mut().left = MOST_PER_LOOK;
        for _ in 0..MOST_EMPTY {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(Some(text.into())),
                Ok(Message::Binary(bytes)) => return Ok(Some(bytes)),
                Ok(Message::Close(_)) => return Err(Broken(Error::ConnectionClosed)),
                Ok(_) => {}
                Err(Error::Io(error)) if is_none_yet(error.kind()) && self.socket.get_ref().left > 0 => {
                    return Ok(None);
                }
                Err(Error::Io(error)) if is_none_yet(error.kind()) => break,
                Err(error) => return Err(Broken(error)),
            }
        }
        // It talks without saying anything.
        Err(Broken(Error::AttackAttempt))
    }

    /// Says goodbye; whether it arrives does not matter.
    pub(crate) fn close(&mut self) {
        let _ = self.socket.close(None);
        let _ = self.socket.get_ref().stream.shutdown(Shutdown::Both);
    }
}

/// Refuses the page of a browser, which says where it is from: any site could otherwise push a hand on this machine.
#[cfg(any(test, feature = "mock"))]
#[expect(clippy::result_large_err, reason = "the type is tungstenite's")]
fn native(request: &Request, response: Response) -> Result<Response, ErrorResponse> {
    if !request.headers().contains_key("origin") {
        return Ok(response);
    }
    let mut refusal = ErrorResponse::new(Some("pages of a browser are not served".to_owned()));
    *refusal.status_mut() = StatusCode::FORBIDDEN;
    Err(refusal)
}

fn is_none_yet(kind: io::ErrorKind) -> bool {
    matches!(kind, io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn refused<H: tungstenite::handshake::HandshakeRole>(error: HandshakeError<H>) -> io::Error {
    match error {
        HandshakeError::Interrupted(_) => io::Error::new(io::ErrorKind::TimedOut, "its handshake has no end"),
        HandshakeError::Failure(Error::Io(error)) => error,
        HandshakeError::Failure(error) => {
            io::Error::new(io::ErrorKind::InvalidData, format!("it is no WebSocket server: {error}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    /// A client, the service's end of its connection, and the socket below that.
    fn pair() -> (Wire, Wire, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}/", listener.local_addr().unwrap());
        let server = std::thread::spawn(move || Wire::accept(listener.accept().unwrap().0).unwrap());
        let (client, server) = (Wire::connect(&address).unwrap(), server.join().unwrap());
        let raw = server.socket.get_ref().stream.try_clone().unwrap();
        (client, server, raw)
    }

    fn lost(client: &mut Wire) -> String {
        client.receive().unwrap_err().to_string()
    }

    #[test]
    fn messages_arrive_as_they_were_sent_from_both_writers_of_a_client_too() {
        let (mut client, mut server, _) = pair();
        for length in [0, 1, 125, 126, 1000, 65535, MAX_MESSAGE] {
            let text = "haply".repeat(length)[..length].to_owned();
            client.send(|out| out.write_all(text.as_bytes())).unwrap().unwrap();
            client.second().unwrap().say("zero").unwrap();
            assert_eq!(server.receive().unwrap().unwrap(), text);
            assert_eq!(server.receive().unwrap().unwrap(), "zero");
            server.say(&text).unwrap();
            assert_eq!(client.receive().unwrap().unwrap(), text);
        }
    }

    #[test]
    fn a_message_in_parts_with_a_ping_between_them_is_one_message() {
        let (mut client, mut server, mut raw) = pair();
        raw.write_all(b"\x01\x03abc\x89\x02hi\x80\x03def").unwrap();
        assert_eq!(client.receive().unwrap().unwrap(), "abcdef");
        // The answer to the ping is no message.
        server.block_for(Duration::from_millis(20)).unwrap();
        assert_eq!(server.receive().unwrap(), None);
    }

    #[test]
    fn what_is_no_websocket_is_refused_and_an_end_is_an_end() {
        let (mut client, server, raw) = pair();
        drop((server, raw));
        assert_eq!(lost(&mut client), "closed the connection");
        let (mut client, mut server, _) = pair();
        server.close();
        assert_eq!(lost(&mut client), "closed the connection");
        for bytes in
            [&b"HTTP/1.1 400 Bad Request\r\n\r\n"[..], b"\x81\x7f\0\0\0\0\0\x01\0\x01", b"\x81\x80abcd", b"\x83\x00"]
        {
            let (mut client, _server, mut raw) = pair();
            // Enough of it for whatever length it seems to name.
            raw.write_all(&bytes.repeat(8)).unwrap();
            assert!(lost(&mut client).starts_with("broke the WebSocket protocol"), "{bytes:?}");
        }
    }

    /// Frames of no length, parts that never become a message, and pings: a look comes back, and soon.
    #[test]
    fn a_service_that_talks_without_an_end_and_says_nothing_is_given_up() {
        for (begin, more) in [(&b"\x01\x00"[..], &b"\x00\x00"[..]), (b"", b"\x89\x00")] {
            let (mut client, _server, mut raw) = pair();
            client.never_block().unwrap();
            let talks = std::thread::spawn(move || {
                let _ = raw.write_all(begin);
                while raw.write_all(&more.repeat(4096)).is_ok() {}
            });
            std::thread::sleep(Duration::from_millis(100));
            assert!(lost(&mut client).contains("Attack"));
            client.close();
            drop(client);
            talks.join().unwrap();
        }
    }
}
