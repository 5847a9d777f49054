//! Why a device could not be read or written.

/// A reason for which a device could not be read or written. `Copy`, so that a real-time tick can pass it on.
///
/// ```
/// use palpate::devices::DeviceFault;
///
/// let fault = DeviceFault::Disconnected;
/// assert_eq!(DeviceFault::from_code(fault.code()), Some(fault), "records hold the code");
/// assert_eq!(fault.to_string(), fault.words());
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DeviceFault {
    /// No new state since the last read; the last one is used again. A retry helps.
    Stale,
    /// The device is not calibrated or not ready. A retry helps once the user has made it ready.
    NotReady,
    /// The device is gone. A retry does not help until it is connected again.
    Disconnected,
    /// The device does not take this command, which is not finite or above its limit; it exerts none of it. Another one may do.
    Refused,
    /// Another program uses it. A retry helps once that one is done.
    Busy,
    /// The device stopped by itself and exerts nothing. A retry helps once the user has released it.
    SafetyStop(SafetyStop),
}

/// A reason for which a device stopped by itself.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SafetyStop {
    /// The emergency brake of the device was pulled.
    EmergencyBrake,
    /// A motor is blocked.
    Stall,
    /// The device found itself unstable.
    Unstable,
    /// A motor is too hot.
    Overheated,
    /// The device gave another reason, or none.
    Other,
}

impl SafetyStop {
    /// All reasons, in the order of their codes.
    pub const ALL: [Self; 5] = [Self::EmergencyBrake, Self::Stall, Self::Unstable, Self::Overheated, Self::Other];
}

impl DeviceFault {
    /// All faults, in the order of their codes.
    pub const ALL: [Self; 10] = [
        Self::Stale,
        Self::NotReady,
        Self::Disconnected,
        Self::Refused,
        Self::Busy,
        Self::SafetyStop(SafetyStop::EmergencyBrake),
        Self::SafetyStop(SafetyStop::Stall),
        Self::SafetyStop(SafetyStop::Unstable),
        Self::SafetyStop(SafetyStop::Overheated),
        Self::SafetyStop(SafetyStop::Other),
    ];

    /// A number for records and outcomes, from 1.
    pub fn code(self) -> u32 {
        match self {
            Self::Stale => 1,
            Self::NotReady => 2,
            Self::Disconnected => 3,
            Self::Refused => 4,
            Self::Busy => 5,
            Self::SafetyStop(stop) => 16 + stop as u32,
        }
    }

    /// The fault with this [`code`](Self::code).
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }

    /// The fault in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Stale => "the device had no new state",
            Self::NotReady => "the device is not ready",
            Self::Disconnected => "the device is disconnected",
            Self::Refused => "the device refused a force",
            Self::Busy => "the device is used by another program",
            Self::SafetyStop(SafetyStop::EmergencyBrake) => "the device stopped: its emergency brake was pulled",
            Self::SafetyStop(SafetyStop::Stall) => "the device stopped: a motor is blocked",
            Self::SafetyStop(SafetyStop::Unstable) => "the device stopped: it found itself unstable",
            Self::SafetyStop(SafetyStop::Overheated) => "the device stopped: a motor is too hot",
            Self::SafetyStop(SafetyStop::Other) => "the device stopped by itself",
        }
    }
}

impl std::fmt::Display for DeviceFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.words())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_number_and_words_of_its_own() {
        for (index, fault) in DeviceFault::ALL.into_iter().enumerate() {
            assert_eq!(DeviceFault::from_code(fault.code()), Some(fault));
            assert!(DeviceFault::ALL[..index].iter().all(|other| other.words() != fault.words()));
        }
        let stops = SafetyStop::ALL.map(DeviceFault::SafetyStop);
        assert!(stops.iter().all(|stop| DeviceFault::ALL.contains(stop)));
        assert_eq!([0, 6, 21].map(DeviceFault::from_code), [None; 3]);
    }
}
