//! What a connection to the service needs to know.

use crate::protocol::is_plain;
use palpate::model::Vec3;
use palpate::{Error, ErrorKind};
use std::time::Duration;

/// How to reach the service, which device, and what it may do.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplyOptions {
    /// The simulation channel, `host:port`; `localhost:10001` by default.
    pub address: String,
    /// The events channel; `localhost:10020` by default. `None` is for a service that has none: then nothing tells of an
    /// emergency brake.
    pub events_address: Option<String>,
    /// The device, such as `049D`; the first that the service lists if `None`.
    pub device_id: Option<String>,
    /// Largest force (N). The vendor's pages name none, so there is no default.
    pub max_force_n: f64,
    /// The name of the session's profile, as the service shows it.
    pub profile: String,
    /// The order and signs of the axes, as the service takes it: `XYZ` by default, right-handed.
    pub basis: String,
    /// Where the device's base is in the scene (m).
    pub origin_m: Vec3,
    /// The time of one tick: how long a reply may take, and the pace of [`wait`](palpate::Device::wait).
    pub period: Duration,
}

impl HaplyOptions {
    /// The first device of a service on this machine, at 1 kHz, with at most `max_force_n` newtons.
    ///
    /// # Real-time
    /// Not called in a tick: allocates.
    pub fn new(max_force_n: f64) -> Self {
        Self {
            address: "localhost:10001".to_owned(),
            events_address: Some("localhost:10020".to_owned()),
            device_id: None,
            max_force_n,
            profile: "palpate:palpate".to_owned(),
            basis: "XYZ".to_owned(),
            origin_m: Vec3::zeros(),
            period: Duration::from_millis(1),
        }
    }

    /// Refuses what could not go into a frame.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let names =
            [("profile", Some(&self.profile)), ("basis", Some(&self.basis)), ("device_id", self.device_id.as_ref())];
        let refuse = |message: String| Err(Error::new(ErrorKind::Device, message).at("haply"));
        for (field, name) in names {
            if let Some(name) = name
                && !is_plain(name)
            {
                return refuse(format!("{field} is {name:?}, must be 1 to 64 letters, digits or ._:-+/"));
            }
        }
        if !(self.max_force_n > 0.0 && self.max_force_n.is_finite()) {
            return refuse(format!("max_force_n is {}, must be a finite number above 0", self.max_force_n));
        }
        if self.period.is_zero() || !self.origin_m.iter().all(|c| c.is_finite()) {
            return refuse("the period must be above zero and the origin finite".to_owned());
        }
        Ok(())
    }
}
