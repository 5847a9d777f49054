//! The body of a session as it is at the start, and what can be wrong with it.

use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::{Body, State};
use crate::model::equilibrium::static_equilibrium;
use crate::model::integrator::Spectrum;
use crate::model::mesh::Lattice;
use crate::runtime::Rate;
use crate::scene::{InitialSpec, Scene, device_field};

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
            (None, Some(spec)) => Box::new(spec.build()?) as Box<dyn Body>,
            (None, None) => return Err(Error::scene("body", "is missing")),
        };
        check_body(&*body)?;
        let lattice = scene.body.as_ref().map(|spec| Lattice { nodes: spec.block.nodes });
        let id = |node: [usize; 3]| lattice.map_or(0, |lattice| lattice.id(node));
        let own_node = |index: usize| attached.get(index).copied().flatten();
        let devices = scene.devices.iter().enumerate();
        let attached: Vec<_> = devices.map(|(index, spec)| own_node(index).or(spec.attach_node.map(id))).collect();
        let probes: Vec<u32> = probes.into_iter().chain(scene.probes.iter().map(|probe| id(probe.node))).collect();
        check_nodes(&*body, &attached, &probes)?;
        let tick = haptic.period_s();
        let (substeps, stable_substeps) = substeps(&mut *body, scene.global.substeps_per_ms, tick)?;
        let state = match &scene.initial {
            Some(initial) => pulled(&mut *body, initial, id)?,
            None => State::at_rest(body.rest()),
        };
        Ok(Self { body, state, attached, probes, tick, substeps, stable_substeps })
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

/// What a program or a scene can get wrong about nodes.
fn check_nodes(body: &dyn Body, attached: &[Option<u32>], probes: &[u32]) -> Result<(), Error> {
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

/// Substeps per haptic tick: as asked, unless that is unstable, or from the stability limit; and what that asks for.
fn substeps(body: &mut dyn Body, per_ms: Option<u32>, tick: f64) -> Result<(u32, u32), Error> {
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
        return Ok((substeps, substeps));
    };
    let substeps = (f64::from(per_ms) * tick * 1e3 - 1e-9).ceil().max(1.0);
    if tick / substeps >= stable {
        let needed = (1.3e-3 / stable).ceil();
        let message = format!(
            "is {per_ms}, which is unstable for this stiffness, damping and mass: use {needed} or more, or leave it out"
        );
        return Err(Error::scene("global.substeps_per_ms", message));
    }
    Ok((substeps as u32, spectrum.substeps(tick)))
}

/// The equilibrium that the run begins from.
fn pulled(body: &mut dyn Body, initial: &InitialSpec, id: impl Fn([usize; 3]) -> u32) -> Result<State, Error> {
    let rest = |node: u32| body.rest()[node as usize];
    let pulled = id(initial.pull.node);
    let mut held = vec![(pulled, rest(pulled) + Vec3::from(initial.pull.offset_m))];
    held.extend(initial.hold.iter().map(|&node| (id(node), rest(id(node)))));
    Ok(static_equilibrium(body, &held)?)
}
