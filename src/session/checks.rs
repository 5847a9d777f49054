//! What a session refuses beyond what a scene's own validation can see.

use crate::devices::Capabilities;
use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::Body;
use crate::model::local::Kind;
use crate::safety::Limits;
use crate::scene::{Scene, device_field};

/// Limits and gains follow from what the device says, so it must be possible; its largest force is [`check_ramp`]'s.
pub(super) fn check_capabilities(capabilities: Capabilities, limits: &Limits) -> Result<(), Error> {
    let asked = Capabilities { max_force_n: limits.max_force_n, continuous_force_n: None, ..capabilities };
    asked.fault().map_or(Ok(()), |words| Err(Error::scene("device", format!("has impossible capabilities: {words}"))))
}

/// The slew limit must not keep the force from being gone when the ramp is over.
pub(super) fn check_ramp(limits: &Limits) -> Result<(), Error> {
    if !(limits.max_force_n.is_finite() && limits.max_force_n > 0.0) {
        let message = format!("has a largest force of {} N, must be a finite number above 0", limits.max_force_n);
        return Err(Error::scene("device", message));
    }
    let needed_s = limits.max_force_n / limits.max_slew_n_per_s;
    if limits.ramp_s >= needed_s {
        return Ok(());
    }
    let message = format!(
        "is {} ms, but the largest force of {} N takes {} ms at the slew limit: use that or more, or raise \
         safety.max_slew_n_per_ms",
        limits.ramp_s * 1e3,
        limits.max_force_n,
        (needed_s * 1e3).ceil()
    );
    Err(Error::scene("safety.ramp_ms", message))
}

/// What a program's own body can get wrong.
pub(super) fn check_body(body: &dyn Body) -> Result<(), Error> {
    let (nodes, masses) = (body.rest().len(), body.inverse_masses().len());
    if nodes == 0 || nodes != masses {
        let message =
            format!("has {nodes} nodes and {masses} inverse masses, one each for at least one node is needed");
        return Err(Error::scene("body", message));
    }
    if !body.rest().iter().flat_map(Vec3::iter).all(|c| c.is_finite()) {
        return Err(Error::scene("body", "has rest positions that are not finite"));
    }
    if !body.inverse_masses().iter().all(|w| w.is_finite() && *w >= 0.0) {
        return Err(Error::scene("body", "has inverse masses that are negative or not finite"));
    }
    if body.surface().triangles.is_empty() {
        return Err(Error::scene("body", "has no surface triangles, a tool could not touch it"));
    }
    Ok(())
}

pub(super) fn check_nodes(body: &dyn Body, attached: &[Option<u32>], probes: &[u32]) -> Result<(), Error> {
    let nodes = body.rest().len();
    let field = |index: usize| format!("{}.attach_node", device_field(index, attached.len()));
    let glued = || attached.iter().enumerate().filter_map(|(index, node)| Some((field(index), (*node)?)));
    for (field, node) in glued().chain(probes.iter().map(|&node| ("probe".to_owned(), node))) {
        if node as usize >= nodes {
            let message = format!("node {node} is outside the body, nodes run from 0 to {}", nodes - 1);
            return Err(Error::scene(&field, message));
        }
    }
    for (field, node) in glued() {
        if !body.surface().has_node(node) {
            let message =
                format!("node {node} is inside the body, the tool can only be glued to a node of the surface");
            return Err(Error::scene(&field, message));
        }
        if body.inverse_masses()[node as usize] == 0.0 {
            return Err(Error::scene(&field, format!("node {node} is held, the tool could not move it")));
        }
    }
    Ok(())
}

/// A model of the whole body cannot be each tool's own.
pub(super) fn check_model(kind: Kind, scene: &Scene) -> Result<(), Error> {
    if kind != Kind::Full || scene.devices.len() == 1 {
        return Ok(());
    }
    let message = format!(
        "is `full`, which is one model of the whole body, and the {} devices need one each: use another, such as \
         \"predictive\"",
        scene.devices.len()
    );
    Err(Error::scene("local.model", message))
}
