//! Turns a validated description into bodies, states and models that can start.

use std::path::PathBuf;

use super::budget::{self, nominal_evaluation};
use super::checks::{check_body, check_model, check_nodes};
use super::choice::{Choice, choose};
use super::disturbed::Disturbed;
use super::graph::groups;
use super::hardware::paced;
use super::horizon::{horizon, lateness};
use super::patch::{self, PatchChoice};
use super::rate_groups::{check_group, global_group, local_group};
use super::situation::Situation;
use super::substeps::substeps;
use super::tools::{Making, Tool, complete, tools};
use crate::devices::Device;
use crate::error::Error;
use crate::model::Vec3;
use crate::model::local::Blend;
use crate::model::body::{Block, Body, State};
use crate::model::contact::Law;
use crate::model::equilibrium::static_equilibrium;
use crate::model::local::{Kind, MOST_EXPLICIT_STEPS, Template};
use crate::model::mesh::Lattice;
use crate::model::simulation::{Simulation, Stepping};
use crate::runtime::{Execution, RateGroup, admit_here};
use crate::scene::ProbeSpec;
use crate::scene::{
    BasisSize, BodySpec, DeviceSpec, Equations, Feedback, InitialSpec, ModelChoice, SafetyStage, Scene, StepKind,
};
use crate::runtime::{Nanos, Rate};

/// What a builder has collected.
#[derive(Debug)]
pub(super) struct Parts {
    pub scene: Scene,
    /// The program's own body, in place of the scene's.
    pub body: Option<Box<dyn Body>>,
    /// The program's own devices with their names, in place of the scene's first ones.
    pub devices: Vec<(Option<String>, Box<dyn Device>)>,
    /// The nodes that the program glues tools to, by device.
    pub attached: Vec<Option<u32>>,
    pub probes: Vec<u32>,
    pub global: Option<RateGroup>,
    pub local: Option<RateGroup>,
    pub execution: Execution,
    /// On threads, or executing a log of such a run.
    pub in_real_time: bool,
    pub log: Option<PathBuf>,
    pub keep_records: bool,
    pub measures_cost: bool,
    pub endless: bool,
    pub disturbed: Disturbed,
    /// The device gives the samples of the very run that is executed again.
    pub is_replay: bool,
}

impl Parts {
    pub(super) fn new(body: Option<Box<dyn Body>>, scene: Scene) -> Self {
        Self {
            endless: body.is_some(),
            scene,
            body,
            devices: Vec::new(),
            attached: Vec::new(),
            probes: Vec::new(),
            global: None,
            local: None,
            execution: Execution::Threaded,
            in_real_time: true,
            log: None,
            keep_records: false,
            measures_cost: false,
            disturbed: Disturbed::default(),
            is_replay: false,
        }
    }
}

/// Everything that a session's actors are made of.
#[derive(Debug)]
pub(super) struct Prepared {
    pub simulation: Simulation,
    pub template: Template,
    /// Why its model, if none was named.
    pub choice: Option<Choice>,
    /// The patch, if an error budget chose it.
    pub sized_patch: Option<PatchChoice>,
    /// How large reduced surroundings are to be.
    pub basis_size: BasisSize,
    /// Where bases are kept from run to run.
    pub basis_folder: Option<PathBuf>,
    /// Virtual time: how long after its release a basis becomes visible.
    pub basis_latency: Nanos,
    /// Haptic ticks that a local model may have to reach ahead.
    pub horizon: u32,
    pub blend: Blend,
    /// In the order of their devices.
    pub tools: Vec<Tool>,
    /// Stages of the safety pipeline that the scene switched off.
    pub safety_off: Vec<SafetyStage>,
    pub probes: Vec<u32>,
    pub haptic: Rate,
    pub global_rate: Rate,
    pub local: RateGroup,
    pub global: RateGroup,
    pub execution: Execution,
    /// A basis takes its time here: bases are asked for ahead of the tool.
    pub prefetches: bool,
    pub until: Option<Nanos>,
    pub log: Option<PathBuf>,
    /// The log has the topic `/scene`.
    pub logs_scene: bool,
    pub keep_records: bool,
    pub measures_cost: bool,
    pub disturbed: Disturbed,
    /// The scene file's text, for the log.
    pub source: Option<String>,
    /// The scene as it is run, with everything that a program or the command line changed.
    pub as_run: Scene,
    /// The recording that is executed again in place of a run of its own.
    pub reexecuted: Option<super::replay::Reexecuted>,
}

impl Prepared {
    /// True if the local models use reduced surroundings.
    pub(super) fn reduces(&self) -> bool {
        self.template.kind == Kind::Predictive && self.basis_size != BasisSize::States(0)
    }
}

/// How often the whole body's forces are evaluated: `substeps` times per haptic tick; and for how many ticks ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub haptic: Rate,
    pub global: Rate,
    pub substeps: u32,
    /// Haptic ticks that a local model may have to reach ahead.
    pub horizon: u32,
}

pub(super) fn prepare(parts: Parts) -> Result<Prepared, Error> {
    let mut scene = parts.scene.clone();
    complete(&mut scene, &parts);
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
    let named =
        |(index, spec): (usize, &DeviceSpec)| parts.attached.get(index).copied().flatten().or(spec.attach_node.map(id));
    let attached: Vec<Option<u32>> = scene.devices.iter().enumerate().map(named).collect();
    let probes: Vec<u32> = parts.probes.into_iter().chain(scene.probes.iter().map(|probe| id(probe.node))).collect();
    check_nodes(&*body, &attached, &probes)?;

    let tick = haptic.period_s();
    let (substeps, stable_substeps) = substeps(&mut *body, scene.global.substeps_per_ms, tick)?;
    let state = match &scene.initial {
        Some(initial) => pulled(&mut *body, initial, id)?,
        None => State::at_rest(body.rest()),
    };
    let blend_ticks = (scene.local.blend.ms * 1e-3 / tick).round().max(1.0) as u32;
    let global = global_group(parts.global, &scene.global, global_rate, parts.execution)?;
    let work = Nanos(nominal_evaluation(&*body).0 * u64::from(substeps));
    let lateness = lateness(&global, haptic, work, parts.in_real_time);
    let horizon = horizon(haptic, global_rate, lateness, blend_ticks);
    let timing = Timing { haptic, global: global_rate, substeps, horizon };
    let (kind, choice, measured) = match scene.local.model {
        ModelChoice::Named(kind) => (kind, None, None),
        ModelChoice::Auto => {
            let situation = Situation::of(&scene, &mut *body, &state, timing, parts.execution);
            let choice = choose(&situation);
            (choice.model, Some(choice), Some(situation.evaluation))
        }
    };
    if choice.is_some() {
        // The log's scene names the model and what was asked of it.
        scene.local.name_chosen(kind);
    }
    check_model(kind, &scene)?;
    let sized_patch = patch::choose(&scene, &*body, &attached);
    let patch = sized_patch.as_ref().map_or(scene.local.patch_size(), |choice| choice.size);
    // Named in the log's scene, so that a replay does not choose again.
    scene.local.patch = Some(patch);
    let mut as_run = as_run(&scene, Some((&attached, &probes)));
    let law = Law {
        friction: scene.contact.friction.coefficient(),
        normals: scene.contact.normals,
        equations: scene.contact.equations,
    };
    let is_replay = parts.is_replay;
    let making = Making {
        scene: &scene,
        body: &mut *body,
        state: &state,
        tick,
        attached: &attached,
        execution: parts.execution,
        is_replay,
    };
    let (tools, resolved) = tools(parts.devices, making)?;
    let safety_off = resolved.off.clone();
    {
        // With what it left to the device.
        as_run.safety = resolved;
    }
    let is_implicit = match scene.local.step {
        StepKind::Explicit => false,
        StepKind::Implicit => true,
        StepKind::Auto => scene.contact.equations != Equations::Paper && stable_substeps > MOST_EXPLICIT_STEPS,
    };
    // The longer one where periods alternate, 33 and 34 ticks at 30 Hz.
    let period_ticks = (haptic.as_hz() / global_rate.as_hz() - 1e-6).ceil().min(f64::from(u32::MAX)) as u32;
    let template = Template::new(kind, patch, &*body)?
        .with_feedback(scene.local.feedback.unwrap_or(Feedback::of(kind)))
        .with_prediction(scene.local.prediction)
        .with_period(period_ticks);
    let template = if is_implicit { template.with_implicit_steps() } else { template };
    let ramp_s = tools.iter().map(|tool| tool.limits.ramp_s).fold(0.0, f64::max);
    let exerts_force = tools.iter().any(|tool| tool.device.exerts_force());
    let local = paced(local_group(parts.local, haptic, ramp_s, exerts_force), &scene.devices, parts.execution);
    let [local, global] = match parts.execution {
        Execution::Virtual => [local, global],
        Execution::Threaded => {
            let nodes = body.rest().len();
            let evaluation = || measured.unwrap_or_else(|| budget::force_evaluation(&mut *body, &state));
            budget::declare(evaluation, nodes, timing, kind, [local, global])?
        }
    };
    let prepared = Prepared {
        template,
        choice,
        sized_patch,
        basis_size: scene.local.basis_size(),
        basis_folder: scene.local.basis_folder.clone(),
        basis_latency: Nanos::from_secs_f64(scene.global.basis_latency_ms * 1e-3),
        horizon,
        simulation: simulation(body, state, &tools, law, Stepping { tick, substeps })?,
        blend: Blend::new(scene.local.blend.kind, blend_ticks),
        tools,
        safety_off,
        probes,
        haptic,
        global_rate,
        local,
        global,
        execution: parts.execution,
        prefetches: parts.in_real_time,
        until: (!parts.endless).then(|| Nanos::from_secs_f64(scene.run.duration_s)),
        log: parts.log,
        logs_scene: scene.log.scene,
        keep_records: parts.keep_records,
        measures_cost: parts.measures_cost,
        disturbed: parts.disturbed,
        source: scene.source,
        as_run,
        reexecuted: None,
    };
    // Before anything is started or written.
    admit_here(&groups(&prepared), prepared.execution)?;
    Ok(prepared)
}

/// The scene without what a log holds in other places, and with the nodes that a program named, if it has a lattice.
pub(super) fn as_run(scene: &Scene, named: Option<(&[Option<u32>], &[u32])>) -> Scene {
    let mut scene = scene.clone();
    scene.source = None;
    for device in &mut scene.devices {
        (device.path_csv, device.path, device.log) = (None, None, None);
    }
    if let (Some(body), Some((attached, probes))) = (&scene.body, named) {
        let lattice = Lattice { nodes: body.block.nodes };
        for (device, node) in scene.devices.iter_mut().zip(attached) {
            device.attach_node = node.map(|node| lattice.coordinates(node));
        }
        scene.probes = probes.iter().map(|&node| ProbeSpec { node: lattice.coordinates(node) }).collect();
    }
    scene
}

fn rate(field: &str, hz: f64) -> Result<Rate, Error> {
    Rate::from_hz(hz).ok_or_else(|| Error::scene(field, format!("is {hz}, which is no rate")))
}

pub(super) fn block(spec: &BodySpec) -> Result<Block, Error> {
    let builder = Block::builder(spec.block.nodes, spec.block.size_m)
        .node_mass(spec.material.node_mass_kg)
        .stiffness(spec.material.stiffness_n_per_m)
        .damping_ratio(spec.material.damping_ratio);
    let builder = spec.regions.iter().fold(builder, |builder, spec| builder.region(spec.region()));
    spec.block.fixed.iter().fold(builder, |builder, &face| builder.fix(face)).build().map_err(|error| error.at("body"))
}

fn pulled(body: &mut dyn Body, initial: &InitialSpec, id: impl Fn([usize; 3]) -> u32) -> Result<State, Error> {
    let rest = |node: u32, body: &dyn Body| body.rest()[node as usize];
    let pulled = id(initial.pull.node);
    let mut held = vec![(pulled, rest(pulled, body) + Vec3::from(initial.pull.offset_m))];
    held.extend(initial.hold.iter().map(|&node| (id(node), rest(id(node), body))));
    static_equilibrium(body, &held)
}

fn simulation(
    body: Box<dyn Body>,
    state: State,
    tools: &[Tool],
    law: Law,
    stepping: Stepping,
) -> Result<Simulation, Error> {
    let mut contacts = tools.iter().map(|tool| tool.contact);
    let first = Simulation::new(body, state, contacts.next().unwrap_or_default(), law, stepping)?;
    Ok(contacts.fold(first, Simulation::with_tool))
}
