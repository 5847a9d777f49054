//! What can be wrong with the tool's part of a scene.

use super::{DeviceKind, DeviceSpec, HandSpec, PlantSpec, haply};
use crate::error::Error;

pub(super) fn device(device: &DeviceSpec) -> Result<(), Error> {
    if device.path_csv.is_some() && device.path.is_none() {
        let message = "was not read, use Scene::load, or set device.path to a ToolPath";
        return Err(Error::scene("device.path_csv", message));
    }
    // A key that does nothing is a mistake in the scene.
    if device.kind != DeviceKind::Hand {
        let unused = [
            ("device.plant", device.plant != PlantSpec::default()),
            ("device.hand", device.hand != HandSpec::default()),
        ];
        if let Some((field, _)) = unused.iter().find(|(_, is_set)| *is_set) {
            return Err(Error::scene(field, "belongs to kind = \"hand\", set that or leave it out"));
        }
    }
    if device.kind != DeviceKind::Replay && device.log.is_some() {
        return Err(Error::scene("device.log", "belongs to kind = \"replay\", set that or leave it out"));
    }
    if device.kind == DeviceKind::Replay && device.path_csv.is_some() {
        let message = "does nothing with kind = \"replay\", the tool moves as in the log: leave it out";
        return Err(Error::scene("device.path_csv", message));
    }
    if let Some((field, message)) = device.plant.fault() {
        return Err(Error::scene(&format!("device.plant.{field}"), message));
    }
    if let Some((field, message)) = device.hand.fault() {
        return Err(Error::scene(&format!("device.hand.{field}"), message));
    }
    haply::validate(device)?;
    device.faults.iter().enumerate().try_for_each(|(index, fault)| fault.check(&format!("device.fault[{index}]")))
}

/// A scene file must move its tool itself; a program may bring a device of its own.
pub(super) fn tool(device: &DeviceSpec) -> Result<(), Error> {
    let message = match device.kind {
        DeviceKind::Scripted if device.path.is_none() && device.attach_node.is_none() => {
            "has no tool, give path_csv (a file t_s,x_m,y_m,z_m), attach_node or both"
        }
        DeviceKind::Hand if device.path.is_none() && device.attach_node.is_none() => {
            "has a hand that wants nothing, give path_csv (a file t_s,x_m,y_m,z_m), attach_node or both"
        }
        DeviceKind::Replay if device.log.is_none() => "has no log to replay, give log (a file of `palpate run`)",
        _ => return Ok(()),
    };
    Err(Error::scene("device", message))
}
