//! Devices: what moves the tool and feels the force. One file per device; a program brings its own.

#[cfg(feature = "haply")]
pub mod haply;
mod path_csv;
mod replayed;
mod scripted;
mod tool_path;

pub use replayed::{Replayed, ReplayedSample};
pub use scripted::Scripted;
pub use tool_path::ToolPath;

use crate::model::Vec3;
use crate::time::Nanos;
use std::time::Duration;

/// What a device can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capabilities {
    /// Largest force that it can or may exert (N).
    pub max_force_n: f64,
}

/// The newest state of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceState {
    /// Tool position (m).
    pub position: Vec3,
    /// Tool velocity (m/s).
    pub velocity: Vec3,
    /// Pressed buttons, a bit each.
    pub buttons: u16,
}

/// Why a device could not be read or written. `Copy`, so that a real-time tick can pass it on.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DeviceFault {
    /// No new state since the last read; the last one is used again. A retry helps.
    Stale,
    /// It is not calibrated or not ready. A retry helps once the user has made it ready.
    NotReady,
    /// It is gone. A retry does not help until it is connected again.
    Disconnected,
    /// It has stopped itself, or was stopped: a brake, a stall, something in its way. A retry helps once that is over.
    SafetyStop,
    /// Another program has it. A retry helps once that one lets go.
    Busy,
}

impl DeviceFault {
    /// A number for records and outcomes.
    pub fn code(self) -> u32 {
        match self {
            Self::Stale => 1,
            Self::NotReady => 2,
            Self::Disconnected => 3,
            Self::SafetyStop => 4,
            Self::Busy => 5,
        }
    }
}

impl std::fmt::Display for DeviceFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Stale => "the device had no new state",
            Self::NotReady => "the device is not ready",
            Self::Disconnected => "the device is disconnected",
            Self::SafetyStop => "the device has stopped for safety",
            Self::Busy => "the device is in use by another program",
        })
    }
}

/// A force-feedback device, or anything that moves a tool.
///
/// Per release of its group, [`read`](Self::read) is called once and then, from the second release on,
/// [`write`](Self::write) once with the force of the same release.
pub trait Device: Send + std::fmt::Debug {
    /// Its name in reports and logs.
    ///
    /// # Real-time
    /// Not called in a tick.
    fn name(&self) -> &str;

    /// What it can do.
    ///
    /// # Real-time
    /// Asked before the run, not in a tick.
    fn capabilities(&self) -> Capabilities;

    /// False for a device whose [`write`](Self::write) moves nothing: nobody needs to wait for its force to fade.
    ///
    /// # Real-time
    /// Asked before the run, not in a tick.
    fn exerts_force(&self) -> bool {
        true
    }

    /// The blocking read of a device that owns the clock: blocks until there is something new, at most `timeout`; true if
    /// there is. New is what has come since it last said so, also between two calls. What it fetched is for the next
    /// [`read`](Self::read), the newest if there were several.
    ///
    /// Only asked where the local group is [device-paced](crate::runtime::Release::DevicePaced). A device without a clock
    /// of its own leaves it as it is: nothing waits, and the clock of the group goes on.
    ///
    /// # Real-time
    /// May block, at most for `timeout`: the one wait of such a tick, and it costs what the device costs. With a timeout of
    /// zero it only looks.
    fn wait(&mut self, timeout: Duration) -> bool {
        let _ = timeout;
        false
    }

    /// The state at `time`, the scheduled time of the release.
    ///
    /// # Errors
    /// A [`DeviceFault`]; the run goes on with the last state.
    ///
    /// # Real-time
    /// Called in the haptic tick: must neither allocate nor block.
    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault>;

    /// Exerts `force` (N) until the next call.
    ///
    /// # Errors
    /// A [`DeviceFault`]; it is counted and reported.
    ///
    /// # Real-time
    /// As [`read`](Self::read).
    fn write(&mut self, force: Vec3) -> Result<(), DeviceFault>;
}
