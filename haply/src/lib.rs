//! A Haply Inverse3 as a device of palpate: a client of the Haply Inverse service 3.5, and a mock of that service to try it
//! without hardware.
//!
//! ```no_run
//! use palpate::model::{body::Block, mesh::Face};
//! use palpate_haply::{Haply, HaplyOptions};
//!
//! # fn main() -> Result<(), palpate::Error> {
//! let body = Block::builder([12; 3], [0.1; 3]).fix(Face::ZMin).build()?;
//! let session = palpate::Session::builder(body).device(Haply::connect(HaplyOptions::new(3.0))?).build()?;
//! # Ok(())
//! # }
//! ```
//!
//! A scene with `device.kind = "haply"` is opened by [`open`]: `Session::from_scene(scene).open_haply_with(palpate_haply::open)`.
//! The feature `mock` adds `palpate_haply::mock`, the service with one device in a simulated hand; the command
//! `palpate mock haply` starts it.
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
//! | `protocol` | messages out and in, by `serde_json`, nothing allocated for a state |
//! | `wire` | a connection, by `tungstenite`: limits, and buffers that come back |
//! | `mock` | the service without hardware |

mod client;
mod events;
mod guard;
mod hold;
mod link;
#[cfg(feature = "mock")]
pub mod mock;
mod options;
mod protocol;
mod pulse;
mod watch;
mod wire;
mod words;

pub use client::{Haply, HaplyCounts};
pub use options::HaplyOptions;

use palpate::scene::HaplySpec;
use palpate::{Device, Error};
use std::time::Duration;

/// Connects to the device that a scene names, which is driven every `tick_s` seconds: the opener of `device.kind = "haply"`.
///
/// # Errors
/// The errors of [`Haply::connect`].
///
/// # Panics
/// If `tick_s` is negative or no number.
///
/// # Real-time
/// Not called in a tick: blocks for up to some seconds.
pub fn open(spec: &HaplySpec, tick_s: f64) -> Result<Box<dyn Device>, Error> {
    let device = Haply::connect(HaplyOptions {
        address: spec.address.clone(),
        events_address: (!spec.events_address.is_empty()).then(|| spec.events_address.clone()),
        device_id: spec.device_id.clone(),
        max_force_n: spec.max_force_n,
        profile: spec.profile.clone(),
        basis: spec.basis.clone(),
        origin_m: spec.origin_m.into(),
        period: Duration::from_secs_f64(tick_s),
    })?;
    Ok(Box::new(device))
}
