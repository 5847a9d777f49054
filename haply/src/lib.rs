//! The Haply Inverse service 3.5: a client for its Inverse3 devices.

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
