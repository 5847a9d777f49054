//! A tool that follows a path and ignores the force.

use super::device::take_nothing;
use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use crate::model::{Pose, Vec3};
use crate::runtime::Nanos;

/// A tool that follows a path and exerts nothing.
///
/// # Real-time
/// Real-time safe; bounded by a binary search over the samples of the path.
#[derive(Clone, Debug)]
pub struct Scripted {
    path: ToolPath,
    capabilities: Capabilities,
    last: Option<(Nanos, Vec3)>,
}

impl Scripted {
    /// A tool on `path`; past its end it holds the last sample. Its limits are those of the paper's device.
    pub fn new(path: ToolPath) -> Self {
        Self { path, capabilities: Capabilities::PHANTOM_PREMIUM, last: None }
    }

    /// Takes the limits of another device.
    #[must_use]
    pub fn with_capabilities(self, capabilities: Capabilities) -> Self {
        Self { capabilities, ..self }
    }
}

impl Device for Scripted {
    fn name(&self) -> &str {
        "scripted"
    }

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn exerts_force(&self) -> bool {
        false
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let Pose { position, orientation } = self.path.pose_at(time.as_secs_f64());
        let velocity = match self.last {
            Some((before, was)) if time > before => (position - was) / time.saturating_sub(before).as_secs_f64(),
            _ => Vec3::zeros(),
        };
        self.last = Some((time, position));
        Ok(DeviceState { position, velocity, orientation, buttons: 0 })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        take_nothing(command)
    }
}
