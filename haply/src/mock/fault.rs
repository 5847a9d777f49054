//! What a mock service can do wrong, once, after so many commands.

use std::time::Duration;

/// A way to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MockFaultKind {
    /// Reads on and answers nothing; the next connection is answered again.
    Silent,
    /// Answers each message 5 ms late, on this connection.
    Slow,
    /// Answers with what is no state, on this connection.
    Garbage,
    /// Closes every connection and takes no new one for 300 ms.
    Vanish,
    /// The emergency brake engages, and is released after [`MockFaultKind::LASTS`].
    Ebrake,
    /// The FOD stage goes up, and down again after the same time.
    Fod,
    /// A motor stalls.
    Stall,
    /// The stability ceiling is reached.
    Ceiling,
    /// The device is unplugged, and is back after the same time.
    Unplug,
    /// Another session has the device.
    Busy,
    /// A safety event that no client can know.
    Unknown,
    /// The status says that the device is not calibrated, for the same time; no event does.
    Uncalibrated,
    /// The status says that the device is not ready, for the same time; no event does.
    Unready,
}

impl MockFaultKind {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Silent,
        Self::Slow,
        Self::Garbage,
        Self::Vanish,
        Self::Ebrake,
        Self::Fod,
        Self::Stall,
        Self::Ceiling,
        Self::Unplug,
        Self::Busy,
        Self::Unknown,
        Self::Uncalibrated,
        Self::Unready,
    ];

    /// How long a fault lasts that ends by itself.
    pub const LASTS: Duration = Duration::from_millis(500);

    /// As it is called on the command line.
    ///
    /// # Real-time
    /// Wait-free.
    pub fn name(self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::Slow => "slow",
            Self::Garbage => "garbage",
            Self::Vanish => "vanish",
            Self::Ebrake => "ebrake",
            Self::Fod => "fod",
            Self::Stall => "stall",
            Self::Ceiling => "ceiling",
            Self::Unplug => "unplug",
            Self::Busy => "busy",
            Self::Unknown => "unknown",
            Self::Uncalibrated => "uncalibrated",
            Self::Unready => "unready",
        }
    }

    /// The event that announces it, and the one that takes it back: name, level, safety type, message.
    pub(super) fn events(self) -> Option<(Event, Option<Event>)> {
        let safety = |level, kind, message| Event { name: "device-safety-triggered", level, kind: Some(kind), message };
        let device = |name, level, message| Event { name, level, kind: None, message };
        Some(match self {
            Self::Silent | Self::Slow | Self::Garbage | Self::Vanish | Self::Uncalibrated | Self::Unready => {
                return None;
            }
            Self::Ebrake => (
                safety("error", "ebrake_triggered", "Emergency brake engaged"),
                Some(safety("notice", "ebrake_released", "Emergency brake released")),
            ),
            Self::Fod => (
                safety("warning", "fod_stage_changed", "FOD stage changed: guard -> hard"),
                Some(safety("info", "fod_stage_changed", "FOD stage changed: hard -> guard")),
            ),
            Self::Stall => (safety("warning", "stall_detected", "Motor stall detected"), None),
            Self::Ceiling => (safety("warning", "stability_ceiling", "Stability ceiling reached"), None),
            Self::Unknown => (safety("critical", "not_in_any_page", "Something new"), None),
            Self::Unplug => (
                device("device-disconnected", "warning", "Device lost"),
                Some(device("device-connected", "info", "Device ready")),
            ),
            Self::Busy => (device("device-busy", "warning", "Device is in use by another session"), None),
        })
    }
}

/// One message of the events channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Event {
    pub(super) name: &'static str,
    pub(super) level: &'static str,
    /// The `safety_type`, if it is a safety event.
    pub(super) kind: Option<&'static str>,
    pub(super) message: &'static str,
}

impl Event {
    pub(super) fn text(&self, device: &str) -> String {
        let kind = self.kind.map_or(String::new(), |kind| format!(r#","safety_type":"{kind}""#));
        format!(
            r#"{{"name":"{}","category":"device","level":"{}","data":{{"device_family":"inverse","device_id":"{device}"{kind}}},"message":"{}"}}"#,
            self.name, self.level, self.message
        )
    }
}
