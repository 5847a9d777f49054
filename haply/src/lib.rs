//! The Haply Inverse service 3.5: a client for its Inverse3 devices, and a mock service to try it without hardware.
//!
//! The service speaks JSON over WebSocket. On the simulation channel it sends one inventory when a client connects and from
//! then on exactly one state for each message of the client, so the client is the one who keeps the pace; commands do not
//! persist. What concerns safety comes over a second channel, of events. Source: the vendor's documentation of the service
//! and its crate `haply` 1.3.1, against which the mock is tested (`interop/haply`).
//!
//! | file | is |
//! | --- | --- |
//! | `client` | the device: one command per tick, one reply each |
//! | `link`, `events` | the threads that connect again and that listen for events |
//! | `guard` | what the events mean for the force |
//! | `hold`, `watch` | the expiry of a force: on the client's clock, and by a thread where the tick does not go on |
//! | `pulse` | which replies are missing, and when the force may come back |
//! | `protocol`, `json` | frames out and in, nothing allocated |
//! | `websocket`, `handshake` | RFC 6455, both sides |
//! | `mock` | the service without hardware |

mod client;
mod events;
mod guard;
mod handshake;
mod hold;
mod json;
mod link;
#[cfg(feature = "mock")]
pub mod mock;
mod options;
mod protocol;
mod pulse;
mod watch;
mod websocket;

pub use client::{Haply, HaplyCounts};
pub use options::HaplyOptions;

/// stub
pub fn open(_: &palpate::scene::HaplySpec, _: f64) -> Result<Box<dyn palpate::devices::Device>, palpate::Error> { unimplemented!() }
