//! What goes to and fro between a run and a device: newest state, force with an expiry, calibration.

use crate::model::{Pose, Turn, Vec3};
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
    /// The turn from the tool's own axes to those of the world; none for a device that tells none.
    pub orientation: Turn,
    /// Pressed buttons, a bit each.
    pub buttons: u16,
}

impl DeviceState {
    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        let numbers = self.position.iter().chain(self.velocity.iter()).chain(self.orientation.coords.iter());
        numbers.into_iter().all(|c| c.is_finite())
    }

    /// Where the tool is and how it is turned.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, orientation: self.orientation }
    }

    /// The state with an orientation of length one: as it is up to an error of 1e-6, brought to that length up to 1e-3,
    /// and `None` beyond, where the four numbers are no turn.
    pub fn upright(self) -> Option<Self> {
        let error = (self.orientation.coords.norm() - 1.0).abs();
        if error <= EXACT_TURN {
            return Some(self);
        }
        let orientation = Turn::new_normalize(self.orientation.into_inner());
        (error <= ROUGH_TURN).then_some(Self { orientation, ..self })
    }
}

/// What the length of a quaternion may lack of one by rounding.
const EXACT_TURN: f64 = 1e-6;
/// What the length of a quaternion may lack of one where few digits of it are told.
pub(super) const ROUGH_TURN: f64 = 1e-3;

/// A force and a torque for a device and how long they may act.
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
    /// Torque on the tool, in the world's axes (N m); zero for a device that exerts none.
    pub torque: Vec3,
    /// The time, on the clock of [`Device::read`](super::Device::read), from which on both are zero unless another
    /// command came. A device that has a clock of its own sees to that itself, so that nothing stays when nobody drives it.
    pub expires: Nanos,
}

impl ForceCommand {
    /// A command to exert neither force nor torque, for good.
    pub const ZERO: Self =
        Self { force: Vec3::new(0.0, 0.0, 0.0), torque: Vec3::new(0.0, 0.0, 0.0), expires: Nanos(u64::MAX) };

    /// A command to exert `force` (N) and no torque until `expires`.
    pub fn until(force: Vec3, expires: Nanos) -> Self {
        Self { force, torque: Vec3::zeros(), expires }
    }

    /// The command with `torque` (N m) beside its force.
    #[must_use]
    pub fn with_torque(self, torque: Vec3) -> Self {
        Self { torque, ..self }
    }

    /// True if every number of force and torque is finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().chain(self.torque.iter()).all(|c| c.is_finite())
    }

    /// The force at `time` (N): zero from the expiry on.
    pub fn at(&self, time: Nanos) -> Vec3 {
        if time < self.expires { self.force } else { Vec3::zeros() }
    }

    /// The torque at `time` (N m): zero from the expiry on.
    pub fn torque_at(&self, time: Nanos) -> Vec3 {
        if time < self.expires { self.torque } else { Vec3::zeros() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orientation_is_believed_as_it_is_made_of_length_one_or_no_turn() {
        let turned = Turn::from_axis_angle(&Vec3::z_axis(), 0.7);
        let of_length = |length: f64| DeviceState {
            orientation: Turn::new_unchecked(turned.into_inner() * length),
            ..DeviceState::default()
        };
        assert_eq!(of_length(1.0 + 5e-7).upright(), Some(of_length(1.0 + 5e-7)), "to the last bit");
        let brought = of_length(0.9995).upright().unwrap();
        assert!((brought.orientation.coords.norm() - 1.0).abs() < 1e-15);
        assert!(brought.orientation.angle_to(&turned) < 1e-7);
        assert!([0.0, 0.99, 1.01, f64::NAN, f64::INFINITY].iter().all(|&length| of_length(length).upright().is_none()));
        assert!(!of_length(f64::NAN).is_finite() && of_length(2.0).is_finite());
        assert_eq!(DeviceState::default().orientation, Turn::identity());
    }

    #[test]
    fn a_torque_ends_with_its_command_and_must_be_finite() {
        let command = ForceCommand::until(Vec3::x(), Nanos(5)).with_torque(Vec3::y());
        assert_eq!((command.torque_at(Nanos(4)), command.torque_at(Nanos(5))), (Vec3::y(), Vec3::zeros()));
        assert_eq!(command.force, Vec3::x());
        assert!(command.is_finite() && !command.with_torque(Vec3::repeat(f64::NAN)).is_finite());
        assert_eq!(ForceCommand::until(Vec3::x(), Nanos(5)).torque, Vec3::zeros());
    }
}
