//! The devices that a scene names and that are really there.

use crate::devices::Device;
use crate::error::Error;
use crate::runtime::{Execution, Nanos, RateGroup};
use crate::scene::{DeviceKind, DeviceSpec, HaplySpec};

/// Opens the Haply device that a scene describes, for ticks of so many seconds: `palpate_haply::open`.
pub type OpenHaply = fn(&HaplySpec, f64) -> Result<Box<dyn Device>, Error>;

/// Connects to the service of a Haply device that is driven every `tick` seconds.
pub(super) fn haply(
    device: &DeviceSpec,
    tick: f64,
    execution: Execution,
    open: Option<OpenHaply>,
) -> Result<Box<dyn Device>, Error> {
    in_real_time(execution)?;
    let spec = device.haply.as_ref().ok_or_else(|| Error::scene("device.haply", "is missing"))?;
    let message = "is \"haply\", which this program does not open: give `palpate_haply::open` to its session";
    open.ok_or_else(|| Error::scene("device.kind", message))?(spec, tick)
}

fn in_real_time(execution: Execution) -> Result<(), Error> {
    match execution {
        Execution::Threaded => Ok(()),
        Execution::Virtual => {
            let message = "is \"haply\", a device that is really there: it cannot run in virtual time";
            Err(Error::scene("device.kind", message))
        }
    }
}

/// The haptic group, released by the device if that is the only one and has replies to wait for.
pub(super) fn paced(local: RateGroup, devices: &[DeviceSpec], execution: Execution) -> RateGroup {
    match (devices, execution) {
        ([DeviceSpec { kind: DeviceKind::Haply, haply: Some(spec), .. }], Execution::Threaded) => {
            let watchdog = Nanos::from_secs_f64(spec.watchdog_ms * 1e-3).max(local.rate().period());
            local.device_paced(watchdog)
        }
        _ => local,
    }
}
