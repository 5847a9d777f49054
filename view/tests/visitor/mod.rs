//! A visitor without a browser: asks for the page, opens the socket, reads what is shown.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use palpate::prelude::*;
use palpate_view::{Options, Pushed, Server};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Error, HandshakeError, Message, WebSocket};

/// No test waits longer for what must come.
pub const PATIENCE: Duration = Duration::from_secs(40);

/// A server of a small body under a pointer, with its token.
pub fn server() -> (Server, String) {
    let mut scene = Scene::demo();
    scene = scene.with_model(palpate::model::local::Kind::Hold);
    let server = palpate_view::serve_scene(Pushed::new(scene), &Options::default()).unwrap();
    let token = server.url().split_once('#').unwrap().1.to_owned();
    (server, token)
}

/// The answer to a request with these lines of its head.
pub fn ask(address: SocketAddr, head: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let _ = stream.write_all(format!("{head}\r\n\r\n").as_bytes());
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// Opens the socket as a page of `origin` would.
pub fn open(address: SocketAddr, origin: Option<&str>) -> Result<WebSocket<TcpStream>, String> {
    let stream = TcpStream::connect(address).map_err(|error| error.to_string())?;
    let mut request = format!("ws://{address}/socket").into_client_request().unwrap();
    if let Some(origin) = origin {
        request.headers_mut().insert("Origin", origin.parse().unwrap());
    }
    match tungstenite::client(request, stream) {
        Ok((socket, _)) => {
            socket.get_ref().set_read_timeout(Some(Duration::from_millis(200))).unwrap();
            socket.get_ref().set_write_timeout(Some(PATIENCE)).unwrap();
            Ok(socket)
        }
        Err(HandshakeError::Failure(Error::Http(answer))) => Err(answer.status().as_u16().to_string()),
        Err(error) => Err(error.to_string()),
    }
}

/// A visitor that knows the token.
pub fn enter(server: &Server, token: &str) -> WebSocket<TcpStream> {
    visit(server, &format!(r#"{{"do":"enter","token":"{token}"}}"#))
}

/// The page with this key, by another connection.
pub fn enter_again(server: &Server, token: &str, key: &str) -> WebSocket<TcpStream> {
    visit(server, &format!(r#"{{"do":"enter","token":"{token}","again":"{key}"}}"#))
}

fn visit(server: &Server, words: &str) -> WebSocket<TcpStream> {
    let address = server.address();
    let mut socket = open(address, Some(&format!("http://{address}"))).unwrap();
    say(&mut socket, words);
    socket
}

pub fn say(socket: &mut WebSocket<TcpStream>, text: &str) {
    socket.send(Message::Text(text.into())).unwrap();
}

/// The next message that `wanted` takes for what it waits for; `None` when the server has closed.
pub fn find<T>(socket: &mut WebSocket<TcpStream>, mut wanted: impl FnMut(&Message) -> Option<T>) -> Option<T> {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        match socket.read() {
            Ok(Message::Close(_)) => return None,
            Ok(message) => {
                if let Some(found) = wanted(&message) {
                    return Some(found);
                }
            }
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return None,
        }
    }
    panic!("it did not come");
}

/// What the server says when it closes.
pub fn farewell(socket: &mut WebSocket<TcpStream>) -> Option<String> {
    farewell_with_code(socket).map(|(_, words)| words)
}

/// What the server says when it closes, and the code that says whether a page comes again by itself: not after 1008.
pub fn farewell_with_code(socket: &mut WebSocket<TcpStream>) -> Option<(u16, String)> {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        match socket.read() {
            Ok(Message::Close(frame)) => return frame.map(|frame| (frame.code.into(), frame.reason.to_string())),
            Ok(_) => {}
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return None,
        }
    }
    panic!("it does not close");
}

/// Time (s), position and pointer (m) of the first tool, if `message` is a picture of tools.
pub fn tool(message: &Message) -> Option<(f64, [f32; 3], [f32; 3])> {
    let Message::Binary(bytes) = message else { return None };
    (bytes[..4] == [2, 0, 0, 0]).then(|| {
        let float = |n: usize| f32::from_le_bytes(bytes[24 + 4 * n..][..4].try_into().unwrap());
        let vector = |n: usize| [float(n), float(n + 1), float(n + 2)];
        (f64::from_le_bytes(bytes[8..16].try_into().unwrap()), vector(0), vector(13))
    })
}

/// The key by which a page is known when it comes again.
pub fn key(message: &Message) -> Option<String> {
    told(message, "key")
}

/// The role that a visitor is told.
pub fn role(message: &Message) -> Option<String> {
    told(message, "role")
}

fn told(message: &Message, field: &str) -> Option<String> {
    let Message::Text(text) = message else { return None };
    let message: serde_json::Value = serde_json::from_str(text).unwrap();
    message.get(field).and_then(|value| value.as_str()).map(str::to_owned)
}
