//! One request of a connection, and the answer: three paths, no names of files, nothing kept.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The head of a request: browsers send about 700 bytes.
const MOST_BYTES: usize = 8 << 10;
const MOST_HEADERS: usize = 40;
/// Whoever has not said by then what is wanted is not waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);

/// What a browser asks for.
#[derive(Debug, Default)]
pub(crate) struct Request {
    pub(crate) method: String,
    pub(crate) path: String,
    pub(crate) host: String,
    pub(crate) origin: Option<String>,
    pub(crate) authorization: Option<String>,
    /// The key of a request for a WebSocket of version 13.
    pub(crate) key: Option<String>,
    /// What came after the head.
    pub(crate) rest: Vec<u8>,
}

/// Reads the head of a request; `None` for one that is none, that is too long or that does not come.
pub(crate) fn read(stream: &mut TcpStream) -> Option<Request> {
    let (begin, mut bytes) = (Instant::now(), Vec::new());
    loop {
        // However it is spread: one byte a second is no way to hold a connection.
        let left = PATIENCE.checked_sub(begin.elapsed()).filter(|left| !left.is_zero())?;
        stream.set_read_timeout(Some(left)).ok()?;
        let mut part = [0; 2048];
        let count = stream.read(&mut part).ok().filter(|count| *count > 0)?;
        bytes.extend_from_slice(&part[..count]);
        match parse(&bytes) {
            Ok(Some(request)) => return Some(request),
            Ok(None) if bytes.len() < MOST_BYTES => {}
            _ => return None,
        }
    }
}

/// The request that `bytes` begin with; `None` if its head is not complete.
fn parse(bytes: &[u8]) -> Result<Option<Request>, httparse::Error> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let httparse::Status::Complete(length) = parsed.parse(bytes)? else { return Ok(None) };
    let mut request = Request {
        method: parsed.method.unwrap_or_default().to_owned(),
        path: parsed.path.unwrap_or_default().to_owned(),
        rest: bytes[length..].to_vec(),
        ..Request::default()
    };
    let (mut key, mut is_upgrade, mut is_version) = (None, false, false);
    let mut hosts = 0;
    for header in parsed.headers {
        let value = std::str::from_utf8(header.value).map_err(|_| httparse::Error::HeaderValue)?.to_owned();
        match header.name.to_ascii_lowercase().as_str() {
            "host" => (hosts, request.host) = (hosts + 1, value),
            "origin" => request.origin = Some(value),
            "authorization" => request.authorization = Some(value),
            "upgrade" => is_upgrade = value.eq_ignore_ascii_case("websocket"),
            "sec-websocket-version" => is_version = value == "13",
            "sec-websocket-key" => key = Some(value),
            _ => {}
        }
    }
    if hosts != 1 {
        return Err(httparse::Error::HeaderValue);
    }
    request.key = key.filter(|_| is_upgrade && is_version);
    Ok(Some(request))
}

/// An answer, after which the connection ends.
pub(crate) struct Answer<'a> {
    pub(crate) status: &'static str,
    pub(crate) content_type: &'static str,
    /// Lines of the head besides the usual ones, each with its end.
    pub(crate) head: String,
    pub(crate) body: &'a [u8],
}

impl Answer<'static> {
    /// A refusal in words.
    pub(crate) fn refusal(status: &'static str, words: &'static str) -> Self {
        Self { status, content_type: "text/plain; charset=utf-8", head: String::new(), body: words.as_bytes() }
    }
}

/// Sends `answer` and ends the connection.
pub(crate) fn answer(stream: &mut TcpStream, answer: &Answer<'_>) -> io::Result<()> {
    let Answer { status, content_type, head, body } = answer;
    stream.set_write_timeout(Some(PATIENCE))?;
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nContent-Length: {length}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n{head}\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()?;
    stream.shutdown(std::net::Shutdown::Write)
}

/// The answer that makes a connection a WebSocket.
pub(crate) fn accept(stream: &mut TcpStream, key: &str) -> io::Result<()> {
    let accepted = tungstenite::handshake::derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accepted}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_is_read_whole_or_not_at_all() {
        let head = "GET /socket HTTP/1.1\r\nHost: a:1\r\nUpgrade: WebSocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: k\r\n\r\n";
        let request = parse(format!("{head}more").as_bytes()).unwrap().unwrap();
        assert_eq!((request.path.as_str(), request.host.as_str()), ("/socket", "a:1"));
        assert_eq!((request.key.as_deref(), request.rest.as_slice()), (Some("k"), &b"more"[..]));
        for cut in 0..head.len() {
            assert!(matches!(parse(&head.as_bytes()[..cut]), Ok(None)), "{cut}");
        }
    }

    #[test]
    fn a_request_without_one_host_or_with_too_many_headers_is_none() {
        assert!(parse(b"GET / HTTP/1.1\r\n\r\n").is_err());
        assert!(parse(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").is_err());
        let many: String = (0..MOST_HEADERS + 1).map(|n| format!("x{n}: y\r\n")).collect();
        assert!(parse(format!("GET / HTTP/1.1\r\n{many}\r\n").as_bytes()).is_err());
        assert!(parse(b"\x16\x03\x01\x02\x00\x01\x00").is_err(), "TLS");
    }

    #[test]
    fn an_old_version_of_the_protocol_gets_no_socket() {
        let head = "GET /socket HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 8\r\nSec-WebSocket-Key: k\r\n\r\n";
        assert_eq!(parse(head.as_bytes()).unwrap().unwrap().key, None);
    }
}
