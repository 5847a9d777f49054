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
    pub(super) fn events(self, id: &str) -> [Option<Value>; 2] {
        // Their levels, what they say of safety or of the device, and their messages.
        let events: &[(&str, &str, &str)] = match self {
            Self::Silent | Self::Slow | Self::Garbage | Self::Vanish | Self::Uncalibrated | Self::Unready => &[],
            Self::Ebrake => &[
                ("error", "ebrake_triggered", "Emergency brake engaged"),
                ("notice", "ebrake_released", "Emergency brake released"),
            ],
            Self::Fod => &[
                ("warning", "fod_stage_changed", "FOD stage changed: guard -> hard"),
                ("info", "fod_stage_changed", "FOD stage changed: hard -> guard"),
            ],
            Self::Stall => &[("warning", "stall_detected", "Motor stall detected")],
            Self::Ceiling => &[("warning", "stability_ceiling", "Stability ceiling reached")],
            Self::Unknown => &[("critical", "not_in_any_page", "Something new")],
            Self::Unplug => {
                &[("warning", "device-disconnected", "Device lost"), ("info", "device-connected", "Device ready")]
            }
            Self::Busy => &[("warning", "device-busy", "Device is in use by another session")],
        };
        [0, 1].map(|index| {
            let &(level, name, message) = events.get(index)?;
            let mut data = json!({"device_family": "inverse", "device_id": id});
            let is_safety = !name.starts_with("device-");
            if is_safety {
                data["safety_type"] = name.into();
            }
            let name = if is_safety { "device-safety-triggered" } else { name };
            Some(json!({"name": name, "category": "device", "level": level, "data": data, "message": message}))
        })
    }
}
