//! The body of a session as it is at the start, and what can be wrong with it.

use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::{Body, State};
use crate::model::equilibrium::static_equilibrium;
use crate::model::integrator::{MARGIN, Spectrum};
use crate::runtime::Rate;
use crate::scene::{Nodes, Scene, device_field};

/// Steps of 0.1 us, the limit of `global.substeps_per_ms` too: a body that needs more would seem to hang.
const MAX_SUBSTEPS_PER_MS: f64 = 1e4;

/// The body before the first tick, with the nodes that the session names.
pub(super) struct Start {
    pub(super) body: Box<dyn Body>,
    pub(super) state: State,
    /// The nodes that tools are glued to, one for each device.
    pub(super) attached: Vec<Option<u32>>,
    pub(super) probes: Vec<u32>,
    /// The haptic period (s).
    pub(super) tick: f64,
    /// Explicit steps per haptic tick.
    pub(super) substeps: u32,
    /// How many of them the stability limit asks for.
    pub(super) stable_substeps: u32,
    /// That limit (s).
    pub(super) stable_step: f64,
}

impl Start {
    /// The program's `own` body or the scene's, as its `[initial]` says; nodes of the program come before the scene's.
    ///
    /// # Errors
    /// If the body is none that can be simulated, or a node is none that can be named.
    pub(super) fn new(
        own: Option<Box<dyn Body>>,
        scene: &Scene,
        attached: &[Option<u32>],
        probes: Vec<u32>,
        haptic: Rate,
    ) -> Result<Self, Error> {
        let mut body = match (own, &scene.body) {
            (Some(own), _) => own,
            (None, Some(spec)) => spec.build_on(scene.global.cores)?,
            (None, None) => return Err(Error::scene("body", "is missing")),
        };
        check_body(&*body)?;
        let devices = scene.devices.iter().enumerate();
        let attached = devices.map(|(index, _)| match attached.get(index).copied().flatten() {
            None => scene.glued_node(index, &*body),
            own => Ok(own),
        });
        let attached = attached.collect::<Result<Vec<_>, _>>()?;
        let nodes = Nodes::of(&*body, scene);
        let named = scene.probes.iter().enumerate();
        let named = named.map(|(index, probe)| nodes.id(&format!("probe[{index}].node"), probe.node));
        let probes = probes.into_iter().map(Ok).chain(named).collect::<Result<Vec<u32>, _>>()?;
        let held = scene.initial.as_ref().map(|initial| nodes.held(initial)).transpose()?;
        check_nodes(&*body, &attached, &probes)?;
        let tick = haptic.period_s();
        let (substeps, stable_substeps, stable_step) = substeps(&mut *body, scene.global.substeps_per_ms, tick)?;
        check_stride(scene.global.ticks_per_step, substeps, stable_step / (MARGIN * tick))?;
        let state = match held {
            // The equilibrium that the run begins from.
            Some(held) => static_equilibrium(&mut *body, &held)?,
            None => State::at_rest(body.rest()),
        };
        Ok(Self { body, state, attached, probes, tick, substeps, stable_substeps, stable_step })
    }
}

/// What a program's own body can get wrong.
fn check_body(body: &dyn Body) -> Result<(), Error> {
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

/// Where the node of the `index`-th of `count` devices stands in a scene.
fn attach_field(index: usize, count: usize) -> String {
    format!("{}.attach_node", device_field(index, count))
}

/// What a program or a scene can get wrong about nodes.
fn check_nodes(body: &dyn Body, attached: &[Option<u32>], probes: &[u32]) -> Result<(), Error> {
    let nodes = body.rest().len();
    let count = attached.len();
    let glued = || attached.iter().enumerate().filter_map(|(index, node)| Some((attach_field(index, count), (*node)?)));
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

/// Substeps per haptic tick: as asked, unless that is unstable, or from the stability limit; what that asks for; and the limit itself (s).
fn substeps(body: &mut dyn Body, per_ms: Option<u32>, tick: f64) -> Result<(u32, u32, f64), Error> {
    let spectrum = Spectrum::estimate(body);
    let stable = spectrum.stable_step();
    if stable.is_nan() || stable <= 0.0 {
        return Err(Error::scene("body", "gives forces near its rest positions that are not finite"));
    }
    let Some(per_ms) = per_ms else {
        let substeps = spectrum.substeps(tick);
        if f64::from(substeps) > MAX_SUBSTEPS_PER_MS * (tick * 1e3).max(1.0) {
            let message = format!(
                "needs {substeps} explicit steps per haptic tick to be stable, which no machine can do: less stiffness or \
                 damping, or more mass"
            );
            return Err(Error::scene("body", message));
        }
        return Ok((substeps, substeps, stable));
    };
    let substeps = (f64::from(per_ms) * tick * 1e3 - 1e-9).ceil().max(1.0);
    if tick / substeps >= stable {
        let needed = (1.3e-3 / stable).ceil();
        let message = format!(
            "is {per_ms}, which is unstable for this stiffness, damping and mass: use {needed} or more, or leave it out"
        );
        return Err(Error::scene("global.substeps_per_ms", message));
    }
    Ok((substeps as u32, spectrum.substeps(tick), stable))
}

/// Whether one step may span `ticks` haptic ticks of so many `substeps`, where as many as `stable` are stable with the usual margin.
fn check_stride(ticks: u32, substeps: u32, stable: f64) -> Result<(), Error> {
    if ticks == 1 || (substeps == 1 && f64::from(ticks) <= stable) {
        return Ok(());
    }
    let most = if substeps == 1 { stable.max(1.0) as u32 } else { 1 };
    let why = if substeps == 1 { "longer steps are unstable" } else { "each haptic tick is several steps already" };
    let message = format!("is {ticks}, must be 1 to {most}, as {why} at this haptic rate");
    Err(Error::scene("global.ticks_per_step", message))
}
