//! Makes the device that a scene describes.

use std::path::Path;

use super::super::parts::OpenHaply;
use crate::devices::{
    Device, DeviceState, Elsewhere, ElsewhereHandle, Faulty, Hand, Pointer, PointerHandle, Replayed, ReplayedSample,
    Scripted, ToolPath,
};
use crate::error::{Error, ErrorKind};
use crate::files;
use crate::log::{LogEntry, LogReader, LogRecord, ToolSample};
use crate::model::contact::ToolShape;
use crate::model::{Pose, Vec3};
use crate::runtime::Execution;
use crate::scene::{DeviceKind, DeviceSpec};

/// A glued tool that starts farther from its node would tear it there in the first tick (m).
const LARGEST_START_GAP: f64 = 1e-3;

/// A device, and what moves it if that is a pointer.
pub(super) type Made = (Box<dyn Device>, Option<PointerHandle>);

/// The device of `spec` for ticks of `tick` (s); `glued_at` is where the node that the tool is glued to is at the start,
/// `body` where its nodes are.
pub(super) fn device(
    spec: &DeviceSpec,
    tick: f64,
    glued_at: Option<Vec3>,
    body: &[Vec3],
    execution: Execution,
    open_haply: Option<OpenHaply>,
) -> Result<Made, Error> {
    let capabilities = spec.profile.capabilities();
    let made: Result<Box<dyn Device>, Error> = match spec.kind {
        DeviceKind::Pointer => return pointer(spec, glued_at, body),
        DeviceKind::Scripted => {
            let path = path(spec, glued_at)?;
            check_start("device.path_csv", path.at(0.0).into(), glued_at)?;
            Ok(Box::new(Scripted::new(path).with_capabilities(capabilities)))
        }
        DeviceKind::Hand => {
            let path = path(spec, glued_at)?;
            let start = spec.plant.start_m.unwrap_or_else(|| path.at(0.0));
            check_start("device.plant.start_m", start.into(), glued_at)?;
            Ok(Box::new(Hand::new(path, spec.plant.clone(), spec.hand.clone(), capabilities)?))
        }
        DeviceKind::Replay => replayed(spec, glued_at),
        DeviceKind::Haply => haply(spec, tick, execution, open_haply),
    };
    made.map(|device| (device, None))
}

/// Clear of a `body` that it starts above, in its largest extent.
const CLEARANCE: f64 = 0.1;

/// Clear of the body, above its middle: where the tool of `spec` is before anybody says otherwise, unless it is glued.
fn home(spec: &DeviceSpec, glued_at: Option<Vec3>, body: &[Vec3]) -> Vec3 {
    glued_at.unwrap_or_else(|| {
        let corner = |by: fn(&Vec3, &Vec3) -> Vec3| body.iter().copied().reduce(|a, b| by(&a, &b)).unwrap_or_default();
        let (low, high) = (corner(Vec3::inf), corner(Vec3::sup));
        let reach = match spec.tool.shape() {
            ToolShape::Point => 0.0,
            ToolShape::Sphere { radius } => radius,
            ToolShape::Capsule { radius, half_axis } => radius + half_axis.norm(),
        };
        let middle = 0.5 * (low + high);
        Vec3::new(middle.x, middle.y, high.z + reach + CLEARANCE * (high - low).amax())
    })
}

/// The tool behind a pointer, which starts at the node that it is glued to, or clear of the body, above its middle.
fn pointer(spec: &DeviceSpec, glued_at: Option<Vec3>, body: &[Vec3]) -> Result<Made, Error> {
    let home = home(spec, glued_at, body);
    let (tool, handle) = Pointer::new(spec.pointer.clone(), home.into(), spec.profile.capabilities())
        .map_err(|error| error.at("device.pointer"))?;
    check_start("device.pointer.start_m", handle.home().into(), glued_at)?;
    Ok((Box::new(tool), Some(handle)))
}

/// A tool whose device is at another machine, and what moves it.
pub(super) fn elsewhere(
    spec: &DeviceSpec,
    glued_at: Option<Vec3>,
    body: &[Vec3],
) -> (Box<dyn Device>, ElsewhereHandle) {
    let (device, handle) = Elsewhere::new(spec.profile.capabilities(), Pose::at(home(spec, glued_at, body)));
    (Box::new(device), handle)
}

/// `device` with the faults of `spec`.
pub(super) fn with_faults(device: Box<dyn Device>, spec: &DeviceSpec) -> Box<dyn Device> {
    if spec.faults.is_empty() {
        return device;
    }
    Box::new(Faulty::new(device, spec.faults.clone()))
}

/// Connects to the service of a Haply device that is driven every `tick` seconds.
fn haply(
    device: &DeviceSpec,
    tick: f64,
    execution: Execution,
    open: Option<OpenHaply>,
) -> Result<Box<dyn Device>, Error> {
    if execution == Execution::Virtual {
        let message = "is \"haply\", a device that is really there: it cannot run in virtual time";
        return Err(Error::scene("device.kind", message));
    }
    let spec = device.haply.as_ref().ok_or_else(|| Error::scene("device.haply", "is missing"))?;
    let message = "is \"haply\", which this program does not open: give `palpate_haply::open` to its session";
    open.ok_or_else(|| Error::scene("device.kind", message))?(spec, tick)
}

/// Where the tool, or the hand that holds it, goes; without a path it stays where the node is that it is glued to.
fn path(spec: &DeviceSpec, glued_at: Option<Vec3>) -> Result<ToolPath, Error> {
    match (&spec.path, glued_at) {
        (Some(path), _) => Ok(path.clone()),
        (None, Some(position)) => ToolPath::constant(position.into()),
        (None, None) => {
            let message = "nothing moves the tool: give it a path_csv, an attach_node or a device of the program's own";
            Err(Error::new(ErrorKind::Scene, message).at("device"))
        }
    }
}

/// Refuses a path that leaves what its device reaches (m) from the path's beginning: most often it is of another unit.
pub(super) fn check_path(spec: &DeviceSpec, reach_m: f64) -> Result<(), Error> {
    let Some(path) = &spec.path else { return Ok(()) };
    let first = Vec3::from(path.positions_m()[0]);
    let samples = path.times_s().iter().zip(path.positions_m());
    let far_m = |position: &[f64; 3]| (Vec3::from(*position) - first).norm();
    match samples.into_iter().find(|(_, position)| far_m(position) > reach_m) {
        None => Ok(()),
        Some((time_s, position)) => {
            let message = format!(
                "is at {position:?} m after {time_s} s, {} m from its beginning, and the device reaches {reach_m:.3} m: is \
                 the path in metres?",
                far_m(position)
            );
            Err(Error::scene("device.path_csv", message))
        }
    }
}

fn check_start(field: &str, start: Vec3, glued_at: Option<Vec3>) -> Result<(), Error> {
    let gap = glued_at.and_then(|node| start_gap(start, node));
    gap.map_or(Ok(()), |message| Err(Error::scene(field, message)))
}

/// What is wrong with a `start` of a tool that is glued to a node at `node`, if it is too far from there.
pub(in crate::session) fn start_gap(start: Vec3, node: Vec3) -> Option<String> {
    let (gap, place): (_, [f64; 3]) = ((start - node).norm(), node.into());
    (gap > LARGEST_START_GAP)
        .then(|| format!("starts {gap} m away from the node that the tool is glued to, must start at {place:?}"))
}

fn replayed(spec: &DeviceSpec, glued_at: Option<Vec3>) -> Result<Box<dyn Device>, Error> {
    let Some(log) = &spec.log else {
        return Err(Error::scene("device.log", "is missing, name the log whose device is replayed"));
    };
    let (first, samples) = recorded(log, spec.name.as_deref()).map_err(|error| error.at("device.log"))?;
    check_start("device.log", first.position, glued_at)?;
    Ok(Box::new(Replayed::new(first, samples, spec.profile.capabilities()).at_any_rate()))
}

/// The first state and the samples of the tool in a log, as far as it is whole: of the device called `name` if the log has
/// several, where no name means the first.
fn recorded(log: &Path, name: Option<&str>) -> Result<(DeviceState, Vec<ReplayedSample>), Error> {
    files::ordinary(log)?;
    let mut reader = LogReader::open(log)?;
    let reader_place = reader.place().to_owned();
    let (mut number, mut first, mut samples) = (0, None, Vec::new());
    for entry in reader.readable() {
        match entry {
            LogEntry::Environment(environment) => {
                let devices = &environment.devices;
                let place = devices.iter().position(|device| Some(device.as_str()) == name);
                if let (None, Some(name), false) = (place, name, devices.is_empty()) {
                    let message = format!("it has no device {name:?}, but {}", devices.join(" and "));
                    return Err(Error::new(ErrorKind::Log, message).at(reader_place));
                }
                number = place.unwrap_or_default() as u16;
                first = environment.first_tools.get(usize::from(number)).map(|first| logged(first).state);
            }
            LogEntry::Record(LogRecord::Tool(sample)) if sample.device == number => {
                samples.push(logged(&sample));
            }
            _ => {}
        }
    }
    // Records of one actor are in order, chunks of a damaged log need not be.
    samples.sort_by_key(|sample| sample.time);
    match first.or_else(|| samples.first().map(|sample| sample.state)) {
        Some(first) if !samples.is_empty() => Ok((first, samples)),
        _ => Err(Error::new(ErrorKind::Log, "it holds no sample of a tool").at(reader.place())),
    }
}

/// The sample of a device that a log has.
pub(in crate::session) fn logged(sample: &ToolSample) -> ReplayedSample {
    let state = DeviceState {
        position: sample.position_m.into(),
        velocity: sample.velocity_m_s.into(),
        orientation: sample.orientation,
        buttons: sample.buttons,
    };
    ReplayedSample { time: sample.time, id: sample.id, state }
}
