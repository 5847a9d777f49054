//! A page in the browser that shows a session: the body, the tools, the forces, and strips of what every tick did. A visitor pushes
//! the body with a mouse, a finger or a pen.
//!
//! ```no_run
//! use palpate::prelude::*;
//!
//! # fn main() -> Result<(), Error> {
//! let running = Session::from_scene(Scene::demo()).endless().share_records().build()?.start()?;
//! let server = palpate_view::serve(running, &palpate_view::Options::default())?;
//! println!("open {}", server.url());
//! server.wait();
//! # Ok(())
//! # }
//! ```
//!
//! The server runs off the real-time threads. It takes what it shows from the session's wait-free views and from its logger; a
//! browser that is slow is shown the newest picture and costs nobody anything. It listens to this machine alone unless it is told
//! otherwise, and lets in who knows the token of its address.
//!
//! | module | what it is |
//! | --- | --- |
//! | `server` | listens, answers, holds the threads together |
//! | `guard`, `http`, `socket` | who may come in; one request; one browser |
//! | `wish` | what a page may say |
//! | `hub`, `client` | where the threads meet; what waits for one browser |
//! | `stage`, `subject`, `live`, `tuning` | the session's thread; what it is made of; what is shown of it; what is changed of it |
//! | `playback` | a log in place of a session |
//! | `frames`, `samples` | pictures and ticks in bytes |
//! | `recent` | the newest minute, as a log |
//! | `page` | html, style and script |

mod client;
mod frames;
mod guard;
mod http;
mod hub;
mod live;
mod options;
mod page;
mod playback;
mod recent;
mod samples;
mod server;
mod socket;
mod stage;
mod subject;
mod tuning;
mod wish;

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SendError, channel};

use palpate::session::Running;
use palpate::{Error, ErrorKind};

pub use options::Options;
pub use server::Server;
pub use subject::{Pushed, numbered};

use guard::Token;
use hub::Hub;
use playback::Playback;
use server::Door;
use stage::Stage;
use wish::Wish;

/// Shows a session that runs, and ends it with the server. Strips need a session that
/// [shares its records](palpate::session::SessionBuilder::share_records); a tool can be pushed if its device is a
/// [pointer](palpate::devices::Pointer).
///
/// # Errors
/// [`ErrorKind::Runtime`] if it cannot listen, or if the system has no random numbers for a token, with the
/// session, which goes on. Where it is dropped it ends, and `?` makes an [`Error`] of what is left.
///
/// # Real-time
/// Not for a tick: starts threads. The session's own are never waited for.
pub fn serve(running: Running, options: &Options) -> Result<Server, NotServed> {
    // Handed over once everything that can fail has not.
    let (sender, session) = channel::<Running>();
    let start = || {
        let (door, hub, wishes) = prepare(options)?;
        let shared = Arc::clone(&hub);
        let show = move || Stage::of_running(shared, wishes, session.recv().ok()?).run();
        Server::start(door, hub, show)
    };
    let not_served = |running, error| NotServed { error, running: Box::new(running) };
    match start() {
        Err(error) => Err(not_served(running, error)),
        Ok(server) => match sender.send(running) {
            Ok(()) => Ok(server),
            Err(SendError(running)) => {
                let gone = "the thread of the page is gone";
                Err(not_served(running, Error::new(ErrorKind::Runtime, gone.to_owned())))
            }
        },
    }
}

/// Why a session is not shown; it goes on.
#[derive(Debug)]
pub struct NotServed {
    /// What was in the way.
    pub error: Error,
    /// The session.
    pub running: Box<Running>,
}

impl fmt::Display for NotServed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for NotServed {}

impl From<NotServed> for Error {
    /// Ends the session.
    fn from(not_served: NotServed) -> Self {
        not_served.error
    }
}

/// Shows a scene: starts a session of it, and another in its place when a visitor resets it. Friction, stiffness and local model change
/// while it runs.
///
/// # Errors
/// Those of [`serve`], and if the scene cannot be run.
///
/// # Real-time
/// Not for a tick: starts threads.
pub fn serve_scene(pushed: Pushed, options: &Options) -> Result<Server, Error> {
    let (door, hub, wishes) = prepare(options)?;
    let stage = Stage::of_scene(Arc::clone(&hub), wishes, pushed)?;
    Server::start(door, hub, move || stage.run())
}

/// Shows a log with pictures (topic `/scene`): a visitor plays it, steps through it, slower and faster.
///
/// # Errors
/// Those of [`serve`]; [`ErrorKind::Io`] and [`ErrorKind::Log`] if the log cannot be
/// read or has no pictures.
///
/// # Real-time
/// Not for a tick: reads a file, starts threads.
pub fn serve_log(log: &Path, options: &Options) -> Result<Server, Error> {
    let playback = Playback::open(log)?;
    let (door, hub, wishes) = prepare(options)?;
    let shared = Arc::clone(&hub);
    let show = move || {
        playback.run(&shared, &wishes);
        None
    };
    Server::start(door, hub, show)
}

/// What every server has before there is anything to show.
type Prepared = (Door, Arc<Hub>, Receiver<(u64, Wish)>);

fn prepare(options: &Options) -> Result<Prepared, Error> {
    let door = Door::open(options)?;
    let (sender, wishes) = channel();
    Ok((door, Arc::new(Hub::new(Token::new()?, sender)), wishes))
}
