//! A device that the program itself reads and writes, in a haptic loop that it has already.
//!
//! The loop puts the state that it read ([`HostSide::put`]) and takes the command that it is to write ([`HostSide::command`]), once
//! per tick. Both go through exchanges, wait-free on both sides; where the loop also releases the group of the session's local model
//! ([`HostedGroup`](crate::runtime::HostedGroup)), state in and force out are of the same release.

use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use crate::error::{Error, ErrorKind};
use crate::runtime::Nanos;
use crate::runtime::exchange::{ExchangeReader, ExchangeWriter, exchange};

/// A device that the program drives: the session's end of it.
///
/// A read without a new state is [`DeviceFault::Stale`], so that the force fades when the program falls silent.
///
/// ```
/// use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, Hosted};
/// use palpate::runtime::Nanos;
///
/// let (mut device, mut host) = Hosted::new(Capabilities::OMEGA_3, DeviceState::default())?;
/// assert!(device.read(Nanos(0)).is_ok(), "the first state");
/// assert_eq!(device.read(Nanos(1_000_000)), Err(DeviceFault::Stale));
/// host.put(DeviceState { buttons: 1, ..DeviceState::default() });
/// assert_eq!(device.read(Nanos(2_000_000)).map(|state| state.buttons), Ok(1));
/// # Ok::<(), palpate::Error>(())
/// ```
///
/// # Real-time
/// Real-time safe: wait-free.
#[derive(Debug)]
pub struct Hosted {
    capabilities: Capabilities,
    states: ExchangeReader<DeviceState>,
    commands: ExchangeWriter<ForceCommand>,
    /// The first state has not been read.
    is_first: bool,
}

/// The program's end of a [`Hosted`] device.
#[derive(Debug)]
pub struct HostSide {
    states: ExchangeWriter<DeviceState>,
    commands: ExchangeReader<ForceCommand>,
}

impl Hosted {
    /// A device of these `capabilities` that is at `first` before the run, and the program's end of it.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] with the capability that cannot be.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(capabilities: Capabilities, first: DeviceState) -> Result<(Self, HostSide), Error> {
        if let Some(fault) = capabilities.fault() {
            return Err(Error::new(ErrorKind::Device, fault).at("device `hosted`"));
        }
        let (states, read) = exchange(|| first);
        let (write, commands) = exchange(|| ForceCommand::ZERO);
        Ok((Self { capabilities, states: read, commands: write, is_first: true }, HostSide { states, commands }))
    }
}

impl Device for Hosted {
    fn name(&self) -> &str {
        "hosted"
    }

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn read(&mut self, _: Nanos) -> Result<DeviceState, DeviceFault> {
        let is_new = self.states.refresh() | std::mem::take(&mut self.is_first);
        if is_new { Ok(*self.states.get()) } else { Err(DeviceFault::Stale) }
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        let is_good = command.is_finite();
        *self.commands.buffer() = if is_good { command } else { ForceCommand::ZERO };
        self.commands.publish(Nanos::ZERO);
        if is_good { Ok(()) } else { Err(DeviceFault::Refused) }
    }
}

impl HostSide {
    /// Tells the newest state of the device. One that is not finite, or whose orientation is no turn, is not used.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the tick.
    pub fn put(&mut self, state: DeviceState) {
        *self.states.buffer() = state;
        self.states.publish(Nanos::ZERO);
    }

    /// The newest command for the device, zero before the first. What it says of its expiry is on the clock of the run.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the tick.
    pub fn command(&mut self) -> ForceCommand {
        self.commands.refresh();
        *self.commands.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Vec3;

    #[test]
    fn a_command_that_is_no_number_leaves_none_behind() {
        let (mut device, mut host) = Hosted::new(Capabilities::TOUCH, DeviceState::default()).unwrap();
        device.write(ForceCommand::until(Vec3::x(), Nanos(5))).unwrap();
        assert_eq!(host.command().force, Vec3::x());
        let refused = device.write(ForceCommand::until(Vec3::repeat(f64::NAN), Nanos(5)));
        assert_eq!((refused, host.command()), (Err(DeviceFault::Refused), ForceCommand::ZERO));
        assert_eq!(host.command(), ForceCommand::ZERO);
    }

    #[test]
    fn a_capability_that_cannot_be_is_named() {
        let no_force = Capabilities { max_force_n: 0.0, ..Capabilities::TOUCH };
        let error = Hosted::new(no_force, DeviceState::default()).unwrap_err().to_string();
        assert!(error.contains("max_force_n"), "{error}");
    }
}
