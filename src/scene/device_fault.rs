//! A device's faults as a scene names them.

use crate::devices::{FaultWindow, InjectedFault, SafetyStop};
use crate::error::Error;
use crate::runtime::Nanos;

/// A way in which the device fails, from one time to another.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// The first scheduled time at which the device fails (s).
    pub from_s: f64,
    /// The first scheduled time at which it does not fail any more (s).
    pub to_s: f64,
    /// Number of reads that a state is behind (`late`).
    #[serde(default = "one_read")]
    pub reads: u32,
    /// Probability of the loss of a frame, 0 to 1 (`lost`).
    #[serde(default = "certain")]
    pub probability: f64,
    /// Seed that decides which frames are lost: equal seeds lose equal frames (`lost`).
    #[serde(default)]
    pub seed: u64,
    /// Reason for which the device stopped itself (`safety_stop`).
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

    /// The fault as a device takes it.
    pub(crate) fn window(&self) -> FaultWindow {
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
