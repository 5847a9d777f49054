//! A Haply device in a scene: where its service is, and what it may do.

/// A Haply device of a scene: the service that drives it, and the force that it may exert.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct HaplySpec {
    /// Largest force that the device may exert (N), which no page of the vendor's says.
    pub max_force_n: f64,
    /// Address of the service's simulation channel, `host:port`.
    #[serde(default = "HaplySpec::address")]
    pub address: String,
    /// Address of the service's events channel; `""` for a service without one.
    #[serde(default = "HaplySpec::events_address")]
    pub events_address: String,
    /// Id of the device; the first that the service lists if absent.
    #[serde(default)]
    pub device_id: Option<String>,
    /// The name of the session's profile.
    #[serde(default = "HaplySpec::profile")]
    pub profile: String,
    /// Order and signs of the axes, as the service takes it.
    #[serde(default = "HaplySpec::basis")]
    pub basis: String,
    /// Position of the device's base in the scene (m).
    #[serde(default)]
    pub origin_m: [f64; 3],
    /// Time without a reply after which the clock releases the haptic group in place of the device (ms).
    #[serde(default = "HaplySpec::watchdog_ms")]
    pub watchdog_ms: f64,
}

impl HaplySpec {
    /// Describes the first device of a service on this machine, with at most `max_force_n` newtons.
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
