//! What goes to and fro between a run and a device: newest state, force with an expiry, calibration.

use crate::model::Vec3;
use crate::runtime::Nanos;

/// The newest state of a device.
///
/// ```
/// use palpate::prelude::*;
///
/// let state = DeviceState { position: Vec3::new(0.0, 0.0, 0.1), buttons: 0b10, ..DeviceState::default() };
/// assert!(state.is_finite());
/// assert!(state.buttons & 1 << 1 != 0, "the second button is pressed");
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceState {
    /// Tool position (m).
    pub position: Vec3,
    /// Tool velocity (m/s).
    pub velocity: Vec3,
    /// Pressed buttons, a bit each.
    pub buttons: u16,
}

impl DeviceState {
    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position.iter().chain(self.velocity.iter()).all(|c| c.is_finite())
    }
}

/// A force for a device and how long it may act.
///
/// ```
/// use palpate::prelude::*;
///
/// let push = ForceCommand::until(Vec3::new(0.0, 0.0, 1.5), Nanos(3_000_000));
/// assert_eq!(push.at(Nanos(2_999_999)).z, 1.5);
/// assert_eq!(push.at(Nanos(3_000_000)).z, 0.0, "nothing stays when nobody drives the device");
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceCommand {
    /// Force on the tool (N).
    pub force: Vec3,
    /// The time, on the clock of [`Device::read`](super::Device::read), from which on the force is zero unless another
    /// command came. A device that has a clock of its own sees to that itself, so that nothing stays when nobody drives it.
    pub expires: Nanos,
}

impl ForceCommand {
    /// A command to exert no force, for good.
    pub const ZERO: Self = Self { force: Vec3::new(0.0, 0.0, 0.0), expires: Nanos(u64::MAX) };

    /// A command to exert `force` (N) until `expires`.
    pub fn until(force: Vec3, expires: Nanos) -> Self {
        Self { force, expires }
    }

    /// True if every number of the force is finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().all(|c| c.is_finite())
    }

    /// The force at `time` (N): zero from the expiry on.
    pub fn at(&self, time: Nanos) -> Vec3 {
        if time < self.expires { self.force } else { Vec3::zeros() }
    }
}

impl Default for ForceCommand {
    fn default() -> Self {
        Self::ZERO
    }
}

/// Whether a device knows where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Calibration {
    /// The device knows where it is, or has no need to.
    #[default]
    Done,
    /// The device is finding out where it is; its reads are [`NotReady`](super::DeviceFault::NotReady) until then.
    Running,
    /// Somebody has to calibrate the device; its reads are [`NotReady`](super::DeviceFault::NotReady) until then.
    Needed,
}
