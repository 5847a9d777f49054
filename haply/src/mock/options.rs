//! The settings of a mock service, and what it counts.

use super::fault::MockFault;

/// The settings of a mock service: its ports, its device and what goes wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct MockOptions {
    /// Port of the simulation channel on this machine; any free one if 0.
    pub port: u16,
    /// Port of the events channel; any free one if 0.
    pub events_port: u16,
    /// The id of its one Inverse3.
    pub device_id: String,
    /// How its grip is turned: a quaternion (w, x, y, z) of length one; without, it has no grip.
    pub grip: Option<[f64; 4]>,
    /// What it does wrong.
    pub fault: Option<MockFault>,
}

impl Default for MockOptions {
    fn default() -> Self {
        Self { port: 10001, events_port: 10020, device_id: "049D".to_owned(), grip: None, fault: None }
    }
}

/// The counts of what a mock service has seen since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MockCounts {
    /// Connections to the simulation channel.
    pub connections: u64,
    /// Messages of clients.
    pub messages: u64,
    /// Messages that opened or changed a session.
    pub sessions: u64,
    /// Messages with a `set_*` command.
    pub commands: u64,
    /// Messages that asked for the state only.
    pub probes: u64,
    /// Messages with two `set_*` commands for one device.
    pub conflicts: u64,
    /// Messages with a force above 24 N, of which nothing is exerted.
    pub refused: u64,
    /// Messages that were not JSON of the documented shape.
    pub malformed: u64,
    /// Replies sent.
    pub replies: u64,
    /// Events sent.
    pub events: u64,
}
