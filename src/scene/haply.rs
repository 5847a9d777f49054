//! A Haply device in a scene: where its service is, and what it may do.

use super::check::{lengths_within, positive};
use super::{DeviceKind, DeviceProfile, DeviceSpec};
use crate::error::Error;

/// How to reach a Haply Inverse service, and what its device may do.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct HaplySpec {
    /// Largest force (N): what the device may exert, which no page of the vendor's says.
    pub max_force_n: f64,
    /// The simulation channel, `host:port`.
    #[serde(default = "HaplySpec::address")]
    pub address: String,
    /// The events channel; `""` for a service without one.
    #[serde(default = "HaplySpec::events_address")]
    pub events_address: String,
    /// The device; the first that the service lists if absent.
    #[serde(default)]
    pub device_id: Option<String>,
    /// The name of the session's profile.
    #[serde(default = "HaplySpec::profile")]
    pub profile: String,
    /// Order and signs of the axes, as the service takes it.
    #[serde(default = "HaplySpec::basis")]
    pub basis: String,
    /// Where the device's base is in the scene (m).
    #[serde(default)]
    pub origin_m: [f64; 3],
    /// Without a reply for this long the clock releases the haptic group in place of the device (ms).
    #[serde(default = "HaplySpec::watchdog_ms")]
    pub watchdog_ms: f64,
}

impl HaplySpec {
    /// The first device of a service on this machine, with at most `max_force_n` newtons.
    pub fn new(max_force_n: f64) -> Self {
        Self {
            max_force_n,
            address: Self::address(),
            events_address: Self::events_address(),
            device_id: None,
            profile: Self::profile(),
            basis: Self::basis(),
            origin_m: [0.0; 3],
            watchdog_ms: Self::watchdog_ms(),
        }
    }

    fn address() -> String {
        "localhost:10001".to_owned()
    }

    fn events_address() -> String {
        "localhost:10020".to_owned()
    }

    fn profile() -> String {
        "palpate:palpate".to_owned()
    }

    fn basis() -> String {
        "XYZ".to_owned()
    }

    /// Three periods of 1 kHz: by then the client has sent its zero.
    fn watchdog_ms() -> f64 {
        3.0
    }
}

/// Longer than any operator would wait to see that a cable is out (ms).
const LONGEST_WATCHDOG_MS: f64 = 1000.0;

/// A base that is farther away is a wrong unit (m).
const FARTHEST_M: f64 = 1e3;

/// What can be wrong with it.
pub(super) fn validate(device: &DeviceSpec) -> Result<(), Error> {
    let Some(spec) = &device.haply else {
        return match device.kind {
            DeviceKind::Haply => {
                let message = "is missing: a haply device needs the table [device.haply] with max_force_n";
                Err(Error::scene("device.haply", message))
            }
            _ => Ok(()),
        };
    };
    if device.kind != DeviceKind::Haply {
        return Err(Error::scene("device.haply", "belongs to kind = \"haply\", set that or leave it out"));
    }
    if device.path_csv.is_some() || device.path.is_some() {
        let message = "moves a simulated tool, and a haply device is moved by a hand: leave it out";
        return Err(Error::scene("device.path_csv", message));
    }
    if device.attach_node.is_some() {
        let message = "glues a tool that starts at its node, and a hand starts anywhere: leave it out";
        return Err(Error::scene("device.attach_node", message));
    }
    if device.profile != DeviceProfile::default() {
        let message = "names the limits of a simulated device, those of this one are in device.haply: leave it out";
        return Err(Error::scene("device.profile", message));
    }
    positive("device.haply.max_force_n", spec.max_force_n)?;
    lengths_within("device.haply.origin_m", spec.origin_m, FARTHEST_M)?;
    positive("device.haply.watchdog_ms", spec.watchdog_ms)?;
    if spec.watchdog_ms > LONGEST_WATCHDOG_MS {
        let message = format!("is {}, must be at most {LONGEST_WATCHDOG_MS} ms", spec.watchdog_ms);
        return Err(Error::scene("device.haply.watchdog_ms", message));
    }
    Ok(())
}
