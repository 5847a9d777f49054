//! The frames of RFC 6455 over TCP, for both sides, in buffers that are made once.
//!
//! Why not a crate: the well-kept ones hand out and take messages that own their memory, an allocation or two per message.

use super::handshake;
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// The body of a control frame has no more (bytes).
const MAX_CONTROL: usize = 125;
/// A receiver that has taken so many frames and has no message is being kept busy.
const MOST_FRAMES: u32 = 64;
/// Longest message: an inventory of many devices has some ten kilobytes.
const MAX_MESSAGE: usize = 64 * 1024;

/// For connecting and for the handshake; never in a tick.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);

/// Why a connection is of no use any more. `Copy`, so that a tick can pass it on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Broken {
    /// The other side closed it.
    Closed,
    /// The system reported an error.
    Io(io::ErrorKind),
    /// It does not follow the protocol.
    Protocol(&'static str),
}

impl std::fmt::Display for Broken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Closed => f.write_str("closed the connection"),
            Self::Io(kind) => write!(f, "is unreachable ({kind})"),
            Self::Protocol(what) => write!(f, "broke the WebSocket protocol ({what})"),
        }
    }
}

/// One end of a connection.
#[derive(Debug)]
pub(super) struct WebSocket {
    stream: TcpStream,
    /// What was received and not looked at yet: `input[start..end]`.
    input: Vec<u8>,
    start: usize,
    end: usize,
    /// The last message that was received in whole, or the parts of one.
    message: Vec<u8>,
    is_whole: bool,
    output: Vec<u8>,
    /// The state of the masks that a client puts on what it sends; a server has none.
    mask: Option<u64>,
}

/// Longest header: two bytes, eight of length, four of mask.
const MAX_HEADER: usize = 14;

const TEXT: u8 = 1;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;

impl WebSocket {
    /// Connects to `address`, `host:port` with or without `ws://`.
    pub(super) fn connect(address: &str) -> io::Result<Self> {
        let host = address.strip_prefix("ws://").unwrap_or(address).trim_end_matches('/');
        let mut result = Err(io::Error::new(io::ErrorKind::NotFound, "the name has no address"));
        for address in host.to_socket_addrs()? {
            result = TcpStream::connect_timeout(&address, PATIENCE);
            if result.is_ok() {
                break;
            }
        }
        let mut stream = result?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        // Keys that nobody can predict are asked for; the standard library has a source of them.
        let random = |n: u64| RandomState::new().hash_one(n);
        let mut nonce = [0; 16];
        nonce[..8].copy_from_slice(&random(0).to_be_bytes());
        nonce[8..].copy_from_slice(&random(1).to_be_bytes());
        handshake::ask(&mut stream, host, nonce)?;
        Ok(Self::over(stream, Some(random(2) | 1)))
    }

    /// Answers a client that has connected.
    pub(super) fn accept(mut stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        handshake::answer(&mut stream)?;
        Ok(Self::over(stream, None))
    }

    fn over(stream: TcpStream, mask: Option<u64>) -> Self {
        let message = Vec::with_capacity(MAX_MESSAGE);
        let output = Vec::with_capacity(4096);
        Self { stream, input: vec![0; 2 * MAX_MESSAGE], start: 0, end: 0, message, is_whole: true, output, mask }
    }

    /// A second writer on a client's connection. A frame is one call of the system, so that two writers do not mix theirs.
    pub(super) fn second(&self) -> io::Result<Self> {
        Ok(Self::over(self.stream.try_clone()?, Some(RandomState::new().hash_one(3) | 1)))
    }

    /// From now on receiving only looks, and sending gives up at once.
    pub(super) fn never_block(&self) -> io::Result<()> {
        self.stream.set_nonblocking(true)
    }

    /// How long receiving waits, about: the system counts in ticks of its own, up to 4 ms long.
    pub(super) fn block_for(&self, timeout: Duration) -> io::Result<()> {
        self.stream.set_read_timeout(Some(timeout))
    }

    /// Sends one text message that `write` appends to an empty buffer.
    pub(super) fn send(&mut self, write: impl FnOnce(&mut Vec<u8>)) -> Result<(), Broken> {
        self.output.clear();
        self.output.resize(MAX_HEADER, 0);
        write(&mut self.output);
        self.frame(TEXT)
    }

    /// Sends the buffer as one frame, with one system call.
    fn frame(&mut self, opcode: u8) -> Result<(), Broken> {
        let length = self.output.len() - MAX_HEADER;
        let masked = if self.mask.is_some() { 0x80 } else { 0 };
        let mut header = [0; MAX_HEADER];
        header[0] = 0x80 | opcode;
        let mut used = 2;
        match length {
            0..126 => header[1] = masked | length as u8,
            126..65536 => {
                header[1] = masked | 126;
                header[2..4].copy_from_slice(&(length as u16).to_be_bytes());
                used = 4;
            }
            _ => {
                header[1] = masked | 127;
                header[2..10].copy_from_slice(&(length as u64).to_be_bytes());
                used = 10;
            }
        }
        if let Some(state) = &mut self.mask {
            // xorshift64*: a new mask for every frame.
            *state ^= *state >> 12;
            *state ^= *state << 25;
            *state ^= *state >> 27;
            let key = ((state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32) as u32).to_be_bytes();
            header[used..used + 4].copy_from_slice(&key);
            used += 4;
            unmask(&mut self.output[MAX_HEADER..], key);
        }
        let begin = MAX_HEADER - used;
        self.output[begin..MAX_HEADER].copy_from_slice(&header[..used]);
        match self.stream.write(&self.output[begin..]) {
            Ok(sent) if sent == length + used => Ok(()),
            // Half a frame cannot be taken back, and a full buffer means that nobody reads.
            Ok(_) => Err(Broken::Io(io::ErrorKind::WouldBlock)),
            Err(error) => Err(Broken::Io(error.kind())),
        }
    }

    /// Receives one message; false if there is none yet.
    pub(super) fn receive(&mut self) -> Result<bool, Broken> {
        let mut frames = 0;
        loop {
            if self.next_frame(&mut frames)? {
                return Ok(true);
            }
            if self.start > 0 {
                self.input.copy_within(self.start..self.end, 0);
                (self.start, self.end) = (0, self.end - self.start);
            }
            match self.stream.read(&mut self.input[self.end..]) {
                Ok(0) => return Err(Broken::Closed),
                Ok(count) => self.end += count,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(false);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(Broken::Io(error.kind())),
            }
        }
    }

    /// The message that was received last.
    pub(super) fn message(&self) -> &[u8] {
        &self.message
    }

    /// Takes frames out of the input and counts them; true at the end of a message.
    fn next_frame(&mut self, frames: &mut u32) -> Result<bool, Broken> {
        while let Some((opcode, is_last, header, length)) = self.header()? {
            let body = self.start + header..self.start + header + length;
            if body.end > self.end {
                return Ok(false);
            }
            *frames += 1;
            if *frames > MOST_FRAMES {
                return Err(Broken::Protocol("too many frames without a message"));
            }
            if self.mask.is_none() {
                let key = &self.input[body.start - 4..body.start];
                let key = [key[0], key[1], key[2], key[3]];
                unmask(&mut self.input[body.clone()], key);
            }
            self.start = body.end;
            match opcode {
                0..=2 => {
                    if self.is_whole {
                        self.message.clear();
                    }
                    if self.message.len() + length > MAX_MESSAGE {
                        return Err(Broken::Protocol("a message is too long"));
                    }
                    self.message.extend_from_slice(&self.input[body]);
                    self.is_whole = is_last;
                    if is_last {
                        return Ok(true);
                    }
                }
                CLOSE => return Err(Broken::Closed),
                PING => {
                    self.output.clear();
                    self.output.resize(MAX_HEADER, 0);
                    self.output.extend_from_slice(&self.input[body]);
                    self.frame(PONG)?;
                }
                PONG => {}
                _ => return Err(Broken::Protocol("unknown kind of frame")),
            }
        }
        Ok(false)
    }

    /// Kind, whether it is the last part, length of the header with its mask, length of the body; `None` if it is not there yet.
    fn header(&self) -> Result<Option<(u8, bool, usize, usize)>, Broken> {
        let input = &self.input[self.start..self.end];
        let &[first, second, ..] = input else {
            return Ok(None);
        };
        let is_masked = second & 0x80 != 0;
        if first & 0x70 != 0 {
            return Err(Broken::Protocol("reserved bits are set"));
        }
        if is_masked == self.mask.is_some() {
            return Err(Broken::Protocol("the wrong side masks"));
        }
        let (length, header) = match (second & 0x7f, input) {
            (126, &[_, _, a, b, ..]) => (usize::from(u16::from_be_bytes([a, b])), 4),
            (127, &[_, _, a, b, c, d, e, f, g, h, ..]) => {
                let length = u64::from_be_bytes([a, b, c, d, e, f, g, h]);
                (usize::try_from(length).unwrap_or(usize::MAX), 10)
            }
            (126 | 127, _) => return Ok(None),
            (length, _) => (usize::from(length), 2),
        };
        if length > MAX_MESSAGE {
            return Err(Broken::Protocol("a message is too long"));
        }
        // RFC 6455, 5.5.
        if first & 0x08 != 0 && (length > MAX_CONTROL || first & 0x80 == 0) {
            return Err(Broken::Protocol("a control frame is too long or in parts"));
        }
        let header = header + if is_masked { 4 } else { 0 };
        Ok(Some((first & 0x0f, first & 0x80 != 0, header, length)))
    }

    /// Says goodbye; whether it arrives does not matter.
    pub(super) fn close(&mut self) {
        self.output.clear();
        self.output.resize(MAX_HEADER, 0);
        let _ = self.frame(CLOSE);
        let _ = self.stream.shutdown(std::net::Shutdown::Both);
    }
}

fn unmask(bytes: &mut [u8], key: [u8; 4]) {
    for (byte, key) in bytes.iter_mut().zip(key.iter().cycle()) {
        *byte ^= key;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    fn pair() -> (WebSocket, WebSocket) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}/", listener.local_addr().unwrap());
        let server = std::thread::spawn(move || WebSocket::accept(listener.accept().unwrap().0).unwrap());
        (WebSocket::connect(&address).unwrap(), server.join().unwrap())
    }

    #[test]
    fn messages_of_every_length_arrive_as_they_were_sent_in_both_directions() {
        let (mut client, mut server) = pair();
        for length in [0, 1, 125, 126, 250, 1000, 65535, MAX_MESSAGE] {
            let text: Vec<u8> = (0..length).map(|n| b'a' + (n % 26) as u8).collect();
            client.send(|out| out.extend_from_slice(&text)).unwrap();
            assert_eq!((server.receive(), server.message()), (Ok(true), &text[..]));
            server.send(|out| out.extend_from_slice(&text)).unwrap();
            assert_eq!((client.receive(), client.message()), (Ok(true), &text[..]));
        }
    }

    #[test]
    fn a_message_in_parts_with_a_ping_between_them_is_one_message() {
        let (mut client, mut server) = pair();
        server.stream.write_all(b"\x01\x03abc\x89\x02hi\x80\x03def").unwrap();
        assert_eq!((client.receive(), client.message()), (Ok(true), &b"abcdef"[..]));
        // The answer to the ping is no message.
        server.stream.set_nonblocking(true).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(server.receive(), Ok(false));
        client.send(|out| out.push(b'x')).unwrap();
        server.stream.set_nonblocking(false).unwrap();
        assert_eq!((server.receive(), server.message()), (Ok(true), &b"x"[..]));
    }

    #[test]
    fn what_is_no_websocket_is_refused_and_an_end_is_an_end() {
        let (mut client, server) = pair();
        drop(server);
        assert_eq!(client.receive(), Err(Broken::Closed));
        for bytes in [
            &b"HTTP/1.1 400 Bad Request\r\n\r\n"[..],
            b"\x81\x7f\xff\xff\xff\xff\xff\xff\xff\xff",
            b"\x81\x80abcd",
            b"\x83\x00",
        ] {
            let (mut client, mut server) = pair();
            server.stream.write_all(bytes).unwrap();
            assert!(matches!(client.receive(), Err(Broken::Protocol(_))), "{bytes:?}");
        }
        let (mut client, mut server) = pair();
        server.close();
        assert_eq!(client.receive(), Err(Broken::Closed));
        client.never_block().unwrap();
    }
}
