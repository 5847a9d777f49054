//! What can be wrong with the devices of a scene: each by itself, and several together.

use super::super::device::{DeviceKind, DeviceProfile, DeviceSpec, field, numbered};
use super::super::tool::ToolSpec;
use super::check::{at_most_ms, lengths_within, not_negative, positive};
use crate::devices::{HandSpec, PlantSpec, PointerSpec};
use crate::error::Error;
use crate::model::contact::Equations;

/// More hands than two people have; the log numbers them in few bits.
pub(crate) const MAX_DEVICES: usize = 8;

/// Longer than any operator would wait to see that a cable is out (ms).
const LONGEST_WATCHDOG_MS: f64 = 1000.0;

/// A base that is farther away is a wrong unit (m).
const FARTHEST_M: f64 = 1e3;

/// A smaller tool is a point (m).
const LEAST_RADIUS_M: f64 = 1e-4;

/// A larger tool is a wrong unit (m).
const LARGEST_TOOL_M: f64 = 1.0;

/// First words of topics that a device's own would be mistaken for.
const TAKEN: [&str; 5] = ["timing", "stats", "global", "ports", "log"];

/// What can be wrong with them.
pub(super) fn validate(devices: &[DeviceSpec], equations: Equations) -> Result<(), Error> {
    for (index, device) in devices.iter().enumerate() {
        self::device(device)
            .and_then(|()| shape(device.tool, equations))
            .map_err(|error| numbered(error, index, devices))?;
    }
    if devices.len() == 1 {
        return Ok(());
    }
    if equations == Equations::Paper {
        let message = "\"paper\" are equations for one tool, use \"corrected\" with several devices";
        return Err(Error::scene("contact.equations", message));
    }
    devices.iter().enumerate().try_for_each(|(index, device)| name(index, device, devices))
}

fn name(index: usize, device: &DeviceSpec, devices: &[DeviceSpec]) -> Result<(), Error> {
    let field = format!("{}.name", field(index, devices.len()));
    let Some(name) = &device.name else {
        return Err(Error::scene(
            &field,
            "is missing, each of several devices needs one for its topics and its report",
        ));
    };
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name.is_empty() || !name.chars().all(is_plain) || TAKEN.contains(&name.as_str()) {
        let taken = TAKEN.join(", ");
        let message = format!("is {name:?}, must be of lower-case letters, digits and _, and none of {taken}");
        return Err(Error::scene(&field, message));
    }
    if devices[..index].iter().any(|other| other.name == device.name) {
        return Err(Error::scene(&field, format!("is {name:?}, as that of an earlier device, use another")));
    }
    Ok(())
}

/// What can be wrong with one of them.
fn device(device: &DeviceSpec) -> Result<(), Error> {
    if device.path_csv.is_some() && device.path.is_none() {
        let message = "was not read, use Scene::load, or set device.path to a ToolPath";
        return Err(Error::scene("device.path_csv", message));
    }
    // A key that does nothing is a mistake in the scene.
    let of_kind = [
        ("device.plant", device.plant != PlantSpec::default(), DeviceKind::Hand, "hand"),
        ("device.hand", device.hand != HandSpec::default(), DeviceKind::Hand, "hand"),
        ("device.pointer", device.pointer != PointerSpec::default(), DeviceKind::Pointer, "pointer"),
        ("device.log", device.log.is_some(), DeviceKind::Replay, "replay"),
    ];
    if let Some((field, .., name)) = of_kind.iter().find(|(_, is_set, kind, _)| *is_set && device.kind != *kind) {
        return Err(Error::scene(field, format!("belongs to kind = {name:?}, set that or leave it out")));
    }
    if device.kind == DeviceKind::Replay && device.path_csv.is_some() {
        let message = "does nothing with kind = \"replay\", the tool moves as in the log: leave it out";
        return Err(Error::scene("device.path_csv", message));
    }
    if device.kind == DeviceKind::Pointer && (device.path_csv.is_some() || device.path.is_some()) {
        let message = "does nothing with kind = \"pointer\", whoever points says where the tool goes: leave it out";
        return Err(Error::scene("device.path_csv", message));
    }
    let none_of = |table: &str, fault: Option<(&str, String)>| match fault {
        None => Ok(()),
        Some((field, message)) => Err(Error::scene(&format!("device.{table}.{field}"), message)),
    };
    none_of("plant", device.plant.fault())?;
    none_of("hand", device.hand.fault())?;
    none_of("pointer", device.pointer.fault())?;
    haply(device)?;
    let mut faults = device.faults.iter().enumerate();
    faults.try_for_each(|(index, spec)| none_of(&format!("fault[{index}]"), spec.fault()))
}

/// What can be wrong with the shape of a tool.
fn shape(tool: ToolSpec, equations: Equations) -> Result<(), Error> {
    let radius_m = match tool {
        ToolSpec::Point => return Ok(()),
        ToolSpec::Sphere { radius_m } | ToolSpec::Capsule { radius_m, .. } => radius_m,
    };
    let field = "device.tool.radius_m";
    positive(field, radius_m)?;
    if radius_m < LEAST_RADIUS_M {
        let message =
            format!("is {radius_m}, must be at least {LEAST_RADIUS_M} m: use tool = \"point\" for a smaller one");
        return Err(Error::scene(field, message));
    }
    if radius_m > LARGEST_TOOL_M {
        return Err(Error::scene(
            field,
            format!("is {radius_m}, must be at most {LARGEST_TOOL_M} m: is it in metres?"),
        ));
    }
    if let ToolSpec::Capsule { length_m, axis, .. } = tool {
        let field = "device.tool.length_m";
        not_negative(field, length_m)?;
        if length_m >= LARGEST_TOOL_M {
            let message = format!("is {length_m}, must be below {LARGEST_TOOL_M} m: is it in metres?");
            return Err(Error::scene(field, message));
        }
        if !axis.iter().all(|c| c.is_finite()) || axis == [0.0; 3] {
            let message = format!("is {axis:?}, must be three finite numbers that are not all 0: a direction");
            return Err(Error::scene("device.tool.axis", message));
        }
    }
    if equations == Equations::Paper {
        let name = tool.name();
        let message = format!(
            "is a {name}, and contact.equations = \"paper\" are for a point: use \"corrected\" there or tool = \"point\""
        );
        return Err(Error::scene("device.tool", message));
    }
    Ok(())
}

/// A scene file must move its tool itself; a program may bring a device of its own.
pub(crate) fn tool(device: &DeviceSpec) -> Result<(), Error> {
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

/// What can be wrong with a device that is really there.
fn haply(device: &DeviceSpec) -> Result<(), Error> {
    let Some(spec) = &device.haply else {
        return match device.kind {
            DeviceKind::Haply => {
                let message = "is missing: a haply device needs the table [device.haply] with max_force_n";
                Err(Error::scene("device.haply", message))
            }
            _ => Ok(()),
        };
    };
    if device.kind != DeviceKind::Haply {
        return Err(Error::scene("device.haply", "belongs to kind = \"haply\", set that or leave it out"));
    }
    let (has_path, is_attached) = (device.path_csv.is_some() || device.path.is_some(), device.attach_node.is_some());
    let has_profile = device.profile != DeviceProfile::default();
    for (field, is_set, why) in [
        ("path_csv", has_path, "moves a simulated tool, and a haply device is moved by a hand"),
        ("attach_node", is_attached, "glues a tool that starts at its node, and a hand starts anywhere"),
        ("profile", has_profile, "names the limits of a simulated device, those of this one are in device.haply"),
    ] {
        if is_set {
            return Err(Error::scene(&format!("device.{field}"), format!("{why}: leave it out")));
        }
    }
    positive("device.haply.max_force_n", spec.max_force_n)?;
    lengths_within("device.haply.origin_m", spec.origin_m, FARTHEST_M)?;
    positive("device.haply.watchdog_ms", spec.watchdog_ms)?;
    at_most_ms("device.haply.watchdog_ms", spec.watchdog_ms, LONGEST_WATCHDOG_MS)
}
