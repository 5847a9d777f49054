//! The server: listens, gives out the page, and holds the threads together.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use palpate::session::Summary;
use palpate::{Error, ErrorKind};

use crate::guard::Hosts;
use crate::http::{self, Answer, Request};
use crate::hub::{Hub, locked};
use crate::options::Options;
use crate::{page, socket};

/// Connections at a time, of all kinds; more are closed at once.
const MOST_CONNECTIONS: usize = 16;
/// What a connection's thread needs.
const STACK: usize = 256 << 10;
/// When no connection can be taken, because files or memory are short.
const PAUSE: Duration = Duration::from_millis(50);

/// A server that shows a session. Dropping it ends it, and its session.
pub struct Server {
    hub: Arc<Hub>,
    address: SocketAddr,
    stage: Option<JoinHandle<Option<Summary>>>,
    accepting: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Server {
    /// Without the token, which is no matter for a log.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("address", &self.address).finish_non_exhaustive()
    }
}

/// A place to listen at, before there is anything to show.
pub(crate) struct Door {
    listener: TcpListener,
    address: SocketAddr,
    title: String,
}

impl Door {
    /// Listens as `options` say.
    ///
    /// # Errors
    /// [`ErrorKind::Runtime`] if the port is taken, or the address is not one of this machine's.
    pub(crate) fn open(options: &Options) -> Result<Self, Error> {
        let wanted = SocketAddr::new(options.listen, options.port);
        let failed = |error: std::io::Error| {
            Error::new(
                ErrorKind::Runtime,
                format!("cannot listen on {wanted}: {error}; choose another --port or --listen"),
            )
        };
        let listener = TcpListener::bind(wanted).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, address, title: options.title.clone() })
    }
}

impl Server {
    /// Lets visitors in by `door`, and runs `stage` on a thread of its own.
    pub(crate) fn start(
        door: Door,
        hub: Arc<Hub>,
        stage: impl FnOnce() -> Option<Summary> + Send + 'static,
    ) -> Result<Self, Error> {
        let Door { listener, address, title } = door;
        let failed = |error| Error::new(ErrorKind::Runtime, format!("no thread for the page: {error}"));
        let shared = Arc::clone(&hub);
        let accept = move || accept(&listener, &shared, address, &title);
        let accepting = std::thread::Builder::new().name("view-accept".into()).spawn(accept).map_err(failed)?;
        let ends = Ends(Arc::clone(&hub));
        let run = move || {
            let _ends = ends;
            stage()
        };
        let stage = std::thread::Builder::new().name("view".into()).spawn(run).map_err(failed)?;
        Ok(Self { hub, address, stage: Some(stage), accepting: Some(accepting) })
    }

    /// The address for a browser, with the token that lets it in.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn url(&self) -> String {
        format!("http://{}/#{}", self.shown_address(), self.hub.token.text())
    }

    /// The address that it listens on.
    ///
    /// # Real-time
    /// Not for a tick.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// An address that a browser can open: one that stands for all of a machine's is no place.
    fn shown_address(&self) -> SocketAddr {
        let mut shown = self.address;
        if shown.ip().is_unspecified() {
            shown.set_ip(match shown.ip() {
                std::net::IpAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
                std::net::IpAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
            });
        }
        shown
    }

    /// Waits for `span`; true if the server has ended meanwhile, by [`stopper`](Self::stopper).
    ///
    /// # Real-time
    /// Not for a tick: blocks.
    pub fn wait_for(&self, span: Duration) -> bool {
        self.hub.wait(span)
    }

    /// Waits until the server is ended by [`stopper`](Self::stopper).
    ///
    /// # Real-time
    /// Not for a tick: blocks.
    pub fn wait(&self) {
        while !self.hub.wait(Duration::from_secs(3600)) {}
    }

    /// Ends the server from another thread, or from that of a signal's handler.
    ///
    /// # Real-time
    /// Not for a tick: what it gives may block.
    pub fn stopper(&self) -> impl Fn() + Send + 'static {
        let hub = Arc::clone(&self.hub);
        move || hub.end()
    }

    /// Browsers that are shown something, bytes that they were sent and messages that newer ones replaced.
    ///
    /// # Real-time
    /// Not for a tick: may block.
    pub fn traffic(&self) -> (usize, u64, u64) {
        self.hub.traffic()
    }

    /// Ends the server and the session, and says how that went; `None` for a log, or after a fault of the session's thread.
    ///
    /// # Real-time
    /// Not for a tick: blocks.
    pub fn stop(mut self) -> Option<Summary> {
        self.end()
    }

    fn end(&mut self) -> Option<Summary> {
        self.hub.end();
        // A knock at the own door: whoever waits there sees that it is over. Where the address has gone from this machine nobody hears
        // it, and nobody is waited for.
        let knocked = TcpStream::connect_timeout(&self.shown_address(), Duration::from_secs(1));
        if let Some(accepting) = self.accepting.take().filter(|_| knocked.is_ok()) {
            let _ = accepting.join();
        }
        self.stage.take().and_then(|stage| stage.join().ok().flatten())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
    }
}

/// Ends the server with the session's thread, also when that panics: nobody waits for what does not come.
struct Ends(Arc<Hub>);

impl Drop for Ends {
    fn drop(&mut self) {
        self.0.end();
    }
}

fn accept(listener: &TcpListener, hub: &Arc<Hub>, address: SocketAddr, title: &str) {
    // Each connection holds one of these.
    let places = Arc::new(());
    let title: Arc<str> = title.into();
    while !hub.is_over() {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(PAUSE);
            continue;
        };
        if hub.is_over() || Arc::strong_count(&places) > MOST_CONNECTIONS {
            continue;
        }
        let (place, hub, title) = (Arc::clone(&places), Arc::clone(hub), Arc::clone(&title));
        let serve = move || {
            let _held = place;
            serve(stream, &hub, Hosts(address), &title)
        };
        // Without a thread there is no answer; the browser tries again.
        let _ = std::thread::Builder::new().name("view-browser".into()).stack_size(STACK).spawn(serve);
    }
}

/// One connection, to its end. A browser that goes in the middle is no error.
fn serve(mut stream: TcpStream, hub: &Hub, hosts: Hosts, title: &str) {
    let Some(request) = http::read(&mut stream) else { return };
    let refusal = |status, words| Answer::refusal(status, words);
    let refused = match (request.method.as_str(), request.path.as_str()) {
        _ if !hosts.allow(&request.host) => {
            refusal("421 Misdirected Request", "open the address that the command printed\n")
        }
        ("GET", "/") => return give_page(&mut stream, &request, title),
        ("GET", "/socket") if !is_own_page(&request) => {
            refusal("403 Forbidden", "only the page of this server may open its socket\n")
        }
        ("GET", "/socket") => match &request.key {
            Some(key) => {
                if http::accept(&mut stream, key).is_ok() {
                    let _ = socket::serve(stream, request.rest, hub);
                }
                return;
            }
            None => refusal("426 Upgrade Required", "this is a WebSocket of version 13\n"),
        },
        ("GET", "/log") if is_admitted(&request, hub) => return give_log(&mut stream, hub),
        ("GET", "/log") => refusal("403 Forbidden", "the log is for the page of this server\n"),
        ("GET", _) => refusal("404 Not Found", "there is nothing here\n"),
        _ => refusal("405 Method Not Allowed", "only GET\n"),
    };
    let _ = http::answer(&mut stream, &refused);
}

/// Browsers name the page that opens a socket, whatever that page wants.
fn is_own_page(request: &Request) -> bool {
    request.origin.as_deref().is_some_and(|origin| Hosts::is_same_origin(origin, &request.host))
}

/// A page elsewhere can neither know the token nor send this header.
fn is_admitted(request: &Request, hub: &Hub) -> bool {
    let told = request.authorization.as_deref().and_then(|told| told.strip_prefix("Bearer "));
    told.is_some_and(|token| hub.token.is(token)) && request.origin.as_deref().is_none_or(|_| is_own_page(request))
}

fn give_page(stream: &mut TcpStream, request: &Request, title: &str) {
    // The token is needed for what is shown, not for the empty page.
    if let Ok((page, head)) = page::page(title, &request.host) {
        let answer = Answer { status: "200 OK", content_type: "text/html; charset=utf-8", head, body: page.as_bytes() };
        let _ = http::answer(stream, &answer);
    }
}

fn give_log(stream: &mut TcpStream, hub: &Hub) {
    // The copy is made under the lock, the log of it is not.
    let recent = locked(&hub.recent).clone();
    match recent.log() {
        Ok(Some(log)) => {
            let head = "Content-Disposition: attachment; filename=\"palpate-view.mcap\"\r\n".to_owned();
            let answer = Answer { status: "200 OK", content_type: "application/octet-stream", head, body: &log };
            let _ = http::answer(stream, &answer);
        }
        _ => drop(http::answer(stream, &Answer::refusal("404 Not Found", "nothing was recorded\n"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guard::Token;

    #[test]
    fn a_server_whose_address_has_gone_ends_all_the_same() {
        let mut door = Door::open(&Options::default()).unwrap();
        let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        door.address = gone;
        let hub = Arc::new(Hub::new(Token::new().unwrap(), std::sync::mpsc::channel().0));
        let server = Server::start(door, hub, || None).unwrap();
        let (tell, told) = std::sync::mpsc::channel();
        std::thread::spawn(move || tell.send(server.stop().is_none()));
        assert_eq!(told.recv_timeout(Duration::from_secs(3)), Ok(true), "it does not end");
    }
}
