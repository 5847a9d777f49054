//! The tools of a session: each with its device, its contact, its limits.

use super::super::parts::{OpenHaply, Parts, Side};
use super::body::Start;
use super::device;
use super::limits::{self, check_capabilities, check_ramp};
use crate::actors::Bounds;
use crate::devices::{Device, ElsewhereHandle, PointerHandle};
use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::Body;
use crate::model::contact::{Contact, ToolShape};
use crate::runtime::{Execution, Rate};
use crate::safety::Limits;
use crate::safety::coupling::Design;
use crate::scene::{DeviceSpec, SafetySpec, Scene, numbered};

const _: () = assert!(crate::scene::MAX_DEVICES == crate::log::MAX_DEVICES as usize, "the log numbers every device");

/// A tool before the start.
#[derive(Debug)]
pub(crate) struct Tool {
    /// Its name; empty for the only one.
    pub(crate) name: String,
    pub(crate) device: Box<dyn Device>,
    /// What moves it, if it follows a pointer.
    pub(crate) pointer: Option<PointerHandle>,
    /// Its device is at another machine, which uses the same body.
    pub(crate) is_elsewhere: bool,
    /// What moves it then.
    pub(crate) elsewhere: Option<ElsewhereHandle>,
    /// How it touches the body at the start.
    pub(crate) contact: Contact,
    /// Where the node is then that it is glued to.
    pub(crate) glued_at: Option<Vec3>,
    pub(crate) shape: ToolShape,
    pub(crate) limits: Limits,
    /// What is believed of its device.
    pub(crate) bounds: Bounds,
    /// Between device and simulated tool.
    pub(crate) coupling: Option<Design>,
}

/// What tools are made from.
pub(super) struct Making<'a> {
    pub(super) scene: &'a Scene,
    pub(super) start: &'a mut Start,
    pub(super) haptic: Rate,
    pub(super) execution: Execution,
    pub(super) open_haply: Option<OpenHaply>,
    pub(super) is_replay: bool,
    pub(super) side: Side,
    /// The devices that are at this machine, if not all are.
    pub(super) here: Option<&'a [String]>,
}

/// Fills in the scene's devices for those that a program brings, one each with a name if there are several, and the shapes of
/// tools.
pub(super) fn complete(scene: &mut Scene, parts: &Parts) {
    let brought = parts.devices.len().max(parts.attached.len()).max(parts.shapes.len());
    if brought > scene.devices.len() {
        scene.devices.resize_with(brought, DeviceSpec::default);
    }
    for (spec, (name, _)) in scene.devices.iter_mut().zip(&parts.devices) {
        if name.is_some() {
            spec.name.clone_from(name);
        }
    }
    for (spec, shape) in scene.devices.iter_mut().zip(&parts.shapes) {
        spec.tool = shape.map_or(spec.tool, Into::into);
    }
}

/// The tools, in the order of the scene, and its safety section with what it left to the devices.
///
/// # Errors
/// If a device cannot be made, or its limits and the scene's do not go together.
pub(super) fn tools(
    brought: Vec<(Option<String>, Box<dyn Device>)>,
    making: Making<'_>,
) -> Result<(Vec<Tool>, SafetySpec), Error> {
    let Making { scene, start, haptic, execution, open_haply, is_replay, side, here } = making;
    let (body, state, tick) = (&mut *start.body, &start.state, haptic.period_s());
    // Both ledgers begin with a share of what is stored: together they give out no more than all of it.
    let stored_j = limits::stored_energy(body, state) / scene.devices.len() as f64;
    let mut brought = brought.into_iter();
    let (mut tools, mut all_resolved) = (Vec::new(), Vec::new());
    for (index, (spec, &node)) in scene.devices.iter().zip(&start.attached).enumerate() {
        let of_this = |error: Error| numbered(error, index, &scene.devices);
        let glued_at = node.map(|node| state.positions[node as usize]);
        let mine = brought.next();
        let (device, pointer, elsewhere) = match mine {
            _ if !is_here(spec, here) => {
                let (device, handle) = device::elsewhere(spec, glued_at, &state.positions);
                (device, None, Some(handle))
            }
            Some((_, device)) => (device, None, None),
            None => {
                let (device, pointer) =
                    device::device(spec, tick, glued_at, &state.positions, execution, open_haply).map_err(of_this)?;
                (device, pointer, None)
            }
        };
        // In the run that is executed again, or at the machine where it is, it has met its faults and was looked at.
        let was_met = is_replay || elsewhere.is_some();
        let device = if was_met { device } else { device::with_faults(device, spec) };
        let device_limits = limits::device_limits(&scene.safety, &device.capabilities());
        let resolved = limits::resolved(scene, &device_limits);
        let limits = limits::limits(&resolved, &device_limits, stored_j, tick);
        // Of one that is at another machine nobody knows here what it can do.
        if side != Side::Global && elsewhere.is_none() {
            check_ramp(&limits).map_err(of_this)?;
            check_capabilities(device.capabilities(), &limits).map_err(of_this)?;
        }
        // One that is elsewhere is told where it is behind its coupling.
        let coupling = match scene.local.coupling && elsewhere.is_none() {
            true => Some(limits::coupling(body, node, &device_limits, tick)?),
            false => None,
        };
        let contact = node.map_or_else(Contact::default, |node| glued(body, node));
        let reach_m = limits::reach_m(&device.capabilities(), body);
        let bounds = match was_met {
            true => Bounds::NONE,
            false => {
                device::check_path(spec, reach_m).map_err(of_this)?;
                Bounds::of(reach_m, device.exerts_force())
            }
        };
        let name = spec.name.clone().filter(|_| scene.devices.len() > 1).unwrap_or_default();
        tools.push(Tool {
            name,
            device,
            pointer,
            is_elsewhere: elsewhere.is_some(),
            elsewhere,
            contact,
            glued_at,
            shape: spec.tool.shape(),
            limits,
            bounds,
            coupling,
        });
        all_resolved.push(resolved);
    }
    // What differs between devices stays theirs.
    let agreed = all_resolved.windows(2).all(|pair| pair[0] == pair[1]);
    let resolved = all_resolved.into_iter().next().filter(|_| agreed).unwrap_or_else(|| scene.safety.clone());
    Ok((tools, resolved))
}

/// Checks that the devices which are said to be `here` are some of those of a scene, and that there is another machine for the others.
///
/// # Errors
/// If not, naming the device and what there is.
pub(super) fn check_here(here: &[String], devices: &[DeviceSpec], side: Side) -> Result<(), Error> {
    let names: Vec<&str> = devices.iter().filter_map(|device| device.name.as_deref()).collect();
    if let Some(unknown) = here.iter().find(|name| !names.contains(&name.as_str())) {
        let known = if names.is_empty() { "one without a name".to_owned() } else { names.join(", ") };
        return Err(Error::scene("device", format!("has no {unknown:?}: the scene's devices are {known}")));
    }
    if side != Side::Haptic && !devices.iter().all(|device| is_here(device, Some(here))) {
        let message =
            "a device that is at another machine needs a global model that both take their models from, over a link";
        return Err(Error::scene("device", message));
    }
    Ok(())
}

/// True if the device of `spec` is at this machine.
fn is_here(spec: &DeviceSpec, here: Option<&[String]>) -> bool {
    here.is_none_or(|here| spec.name.as_ref().is_some_and(|name| here.contains(name)))
}

/// The contact that glues the tool to `node`.
fn glued(body: &dyn Body, node: u32) -> Contact {
    let triangle = body.surface().at_node(node)[0];
    let weights = body.surface().triangles[triangle as usize].map(|corner| f64::from(u8::from(corner == node)));
    Contact::glued(triangle, weights)
}
