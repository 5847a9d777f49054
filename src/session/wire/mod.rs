//! From prepared parts to a running graph: actors, their ports and the runtime that executes them.
//!
//! [`start`] is the whole way. Ports are made in a fixed order, which numbers them in the log.

mod basis;
mod buffers;
mod environment;
mod global;
mod haptic;
mod link;
mod models;
mod sink;

use super::controls::Controls;
use super::parts::Side;
use super::prepare::{Prepared, Tool, start_gap};
use super::records::RecordSender;
use super::running::{Memory, Outside, Running, Viewer};
use crate::actors::{LoggerActor, LoggerOutcome, SceneWatch, SurfaceView, first_state};
use crate::devices::DeviceState;
use crate::error::{Error, ErrorKind};
use crate::link::HapticMachine;
use crate::model::{Pose, Vec3};
use crate::runtime::{Actor, OutletPort, OutletReader, RecordDrain, Recording, Runtime, RuntimeBuilder, Stopwatch};
use basis::BasisSide;
use buffers::ticks_buffered;
use haptic::ToolEnds;
use link::Ends;
use sink::Sinks;

/// A recording that is executed again in place of a run of its own.
pub(super) struct Rerun {
    pub(super) recording: Recording,
    /// Makes the actor that takes the records in place of the logger.
    pub(super) taker: Box<dyn FnOnce(RecordDrain) -> Box<dyn Actor>>,
}

/// Starts what was prepared, or executes a recording of it again.
///
/// # Errors
/// If a device gives no first state, the other side of a link refuses, the log cannot be created or a thread cannot be started.
pub(super) fn start(mut prepared: Prepared, rerun: Option<Rerun>) -> Result<Running, Error> {
    let rest = prepared.simulation.body().rest();
    let first: Vec<DeviceState> =
        prepared.tools.iter_mut().map(|tool| first_of(tool, rest)).collect::<Result<_, _>>()?;
    if let Some(mut transport) = prepared.transport.take() {
        transport.connect(&prepared.hello(&first)?)?;
        prepared.transport = Some(transport);
    }
    start_at(prepared, first, rerun)
}

/// Starts the global side alone, with the tools where the `machines` say that have them, each behind its transport.
///
/// # Errors
/// If a tool is at none of them or at two, or far from the body, or a thread cannot be started.
pub(super) fn start_global(mut prepared: Prepared, machines: Vec<HapticMachine>) -> Result<Running, Error> {
    let rest = prepared.simulation.body().rest();
    let is_whole =
        |(_, hello): &HapticMachine| hello.tools.len() == prepared.tools.len() && hello.own_tools().next().is_some();
    if !machines.iter().all(is_whole) {
        let message = format!("a haptic machine must have some of the scene's tools, {} in all", prepared.tools.len());
        return Err(Error::new(ErrorKind::Runtime, message));
    }
    let mut first = Vec::new();
    for (index, tool) in prepared.tools.iter().enumerate() {
        let told = machines.iter().filter_map(|(_, hello)| hello.tools.get(index)?.1);
        let [pose] = told.collect::<Vec<_>>()[..] else {
            let message = format!("tool {:?} must be at one haptic machine", tool.name);
            return Err(Error::new(ErrorKind::Runtime, message));
        };
        let state = DeviceState { position: pose.position, orientation: pose.orientation, ..DeviceState::default() };
        let place = if tool.name.is_empty() { "over the link" } else { &tool.name };
        first.push(near(&state, tool, rest).map_err(|error| error.at(place))?);
    }
    let round_trip = machines.iter().map(|(_, hello)| hello.round_trip).max().unwrap_or_default();
    prepared.look_ahead(round_trip);
    prepared.machines = machines.into_iter().map(|(way, hello)| (way, hello.own_tools().collect())).collect();
    start_at(prepared, first, None)
}

fn start_at(mut prepared: Prepared, first: Vec<DeviceState>, rerun: Option<Rerun>) -> Result<Running, Error> {
    let places: Vec<Pose> = first.iter().map(DeviceState::pose).collect();
    let environment = environment::environment(&prepared, &first)?;
    let memory = prepared.options.keep_records.then(Memory::default);
    let (sender, records) = prepared.options.shares_records.then(RecordSender::new).unzip();
    let sinks = Sinks::new(memory.clone(), sender, prepared.options.log.as_deref(), &environment)?;
    let (mut graph, taker) = match rerun {
        Some(Rerun { recording, taker }) => (Runtime::reexecution(recording), Some(taker)),
        None => (Runtime::builder(prepared.options.execution), None),
    };
    let build_cost = prepared.options.measures_cost.then(Stopwatch::new);
    let builds = build_cost.as_ref().map(Stopwatch::reader);
    if builds.is_some() {
        graph.measure_cost();
    }
    std::mem::take(&mut prepared.options.disturbed).apply(&mut graph);

    // Before the ports, so that they record what a replay needs. The order of the ports below numbers them in the log.
    let drain = graph.drain();
    let ticks = ticks_buffered(&prepared.plan);
    let Surfaces { ports: surfaces, viewer, scene, seen } = surfaces(&mut graph, &prepared);
    let has_haptic = prepared.has_haptic();
    let with_devices = if has_haptic { places.as_slice() } else { &[] };
    let mut ends: Vec<ToolEnds> = with_devices.iter().map(|place| ToolEnds::new(&mut graph, place)).collect();
    let views = ends.iter_mut().filter_map(ToolEnds::take_view).collect();
    let disbelieved = ends.iter_mut().filter_map(ToolEnds::take_disbelieved).collect();
    let viewer = Viewer::new(prepared.simulation.body().surface(), viewer, views);
    // Whoever watches that closely may want to see it. What comes over a link is the surface alone, and its stress takes what is below.
    let viewer = match records.is_some() && prepared.side != Side::Haptic {
        true => viewer.with_stress(prepared.simulation.body_as_made()),
        false => viewer,
    };
    let bases = if prepared.reduces() { BasisSide::new(&mut graph, &prepared, &places)? } else { None };
    let reducing = bases.as_ref().map(|bases| (prepared.basis_group(), bases.actor()));
    let settings = prepared.plan.tunable(&mut graph);
    let controls = Controls::new(settings.clone(), &prepared.plan);
    let logger_group = prepared.logger_group();
    let link_group = prepared.link_group();
    let pointers = prepared.tools.iter_mut().map(|tool| tool.pointer.take()).collect();
    let elsewhere = prepared.tools.iter_mut().map(|tool| tool.elsewhere.take()).collect();
    let Prepared { simulation, tools, plan, local, global, until, side, transport, machines, .. } = prepared;
    let link = match (side, transport) {
        (Side::Haptic, Some(transport)) => Some(Ends::Haptic(transport)),
        (Side::Global, _) => Some(Ends::Global(machines)),
        _ => plan.link.clone().map(Ends::Both),
    };
    let (models, maker, bridges) =
        models::models(&mut graph, &plan, (simulation, &places), surfaces, bases, &settings, (link, seen, elsewhere))?;
    let tools = if has_haptic { tools } else { Vec::new() };
    let haptic = haptic::actors(&mut graph, &plan, tools, ends, &first, models, ticks);

    let outcome = LoggerOutcome::default();
    let logger = match taker {
        Some(taker) => taker(drain),
        None => {
            let logger = LoggerActor::new(drain, sinks, environment, graph.grants(), outcome.clone());
            Box::new(logger.watching(scene).telling(disbelieved))
        }
    };
    if has_haptic {
        graph.group(local, haptic);
    }
    if let Some((group, actor)) = reducing {
        graph.group(group, vec![actor]);
    }
    if let Some(maker) = maker {
        maker.measured_by(build_cost).join(&mut graph, global)?;
    }
    if !bridges.is_empty() {
        // Behind the global group: what that publishes at its start is over there before the run begins.
        graph.group(link_group, bridges);
    }
    graph.group(logger_group, vec![logger]);
    if let Some(until) = until {
        graph.until(until);
    }
    let outside = Outside { viewer: Some(viewer), pointers, records, controls: Some(controls) };
    Ok(Running::new(graph.build()?.start()?, outcome, memory, outside, until, builds))
}

/// The first state of a tool's device, or why there is none: a device that begins where it reaches no node of the body, at
/// `rest` (m), tells another unit or nothing true, and everything that it tells later is measured from there.
fn first_of(tool: &mut Tool, rest: &[Vec3]) -> Result<DeviceState, Error> {
    let first = first_state(&mut *tool.device);
    if tool.is_elsewhere {
        // Where that is, comes with the first models.
        return first;
    }
    let first = first.and_then(|state| {
        let placed = at_node(&state, tool).and_then(|()| near(&state, tool, rest));
        placed.map_err(|error| error.at(format!("device `{}`", tool.device.name())))
    });
    first.map_err(|error| if tool.name.is_empty() { error } else { error.at(&*tool.name) })
}

/// Refuses the first `state` of a tool that is glued to a node and begins away from it.
fn at_node(state: &DeviceState, tool: &Tool) -> Result<(), Error> {
    let message = tool.glued_at.and_then(|node| start_gap(state.position, node));
    message.map_or(Ok(()), |message| Err(Error::new(ErrorKind::Device, message)))
}

/// The first `state` of a tool, if it is within its reach of the body.
fn near(state: &DeviceState, tool: &Tool, rest: &[Vec3]) -> Result<DeviceState, Error> {
    let away_m = rest.iter().map(|node| (node - state.position).norm()).fold(f64::INFINITY, f64::min);
    if away_m <= tool.bounds.reach_m {
        return Ok(*state);
    }
    let (place, reach_m): ([f64; 3], _) = (state.position.into(), tool.bounds.reach_m);
    let message =
        format!("its first position is {place:?} m, {away_m:.3} m from the body, and it reaches {reach_m:.3} m");
    Err(Error::new(ErrorKind::Device, message))
}

/// Where the body's surface is seen.
struct Surfaces {
    /// All of them, for whoever shows it.
    ports: Vec<OutletPort<SurfaceView>>,
    /// By a program that draws.
    viewer: OutletReader<SurfaceView>,
    /// By the log, if it has the topic `/scene`.
    scene: Option<SceneWatch>,
    /// Beyond the link, if the devices are there.
    seen: Option<OutletReader<SurfaceView>>,
}

fn surfaces(graph: &mut RuntimeBuilder, prepared: &Prepared) -> Surfaces {
    let positions = &prepared.simulation.state().positions;
    let mut outlet = || {
        let positions = positions.clone();
        graph.outlet_port(move || SurfaceView { positions: positions.clone(), ..SurfaceView::default() })
    };
    let mut ports = vec![outlet()];
    let viewer = ports[0].reader();
    let scene = prepared.scene.log.scene.then(|| {
        let port = outlet();
        let watch = SceneWatch::new(port.reader(), prepared.simulation.body().surface());
        ports.push(port);
        watch
    });
    let seen = (prepared.side == Side::Global).then(|| {
        let port = outlet();
        let seen = port.reader();
        ports.push(port);
        seen
    });
    Surfaces { ports, viewer, scene, seen }
}
