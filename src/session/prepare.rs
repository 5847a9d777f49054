//! Turns a validated description into bodies, states and models that can start.

#[cfg(feature = "log")]
use std::path::PathBuf;

use super::budget;
use super::disturbed::Disturbed;
use super::graph::groups;
use crate::actors::GAP_S;
use crate::devices::{Device, Scripted, ToolPath};
use crate::error::{Error, ErrorKind};
use crate::model::Vec3;
use crate::model::blend::Blend;
use crate::model::body::{Block, Body, State};
use crate::model::contact::{Contact, Law};
use crate::model::equilibrium::static_equilibrium;
use crate::model::integrator::Spectrum;
use crate::model::local::Template;
use crate::model::mesh::Lattice;
use crate::model::simulation::{Simulation, Stepping};
use crate::runtime::{Execution, OverrunPolicy, RateGroup, Release, admit_here};
use crate::safety::Limits;
#[cfg(feature = "scene")]
use crate::scene::ProbeSpec;
use crate::scene::{BodySpec, Equations, Feedback, InitialSpec, Scene, StepKind};
use crate::time::{Nanos, Rate};

/// What a builder has collected.
#[derive(Debug)]
pub(super) struct Parts {
    pub scene: Scene,
    /// The program's own body, in place of the scene's.
    pub body: Option<Box<dyn Body>>,
    pub device: Option<Box<dyn Device>>,
    pub attach: Option<u32>,
    pub probes: Vec<u32>,
    pub global: Option<RateGroup>,
    pub local: Option<RateGroup>,
    pub execution: Execution,
    #[cfg(feature = "log")]
    pub log: Option<PathBuf>,
    pub keep_records: bool,
    pub measures_cost: bool,
    pub endless: bool,
    pub disturbed: Disturbed,
}

impl Parts {
    pub(super) fn new(body: Option<Box<dyn Body>>, scene: Scene) -> Self {
        Self {
            endless: body.is_some(),
            scene,
            body,
            device: None,
            attach: None,
            probes: Vec::new(),
            global: None,
            local: None,
            execution: Execution::Threaded,
            #[cfg(feature = "log")]
            log: None,
            keep_records: false,
            measures_cost: false,
            disturbed: Disturbed::default(),
        }
    }
}

/// Everything that a session's actors are made of.
#[derive(Debug)]
pub(super) struct Prepared {
    pub simulation: Simulation,
    pub template: Template,
    /// States of reduced surroundings.
    pub basis_states: usize,
    /// Virtual time: how long after its release a basis becomes visible.
    pub basis_latency: Nanos,
    /// Haptic ticks that a local model may have to reach ahead.
    pub horizon: u32,
    pub blend: Blend,
    pub device: Box<dyn Device>,
    pub limits: Limits,
    pub probes: Vec<u32>,
    pub haptic: Rate,
    pub global_rate: Rate,
    pub local: RateGroup,
    pub global: RateGroup,
    pub execution: Execution,
    pub until: Option<Nanos>,
    #[cfg(feature = "log")]
    pub log: Option<PathBuf>,
    pub keep_records: bool,
    pub measures_cost: bool,
    pub disturbed: Disturbed,
    /// The scene file's text, for the log.
    pub source: Option<String>,
    /// The scene as it is run, with everything that a program or the command line changed.
    #[cfg(feature = "scene")]
    pub as_run: Scene,
    /// The recording that is executed again in place of a run of its own.
    #[cfg(all(feature = "log", feature = "scene"))]
    pub reexecuted: Option<super::replay::Reexecuted>,
}

impl Prepared {
    /// True if the local models use reduced surroundings.
    pub(super) fn reduces(&self) -> bool {
        self.template.kind == crate::model::local::Kind::Predictive && self.basis_states > 0
    }
}

/// How often the whole body's forces are evaluated: `substeps` times per haptic tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub haptic: Rate,
    pub substeps: u32,
}

/// The priority of the haptic thread: above everything but the kernel's own.
const HAPTIC_PRIORITY: u8 = 80;

/// A linear patch whose stability asks for more takes one implicit step per tick: that costs as much as two explicit ones,
/// and damps what four still show.
const MOST_EXPLICIT_STEPS: u32 = 4;

/// Steps of 0.1 us, the limit of `global.substeps_per_ms` too: a body that needs more would seem to hang.
const MAX_SUBSTEPS_PER_MS: f64 = 1e4;

pub(super) fn prepare(parts: Parts) -> Result<Prepared, Error> {
    let scene = parts.scene;
    scene.validate()?;
    for (field, group) in [("local", &parts.local), ("global", &parts.global)] {
        group.as_ref().map_or(Ok(()), |group| check_group(field, group))?;
    }
    let haptic = rate("local.rate_hz", scene.local.rate_hz)?;
    let global_rate = rate("global.rate_hz", scene.global.rate_hz)?;
    let mut body = match (parts.body, &scene.body) {
        (Some(own), _) => own,
        (None, Some(spec)) => Box::new(block(spec)?) as Box<dyn Body>,
        (None, None) => return Err(Error::scene("body", "is missing")),
    };
    check_body(&*body)?;

    let lattice = scene.body.as_ref().map(|spec| Lattice { nodes: spec.block.nodes });
    let id = |node: [usize; 3]| lattice.map_or(0, |lattice| lattice.id(node));
    let attach = parts.attach.or(scene.device.attach_node.map(id));
    let probes: Vec<u32> = parts.probes.into_iter().chain(scene.probes.iter().map(|probe| id(probe.node))).collect();
    check_nodes(&*body, attach, &probes)?;

    let tick = haptic.period_s();
    let (substeps, stable_substeps) = substeps(&mut *body, scene.global.substeps_per_ms, tick)?;
    let state = match &scene.initial {
        Some(initial) => pulled(&mut *body, initial, id)?,
        None => State::at_rest(body.rest()),
    };
    let contact = attach.map_or_else(Contact::default, |node| glued(&*body, node));
    #[cfg(feature = "scene")]
    let mut as_run = as_run(&scene, Some((attach, &probes)));
    let device = match parts.device {
        Some(device) => device,
        None => scripted(scene.device.path, attach.map(|node| state.positions[node as usize]))?,
    };
    let exerts_force = device.exerts_force();
    let law = Law {
        friction: scene.contact.friction.coefficient(),
        normals: scene.contact.normals,
        equations: scene.contact.equations,
    };
    let limits = Limits {
        max_force_n: scene.safety.max_force_n.unwrap_or(device.capabilities().max_force_n),
        max_slew_n_per_s: scene.safety.max_slew_n_per_ms * 1e3,
        ramp_s: scene.safety.ramp_ms * 1e-3,
    };
    check_ramp(&limits)?;
    #[cfg(feature = "scene")]
    {
        // The device's own limit too; one without a limit has none to note.
        as_run.safety.max_force_n = limits.max_force_n.is_finite().then_some(limits.max_force_n);
    }
    let kind = scene.local.model;
    let is_implicit = match scene.local.step {
        StepKind::Explicit => false,
        StepKind::Implicit => true,
        StepKind::Auto => scene.contact.equations != Equations::Paper && stable_substeps > MOST_EXPLICIT_STEPS,
    };
    // The longer one where periods alternate, 33 and 34 ticks at 30 Hz.
    let period_ticks = (haptic.as_hz() / global_rate.as_hz() - 1e-6).ceil().min(f64::from(u32::MAX)) as u32;
    let template = Template::new(kind, scene.local.patch, &*body)?
        .with_feedback(scene.local.feedback.unwrap_or(Feedback::of(kind)))
        .with_prediction(scene.local.prediction)
        .with_period(period_ticks);
    let template = if is_implicit { template.with_implicit_steps() } else { template };
    let blend_ticks = (scene.local.blend.ms * 1e-3 / tick).round().max(1.0) as u32;
    let global = parts.global.unwrap_or_else(|| RateGroup::new(global_rate)).name("global");
    let global = match scene.global.compute_latency_ms {
        // Not given: the latency of a group that the program brings stays.
        0.0 => global,
        latency_ms if parts.execution == Execution::Threaded && latency_ms > 1e3 * global_rate.period_s() => {
            let message = format!(
                "is {latency_ms}, which is above the period of {:.3} ms: in real time a result must be there before the next \
                 release; lower it, or run in virtual time (--virtual)",
                1e3 * global_rate.period_s()
            );
            return Err(Error::scene("global.compute_latency_ms", message));
        }
        latency_ms => global.latency(Nanos::from_secs_f64(latency_ms * 1e-3)),
    };
    let last_core = std::thread::available_parallelism().map_or(0, |cores| cores.get() - 1);
    let local = parts.local.unwrap_or_else(|| {
        let group = RateGroup::new(haptic).realtime(HAPTIC_PRIORITY);
        // On a single core the haptic thread preempts the others; pinning would gain nothing.
        if last_core > 0 { group.pin(last_core) } else { group }
    });
    let local = winding_down(local.name("local"), limits.ramp_s, exerts_force);
    let [local, global] = match parts.execution {
        Execution::Virtual => [local, global],
        Execution::Threaded => budget::declare(&mut *body, &state, Timing { haptic, substeps }, kind, [local, global])?,
    };
    let prepared = Prepared {
        template,
        basis_states: scene.local.basis,
        basis_latency: Nanos::from_secs_f64(scene.global.basis_latency_ms * 1e-3),
        horizon: horizon(haptic, global_rate, scene.global.compute_latency_ms, blend_ticks),
        simulation: Simulation::new(body, state, contact, law, Stepping { tick, substeps })?,
        blend: Blend::new(scene.local.blend.kind, blend_ticks),
        device,
        limits,
        probes,
        haptic,
        global_rate,
        local,
        global,
        execution: parts.execution,
        until: (!parts.endless).then(|| Nanos::from_secs_f64(scene.run.duration_s)),
        #[cfg(feature = "log")]
        log: parts.log,
        keep_records: parts.keep_records,
        measures_cost: parts.measures_cost,
        disturbed: parts.disturbed,
        source: scene.source,
        #[cfg(feature = "scene")]
        as_run,
        #[cfg(all(feature = "log", feature = "scene"))]
        reexecuted: None,
    };
    // Before anything is started or written.
    admit_here(&groups(&prepared), prepared.execution)?;
    Ok(prepared)
}

/// The scene without what a log holds in other places, and with the nodes that a program named, if it has a lattice.
#[cfg(feature = "scene")]
pub(super) fn as_run(scene: &Scene, named: Option<(Option<u32>, &[u32])>) -> Scene {
    let mut scene = scene.clone();
    scene.source = None;
    (scene.device.path_csv, scene.device.path) = (None, None);
    if let (Some(body), Some((attach, probes))) = (&scene.body, named) {
        let lattice = Lattice { nodes: body.block.nodes };
        scene.device.attach_node = attach.map(|node| lattice.place(node));
        scene.probes = probes.iter().map(|&node| ProbeSpec { node: lattice.place(node) }).collect();
    }
    scene
}

/// Haptic ticks from the state that a local model is built from to the end of its service: its own lateness, one period
/// until the next, another if that one is lost, and the time to catch up and to blend.
fn horizon(haptic: Rate, global: Rate, latency_ms: f64, blend_ticks: u32) -> u32 {
    let periods = PERIODS_AHEAD + 1e-3 * latency_ms / global.period_s();
    (periods * haptic.as_hz() / global.as_hz()).ceil() as u32 + blend_ticks
}

/// One period of service, and what catching up takes.
const PERIODS_AHEAD: f64 = 1.25;

fn rate(field: &str, hz: f64) -> Result<Rate, Error> {
    Rate::from_hz(hz).ok_or_else(|| Error::scene(field, format!("is {hz}, which is no rate")))
}

fn block(spec: &BodySpec) -> Result<Block, Error> {
    let builder = Block::builder(spec.block.nodes, spec.block.size_m)
        .node_mass(spec.material.node_mass_kg)
        .stiffness(spec.material.stiffness_n_per_m)
        .damping_ratio(spec.material.damping_ratio);
    spec.block.fixed.iter().fold(builder, |builder, &face| builder.fix(face)).build().map_err(|error| error.at("body"))
}

/// The haptic group as it ends: with time for the force to go to zero. A device that exerts none needs it only to show
/// in the log what would have been done.
fn winding_down(local: RateGroup, ramp_s: f64, exerts_force: bool) -> RateGroup {
    let group = local.wind_down(Nanos::from_secs_f64(ramp_s + RAMP_MARGIN_S));
    if exerts_force { group.wind_down_at_end() } else { group }
}

/// Releases of the wind-down that may be skipped without shortening the ramp (s).
const RAMP_MARGIN_S: f64 = 0.005;

/// The slew limit must not keep the force from being gone when the ramp is over.
fn check_ramp(limits: &Limits) -> Result<(), Error> {
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

/// What a rate group can ask for and a session cannot give.
fn check_group(field: &str, group: &RateGroup) -> Result<(), Error> {
    let own = || group.clone();
    let wrong = if own().offset(Nanos::ZERO) != own() {
        "has an offset, but device and models count from release 0: leave it out"
    } else if own().observer() == own() {
        "is an observer, which a session's groups cannot be: leave it out"
    } else if field == "local" && own().latency(Nanos::ZERO) != own() {
        "has a latency, which only the global group's results can have: leave it out"
    } else if field == "local" && own().overrun(OverrunPolicy::Rephase) == own() {
        "has the policy Rephase, but the tool's samples and the models belong to the nominal grid of ticks: use another"
    } else if field == "local" && own().catches_up().as_secs_f64() > 0.5 * GAP_S {
        "catches up after stops that the force must come back from slowly (0.1 s): catch up at most 0.05 s, or use Skip"
    } else if field == "global" && own().release(Release::Periodic) != own() {
        "is paced by a device, which only the local group has: leave it out"
    } else {
        return Ok(());
    };
    Err(Error::new(ErrorKind::Runtime, wrong).at(field))
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

fn check_nodes(body: &dyn Body, attach: Option<u32>, probes: &[u32]) -> Result<(), Error> {
    let nodes = body.rest().len();
    let named = attach.map(|node| ("device.attach_node", node)).into_iter();
    for (field, node) in named.chain(probes.iter().map(|&node| ("probe", node))) {
        if node as usize >= nodes {
            let message = format!("node {node} is outside the body, nodes run from 0 to {}", nodes - 1);
            return Err(Error::scene(field, message));
        }
    }
    match attach {
        Some(node) if !body.surface().has_node(node) => {
            let message =
                format!("node {node} is inside the body, the tool can only be glued to a node of the surface");
            Err(Error::scene("device.attach_node", message))
        }
        Some(node) if body.inverse_masses()[node as usize] == 0.0 => {
            let message = format!("node {node} is held, the tool could not move it");
            Err(Error::scene("device.attach_node", message))
        }
        _ => Ok(()),
    }
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

fn pulled(body: &mut dyn Body, initial: &InitialSpec, id: impl Fn([usize; 3]) -> u32) -> Result<State, Error> {
    let rest = |node: u32, body: &dyn Body| body.rest()[node as usize];
    let pulled = id(initial.pull.node);
    let mut held = vec![(pulled, rest(pulled, body) + Vec3::from(initial.pull.offset_m))];
    held.extend(initial.hold.iter().map(|&node| (id(node), rest(id(node), body))));
    static_equilibrium(body, &held)
}

/// The contact that glues the tool to `node`.
fn glued(body: &dyn Body, node: u32) -> Contact {
    let triangle = body.surface().at_node(node)[0];
    let weights = body.surface().triangles[triangle as usize].map(|corner| f64::from(u8::from(corner == node)));
    Contact::glued(triangle, weights)
}

/// A glued tool that starts farther from its node would tear it there in the first tick (m).
const LARGEST_START_GAP: f64 = 1e-3;

/// A tool that follows `path`, or stays where the node that it is glued to is at the start.
fn scripted(path: Option<ToolPath>, glued_at: Option<Vec3>) -> Result<Box<dyn Device>, Error> {
    let path = match (path, glued_at) {
        (Some(path), Some(node)) if (Vec3::from(path.at(0.0)) - node).norm() > LARGEST_START_GAP => {
            let gap = (Vec3::from(path.at(0.0)) - node).norm();
            let place: [f64; 3] = node.into();
            let message =
                format!("starts {gap} m away from the node that the tool is glued to, must start at {place:?}");
            return Err(Error::scene("device.path_csv", message));
        }
        (Some(path), _) => path,
        (None, Some(position)) => ToolPath::constant(position.into())?,
        (None, None) => {
            let message = "nothing moves the tool: give it a path_csv, an attach_node or a device of the program's own";
            return Err(Error::new(ErrorKind::Scene, message).at("device"));
        }
    };
    Ok(Box::new(Scripted::new(path)))
}
