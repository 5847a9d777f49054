//! The trait that every device implements.

use std::time::Duration;

use super::{Calibration, Capabilities, DeviceFault, DeviceState, ForceCommand};
use crate::model::Vec3;
use crate::runtime::Nanos;

/// A force-feedback device, or anything that moves a tool.
///
/// Per release of its group, [`read`](Self::read) is called once and then, from the second release on,
/// [`write`](Self::write) once with the force of the same release. Before the first release `read` is called once at time
/// zero. Times never go backwards; releases may be skipped.
///
/// [`Conformance`](super::conformance::Conformance) tells whether an implementation keeps to all of this.
///
/// ```
/// use palpate::prelude::*;
///
/// /// Sways from side to side; nothing pushes it.
/// struct Pendulum;
///
/// impl Device for Pendulum {
///     fn name(&self) -> &str {
///         "pendulum"
///     }
///
///     fn capabilities(&self) -> Capabilities {
///         Capabilities::of_force(2.0)
///     }
///
///     fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
///         let (t, amplitude, rate) = (time.as_secs_f64(), 0.02, 6.0);
///         let position = Vec3::new(amplitude * (rate * t).sin(), 0.0, 0.1);
///         let velocity = Vec3::new(amplitude * rate * (rate * t).cos(), 0.0, 0.0);
///         Ok(DeviceState { position, velocity, ..DeviceState::default() })
///     }
///
///     fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
///         if command.is_finite() { Ok(()) } else { Err(DeviceFault::Refused) }
///     }
/// }
///
/// # fn main() -> Result<(), Error> {
/// let body = Block::builder([6, 6, 6], [0.05; 3]).fix(Face::ZMin).build()?;
/// let session = Session::builder(body).device(Pendulum).virtual_time().duration_s(0.02);
/// assert!(session.build()?.run()?.runtime.fault.is_none());
/// # Ok(())
/// # }
/// ```
pub trait Device: Send {
    /// The name of the device in reports and logs.
    ///
    /// # Real-time
    /// Not called in a tick.
    fn name(&self) -> &str;

    /// The abilities of the device, from which limits and gains follow.
    ///
    /// # Real-time
    /// Asked before the run, not in a tick.
    fn capabilities(&self) -> Capabilities;

    /// Whether the device exerts the forces that it is given: false for one whose [`write`](Self::write) moves nothing:
    /// nobody needs to wait for its force to fade.
    ///
    /// # Real-time
    /// Asked before the run, not in a tick.
    fn exerts_force(&self) -> bool {
        true
    }

    /// Whether the device knows where it is. A session is not started on one that does not.
    ///
    /// # Real-time
    /// Asked before the run, not in a tick.
    fn calibration(&self) -> Calibration {
        Calibration::Done
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

    /// Reads the state at `time`, the scheduled time of the release.
    ///
    /// # Errors
    /// A [`DeviceFault`]; the run goes on with the last state. Whatever the fault, the next read is allowed.
    ///
    /// # Real-time
    /// Called in the haptic tick: must neither allocate nor block.
    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault>;

    /// Exerts a force, and a torque if it can, until the next call, or until the command expires.
    ///
    /// A device that has a clock of its own drops to zero at the expiry by itself. One that sees time only through
    /// [`read`](Self::read) does so at the first read from then on.
    ///
    /// # Errors
    /// A [`DeviceFault`]; it is counted and reported. A force or torque that is not finite is [`DeviceFault::Refused`]
    /// and leaves none behind; one above the limit is refused or shortened. A device that exerts no torque
    /// ([`Capabilities::max_torque_n_m`]) is given none.
    ///
    /// # Real-time
    /// Called in the haptic tick: must neither allocate nor block.
    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault>;

    /// The force that it exerts at the time of the last read (N), if it measures or simulates that: what the
    /// [conformance suite](super::conformance) watches limits and expiry with.
    ///
    /// # Real-time
    /// Not called in a tick.
    fn exerted(&self) -> Option<Vec3> {
        None
    }

    /// The torque that it exerts at the time of the last read (N m), if it measures or simulates that.
    ///
    /// # Real-time
    /// Not called in a tick.
    fn exerted_torque(&self) -> Option<Vec3> {
        None
    }
}

impl std::fmt::Debug for dyn Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device").field("name", &self.name()).finish_non_exhaustive()
    }
}

impl<D: Device + ?Sized> Device for Box<D> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn capabilities(&self) -> Capabilities {
        (**self).capabilities()
    }

    fn exerts_force(&self) -> bool {
        (**self).exerts_force()
    }

    fn calibration(&self) -> Calibration {
        (**self).calibration()
    }

    fn wait(&mut self, timeout: Duration) -> bool {
        (**self).wait(timeout)
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        (**self).read(time)
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        (**self).write(command)
    }

    fn exerted(&self) -> Option<Vec3> {
        (**self).exerted()
    }

    fn exerted_torque(&self) -> Option<Vec3> {
        (**self).exerted_torque()
    }
}

/// What a device that exerts nothing answers to a command.
pub(super) fn take_nothing(command: ForceCommand) -> Result<(), DeviceFault> {
    if command.is_finite() { Ok(()) } else { Err(DeviceFault::Refused) }
}
