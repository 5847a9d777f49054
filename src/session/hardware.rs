//! The devices that a scene names and that are really there.

use crate::devices::Device;
use crate::error::Error;
use crate::runtime::{Execution, RateGroup};
use crate::scene::{DeviceKind, DeviceSpec};
use crate::runtime::Nanos;

/// Connects to the service of a Haply device that is driven every `tick` seconds.
#[cfg(feature = "haply")]
pub(super) fn haply(device: &DeviceSpec, tick: f64, execution: Execution) -> Result<Box<dyn Device>, Error> {
    use crate::devices::haply::{Haply, HaplyOptions};
    in_real_time(execution)?;
    let Some(spec) = &device.haply else {
        return Err(Error::scene("device.haply", "is missing"));
    };
    let device = Haply::connect(HaplyOptions {
        address: spec.address.clone(),
        events_address: (!spec.events_address.is_empty()).then(|| spec.events_address.clone()),
        device_id: spec.device_id.clone(),
        max_force_n: spec.max_force_n,
        profile: spec.profile.clone(),
        basis: spec.basis.clone(),
        origin_m: spec.origin_m.into(),
        period: std::time::Duration::from_secs_f64(tick),
    })?;
    Ok(Box::new(device))
}

/// Says that it cannot.
#[cfg(not(feature = "haply"))]
pub(super) fn haply(_: &DeviceSpec, _: f64, execution: Execution) -> Result<Box<dyn Device>, Error> {
    in_real_time(execution)?;
    let message = "is \"haply\", which this build does not have: build it with `--features haply`";
    Err(Error::scene("device.kind", message))
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
