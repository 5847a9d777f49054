//! The haptic group: a device actor for each tool and one that computes the forces on all, with what they say to each other.

use super::models::Models;
use crate::actors::{
    ComputedForce, DeviceActor, DevicePorts, DeviceSample, Disbelieved, LocalActor, LocalSide, LocalTool,
    LocalToolPorts, ToolView, WholeActor,
};
use crate::devices::DeviceState;
use crate::log::ContactSample;
use crate::model::Pose;
use crate::model::contact::ToolShape;
use crate::runtime::{Actor, OutletReader, OutletWriter, Reader, RuntimeBuilder, Writer};
use crate::safety::Pipeline;
use crate::safety::coupling::CoupledTool;
use crate::session::prepare::{ModelPlan, Tool};

/// Records of a simulated tool per haptic tick at most, besides one per probe and one per place that a tool with a shape touches.
const RECORDS_PER_TICK: usize = 5;

/// Records of a device actor per haptic tick at most: tool and command, of two parts each.
const DEVICE_RECORDS_PER_TICK: usize = 4;

/// Room for records of one actor, whatever the haptic rate: 64 MiB.
const MOST_RECORDS: usize = 1 << 20;

/// Both ends of what a tool's device and local actor say to each other and to a program that draws.
pub(super) struct ToolEnds {
    sample_writer: Writer<DeviceSample>,
    samples: Reader<DeviceSample>,
    force_writer: Writer<ComputedForce>,
    forces: Reader<ComputedForce>,
    view_writer: OutletWriter<ToolView>,
    view: Option<OutletReader<ToolView>>,
    disbelieved_writer: OutletWriter<Disbelieved>,
    disbelieved: Option<OutletReader<Disbelieved>>,
}

impl ToolEnds {
    /// Of a tool that begins at `place`, where it is seen before its first tick too.
    pub(super) fn new(graph: &mut RuntimeBuilder, place: &Pose) -> Self {
        let Pose { position, orientation } = *place;
        let (sample_writer, samples) = graph.exchange(DeviceSample::default);
        let (force_writer, forces) = graph.exchange(ComputedForce::default);
        let (view_writer, view) = graph.outlet(move || ToolView { position, orientation, ..ToolView::default() });
        let (disbelieved_writer, disbelieved) = graph.outlet(Disbelieved::default);
        let (view, disbelieved) = (Some(view), Some(disbelieved));
        Self { sample_writer, samples, force_writer, forces, view_writer, view, disbelieved_writer, disbelieved }
    }

    /// The end of the logger.
    pub(super) fn take_disbelieved(&mut self) -> Option<OutletReader<Disbelieved>> {
        self.disbelieved.take()
    }

    /// The end of a program that draws.
    pub(super) fn take_view(&mut self) -> Option<OutletReader<ToolView>> {
        self.view.take()
    }
}

/// The actors of the group in the order of their ticks, with records of so many `ticks` waiting at most.
pub(super) fn actors(
    graph: &mut RuntimeBuilder,
    plan: &ModelPlan,
    tools: Vec<Tool>,
    ends: Vec<ToolEnds>,
    first: &[DeviceState],
    models: Models,
    ticks: usize,
) -> Vec<Box<dyn Actor>> {
    let (mut devices, mut simulated): (Vec<Box<dyn Actor>>, Vec<LocalTool>) = Default::default();
    for (number, ((tool, ends), state)) in (0..).zip(tools.into_iter().zip(ends).zip(first)) {
        let is_elsewhere = tool.is_elsewhere;
        let safety = Pipeline::new(tool.limits);
        let ports = DevicePorts {
            samples: ends.sample_writer,
            commands: ends.forces,
            view: ends.view_writer,
            disbelieved: ends.disbelieved_writer,
            recorder: graph.recorder((ticks * DEVICE_RECORDS_PER_TICK).min(MOST_RECORDS)),
        };
        let device = DeviceActor::new(tool.device, *state, tool.bounds, safety, ports);
        let places = if tool.shape == ToolShape::Point { 0 } else { ContactSample::MOST_POINTS };
        let ports = LocalToolPorts {
            samples: ends.samples,
            commands: ends.force_writer,
            recorder: graph.recorder((ticks * (RECORDS_PER_TICK + places + plan.probes.len())).min(MOST_RECORDS)),
        };
        let coupled = tool.coupling.as_ref().map(CoupledTool::new);
        let local = LocalTool::new(number, plan.timing.haptic, plan.probes.clone(), coupled, ports);
        simulated.push(if is_elsewhere { local.elsewhere() } else { local });
        devices.push(Box::new(device.numbered(number)));
    }
    let rates = [plan.timing.haptic, plan.timing.global];
    match models {
        // It takes the samples of all devices.
        Models::Whole(simulation, surfaces, settings) => {
            devices.push(Box::new(WholeActor::new(simulation, simulated, rates, surfaces, settings)));
            devices
        }
        Models::Local(models) => {
            if let Some((source, ports)) = models {
                let side = |(tool, ports)| LocalSide { tool, ports };
                let sides = simulated.into_iter().zip(ports).map(side).collect();
                devices.push(Box::new(LocalActor::new(sides, source, rates)));
            }
            devices
        }
    }
}
