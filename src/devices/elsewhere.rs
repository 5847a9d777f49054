//! A tool whose device is at another machine: it is where that says.

use super::device::take_nothing;
use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use crate::model::Pose;
use crate::runtime::Nanos;
use crate::runtime::exchange::{ExchangeReader, ExchangeWriter, exchange};

/// No tool is faster (m/s): one that is was put where it is, as when another machine takes the place of one, or comes back from a silence.
pub(crate) const FASTEST_M_S: f64 = 2.0;

/// A tool that another machine's device moves; the force on it is felt there.
///
/// While nothing comes, it stays where it is.
///
/// # Real-time
/// Real-time safe: wait-free.
#[derive(Debug)]
pub(crate) struct Elsewhere {
    capabilities: Capabilities,
    poses: ExchangeReader<Pose>,
}

/// The end of whoever hears of the tool.
#[derive(Debug)]
pub(crate) struct ElsewhereHandle(ExchangeWriter<Pose>);

impl Elsewhere {
    /// A tool that begins at `first`, on a device of these `capabilities`.
    pub(crate) fn new(capabilities: Capabilities, first: Pose) -> (Self, ElsewhereHandle) {
        let (writer, poses) = exchange(|| first);
        (Self { capabilities, poses }, ElsewhereHandle(writer))
    }
}

impl ElsewhereHandle {
    /// The tool is at `pose` now.
    pub(crate) fn put(&mut self, pose: Pose) {
        *self.0.buffer() = pose;
        self.0.publish(Nanos::ZERO);
    }
}

impl Device for Elsewhere {
    fn name(&self) -> &str {
        "elsewhere"
    }

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn exerts_force(&self) -> bool {
        false
    }

    fn read(&mut self, _: Nanos) -> Result<DeviceState, DeviceFault> {
        self.poses.refresh();
        let Pose { position, orientation } = *self.poses.get();
        Ok(DeviceState { position, orientation, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        take_nothing(command)
    }
}
