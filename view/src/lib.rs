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

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use palpate::Error;
use palpate::session::Running;

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
/// [`ErrorKind::Runtime`](palpate::ErrorKind::Runtime) if it cannot listen, or if the system has no random numbers for a token.
///
/// # Real-time
/// Not for a tick: starts threads. The session's own are never waited for.
pub fn serve(running: Running, options: &Options) -> Result<Server, Error> {
    let (door, hub, wishes) = prepare(options)?;
    let stage = Stage::of_running(Arc::clone(&hub), wishes, running);
    Server::start(door, hub, move || stage.run())
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
/// Those of [`serve`]; [`ErrorKind::Io`](palpate::ErrorKind::Io) and [`ErrorKind::Log`](palpate::ErrorKind::Log) if the log cannot be
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
