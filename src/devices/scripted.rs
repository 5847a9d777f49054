//! A tool that follows a path and ignores the force.

use super::{Capabilities, Device, DeviceFault, DeviceState, ToolPath};
use crate::model::Vec3;
use crate::time::Nanos;

/// Follows a path; exerts nothing.
///
/// # Real-time
/// Real-time safe; bounded by a binary search over the samples of the path.
#[derive(Clone, Debug)]
pub struct Scripted {
    path: ToolPath,
    last: Option<(Nanos, Vec3)>,
}

impl Scripted {
    /// The largest force of the device that the paper used, Phantom Premium 1.5 (N).
    const MAX_FORCE_N: f64 = 8.5;

    /// A tool on `path`; past its end it holds the last sample.
    pub fn new(path: ToolPath) -> Self {
        Self { path, last: None }
    }
}

impl Device for Scripted {
    fn name(&self) -> &str {
        "scripted"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: Self::MAX_FORCE_N }
    }

    fn exerts_force(&self) -> bool {
        false
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let position = Vec3::from(self.path.at(time.as_secs_f64()));
        let velocity = match self.last {
            Some((before, was)) if time > before => (position - was) / time.saturating_sub(before).as_secs_f64(),
            _ => Vec3::zeros(),
        };
        self.last = Some((time, position));
        Ok(DeviceState { position, velocity, buttons: 0 })
    }

    fn write(&mut self, _: Vec3) -> Result<(), DeviceFault> {
        Ok(())
    }
}
