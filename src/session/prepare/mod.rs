//! From what a builder collected to parts that can start: everything is checked here, and nothing is started or written.
//!
//! The steps are those of [`prepare`], in the order of their checks: body, timing, local model, tools, rate groups.

mod body;
mod budget;
mod choice;
mod device;
mod groups;
mod hello;
mod kept;
mod limits;
mod link;
mod plan;
mod situation;
mod sizes;
mod timing;
mod tools;
mod unused;

pub use choice::Choice;
use choice::extended;
pub(super) use device::{logged, start_gap};
pub(super) use groups::BASIS;
pub(super) use link::LINK;
pub(super) use plan::ModelPlan;
pub(super) use timing::Timing;
pub(super) use tools::Tool;

use super::parts::{Options, Parts, Side};
use super::words::in_calls;
use crate::actors::{Beyond, Settings};
use crate::error::{Error, ErrorKind};
use crate::link::Transport;
use crate::log::ModelReason;
use crate::model::body::Stiffness;
use crate::model::contact::Equations;
use crate::model::local::{Blend, Feedback, Kind, Template};
use crate::model::mesh::Lattice;
use crate::model::simulation::{Simulation, Stepping};
use crate::runtime::{Execution, Nanos, Plan, RateGroup};
use crate::scene::{BodySpec, LinkSpec, NodeSpec, ProbeSpec, Scene, StepKind, Volume};
use body::Start;
use situation::Situation;

/// Everything that a session's actors are made of.
#[derive(Debug)]
pub(super) struct Prepared {
    /// The scene as it is run, with everything that a program, the command line or a choice changed; without the paths,
    /// files and folders, see [`as_run`].
    pub(super) scene: Scene,
    pub(super) simulation: Simulation,
    /// In the order of their devices.
    pub(super) tools: Vec<Tool>,
    pub(super) plan: ModelPlan,
    /// Why its model, if none was named.
    pub(super) choice: Option<Choice>,
    /// Why model and sizes are what they are, if that was left to the session, and which settings the model has no use for.
    pub(super) reason: Option<ModelReason>,
    pub(super) local: RateGroup,
    pub(super) global: RateGroup,
    pub(super) until: Option<Nanos>,
    pub(super) options: Options,
    pub(super) side: Side,
    pub(super) transport: Option<Box<dyn Transport>>,
    /// The haptic machines, of the global side once they have come.
    pub(super) machines: Vec<Beyond>,
}

impl Prepared {
    /// True if surroundings are reduced here.
    pub(super) fn reduces(&self) -> bool {
        self.plan.resting.is_some() && self.has_global()
    }

    /// True if devices and local models are here.
    pub(super) fn has_haptic(&self) -> bool {
        self.side != Side::Global
    }

    /// True if there is a global model beside the local ones, and it is here.
    pub(super) fn has_global(&self) -> bool {
        self.is_multi_rate() && self.side != Side::Haptic
    }

    /// True if there is a global model beside the local ones.
    pub(super) fn is_multi_rate(&self) -> bool {
        self.plan.is_multi_rate()
    }

    /// True if there is a link between the two.
    pub(super) fn is_linked(&self) -> bool {
        self.is_multi_rate() && self.plan.link.is_some()
    }

    /// The group of the bridges of a link.
    pub(super) fn link_group(&self) -> RateGroup {
        link::group(self.plan.timing.haptic)
    }

    /// The rate groups, in graph order.
    pub(super) fn groups(&self) -> Vec<RateGroup> {
        let local = self.has_haptic().then(|| self.local.clone());
        let global = self.has_global().then(|| self.global.clone());
        let basis = self.reduces().then(|| self.basis_group());
        let link = self.is_linked().then(|| self.link_group());
        let others = basis.into_iter().chain(global).chain(link);
        local.into_iter().chain(others).chain([self.logger_group()]).collect()
    }

    /// The group that reduces surroundings: it looks for wishes as often as the global model makes them.
    pub(super) fn basis_group(&self) -> RateGroup {
        groups::basis_group(self.plan.timing.global)
    }

    /// The group that takes records to the log.
    pub(super) fn logger_group(&self) -> RateGroup {
        groups::logger_group(self.scene.log.scene)
    }
}

/// Checks `parts` and makes everything that can be made before a start.
///
/// # Errors
/// Whatever cannot work, naming the field and what would be right.
pub(super) fn prepare(parts: Parts) -> Result<Prepared, Error> {
    let mut scene = described(&parts)?;
    let Parts { side, transport, here, body, devices, attached, probes, .. } = parts;
    let Parts { global, local, open_haply, endless, is_of_program, is_replay, options, .. } = parts;
    let execution = options.execution;
    let rates = timing::rates(&scene)?;
    let mut start = Start::new(body, &scene, &attached, probes, rates[0])?;
    let has_global = global.is_some();
    let global = groups::global_group(global, &scene.global, rates[1], execution)?;
    let blend_ticks = (scene.local.blend.ms * 1e-3 / rates[0].period_s()).round().max(1.0) as u32;
    let steps = f64::from(start.substeps) / f64::from(scene.global.ticks_per_step);
    let work = Nanos::from_secs_f64(start.body.nominal_evaluation() * steps);
    let lateness = timing::lateness(&global, rates[0], work, options.in_real_time);
    let lateness = link::lateness(scene.link.as_ref(), rates, lateness);
    link::check(scene.link.as_ref(), &*start.body)?;
    let timing = Timing::new(rates, [start.substeps, scene.global.ticks_per_step], lateness, blend_ticks);

    let (kind, choice, measured) = choice::model(&mut scene, &mut start, timing, execution);
    if side != Side::Both && kind == Kind::Full {
        return Err(Error::scene(
            "local.model",
            "is full, which has no global model to be elsewhere: name another one",
        ));
    }
    let settings = unused::settings(&scene, kind, has_global).into_iter();
    let named = |field: &str| if is_of_program { in_calls(field, scene.local.blend.kind) } else { field.to_owned() };
    let mut unused = unused::in_words(&settings.map(named).collect::<Vec<_>>(), kind);
    let choice = choice.map(|Choice { model, reason }| match unused.take() {
        Some(words) => Choice { model, reason: extended(Some(reason), words, None) },
        None => Choice { model, reason },
    });
    let reason = sizes::reason(choice.as_ref().map(|choice| choice.reason.clone()), &scene, kind);
    let reason = match unused {
        Some(words) => Some(extended(reason, words, None)),
        None => reason,
    };

    let mut as_run = as_run(&scene, Some((&start.attached, &start.probes)));
    // Named in the log's scene, as another version may take other sizes. What is asked of a switchable session is so of every kind.
    if !scene.run.switchable {
        as_run.local.patch = Some(scene.patch_size());
        as_run.local.basis = scene.local.basis.or((kind == Kind::Predictive).then(|| scene.local.basis_states()));
    }
    let here = here.as_deref();
    let making = tools::Making {
        scene: &scene,
        start: &mut start,
        haptic: rates[0],
        execution,
        open_haply,
        is_replay,
        side,
        here,
    };
    let tools;
    // The safety section with what it left to the device.
    (tools, as_run.safety) = tools::tools(devices, making)?;
    let template = template(kind, &scene, &start, timing)?;
    let kinds = {
        let Start { body, state, .. } = &mut start;
        plan::kinds(&scene, kind, is_replay, || Situation::of(&scene, &mut **body, state, timing, execution))
    };
    let resting = plan::resting(&scene, &template, &kinds, &start);

    let local = groups::local_group(local, rates[0], &tools, &scene.devices, execution);
    let measure = || budget::force_evaluation(&mut *start.body, &start.state);
    let nodes = start.state.positions.len();
    let [local, global] = match (execution, side) {
        // Virtual time needs none, and what evaluates the forces of a haptic side is on another machine.
        (Execution::Virtual, _) | (_, Side::Haptic) => [local, global],
        _ => budget::declare(measured, measure, (nodes, timing, kind), [local, global])?,
    };
    let blend = Blend::new(scene.local.blend.kind, blend_ticks);
    let (probes, in_real_time) = (std::mem::take(&mut start.probes), options.in_real_time);
    let basis_folder = kept::folder(&scene, execution);
    let law = scene.contact.law();
    let plan = ModelPlan {
        template,
        kinds,
        resting,
        timing,
        blend,
        in_real_time,
        probes,
        link: scene.link.as_ref().map(link::conditions),
        basis_folder,
        settings: Settings { friction: law.friction, stiffness: Stiffness::default(), model: kind },
        stiffest: Stiffness::largest(
            start.stable_step,
            start.tick * f64::from(scene.global.ticks_per_step),
            start.substeps,
        ),
        equations: law.equations,
    };
    let until = (!endless).then(|| Nanos::from_secs_f64(scene.run.duration_s));
    let simulation = simulation(start, &scene, &tools)?;
    let prepared = Prepared {
        scene: as_run,
        simulation,
        tools,
        plan,
        choice,
        reason,
        local,
        global,
        until,
        options,
        side,
        transport,
        machines: Vec::new(),
    };
    Plan::check(execution, &prepared.groups())?;
    Ok(prepared)
}

/// The scene with the devices that a program brings; it and the program's rate groups have been checked.
fn described(parts: &Parts) -> Result<Scene, Error> {
    let mut scene = parts.scene.clone();
    tools::complete(&mut scene, parts);
    if let (0.0, Some(group)) = (scene.global.compute_latency_ms, &parts.global) {
        // Whatever follows from it, here and in a replay, is looked up in the scene.
        scene.global.compute_latency_ms = 1e3 * group.declared_latency().as_secs_f64();
    }
    if parts.side != Side::Both {
        if parts.options.execution == Execution::Virtual {
            let message = "a link between two processes takes its own time: simulate one, by the table [link]";
            return Err(Error::new(ErrorKind::Runtime, message));
        }
        // The rules of a scene with a link; what that one simulates is none of a real one's affair.
        scene.link = Some(LinkSpec::default());
    }
    scene.validate()?;
    if let Some(here) = &parts.here {
        tools::check_here(here, &scene.devices, parts.side)?;
    }
    for (field, group) in [("local", &parts.local), ("global", &parts.global)] {
        group.as_ref().map_or(Ok(()), |group| groups::check_group(field, group))?;
    }
    Ok(scene)
}

/// The scene without what a log holds in other places, without what is of this machine alone (a log must not choose a path
/// where it is read), and with the nodes that a program named, if the body is the scene's.
pub(super) fn as_run(scene: &Scene, named: Option<(&[Option<u32>], &[u32])>) -> Scene {
    let mut scene = scene.clone();
    for device in &mut scene.devices {
        (device.path_csv, device.path, device.log) = (None, None, None);
    }
    (scene.local.basis_folder, scene.local.keep_bases) = (None, true);
    if let Some(BodySpec::Tetrahedra(spec)) = &mut scene.body {
        // The mesh itself is in the log.
        (spec.mesh, spec.surface, spec.element_size_m, spec.surface_size_m) = (None, None, None, None);
        spec.unit_m = spec.volume.as_ref().map_or(spec.unit_m, Volume::unit_m);
    }
    if let (Some(body), Some((attached, probes))) = (&scene.body, named) {
        let lattice = body.mass_spring().map(|spec| Lattice { nodes: spec.block.nodes });
        let node = |id: u32| lattice.map_or(NodeSpec::Number(id), |lattice| lattice.coordinates(id).into());
        for (device, id) in scene.devices.iter_mut().zip(attached) {
            device.attach_node = id.map(node);
        }
        scene.probes = probes.iter().map(|&id| ProbeSpec { node: node(id) }).collect();
    }
    scene
}

/// What every local model is made by.
fn template(kind: Kind, scene: &Scene, start: &Start, timing: Timing) -> Result<Template, Error> {
    let is_implicit = match scene.local.step {
        StepKind::Explicit => false,
        StepKind::Implicit => true,
        StepKind::Auto => {
            scene.contact.equations != Equations::Paper && start.stable_substeps > Kind::MOST_EXPLICIT_STEPS
        }
    };
    // The longer one where periods alternate, 33 and 34 ticks at 30 Hz.
    let ticks = (timing.haptic.as_hz() / timing.global.as_hz() - 1e-6).ceil().min(f64::from(u32::MAX)) as u32;
    let template = Template::new(kind, scene.patch_size(), &*start.body)?.with_period(ticks);
    // A geometry that comes late belongs to another tick than the body's.
    let over_link = scene.link.as_ref().map(|_| Feedback::Trajectory);
    let template = match scene.local.feedback.or(over_link) {
        Some(feedback) => template.with_feedback(feedback),
        None => template,
    };
    Ok(if is_implicit { template.with_implicit_steps() } else { template })
}

/// The whole body with its tools, before the first tick.
fn simulation(start: Start, scene: &Scene, tools: &[Tool]) -> Result<Simulation, Error> {
    let Start { body, state, tick, substeps, .. } = start;
    let mut contacts = tools.iter().map(|tool| tool.contact);
    let first = contacts.next().unwrap_or_default();
    let first = Simulation::new(body, state, first, scene.contact.law(), Stepping { tick, substeps })?
        .looking_ahead_with(scene.global.ahead_nodes)
        .striding(scene.global.ticks_per_step);
    let all = contacts.fold(first, Simulation::with_tool);
    Ok((0..).zip(tools).fold(all, |all, (index, tool)| all.with_shape(index, tool.shape)))
}
