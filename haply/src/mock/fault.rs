//! What a mock service can do wrong, once, after so many commands.

use serde_json::{Value, json};
use std::time::Duration;

/// A fault that a mock service has once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MockFault {
    /// The kind of the fault.
    pub kind: MockFaultKind,
    /// The number of commands after which it begins; with 0 a status is so from the start, until some time after the first.
    pub after: u64,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident $name:literal)*) => {
        /// A way to fail.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum MockFaultKind {
            $($(#[$doc])* $kind,)*
        }

        impl MockFaultKind {
            /// Every way to fail, in the order of the documentation.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// Its name on the command line.
            ///
            /// # Real-time
            /// Wait-free.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }
        }
    };
}

kinds! {
    /// Reads on and answers nothing; the next connection is answered again.
    Silent "silent"
    /// Answers each message 5 ms late, on this connection.
    Slow "slow"
    /// Answers with what is no state, on this connection.
    Garbage "garbage"
    /// Closes every connection and takes no new one for 300 ms.
    Vanish "vanish"
    /// The emergency brake engages, and is released after [`MockFaultKind::LASTS`].
    Ebrake "ebrake"
    /// The FOD stage goes up, and down again after [`MockFaultKind::LASTS`].
    Fod "fod"
    /// A motor stalls.
    Stall "stall"
    /// The stability ceiling is reached.
    Ceiling "ceiling"
    /// The device is unplugged, and is back after [`MockFaultKind::LASTS`].
    Unplug "unplug"
    /// Another session has the device.
    Busy "busy"
    /// A safety event that no client can know.
    Unknown "unknown"
    /// The status says for [`MockFaultKind::LASTS`] that the device is not calibrated; no event does.
    Uncalibrated "uncalibrated"
    /// The status says for [`MockFaultKind::LASTS`] that the device is not ready; no event does.
    Unready "unready"
}

impl MockFaultKind {
    /// How long a fault lasts that ends by itself.
    pub const LASTS: Duration = Duration::from_millis(500);

    /// The event that announces it, and the one that takes it back.
    pub(super) fn events(self, id: &str) -> Option<(Value, Option<Value>)> {
        let event = |name: &str, level: &str, data: Value, message: &str| json!({"name": name, "category": "device", "level": level, "data": data, "message": message});
        let safety = |level, kind: &str, message| {
            let data = json!({"device_family": "inverse", "device_id": id, "safety_type": kind});
            event("device-safety-triggered", level, data, message)
        };
        let device =
            |name, level, message| event(name, level, json!({"device_family": "inverse", "device_id": id}), message);
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
