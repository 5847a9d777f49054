//! The link between a haptic machine and the machine of the global model, over [zenoh](https://zenoh.io).
//!
//! The engine has the sessions of both sides, their bridges and what crosses; here is what carries it: [`GlobalSide`] is the
//! [`Transport`](palpate::link::Transport) of a haptic session, [`serve`] runs global sessions for the haptic machine that comes, and
//! [`make_keys`] makes what both need to know each other.
//!
//! ```no_run
//! use palpate::prelude::*;
//! use palpate_link::{Access, GlobalSide};
//!
//! # fn main() -> Result<(), Error> {
//! // On the other machine runs `palpate serve demo --listen tcp/127.0.0.1:7447`.
//! let global = GlobalSide::at("tcp/127.0.0.1:7447", &Access::default())?;
//! let summary = Session::from_scene(Scene::demo()).model(ModelKind::Predictive).global_over(global).build()?.run()?;
//! println!("{summary}");
//! # Ok(())
//! # }
//! ```
//!
//! All that zenoh does, it does on threads of its own: a bridge hands a message over and takes what has come, and waits for neither.

mod access;
mod connection;
mod desk;
mod haptic;
mod inbox;
mod keeper;
mod keys;
mod line;
mod outbox;
mod server;
mod sockets;

pub use access::{Access, TLS_RUNTIME};
pub use haptic::GlobalSide;
pub use keys::make_keys;
pub use server::{Event, serve};

/// Names this process, as long as it runs.
fn machine() -> u64 {
    static MACHINE: std::sync::OnceLock<u64> = std::sync::OnceLock::new();
    *MACHINE.get_or_init(unique)
}

/// A name that nobody else has by chance; it is no secret.
fn unique() -> u64 {
    use std::hash::{BuildHasher, Hasher, RandomState};
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    hasher.finish()
}
