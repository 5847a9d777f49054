//! A device's faults as a scene names them.

use crate::devices::{FaultWindow, InjectedFault, SafetyStop};
use crate::error::Error;
use crate::runtime::Nanos;

/// A way in which the device fails, from one time to another.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// What fails.
    pub kind: FaultKind,
    /// The first scheduled time at which it does (s).
    pub from_s: f64,
    /// The first at which it does not any more (s).
    pub to_s: f64,
    /// How many reads a state is behind (`late`).
    #[serde(default = "one_read")]
    pub reads: u32,
    /// How probable a loss is (`lost`).
    #[serde(default = "certain")]
    pub probability: f64,
    /// Which frames: the same seed loses the same (`lost`).
    #[serde(default)]
    pub seed: u64,
    /// Why the device stopped (`safety_stop`).
    #[serde(default = "unknown")]
    pub stop: SafetyStop,
}

fn one_read() -> u32 {
    1
}

fn certain() -> f64 {
    1.0
}

fn unknown() -> SafetyStop {
    SafetyStop::Other
}

/// The faults that a scene file can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// States come late.
    Late,
    /// Frames are lost, with the commands that belong to them.
    Lost,
    /// The last state is told again as if it were new.
    Frozen,
    /// States are no numbers.
    NotFinite,
    /// Nothing comes and nothing goes.
    Disconnected,
    /// The device has stopped itself.
    SafetyStop,
}

impl FaultSpec {
    /// A fault of `kind` from `from_s` to `to_s` (s), with the defaults of a scene file.
    pub fn new(kind: FaultKind, from_s: f64, to_s: f64) -> Self {
        Self { kind, from_s, to_s, reads: 1, probability: 1.0, seed: 0, stop: SafetyStop::Other }
    }

    /// The same for a device.
    pub fn window(&self) -> FaultWindow {
        let fault = match self.kind {
            FaultKind::Late => InjectedFault::Late { reads: self.reads as usize },
            FaultKind::Lost => InjectedFault::Lost { probability: self.probability, seed: self.seed },
            FaultKind::Frozen => InjectedFault::Frozen,
            FaultKind::NotFinite => InjectedFault::NotFinite,
            FaultKind::Disconnected => InjectedFault::Disconnected,
            FaultKind::SafetyStop => InjectedFault::SafetyStop(self.stop),
        };
        FaultWindow { fault, from: Nanos::from_secs_f64(self.from_s), to: Nanos::from_secs_f64(self.to_s) }
    }

    /// Refuses what cannot be; `field` is its own, such as `device.fault[0]`.
    pub(super) fn check(&self, field: &str) -> Result<(), Error> {
        let refuse = |key: &str, message: String| Err(Error::scene(&format!("{field}.{key}"), message));
        if !(self.from_s.is_finite() && self.from_s >= 0.0) {
            return refuse("from_s", format!("is {}, must be a finite number of at least 0", self.from_s));
        }
        if !(self.to_s.is_finite() && self.to_s > self.from_s) {
            return refuse("to_s", format!("is {}, must be a finite number above from_s, {}", self.to_s, self.from_s));
        }
        let latest = FaultWindow::LATEST;
        if !(1..=latest).contains(&(self.reads as usize)) {
            return refuse("reads", format!("is {}, must be 1 to {latest}", self.reads));
        }
        if !(0.0..=1.0).contains(&self.probability) {
            return refuse("probability", format!("is {}, must be 0 to 1", self.probability));
        }
        Ok(())
    }
}
