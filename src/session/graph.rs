//! Wires actors and ports into a runtime and starts it.

use super::basis::{self, BasisSide};
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use super::prepare::Prepared;
use super::replay::{Comparer, Reexecuted};
use super::running::{Running, Viewer};
use super::sink::{Memory, Sinks};
use super::tools::Tool;
use crate::actors::{
    Checkpoint, DeviceActor, DeviceSample, ForceCommand, GlobalPlan, LocalActor, LocalPorts, LoggerActor,
    LoggerOutcome, ModelSource, SceneWatch, SurfaceView, ToolView, first_state,
};
use crate::devices::DeviceState;
use crate::error::Error;
use crate::log::{Environment, LoggedExecution, GroupInfo, ModelReason, SceneFrame, ToolSample};
use crate::model::Vec3;
use crate::model::body::Block;
use crate::model::local::{Full, Hold, Kind, LocalModel, PatchGeometry, Succession};
use crate::runtime::{
    Actor, ExchangePort, Execution, OutletPort, OutletReader, OutletWriter, RateGroup, Reader, Restart, Runtime,
    RuntimeBuilder, Stopwatch, Writer,
};
use crate::safety::coupling::CoupledTool;
use crate::safety::{Actions, Pipeline};
use crate::runtime::Rate;

/// How often records are taken to the log.
const LOGGER: Rate = Rate::hz(20);
/// The same for a log with `/scene`: a picture per release.
const LOGGER_WITH_SCENE: Rate = Rate::hz(SceneFrame::RATE_HZ);
/// Records of one actor per haptic tick at most, besides one per probe.
const RECORDS_PER_TICK: usize = 4;
/// A logger or a global model that is stuck for this long loses nothing.
const SECONDS_BUFFERED: f64 = 4.0;

/// However slow the haptic rate is: release 0 makes several records before the first drain.
const MIN_TICKS_BUFFERED: usize = 64;

/// The rate groups of a session, in graph order.
pub(super) fn groups(prepared: &Prepared) -> Vec<RateGroup> {
    let global = (prepared.template.kind != Kind::Full).then(|| prepared.global.clone());
    let basis = prepared.reduces().then(|| basis::group(prepared));
    [prepared.local.clone()].into_iter().chain(basis).chain(global).chain([logger_group(prepared)]).collect()
}

fn logger_group(prepared: &Prepared) -> RateGroup {
    RateGroup::new(logger_rate(prepared)).name("logger").observer()
}

fn logger_rate(prepared: &Prepared) -> Rate {
    if prepared.logs_scene { LOGGER_WITH_SCENE } else { LOGGER }
}

/// Both ends of what a tool's device and local actor say to each other and to a program that draws.
struct ToolEnds {
    sample_writer: Writer<DeviceSample>,
    samples: Reader<DeviceSample>,
    command_writer: Writer<ForceCommand>,
    commands: Reader<ForceCommand>,
    view_writer: OutletWriter<ToolView>,
    view: Option<OutletReader<ToolView>>,
}

impl ToolEnds {
    fn new(graph: &mut RuntimeBuilder) -> Self {
        let (sample_writer, samples) = graph.exchange(DeviceSample::default);
        let (command_writer, commands) = graph.exchange(ForceCommand::default);
        let (view_writer, view) = graph.outlet(ToolView::default);
        Self { sample_writer, samples, command_writer, commands, view_writer, view: Some(view) }
    }
}

pub(super) fn start(mut prepared: Prepared) -> Result<Running, Error> {
    let first: Vec<DeviceState> = prepared.tools.iter_mut().map(first_of).collect::<Result<_, _>>()?;
    let places: Vec<Vec3> = first.iter().map(|state| state.position).collect();
    let mut environment = environment(&prepared, &first)?;
    let logger_group = logger_group(&prepared);
    let (sinks, memory) = sinks(&prepared, &environment)?;
    let (mut graph, comparison) = match prepared.reexecuted.take() {
        Some(Reexecuted { recording, comparison }) => (Runtime::reexecution(recording), Some(comparison)),
        None => (Runtime::builder(prepared.execution), None),
    };
    if prepared.measures_cost {
        graph.measure_cost();
    }
    std::mem::take(&mut prepared.disturbed).apply(&mut graph);
    let build_cost = prepared.measures_cost.then(Stopwatch::new);
    let builds = build_cost.as_ref().map(Stopwatch::reader);
    // Before the ports, so that they record what a replay needs. The order of the ports below numbers them in the log.
    let drain = graph.drain();
    let ticks_buffered = ((SECONDS_BUFFERED * prepared.haptic.as_hz()) as usize).max(MIN_TICKS_BUFFERED);
    let per_tick = RECORDS_PER_TICK + prepared.probes.len();

    let positions = prepared.simulation.state().positions.clone();
    // No patch holds more nodes than the body, and patches grow as the tool leaves a held face.
    let nodes = positions.len();
    let triangles = prepared.simulation.body().surface().triangles.clone();
    let mut outlet = || {
        let positions = positions.clone();
        graph.outlet_port(move || SurfaceView { positions: positions.clone(), ..SurfaceView::default() })
    };
    let mut surface_ports = vec![outlet()];
    let surface = surface_ports[0].reader();
    let scene = prepared.logs_scene.then(|| {
        let port = outlet();
        let watch = SceneWatch::new(port.reader(), &triangles);
        surface_ports.push(port);
        watch
    });
    let mut ends: Vec<ToolEnds> = prepared.tools.iter().map(|_| ToolEnds::new(&mut graph)).collect();

    let bases = BasisSide::new(&mut graph, &prepared, &places)?;
    if let Some(bases) = &bases {
        environment.model_reason = bases.reason(environment.model_reason.take());
    }
    let reducing = bases.as_ref().map(|bases| (basis::group(&prepared), bases.actor()));

    let probes = prepared.probes;
    let watching = |mut model: Box<dyn LocalModel>, probes: &[u32]| {
        model.watch(probes);
        model
    };
    let spare = || Box::new(Hold::default()) as Box<dyn LocalModel>;
    let (sources, global) = match prepared.template.empty() {
        None => {
            let full = watching(Box::new(Full::new(prepared.simulation)), &probes);
            let surfaces = surface_ports.iter().map(OutletPort::writer).collect();
            (vec![(ModelSource::Alone(surfaces), [full, spare(), spare()])], None)
        }
        Some(_) => {
            let (surroundings, known) = match bases {
                Some(BasisSide { wishes, bases, known, .. }) => (Some((wishes, bases)), known),
                None => Default::default(),
            };
            let (template, watched) = (prepared.template.clone(), probes.clone());
            let model = move || watching(template.empty().unwrap_or_else(spare), &watched);
            let feeds_back = prepared.template.feeds_back();
            let link = |_| ToolLink {
                ticks: graph.queue_port(ticks_buffered),
                geometry: feeds_back.then(|| graph.exchange_port(move || PatchGeometry::with_room(nodes))),
                models: graph.exchange_port(model.clone()),
            };
            let side = GlobalSide {
                tools: prepared.tools.iter().map(link).collect(),
                surroundings,
                surfaces: surface_ports,
                checkpoint: graph.outlet_port(Checkpoint::default),
                recorder: graph.recorder_port(ticks_buffered),
            };
            let source = |link: &ToolLink| ModelSource::Global {
                models: link.models.reader(),
                ticks: link.ticks.writer(),
                geometry: link.geometry.as_ref().map(ExchangePort::writer),
            };
            let sources = side.tools.iter().map(|link| (source(link), [model(), model(), model()])).collect();
            let plan = GlobalPlan {
                haptic: prepared.haptic,
                global: prepared.global_rate,
                horizon: prepared.horizon,
                patch: prepared.template.patch,
                bases: known,
                prefetches: prepared.prefetches,
            };
            let maker = GlobalMaker::new(prepared.simulation, &places, plan, side);
            (sources, Some(maker.measured_by(build_cost)))
        }
    };
    let views = ends.iter_mut().filter_map(|ends| ends.view.take()).collect();
    let mut haptic_actors: Vec<Box<dyn Actor>> = Vec::new();
    for (number, (((tool, ends), state), (source, models))) in
        (0..).zip(prepared.tools.into_iter().zip(ends).zip(&first).zip(sources))
    {
        let safety = Pipeline::new(tool.limits);
        let recorder = graph.recorder(ticks_buffered * 2);
        let device = DeviceActor::new(tool.device, *state, ends.sample_writer, ends.commands, safety, recorder);
        let ports = LocalPorts {
            samples: ends.samples,
            commands: ends.command_writer,
            source,
            view: ends.view_writer,
            recorder: graph.recorder(ticks_buffered * per_tick),
        };
        let succession = Succession::new(models, prepared.blend, Vec3::zeros());
        let local = LocalActor::new(succession, prepared.haptic, prepared.global_rate, probes.clone(), ports);
        let local = match &tool.coupling {
            Some(design) => local.coupled(CoupledTool::new(design)),
            None => local,
        };
        haptic_actors.push(Box::new(device.numbered(number)));
        haptic_actors.push(Box::new(local.numbered(number)));
    }

    let outcome = LoggerOutcome::default();
    let logger = |drain| -> Box<dyn Actor> {
        Box::new(LoggerActor::new(drain, sinks, environment, graph.grants(), outcome.clone()).watching(scene))
    };
    let logger = match comparison {
        Some(comparison) => Box::new(Comparer::new(drain, comparison)),
        None => logger(drain),
    };
    graph.group(prepared.local, haptic_actors);
    if let Some((group, actor)) = reducing {
        graph.group(group, vec![actor]);
    }
    if let Some(mut maker) = global {
        if maker.can_restart() {
            graph.restartable(prepared.global, Restart::default(), move || Ok(maker.make()?));
        } else {
            let actors = maker.make()?;
            graph.group(prepared.global, actors);
        }
    }
    graph.group(logger_group, vec![logger]);
    if let Some(until) = prepared.until {
        graph.until(until);
    }
    let running = graph.build()?.start()?;
    Ok(Running::new(running, outcome, memory, Viewer::new(triangles, surface, views), prepared.until).measuring(builds))
}

fn environment(prepared: &Prepared, first: &[DeviceState]) -> Result<Environment, Error> {
    let group =
        |name: &str, rate: Rate| GroupInfo { background: name == basis::GROUP, ..GroupInfo::new(name, rate.as_hz()) };
    let is_multi_rate = prepared.template.kind != Kind::Full;
    let local = GroupInfo {
        budget: prepared.local.declared_budget(),
        actors: prepared.tools.iter().flat_map(|tool| haptic_actor_names(&tool.name)).collect(),
        ..group("local", prepared.haptic)
    };
    let mut groups = vec![local];
    if prepared.reduces() {
        groups.push(group(basis::GROUP, prepared.global_rate));
    }
    if is_multi_rate {
        let budget = prepared.global.declared_budget();
        groups.push(GroupInfo { budget, ..group("global", prepared.global_rate) });
    }
    groups.push(group("logger", logger_rate(prepared)));
    let session = Some(prepared.as_run.to_toml()?);
    Ok(Environment {
        palpate_version: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: Block::instruction_set().to_owned(),
        execution: match prepared.execution {
            Execution::Virtual => LoggedExecution::Virtual,
            Execution::Threaded => LoggedExecution::Threaded { start_unix_ns: unix_now_ns() },
        },
        model: prepared.template.kind.name().to_owned(),
        model_reason: model_reason(prepared),
        haptic_hz: prepared.haptic.as_hz(),
        global_hz: if is_multi_rate { prepared.global_rate.as_hz() } else { 0.0 },
        groups,
        limit_stages: Actions::NAMES.map(str::to_owned).into(),
        safety_off: prepared.safety_off.iter().map(|stage| stage.name().to_owned()).collect(),
        devices: match prepared.tools.as_slice() {
            [_] => Vec::new(),
            several => several.iter().map(|tool| tool.name.clone()).collect(),
        },
        // All of it: each device's ledger begins with an even share.
        stored_j: prepared.tools.iter().filter_map(|tool| Some(tool.limits.passivity?.stored_j)).sum(),
        coupling: couplings(&prepared.tools),
        granted: Default::default(),
        first_tools: (0..).zip(first).map(first_tool).collect(),
        scene: prepared.source.clone(),
        session,
    })
}

/// Why model and patch are what they are, if that was left to the session.
fn model_reason(prepared: &Prepared) -> Option<ModelReason> {
    let of_model = prepared.choice.as_ref().map(|choice| choice.reason.clone());
    match &prepared.sized_patch {
        Some(patch) => Some(patch.reason(of_model)),
        None => of_model,
    }
}

/// The two actors that each tool has, in the order of their ticks; `tool` is empty for the only one.
fn haptic_actor_names(tool: &str) -> [String; 2] {
    ["device", "local"].map(|actor| if tool.is_empty() { actor.to_owned() } else { format!("{tool}/{actor}") })
}

fn first_tool((device, first): (u16, &DeviceState)) -> ToolSample {
    ToolSample {
        position_m: first.position.into(),
        velocity_m_s: first.velocity.into(),
        buttons: first.buttons,
        device,
        ..ToolSample::default()
    }
}

/// The first state of a tool's device, or why there is none.
fn first_of(tool: &mut Tool) -> Result<DeviceState, Error> {
    let Tool { name, device, .. } = tool;
    first_state(&mut **device).map_err(|error| if name.is_empty() { error } else { error.at(&*name) })
}

/// The gains of each tool's coupling in words.
fn couplings(tools: &[Tool]) -> Option<String> {
    let named = |tool: &Tool| {
        let design = tool.coupling?;
        Some(if tool.name.is_empty() { design.to_string() } else { format!("{}: {design}", tool.name) })
    };
    let all: Vec<String> = tools.iter().filter_map(named).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

fn unix_now_ns() -> u64 {
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX)
}

fn sinks(prepared: &Prepared, environment: &Environment) -> Result<(Sinks, Option<Memory>), Error> {
    let memory = prepared.keep_records.then(Memory::default);
    let mut sinks = Sinks::new(memory.clone());
    if let Some(path) = &prepared.log {
        sinks = sinks.with_file(path, environment)?;
    }
    Ok((sinks, memory))
}
