//! The tool's part of a scene: what moves it and what limits its force.

use super::ToolPath;

/// What moves the tool.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
pub struct DeviceSpec {
    /// The kind of device.
    pub kind: DeviceKind,
    /// A CSV file `t_s,x_m,y_m,z_m`, relative to the scene file.
    pub path_csv: Option<std::path::PathBuf>,
    /// The tool is glued to this node.
    pub attach_node: Option<[usize; 3]>,
    /// The service of a `haply` device.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub haply: Option<HaplySpec>,
    /// The path itself: read from `path_csv`, or given by a program.
    #[cfg_attr(feature = "scene", serde(skip))]
    pub path: Option<ToolPath>,
}

/// The devices that a scene file can name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum DeviceKind {
    /// A tool that follows a path and ignores the force.
    #[default]
    Scripted,
    /// An Inverse3 behind the Haply Inverse service; needs feature `haply`.
    Haply,
}

/// How to reach a Haply Inverse service, and what its device may do.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct HaplySpec {
    /// Largest force (N): what the device may exert, which no page of the vendor's says.
    pub max_force_n: f64,
    /// The simulation channel, `host:port`.
    #[cfg_attr(feature = "scene", serde(default = "HaplySpec::address"))]
    pub address: String,
    /// The events channel; `""` for a service without one.
    #[cfg_attr(feature = "scene", serde(default = "HaplySpec::events_address"))]
    pub events_address: String,
    /// The device; the first that the service lists if absent.
    #[cfg_attr(feature = "scene", serde(default))]
    pub device_id: Option<String>,
    /// The name of the session's profile.
    #[cfg_attr(feature = "scene", serde(default = "HaplySpec::profile"))]
    pub profile: String,
    /// Order and signs of the axes, as the service takes it.
    #[cfg_attr(feature = "scene", serde(default = "HaplySpec::basis"))]
    pub basis: String,
    /// Where the device's base is in the scene (m).
    #[cfg_attr(feature = "scene", serde(default))]
    pub origin_m: [f64; 3],
    /// Without a reply for this long the clock releases the haptic group in place of the device (ms).
    #[cfg_attr(feature = "scene", serde(default = "HaplySpec::watchdog_ms"))]
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

/// Limits on what reaches the device.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
pub struct SafetySpec {
    /// Largest force (N); the device's own limit if absent.
    pub max_force_n: Option<f64>,
    /// Largest change of the force (N/ms).
    pub max_slew_n_per_ms: f64,
    /// Time in which the force goes to zero when the run stops or fails, and comes back after a gap (ms).
    pub ramp_ms: f64,
}

impl Default for SafetySpec {
    fn default() -> Self {
        Self { max_force_n: None, max_slew_n_per_ms: 0.5, ramp_ms: 100.0 }
    }
}
