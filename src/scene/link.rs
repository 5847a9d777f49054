//! The link of a scene: what is between the haptic and the global model's computer.

/// A simulated link between the haptic side of a scene and its global model: what a network does to messages, either way.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LinkSpec {
    /// What a message takes at least, one way (ms).
    pub delay_ms: f64,
    /// What it may take more, evenly (ms).
    pub jitter_ms: f64,
    /// The share of packets of 1200 bytes that are lost, below 1. Those of a longer message are sent again, one round trip later.
    pub loss: f64,
    /// The share of messages that come twice.
    pub duplicate: f64,
    /// The share of messages that are held back for one more delay.
    pub reorder: f64,
    /// As over the connections of TCP that a real session has: a short message that is lost is sent again too, and what comes later by the same
    /// connection waits for it.
    pub tcp: bool,
    /// The rate of the line, one way (Mbit/s); without end if absent.
    pub rate_mbit_s: Option<f64>,
    /// Times in which nothing comes through: from, and until (s).
    pub down_s: Vec<[f64; 2]>,
    /// For the numbers that all chance is drawn from.
    pub seed: u64,
}
